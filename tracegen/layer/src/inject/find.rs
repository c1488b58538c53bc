//! Finds image instructions that read texels, and the operands that are recorded.

use super::shader::{Shader, ids};
use rspirv::dr::{Instruction, Operand};
use rspirv::spirv::{Dim, ImageOperands, Op, Word};
use spool::{Access, Binding, Form, Lod, Shape, TextureSite, What};

/// An image instruction that reads texels, and its recorded operands.
pub(super) struct Found {
    pub what: What,
    pub form: Form,
    /// Id of the coordinate.
    pub coordinate: Word,
    /// Index of the component of the coordinate that divides the others.
    pub divisor: Option<u32>,
    /// Id of a level or bias that varies between fragments.
    pub lod: Option<Word>,
    /// Ids of explicit derivatives.
    pub gradients: Option<[Word; 2]>,
    /// Id of the element of the binding's array, if it varies between fragments.
    pub element: Option<Word>,
}

/// The texel read of an instruction; `None` if it reads no texels.
pub(super) fn find(shader: &Shader, instruction: &Instruction) -> Option<Found> {
    let opcode = instruction.class.opcode;
    let operation = operation(opcode)?;
    let ids = ids(instruction);
    let (image, coordinate) = (*ids.first()?, *ids.get(1)?);
    let left_out = |what: &str| Found {
        what: What::LeftOut(what.to_owned()),
        form: Form::Quad,
        coordinate,
        divisor: None,
        lod: None,
        gradients: None,
        element: None,
    };
    if opcode == Op::ImageTexelPointer {
        return Some(left_out("atomics on storage images"));
    }
    let Some(image_type) = image_type(shader, image) else {
        return Some(left_out("images of unknown type"));
    };
    let access = match operation {
        Operation::Known(access) => access,
        Operation::Other(what) => {
            let is_subpass = image_type.dim == Dim::DimSubpassData;
            return Some(left_out(if is_subpass {
                "input attachments"
            } else {
                what
            }));
        }
    };
    let shape = match (image_type.dim, image_type.arrayed) {
        _ if image_type.multisampled => return Some(left_out("multisampled textures")),
        (Dim::Dim2D | Dim::DimRect, false) => Shape::Flat,
        (Dim::Dim2D, true) => Shape::Array,
        (Dim::DimCube, false) => Shape::Cube,
        (Dim::DimCube, true) => return Some(left_out("cube map arrays")),
        (Dim::Dim1D, _) => return Some(left_out("one-dimensional textures")),
        (Dim::Dim3D, _) => return Some(left_out("three-dimensional textures")),
        (Dim::DimBuffer, _) => return Some(left_out("texel buffers")),
        (Dim::DimSubpassData, _) => return Some(left_out("input attachments")),
        _ => return Some(left_out("images of unknown shape")),
    };
    if access == Access::Gather && shape == Shape::Cube {
        return Some(left_out("gathers of cube maps"));
    }
    let operands = match Operands::of(shader, instruction) {
        Ok(operands) => operands,
        Err(what) => return Some(left_out(what)),
    };
    let mut resolved = Resolved::default();
    shader.start_steps();
    if !resolved.image(shader, image, 0) {
        return Some(left_out("images that a shader chooses"));
    }
    let (Some(image), sampler) = (resolved.image, resolved.sampler) else {
        return Some(left_out("images that a shader chooses"));
    };
    let lod = match access {
        Access::Gather => Lod::Explicit(Some(0.0)),
        Access::Fetch if operands.lod == Lod::Derivatives => Lod::Explicit(Some(0.0)),
        _ => operands.lod,
    };
    let is_plain = matches!(
        lod,
        Lod::Derivatives | Lod::Bias(Some(_)) | Lod::Explicit(Some(_))
    );
    let form = match shape {
        Shape::Flat if is_plain && resolved.element.is_none() => Form::Quad,
        _ => Form::Fragment,
    };
    Some(Found {
        what: What::Texture(TextureSite {
            access,
            shape,
            image,
            sampler,
            lod,
            offset: operands.offset,
        }),
        form,
        coordinate,
        divisor: is_projection(opcode).then_some(2),
        lod: operands.lod_id,
        gradients: operands.gradients,
        element: resolved.element,
    })
}

/// The operation of an opcode on an image.
enum Operation {
    Known(Access),
    /// Not recorded, with its name for the report.
    Other(&'static str),
}

/// Whether an instruction reads texels.
pub(super) fn reads_texels(opcode: Op) -> bool {
    operation(opcode).is_some()
}

fn operation(opcode: Op) -> Option<Operation> {
    use Op::{
        ImageDrefGather, ImageFetch, ImageGather, ImageRead, ImageSampleDrefExplicitLod,
        ImageSampleDrefImplicitLod, ImageSampleExplicitLod, ImageSampleImplicitLod,
        ImageSampleProjDrefExplicitLod, ImageSampleProjDrefImplicitLod, ImageSampleProjExplicitLod,
        ImageSampleProjImplicitLod, ImageSparseDrefGather, ImageSparseFetch, ImageSparseGather,
        ImageSparseRead, ImageSparseSampleDrefExplicitLod, ImageSparseSampleDrefImplicitLod,
        ImageSparseSampleExplicitLod, ImageSparseSampleImplicitLod, ImageTexelPointer,
    };
    match opcode {
        ImageSampleImplicitLod
        | ImageSampleExplicitLod
        | ImageSampleDrefImplicitLod
        | ImageSampleDrefExplicitLod
        | ImageSampleProjImplicitLod
        | ImageSampleProjExplicitLod
        | ImageSampleProjDrefImplicitLod
        | ImageSampleProjDrefExplicitLod => Some(Operation::Known(Access::Sample)),
        ImageGather | ImageDrefGather => Some(Operation::Known(Access::Gather)),
        ImageFetch => Some(Operation::Known(Access::Fetch)),
        ImageRead | ImageTexelPointer => Some(Operation::Other("storage images")),
        ImageSparseSampleImplicitLod
        | ImageSparseSampleExplicitLod
        | ImageSparseSampleDrefImplicitLod
        | ImageSparseSampleDrefExplicitLod
        | ImageSparseFetch
        | ImageSparseGather
        | ImageSparseDrefGather
        | ImageSparseRead => Some(Operation::Other("sparse images")),
        _ => None,
    }
}

fn is_projection(opcode: Op) -> bool {
    matches!(
        opcode,
        Op::ImageSampleProjImplicitLod
            | Op::ImageSampleProjExplicitLod
            | Op::ImageSampleProjDrefImplicitLod
            | Op::ImageSampleProjDrefExplicitLod
    )
}

struct ImageType {
    dim: Dim,
    arrayed: bool,
    multisampled: bool,
}

/// The image type of an image or a sampled image.
fn image_type(shader: &Shader, id: Word) -> Option<ImageType> {
    let mut of = shader.type_of(id)?;
    if of.class.opcode == Op::TypeSampledImage {
        of = shader.definition(of.operands.first()?.id_ref_any()?)?;
    }
    let flag = |place: usize| of.operands.get(place) == Some(&Operand::LiteralBit32(1));
    match (of.class.opcode, of.operands.get(1)) {
        (Op::TypeImage, Some(Operand::Dim(dim))) => Some(ImageType {
            dim: *dim,
            arrayed: flag(3),
            multisampled: flag(4),
        }),
        _ => None,
    }
}

/// Optional operands of an image instruction.
struct Operands {
    lod: Lod,
    lod_id: Option<Word>,
    gradients: Option<[Word; 2]>,
    offset: [i8; 2],
}

impl Operands {
    fn of(shader: &Shader, instruction: &Instruction) -> Result<Self, &'static str> {
        let mut found = Self {
            lod: Lod::Derivatives,
            lod_id: None,
            gradients: None,
            offset: [0; 2],
        };
        let all = &instruction.operands;
        let Some((place, mask)) = (all.iter().enumerate()).find_map(|(place, o)| match o {
            Operand::ImageOperands(mask) => Some((place, *mask)),
            _ => None,
        }) else {
            return Ok(found);
        };
        let mut rest = all[place + 1..].iter().filter_map(Operand::id_ref_any);
        let mut next = || rest.next().ok_or("malformed image operands");
        if mask.contains(ImageOperands::BIAS) {
            let id = next()?;
            let constant = shader.constant(id).map(f32::from_bits);
            found.lod = Lod::Bias(constant);
            found.lod_id = constant.is_none().then_some(id);
        }
        if mask.contains(ImageOperands::LOD) {
            let id = next()?;
            let constant = shader.constant(id).map(|bits| number(shader, id, bits));
            found.lod = Lod::Explicit(constant);
            found.lod_id = constant.is_none().then_some(id);
        }
        if mask.contains(ImageOperands::GRAD) {
            found.lod = Lod::Gradients;
            found.gradients = Some([next()?, next()?]);
        }
        if mask.contains(ImageOperands::CONST_OFFSET) {
            found.offset = constant_offset(shader, next()?)?;
        }
        if mask.contains(ImageOperands::OFFSET) {
            found.offset = constant_offset(shader, next()?)?;
        }
        if mask.contains(ImageOperands::CONST_OFFSETS) {
            return Err("gathers with four offsets");
        }
        if mask.contains(ImageOperands::MIN_LOD) {
            return Err("least levels that a shader names");
        }
        Ok(found)
    }
}

/// A constant level of detail, which is an integer in a fetch.
fn number(shader: &Shader, id: Word, bits: u32) -> f32 {
    let is_integer = (shader.type_of(id)).is_some_and(|of| of.class.opcode == Op::TypeInt);
    if is_integer {
        bits as i32 as f32
    } else {
        f32::from_bits(bits)
    }
}

fn constant_offset(shader: &Shader, id: Word) -> Result<[i8; 2], &'static str> {
    const CHOSEN: &str = "texel offsets that a shader chooses";
    let definition = shader.definition(id).ok_or(CHOSEN)?;
    let parts = match definition.class.opcode {
        Op::ConstantComposite => ids(definition),
        Op::ConstantNull => return Ok([0; 2]),
        Op::Constant => vec![id],
        _ => return Err(CHOSEN),
    };
    let mut offset = [0; 2];
    for (axis, part) in offset.iter_mut().zip(parts) {
        let bits = shader.constant(part).ok_or(CHOSEN)?;
        *axis = i8::try_from(bits as i32).map_err(|_| "texel offsets beyond 127")?;
    }
    Ok(offset)
}

/// Descriptors behind an image operand.
#[derive(Default)]
struct Resolved {
    image: Option<Binding>,
    sampler: Option<Binding>,
    /// Id of an element that varies between fragments.
    element: Option<Word>,
}

impl Resolved {
    /// Traces an image or sampled image back to its descriptors; returns false if that fails.
    fn image(&mut self, shader: &Shader, id: Word, steps: u32) -> bool {
        let Some(definition) = shader.definition(id).filter(|_| shader.may_step(steps)) else {
            return false;
        };
        let of = ids(definition);
        match (definition.class.opcode, &of[..]) {
            (Op::SampledImage, [image, sampler]) => {
                self.image(shader, *image, steps + 1) && {
                    let sampler = self.descriptor(shader, *sampler, steps + 1);
                    self.sampler = sampler;
                    sampler.is_some()
                }
            }
            (Op::Image | Op::CopyObject, [from]) => self.image(shader, *from, steps + 1),
            (Op::FunctionParameter, _) if !is_pointer(shader, id) => {
                self.through_calls(shader, id, steps, Self::image)
            }
            _ => {
                self.image = self.descriptor(shader, id, steps);
                let sampled =
                    (shader.type_of(id)).is_some_and(|of| of.class.opcode == Op::TypeSampledImage);
                self.sampler = self.image.filter(|_| sampled);
                self.image.is_some()
            }
        }
    }

    /// The descriptor that a value is loaded from or a pointer points to.
    fn descriptor(&mut self, shader: &Shader, id: Word, steps: u32) -> Option<Binding> {
        let definition = shader.definition(id).filter(|_| shader.may_step(steps))?;
        if let Some((set, binding)) = shader.binding(id) {
            return Some(Binding {
                set,
                binding,
                element: Some(0),
            });
        }
        let of = ids(definition);
        match (definition.class.opcode, &of[..]) {
            (Op::Load | Op::CopyObject, [from, ..]) => self.descriptor(shader, *from, steps + 1),
            (Op::AccessChain | Op::InBoundsAccessChain, [from, element]) => {
                let of = self.descriptor(shader, *from, steps + 1)?;
                let constant = shader.constant(*element);
                if constant.is_none() {
                    let other = self.element.is_some_and(|other| other != *element);
                    if other {
                        return None;
                    }
                    self.element = Some(*element);
                }
                Some(Binding {
                    element: constant,
                    ..of
                })
            }
            (Op::FunctionParameter, _) => {
                let mut found = None;
                let same = shader.arguments(id)?.into_iter().all(|argument| {
                    let mut of = Self::default();
                    let binding = of.descriptor(shader, argument, steps + 1);
                    let first = *found.get_or_insert(binding);
                    binding.is_some() && first == binding && of.element.is_none()
                });
                found.flatten().filter(|_| same)
            }
            _ => None,
        }
    }

    /// Evaluates the argument for a parameter, if all calls of the function agree.
    fn through_calls(
        &mut self,
        shader: &Shader,
        parameter: Word,
        steps: u32,
        follow: fn(&mut Self, &Shader, Word, u32) -> bool,
    ) -> bool {
        let Some(arguments) = shader.arguments(parameter).filter(|a| !a.is_empty()) else {
            return false;
        };
        for (call, argument) in arguments.into_iter().enumerate() {
            let mut of = Self::default();
            let found = follow(&mut of, shader, argument, steps + 1) && of.element.is_none();
            let same = call == 0 || (of.image, of.sampler) == (self.image, self.sampler);
            if !found || !same {
                return false;
            }
            (self.image, self.sampler) = (of.image, of.sampler);
        }
        true
    }
}

fn is_pointer(shader: &Shader, id: Word) -> bool {
    (shader.type_of(id)).is_some_and(|of| of.class.opcode == Op::TypePointer)
}
