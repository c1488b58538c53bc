//! Declarations of a recording module: capabilities, types, inputs, the draw's number.

use super::shader::Shader;
use super::{InjectError, Target};
use rspirv::dr::{Builder, Instruction, Module, Operand};
use rspirv::spirv::{
    AddressingModel, BuiltIn, Capability, Decoration, MemoryModel, Op, StorageClass, Word,
};

pub(super) fn id(word: Word) -> Operand {
    Operand::IdRef(word)
}

pub(super) fn literal(value: u32) -> Operand {
    Operand::LiteralBit32(value)
}

/// Types of the recording functions.
#[derive(Clone, Copy)]
pub(super) struct Types {
    pub void: Word,
    pub u32: Word,
    pub f32: Word,
    pub bool: Word,
    pub uvec2: Word,
    pub uvec4: Word,
    pub vec2: Word,
    pub vec3: Word,
    pub vec4: Word,
}

impl Types {
    pub fn new(builder: &mut Builder) -> Self {
        let f32 = builder.type_float(32, None);
        let u32 = builder.type_int(32, 0);
        Self {
            void: builder.type_void(),
            u32,
            f32,
            bool: builder.type_bool(),
            uvec2: builder.type_vector(u32, 2),
            uvec4: builder.type_vector(u32, 4),
            vec2: builder.type_vector(f32, 2),
            vec3: builder.type_vector(f32, 3),
            vec4: builder.type_vector(f32, 4),
        }
    }
}

/// An input variable and the type of its value.
#[derive(Clone, Copy)]
pub(super) struct Input {
    pub variable: Word,
    pub of: Word,
}

/// Inputs that identify a fragment or a vertex.
pub(super) struct Inputs {
    pub is_vertex: bool,
    /// `FragCoord`, or `InstanceIndex` in a vertex shader.
    pub place: Input,
    /// `PrimitiveId`, or `VertexIndex` in a vertex shader.
    pub primitive: Input,
    pub view: Option<Input>,
    /// Index of the lane in the subgroup, if ballots are used.
    pub invocation: Option<Input>,
    /// The block of push constants, and the index of the member with the draw's number.
    pub draw: (Word, u32),
    pub known: Known,
}

/// Variables with what all records of a fragment have in common.
#[derive(Clone, Copy)]
pub(super) struct Known {
    /// Lane of the quad.
    pub lane: Word,
    /// Place of the quad.
    pub packed: Word,
    /// Capacity of the record buffer.
    pub capacity: Word,
}

impl Inputs {
    /// Finds or declares the inputs.
    pub fn new(
        builder: &mut Builder,
        shader: &Shader,
        target: &Target,
        types: Types,
    ) -> Result<Self, InjectError> {
        let is_vertex = shader.is_vertex();
        let mut interface = Vec::new();
        let mut input = |builder: &mut Builder, builtin: BuiltIn, of: Word, flat: bool| {
            existing_input(shader, builtin).unwrap_or_else(|| {
                let pointer = builder.type_pointer(None, StorageClass::Input, of);
                let variable = builder.variable(pointer, None, StorageClass::Input, None);
                builder.decorate(variable, Decoration::BuiltIn, [Operand::BuiltIn(builtin)]);
                // Inputs of vertex shaders must not be flat.
                if flat && !is_vertex {
                    builder.decorate(variable, Decoration::Flat, []);
                }
                interface.push(variable);
                Input { variable, of }
            })
        };
        let (place, of_place, primitive) = match is_vertex {
            true => (BuiltIn::InstanceIndex, types.u32, BuiltIn::VertexIndex),
            false => (BuiltIn::FragCoord, types.vec4, BuiltIn::PrimitiveId),
        };
        let place = input(builder, place, of_place, is_vertex);
        let primitive = input(builder, primitive, types.u32, true);
        let view = (target.multiview).then(|| input(builder, BuiltIn::ViewIndex, types.u32, true));
        let invocation = (target.ballots)
            .then(|| input(builder, BuiltIn::SubgroupLocalInvocationId, types.u32, true));
        let draw = draw_number(builder, shader, target, types.u32, &mut interface)?;
        let private = builder.type_pointer(None, StorageClass::Private, types.u32);
        let mut known = || {
            let variable = builder.variable(private, None, StorageClass::Private, None);
            if lists_all_variables(shader) {
                interface.push(variable);
            }
            variable
        };
        let known = Known {
            lane: known(),
            packed: known(),
            capacity: known(),
        };
        let entry = builder.module_mut().entry_points.first_mut();
        let entry = entry.ok_or(InjectError::NoFragmentEntry)?;
        entry.operands.extend(interface.into_iter().map(id));
        Ok(Self {
            is_vertex,
            place,
            primitive,
            view,
            invocation,
            draw,
            known,
        })
    }
}

fn existing_input(shader: &Shader, builtin: BuiltIn) -> Option<Input> {
    let variable = shader.builtin(builtin, StorageClass::Input)?;
    let of = shader.type_of(variable)?.operands.get(1)?.id_ref_any()?;
    Some(Input { variable, of })
}

/// The module, reduced to one entry point, with the capabilities that recording needs.
pub(super) fn builder(shader: &Shader, target: &Target) -> Builder {
    let mut module = shader.module.clone();
    keep_entry_alone(&mut module, shader.entry, shader.main);
    let version = module.header.as_ref().map_or((1, 0), |h| h.version());
    let mut builder = Builder::new_from_module(module);
    if version < (1, 3) {
        // Ballots need version 1.3, which is a superset of 1.0.
        builder.set_version(1, 3);
    }
    let mut wanted = vec![
        Capability::PhysicalStorageBufferAddresses,
        Capability::Int64,
        // Needed for the number of the primitive.
        Capability::Geometry,
        Capability::DerivativeControl,
    ];
    let mut extensions = vec!["SPV_KHR_physical_storage_buffer"];
    if target.ballots {
        wanted.extend([
            Capability::GroupNonUniform,
            Capability::GroupNonUniformBallot,
        ]);
    }
    if target.multiview {
        wanted.push(Capability::MultiView);
        extensions.push("SPV_KHR_multiview");
    }
    for capability in wanted {
        let has = |module: &Module| {
            let declared = Some(&Operand::Capability(capability));
            module
                .capabilities
                .iter()
                .any(|c| c.operands.first() == declared)
        };
        if !has(builder.module_ref()) {
            builder.capability(capability);
        }
    }
    for extension in extensions {
        let declared = Some(&Operand::LiteralString(extension.to_owned()));
        let extensions = &builder.module_ref().extensions;
        if !extensions.iter().any(|e| e.operands.first() == declared) {
            builder.extension(extension);
        }
    }
    builder
}

/// Removes the other entry points. Their stages could not execute the added instructions.
fn keep_entry_alone(module: &mut Module, entry: usize, main: Word) {
    let kept = module.entry_points.swap_remove(entry);
    let dropped = std::mem::replace(&mut module.entry_points, vec![kept]);
    let of_dropped = |id: Option<&Operand>| {
        id.is_some_and(|id| {
            *id != Operand::IdRef(main) && dropped.iter().any(|e| e.operands.get(1) == Some(id))
        })
    };
    module
        .execution_modes
        .retain(|mode| !of_dropped(mode.operands.first()));
    // Another fragment entry point of the same function would share its modes.
}

/// Enables device addresses. Returns whether the module uses the Vulkan memory model.
pub(super) fn use_addresses(builder: &mut Builder) -> Result<bool, InjectError> {
    let model = builder.module_mut().memory_model.as_mut();
    let model = model.ok_or(InjectError::Malformed("no memory model"))?;
    let addressing = model.operands.first_mut();
    *addressing.ok_or(InjectError::Malformed("no addressing model"))? =
        Operand::AddressingModel(AddressingModel::PhysicalStorageBuffer64);
    Ok(model.operands.get(1) == Some(&Operand::MemoryModel(MemoryModel::Vulkan)))
}

/// Declares the draw's number in the block of push constants: as an additional member of the shader's block,
/// or in a new block. Returns the variable and the index of the member.
fn draw_number(
    builder: &mut Builder,
    shader: &Shader,
    target: &Target,
    u32_type: Word,
    interface: &mut Vec<Word>,
) -> Result<(Word, u32), InjectError> {
    let offset = literal(target.push_constant_bytes);
    let class = Operand::StorageClass(StorageClass::PushConstant);
    let globals = &shader.module.types_global_values;
    let variables: Vec<_> = globals
        .iter()
        .filter(|global| {
            global.class.opcode == Op::Variable && global.operands.first() == Some(&class)
        })
        .filter_map(|global| global.result_id)
        .collect();
    // An entry point uses at most one block, but a module of several entry points may have more. Drivers
    // accept only one in the list of an entry point, whether it is used or not.
    let listed = |variable: &Word| {
        let entry = shader.module.entry_points[shader.entry].operands.iter();
        entry.skip(3).any(|of| of.id_ref_any() == Some(*variable))
    };
    let used = variables.iter().filter(|v| is_used(shader, **v)).count();
    let own = match used {
        0 => (variables.iter().find(|v| listed(v)))
            .or(variables.first())
            .copied(),
        1 => variables.into_iter().find(|v| is_used(shader, *v)),
        _ => return Err(InjectError::Malformed("several blocks of push constants")),
    };
    let Some(variable) = own else {
        // A separate type: see `writer`.
        let block = builder.id();
        let definition = Instruction::new(Op::TypeStruct, None, Some(block), vec![id(u32_type)]);
        builder.module_mut().types_global_values.push(definition);
        builder.decorate(block, Decoration::Block, []);
        builder.member_decorate(block, 0, Decoration::Offset, [offset]);
        let pointer = builder.type_pointer(None, StorageClass::PushConstant, block);
        let variable = builder.variable(pointer, None, StorageClass::PushConstant, None);
        if lists_all_variables(shader) {
            interface.push(variable);
        }
        return Ok((variable, 0));
    };
    let malformed = || InjectError::Malformed("push constants that are no block");
    let block = shader
        .type_of(variable)
        .and_then(|pointer| pointer.operands.get(1)?.id_ref_any());
    let block = block.ok_or_else(malformed)?;
    let last = last_byte(shader, block);
    if last >= target.push_constant_bytes {
        return Err(InjectError::PushConstants(target.push_constant_bytes));
    }
    // The member's type must be declared before the block.
    let globals = &mut builder.module_mut().types_global_values;
    let of_type = globals
        .iter()
        .position(|global| global.result_id == Some(u32_type));
    if let Some(place) = of_type {
        let moved = globals.remove(place);
        globals.insert(0, moved);
    }
    let definition = globals
        .iter_mut()
        .find(|global| global.result_id == Some(block));
    let definition = definition.filter(|d| d.class.opcode == Op::TypeStruct);
    let definition = definition.ok_or_else(malformed)?;
    let member = definition.operands.len() as u32;
    definition.operands.push(id(u32_type));
    builder.member_decorate(block, member, Decoration::Offset, [offset]);
    Ok((variable, member))
}

/// Whether entry points list all their variables, instead of only inputs and outputs.
fn lists_all_variables(shader: &Shader) -> bool {
    let header = shader.module.header.as_ref();
    header.is_some_and(|h| h.version() >= (1, 4))
}

/// Whether the functions of the entry point use a variable.
fn is_used(shader: &Shader, variable: Word) -> bool {
    let names = |operand: &Operand| operand.id_ref_any() == Some(variable);
    shader
        .instructions()
        .any(|instruction| instruction.operands.iter().any(names))
}

/// Offset of the last member of a block.
fn last_byte(shader: &Shader, block: Word) -> u32 {
    let offsets = shader
        .module
        .annotations
        .iter()
        .filter_map(|a| match &a.operands[..] {
            [
                Operand::IdRef(of),
                _,
                Operand::Decoration(Decoration::Offset),
                Operand::LiteralBit32(offset),
            ] if *of == block && a.class.opcode == Op::MemberDecorate => Some(*offset),
            _ => None,
        });
    offsets.max().unwrap_or(0)
}
