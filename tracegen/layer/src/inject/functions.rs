//! The functions that append records.

use super::declare::{Input, Inputs, Types, id, literal};
use super::{COUNTER_BYTES, FRAGMENT_LANES_SHIFT, InjectError, RAW_BYTES, Target};
use rspirv::dr::{Builder, Instruction, Operand};
use rspirv::spirv::{
    Decoration, FunctionControl, MemoryAccess, Op, Scope, SelectionControl, StorageClass, Word,
};

type Result<T = Word> = std::result::Result<T, InjectError>;

/// Declares `void quad(uint site, vec2 at)` and
/// `void fragment(uint site, uint element, vec3 at, float lod, vec3 dx, vec3 dy)`.
pub(super) fn declare(
    builder: &mut Builder,
    types: Types,
    inputs: &Inputs,
    target: &Target,
    vulkan_memory: bool,
) -> Result<[Word; 2]> {
    let buffer = BufferTypes::new(builder, types);
    let mut writer = Writer {
        address: {
            let u64 = builder.type_int(64, 0);
            builder.constant_bit64(u64, target.address)
        },
        builder,
        types,
        inputs,
        buffer,
        scope: if vulkan_memory {
            Scope::QueueFamily
        } else {
            Scope::Device
        },
    };
    Ok([writer.quad()?, writer.fragment()?])
}

/// Pointers into the record buffer.
#[derive(Clone, Copy)]
struct BufferTypes {
    /// To the buffer.
    buffer: Word,
    /// To one of its numbers.
    number: Word,
    /// To four numbers of a record.
    four: Word,
}

impl BufferTypes {
    /// `struct Buffer { uint count; uint capacity; Record records[]; }`, `struct Record { uvec4 a, b, c, d; }`
    fn new(builder: &mut Builder, types: Types) -> Self {
        let Types { u32, uvec4, .. } = types;
        // Types of their own: a decoration may not meet a type of the shader's that looks the same.
        let mut declare = |opcode: Op, operands: &[Word]| {
            let result = builder.id();
            let operands = operands.iter().copied().map(id).collect();
            let globals = &mut builder.module_mut().types_global_values;
            globals.push(Instruction::new(opcode, None, Some(result), operands));
            result
        };
        let record = declare(Op::TypeStruct, &[uvec4; 4]);
        let records = declare(Op::TypeRuntimeArray, &[record]);
        let buffer = declare(Op::TypeStruct, &[u32, u32, records]);
        for part in 0..4 {
            builder.member_decorate(record, part, Decoration::Offset, [literal(16 * part)]);
        }
        builder.decorate(
            records,
            Decoration::ArrayStride,
            [literal(RAW_BYTES as u32)],
        );
        builder.decorate(buffer, Decoration::Block, []);
        for (member, offset) in [0, 4, COUNTER_BYTES as u32].into_iter().enumerate() {
            let offset = [literal(offset)];
            builder.member_decorate(buffer, member as u32, Decoration::Offset, offset);
        }
        let class = StorageClass::PhysicalStorageBuffer;
        Self {
            buffer: builder.type_pointer(None, class, buffer),
            number: builder.type_pointer(None, class, u32),
            four: builder.type_pointer(None, class, uvec4),
        }
    }
}

struct Writer<'a> {
    builder: &'a mut Builder,
    types: Types,
    inputs: &'a Inputs,
    buffer: BufferTypes,
    address: Word,
    scope: Scope,
}

/// What is stored beside the fragment's place.
struct Record {
    header: Word,
    element: Word,
    words: [Word; 11],
}

/// Where a fragment is.
struct Place {
    /// Lane of the quad.
    lane: Word,
    /// Column and row of the quad, and view.
    packed: Word,
    /// Column and row of the lane in its quad, 0 or 1, as floats.
    right: Word,
    down: Word,
}

impl Writer<'_> {
    fn quad(&mut self) -> Result {
        let Types { u32, vec2, .. } = self.types;
        let (function, parameters) = self.begin(&[u32, vec2])?;
        let [site, at] = parameters[..] else {
            return Err(InjectError::Malformed("parameters"));
        };
        // Before anything else: derivatives need all lanes of the quad.
        let dx = self.pure(Op::DPdxFine, vec2, &[at]);
        let dy = self.pure(Op::DPdyFine, vec2, &[at]);
        let cross = self.pure(Op::DPdxFine, vec2, &[dy]);
        let place = self.place();
        let mask = self.lanes(&place);
        let writes = self.is_first(mask, place.lane);
        let (buffer, capacity) = self.buffer()?;
        let records = self.is_not_zero(capacity);
        let writes = self.pure(Op::LogicalAnd, self.types.bool, &[writes, records]);
        let end = self.guard(writes)?;
        // From this lane back to the top-left one, the top row and the left column.
        let scaled =
            |w: &mut Self, by: Word, of: Word| w.pure(Op::VectorTimesScalar, vec2, &[of, by]);
        let down_cross = scaled(self, place.down, cross);
        let dx_top = self.pure(Op::FSub, vec2, &[dx, down_cross]);
        let right_cross = scaled(self, place.right, cross);
        let dy_left = self.pure(Op::FSub, vec2, &[dy, right_cross]);
        let mut top_left = at;
        for (by, of) in [(place.right, dx_top), (place.down, dy_left)] {
            let step = scaled(self, by, of);
            top_left = self.pure(Op::FSub, vec2, &[top_left, step]);
        }
        let diagonal = scaled(self, place.right, down_cross);
        let top_left = self.pure(Op::FSub, vec2, &[top_left, diagonal]);
        let header = self.header(site, mask);
        let uzero = self.constant(0);
        let values = [top_left, dx_top, dy_left, cross].map(|pair| self.bits_of(pair, 2));
        let [uv, dx, dy, cross] = values;
        let words = [
            uv[0], uv[1], uzero, dx[0], dx[1], dy[0], dy[1], cross[0], cross[1], uzero, uzero,
        ];
        let record = Record {
            header,
            element: uzero,
            words,
        };
        self.append(&record, &place, buffer, capacity)?;
        self.end(end)?;
        Ok(function)
    }

    fn fragment(&mut self) -> Result {
        let Types { u32, f32, vec3, .. } = self.types;
        let (function, parameters) = self.begin(&[u32, u32, vec3, f32, vec3, vec3])?;
        let [site, element, at, lod, dx, dy] = parameters[..] else {
            return Err(InjectError::Malformed("parameters"));
        };
        let (buffer, capacity) = self.buffer()?;
        let records = self.is_not_zero(capacity);
        let end = self.guard(records)?;
        let place = self.place();
        let one = self.constant(1);
        let mask = self.pure(Op::ShiftLeftLogical, u32, &[one, place.lane]);
        let header = self.header(site, mask);
        let mut words = Vec::with_capacity(11);
        for vector in [at, dx, dy] {
            words.extend(self.bits_of(vector, 3));
        }
        words.push(self.pure(Op::Bitcast, u32, &[lod]));
        words.push(self.constant(0));
        let words: [Word; 11] = words
            .try_into()
            .map_err(|_| InjectError::Malformed("words"))?;
        let record = Record {
            header,
            element,
            words,
        };
        self.append(&record, &place, buffer, capacity)?;
        self.end(end)?;
        Ok(function)
    }

    /// Where the fragment is.
    fn place(&mut self) -> Place {
        let Types { u32, f32, vec4, .. } = self.types;
        let Input { variable, .. } = self.inputs.frag_coord;
        let at = self.pure(Op::Load, vec4, &[variable]);
        let [one, thirteen, view_shift] = [1, 13, 26].map(|v| self.constant(v));
        let pixel = [0, 1].map(|axis| {
            let part = self.extracted(at, axis, f32);
            self.pure(Op::ConvertFToU, u32, &[part])
        });
        let odd = pixel.map(|p| self.pure(Op::BitwiseAnd, u32, &[p, one]));
        let quad = pixel.map(|p| self.pure(Op::ShiftRightLogical, u32, &[p, one]));
        let below = self.pure(Op::ShiftLeftLogical, u32, &[odd[1], one]);
        let lane = self.pure(Op::BitwiseOr, u32, &[odd[0], below]);
        let row = self.pure(Op::ShiftLeftLogical, u32, &[quad[1], thirteen]);
        let mut packed = self.pure(Op::BitwiseOr, u32, &[quad[0], row]);
        if let Some(view) = self.inputs.view {
            let view = self.loaded(view);
            let view = self.pure(Op::ShiftLeftLogical, u32, &[view, view_shift]);
            packed = self.pure(Op::BitwiseOr, u32, &[packed, view]);
        }
        let [right, down] = odd.map(|o| self.pure(Op::ConvertUToF, f32, &[o]));
        Place {
            lane,
            packed,
            right,
            down,
        }
    }

    /// Lanes of the quad that come by: the lane itself where it cannot know the others.
    fn lanes(&mut self, place: &Place) -> Word {
        let Types {
            u32, uvec4, bool, ..
        } = self.types;
        let one = self.constant(1);
        let Some(invocation) = self.inputs.invocation else {
            return self.pure(Op::ShiftLeftLogical, u32, &[one, place.lane]);
        };
        let invocation = self.loaded(invocation);
        // Helper lanes do not vote.
        let present = self.builder.constant_true(bool);
        let scope = self.constant(Scope::Subgroup as u32);
        let votes = self.pure(Op::GroupNonUniformBallot, uvec4, &[scope, present]);
        let votes = self.extracted(votes, 0, u32);
        let [first, all] = [28, 15].map(|v| self.constant(v));
        let first = self.pure(Op::BitwiseAnd, u32, &[invocation, first]);
        let votes = self.pure(Op::ShiftRightLogical, u32, &[votes, first]);
        self.pure(Op::BitwiseAnd, u32, &[votes, all])
    }

    /// A lane is there, and is the first one.
    fn is_first(&mut self, mask: Word, lane: Word) -> Word {
        let Types { u32, bool, .. } = self.types;
        let one = self.constant(1);
        let own = self.pure(Op::ShiftLeftLogical, u32, &[one, lane]);
        // Bits up to the lane's own.
        let below = self.pure(Op::ISub, u32, &[own, one]);
        let up_to = self.pure(Op::BitwiseOr, u32, &[own, below]);
        let found = self.pure(Op::BitwiseAnd, u32, &[mask, up_to]);
        self.pure(Op::IEqual, bool, &[found, own])
    }

    fn header(&mut self, site: Word, mask: Word) -> Word {
        let u32 = self.types.u32;
        let shift = self.constant(FRAGMENT_LANES_SHIFT);
        let mask = self.pure(Op::ShiftLeftLogical, u32, &[mask, shift]);
        self.pure(Op::BitwiseOr, u32, &[site, mask])
    }

    /// The record buffer and its capacity.
    fn buffer(&mut self) -> Result<(Word, Word)> {
        let one = self.constant(1);
        let buffer = self.pure(Op::ConvertUToPtr, self.buffer.buffer, &[self.address]);
        let capacity = self.pure(Op::AccessChain, self.buffer.number, &[buffer, one]);
        let aligned = Some(MemoryAccess::ALIGNED);
        let capacity = (self.builder)
            .load(self.types.u32, None, capacity, aligned, [literal(4)])
            .map_err(builder_error)?;
        Ok((buffer, capacity))
    }

    fn is_not_zero(&mut self, value: Word) -> Word {
        let zero = self.constant(0);
        self.pure(Op::INotEqual, self.types.bool, &[value, zero])
    }

    /// Appends a record if there is room.
    fn append(
        &mut self,
        record: &Record,
        place: &Place,
        buffer: Word,
        capacity: Word,
    ) -> Result<()> {
        let Types {
            u32, uvec4, bool, ..
        } = self.types;
        let [zero, one, two] = [0, 1, 2].map(|v| self.constant(v));
        let scope = self.constant(self.scope as u32);
        let counter = self.pure(Op::AccessChain, self.buffer.number, &[buffer, zero]);
        let index = self.pure(Op::AtomicIAdd, u32, &[counter, scope, zero, one]);
        let fits = self.pure(Op::ULessThan, bool, &[index, capacity]);
        let end = self.guard(fits)?;
        let primitive = self.loaded(self.inputs.primitive);
        let (block, member) = self.inputs.draw;
        let pointer = self
            .builder
            .type_pointer(None, StorageClass::PushConstant, u32);
        let member = self.constant(member);
        let draw = self.pure(Op::AccessChain, pointer, &[block, member]);
        let draw = self.pure(Op::Load, u32, &[draw]);
        let mut all = vec![record.header, draw, place.packed, primitive, record.element];
        all.extend(record.words);
        for (part, four) in all.chunks_exact(4).enumerate() {
            let value = self.pure(Op::CompositeConstruct, uvec4, four);
            let part = self.constant(part as u32);
            let to = self.pure(
                Op::AccessChain,
                self.buffer.four,
                &[buffer, two, index, part],
            );
            let aligned = Some(MemoryAccess::ALIGNED);
            (self.builder)
                .store(to, value, aligned, [literal(16)])
                .map_err(builder_error)?;
        }
        self.merge(end)
    }

    /// Goes on where a condition holds; tells the block where both ways meet again.
    fn guard(&mut self, condition: Word) -> Result {
        let [yes, end] = [self.builder.id(), self.builder.id()];
        let none = SelectionControl::NONE;
        (self.builder.selection_merge(end, none)).map_err(builder_error)?;
        (self.builder.branch_conditional(condition, yes, end, [])).map_err(builder_error)?;
        self.builder.begin_block(Some(yes)).map_err(builder_error)?;
        Ok(end)
    }

    fn merge(&mut self, end: Word) -> Result<()> {
        self.builder.branch(end).map_err(builder_error)?;
        self.builder.begin_block(Some(end)).map_err(builder_error)?;
        Ok(())
    }

    /// Ends the function, in the block where the ways of its first guard meet.
    fn end(&mut self, end: Word) -> Result<()> {
        self.merge(end)?;
        self.builder.ret().map_err(builder_error)?;
        self.builder.end_function().map_err(builder_error)
    }

    fn begin(&mut self, parameters: &[Word]) -> Result<(Word, Vec<Word>)> {
        let void = self.types.void;
        let of = self.builder.type_function(void, parameters.to_vec());
        let function = (self.builder)
            .begin_function(void, None, FunctionControl::NONE, of)
            .map_err(builder_error)?;
        let ids = parameters
            .iter()
            .map(|of| self.builder.function_parameter(*of));
        let ids: std::result::Result<_, _> = ids.collect();
        let ids = ids.map_err(builder_error)?;
        self.builder.begin_block(None).map_err(builder_error)?;
        Ok((function, ids))
    }

    fn loaded(&mut self, input: Input) -> Word {
        let value = self.pure(Op::Load, input.of, &[input.variable]);
        if input.of == self.types.u32 {
            return value;
        }
        self.pure(Op::Bitcast, self.types.u32, &[value])
    }

    /// Bits of a vector's components.
    fn bits_of(&mut self, vector: Word, components: u32) -> Vec<Word> {
        let Types { u32, f32, .. } = self.types;
        let part = |place| {
            let part = self.extracted(vector, place, f32);
            self.pure(Op::Bitcast, u32, &[part])
        };
        (0..components).map(part).collect()
    }

    fn extracted(&mut self, of: Word, place: u32, part_type: Word) -> Word {
        self.add(
            Op::CompositeExtract,
            part_type,
            vec![id(of), literal(place)],
        )
    }

    fn constant(&mut self, value: u32) -> Word {
        self.builder.constant_bit32(self.types.u32, value)
    }

    fn pure(&mut self, opcode: Op, of: Word, operands: &[Word]) -> Word {
        self.add(opcode, of, operands.iter().copied().map(id).collect())
    }

    fn add(&mut self, opcode: Op, of: Word, operands: Vec<Operand>) -> Word {
        let result = self.builder.id();
        let instruction = Instruction::new(opcode, Some(of), Some(result), operands);
        // A block is open wherever this is called.
        let _ = (self.builder).insert_into_block(rspirv::dr::InsertPoint::End, instruction);
        result
    }
}

fn builder_error(_: rspirv::dr::Error) -> InjectError {
    InjectError::Malformed("functions")
}
