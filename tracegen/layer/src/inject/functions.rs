//! The functions that append records.
//!
//! A subgroup reserves space for all its records with one atomic operation. Then each lane stores its own
//! coordinates. Derivatives also need the coordinates of lanes that are not active; the first active lane of
//! the quad stores them. On a CPU, the consecutive stores of each lane are the main cost of recording.

use super::declare::{Input, Inputs, Types, id};
use super::writer::{BufferTypes, Result, Writer};
use super::{InjectError, Target, buffer};
use rspirv::dr::{Builder, Operand};
use rspirv::spirv::{Op, Scope, StorageClass, Word};

/// Declares the functions of a module.
pub(super) struct Functions {
    types: Types,
    inputs: Inputs,
    buffer: BufferTypes,
    address: Word,
    scope: Scope,
    /// Id of the GLSL instruction set.
    extended: Word,
}

/// `FindILsb` of the GLSL instruction set.
const FIND_LOWEST: u32 = 73;

/// Position of a fragment.
struct FragmentPlace {
    /// Lane of the quad.
    lane: Word,
    /// Column and row of the quad, and the view, packed into a word.
    packed: Word,
    /// Mask with only the bit of this lane.
    own: Word,
}

/// The active lanes at a site.
struct Lanes {
    /// Active lanes of the quad.
    quad: Word,
    /// Active lanes of the subgroup, if ballots are used.
    subgroup: Option<Subgroup>,
}

struct Subgroup {
    votes: Word,
    below_quad: Word,
    below_lane: Word,
}

/// Pointer to the record buffer, and its capacity.
#[derive(Clone, Copy)]
struct Buffer {
    pointer: Word,
    capacity: Word,
}

impl Functions {
    pub fn new(
        builder: &mut Builder,
        types: Types,
        inputs: Inputs,
        target: &Target,
        vulkan_memory: bool,
    ) -> Self {
        let u64 = builder.type_int(64, 0);
        Self {
            buffer: BufferTypes::new(builder, types),
            address: builder.constant_bit64(u64, target.address),
            extended: extended_instructions(builder),
            types,
            inputs,
            scope: if vulkan_memory {
                Scope::QueueFamily
            } else {
                Scope::Device
            },
        }
    }

    /// `void quads(uint group, vec2 at[count])`: records a quad with this number of coordinates.
    pub fn quads(&self, builder: &mut Builder, count: u32) -> Result {
        let Types { u32, vec2, .. } = self.types;
        let mut parameters = vec![u32];
        parameters.extend((0..count).map(|_| vec2));
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &parameters)?;
        let w = &mut w;
        let (&group, at) = parameters.split_first().ok_or(NO_PARAMETERS)?;
        // Derivatives need all lanes of the quad, so they come first.
        let slopes: Vec<[Word; 3]> = (at.iter())
            .map(|at| {
                let [right, down] =
                    [Op::DPdxFine, Op::DPdyFine].map(|opcode| w.pure(opcode, vec2, &[*at]));
                [right, down, w.pure(Op::DPdxFine, vec2, &[down])]
            })
            .collect();
        let buffer = self.buffer(w)?;
        let open = is_not_zero(w, buffer.capacity);
        let open = w.guard(open)?;
        let place = self.place(w);
        let lanes = self.lanes(w, &place);
        let header = self.header(w, group, lanes.quad, count << buffer::GROUPS_SHIFT);
        let units = 1 + 2 * count;
        let (first_word, fits) = self.reserve(w, &lanes, buffer, units, true)?;
        let fits = w.guard(fits)?;
        let draw = self.draw(w);
        let primitive = w.loaded(self.inputs.primitive);
        let [zero, all] = [0, 15].map(|v| w.constant(v));
        // The first lane of the quad also stores the coordinates of inactive lanes.
        let absent = w.unsigned(Op::BitwiseXor, &[lanes.quad, all]);
        let is_first = is_lowest(w, lanes.quad, place.own);
        let absent = w.unsigned(Op::Select, &[is_first, absent, zero]);
        let [next_slot, next_left] = [0; 2].map(|_| w.builder.id());
        let (turn, of_turn) = w.turn(&[(place.lane, next_slot), (absent, next_left)])?;
        let (slot, left) = (of_turn[0], of_turn[1]);
        let of_header = self.select(w, slot, [header, draw, place.packed, primitive]);
        let to = w.unsigned(Op::IAdd, &[first_word, slot]);
        self.store(w, buffer, to, of_header)?;
        let step = self.offset_between(w, slot, place.lane);
        let twice = w.unsigned(Op::IAdd, &[slot, slot]);
        let of_slot = w.unsigned(Op::IAdd, &[first_word, twice]);
        for (number, (at, slopes)) in at.iter().zip(&slopes).enumerate() {
            let at = step.coordinates(w, *at, *slopes);
            for axis in 0..2 {
                let offset = w.constant(4 + 8 * number as u32 + axis);
                let to = w.unsigned(Op::IAdd, &[of_slot, offset]);
                let part = w.extracted(at, axis, self.types.f32);
                let bits = w.bits(part);
                self.store(w, buffer, to, bits)?;
            }
        }
        let operands = vec![
            id(self.extended),
            Operand::LiteralExtInstInteger(FIND_LOWEST),
            id(left),
        ];
        w.add_named(next_slot, Op::ExtInst, u32, operands);
        let one = w.constant(1);
        let less = w.unsigned(Op::ISub, &[left, one]);
        w.add_named(next_left, Op::BitwiseAnd, u32, vec![id(left), id(less)]);
        let more = is_not_zero(w, left);
        w.again(&turn, more)?;
        w.merge(&fits)?;
        w.merge(&open)?;
        w.end()?;
        Ok(function)
    }

    /// `void fragment(uint group, uint element, vec3 at, float lod, vec3 dx, vec3 dy)`
    pub fn fragment(&self, builder: &mut Builder) -> Result {
        let Types { u32, f32, vec3, .. } = self.types;
        let parameters = [u32, u32, vec3, f32, vec3, vec3];
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &parameters)?;
        let w = &mut w;
        let [group, element, at, lod, dx, dy] = parameters[..] else {
            return Err(NO_PARAMETERS);
        };
        let buffer = self.buffer(w)?;
        let open = is_not_zero(w, buffer.capacity);
        let open = w.guard(open)?;
        let place = self.place(w);
        let lanes = self.lanes(w, &place);
        let header = self.header(w, group, place.own, buffer::FRAGMENT);
        let (first_word, fits) = self.reserve(w, &lanes, buffer, buffer::FRAGMENT_UNITS, false)?;
        let fits = w.guard(fits)?;
        let draw = self.draw(w);
        let primitive = w.loaded(self.inputs.primitive);
        let mut words = vec![header, draw, place.packed, primitive, element];
        for vector in [at, dx, dy] {
            for axis in 0..3 {
                let part = w.extracted(vector, axis, f32);
                words.push(w.bits(part));
            }
        }
        words.push(w.bits(lod));
        for (offset, word) in words.into_iter().enumerate() {
            let offset = w.constant(offset as u32);
            let to = w.unsigned(Op::IAdd, &[first_word, offset]);
            self.store(w, buffer, to, word)?;
        }
        w.merge(&fits)?;
        w.merge(&open)?;
        w.end()?;
        Ok(function)
    }

    /// Position of the fragment.
    fn place(&self, w: &mut Writer<'_>) -> FragmentPlace {
        let Types { f32, vec4, .. } = self.types;
        let Input { variable, .. } = self.inputs.frag_coord;
        let at = w.pure(Op::Load, vec4, &[variable]);
        let [one, thirteen, view_shift] = [1, 13, 26].map(|v| w.constant(v));
        let pixel = [0, 1].map(|axis| {
            let part = w.extracted(at, axis, f32);
            w.unsigned(Op::ConvertFToU, &[part])
        });
        let odd = pixel.map(|p| w.unsigned(Op::BitwiseAnd, &[p, one]));
        let quad = pixel.map(|p| w.unsigned(Op::ShiftRightLogical, &[p, one]));
        let below = w.unsigned(Op::ShiftLeftLogical, &[odd[1], one]);
        let lane = w.unsigned(Op::BitwiseOr, &[odd[0], below]);
        let row = w.unsigned(Op::ShiftLeftLogical, &[quad[1], thirteen]);
        let mut packed = w.unsigned(Op::BitwiseOr, &[quad[0], row]);
        if let Some(view) = self.inputs.view {
            let view = w.loaded(view);
            let view = w.unsigned(Op::ShiftLeftLogical, &[view, view_shift]);
            packed = w.unsigned(Op::BitwiseOr, &[packed, view]);
        }
        let own = w.unsigned(Op::ShiftLeftLogical, &[one, lane]);
        FragmentPlace { lane, packed, own }
    }

    /// The active lanes. Without ballots, only the lane itself.
    fn lanes(&self, w: &mut Writer<'_>, place: &FragmentPlace) -> Lanes {
        let Types {
            uvec4, bool, u32, ..
        } = self.types;
        let Some(invocation) = self.inputs.invocation else {
            return Lanes {
                quad: place.own,
                subgroup: None,
            };
        };
        let invocation = w.loaded(invocation);
        // Helper lanes do not take part in ballots.
        let present = w.builder.constant_true(bool);
        let votes = w.of_subgroup(Op::GroupNonUniformBallot, uvec4, &[present]);
        let votes = w.extracted(votes, 0, u32);
        let [of_quad, all, one] = [28, 15, 1].map(|v| w.constant(v));
        let first = w.unsigned(Op::BitwiseAnd, &[invocation, of_quad]);
        let quad = w.unsigned(Op::ShiftRightLogical, &[votes, first]);
        let quad = w.unsigned(Op::BitwiseAnd, &[quad, all]);
        let [below_quad, below_lane] = [first, invocation].map(|lane| {
            let bit = w.unsigned(Op::ShiftLeftLogical, &[one, lane]);
            w.unsigned(Op::ISub, &[bit, one])
        });
        Lanes {
            quad,
            subgroup: Some(Subgroup {
                votes,
                below_quad,
                below_lane,
            }),
        }
    }

    fn header(&self, w: &mut Writer<'_>, group: Word, lanes: Word, kind: u32) -> Word {
        let [shift, kind] = [buffer::LANES_SHIFT, kind].map(|v| w.constant(v));
        let lanes = w.unsigned(Op::ShiftLeftLogical, &[lanes, shift]);
        let header = w.unsigned(Op::BitwiseOr, &[group, lanes]);
        w.unsigned(Op::BitwiseOr, &[header, kind])
    }

    /// Pointer to the record buffer, and its capacity.
    fn buffer(&self, w: &mut Writer<'_>) -> Result<Buffer> {
        let one = w.constant(1);
        let pointer = w.pure(Op::ConvertUToPtr, self.buffer.buffer, &[self.address]);
        let capacity = w.pure(Op::AccessChain, self.buffer.word, &[pointer, one]);
        let capacity = w.load_word(capacity)?;
        Ok(Buffer { pointer, capacity })
    }

    /// Reserves space for records of `units` units: one per quad, or one per lane. Returns the index of the
    /// first word, and whether there was space.
    fn reserve(
        &self,
        w: &mut Writer<'_>,
        lanes: &Lanes,
        buffer: Buffer,
        units: u32,
        quads: bool,
    ) -> Result<(Word, Word)> {
        let Types { u32, bool, .. } = self.types;
        let units = w.constant(units);
        let [zero, two] = [0, 2].map(|v| w.constant(v));
        let scope = w.constant(self.scope as u32);
        let counter = w.pure(Op::AccessChain, self.buffer.word, &[buffer.pointer, zero]);
        let take = |w: &mut Writer<'_>, units: Word| {
            w.unsigned(Op::AtomicIAdd, &[counter, scope, zero, units])
        };
        let (first, end) = match &lanes.subgroup {
            None => {
                let first = take(w, units);
                (first, w.unsigned(Op::IAdd, &[first, units]))
            }
            Some(subgroup) => {
                let occupied = if quads {
                    quads_of(w, subgroup.votes)
                } else {
                    subgroup.votes
                };
                let below = if quads {
                    subgroup.below_quad
                } else {
                    subgroup.below_lane
                };
                let before = w.unsigned(Op::BitwiseAnd, &[occupied, below]);
                let [all, before] = [occupied, before].map(|of| {
                    let count = w.unsigned(Op::BitCount, &[of]);
                    w.unsigned(Op::IMul, &[count, units])
                });
                // One lane reserves the space for all.
                let elected = w.of_subgroup(Op::GroupNonUniformElect, bool, &[]);
                let guard = w.guard(elected)?;
                let taken = take(w, all);
                let taken = w.merge_value(&guard, taken, zero)?;
                let base = w.of_subgroup(Op::GroupNonUniformBroadcastFirst, u32, &[taken]);
                let first = w.unsigned(Op::IAdd, &[base, before]);
                (first, w.unsigned(Op::IAdd, &[base, all]))
            }
        };
        let fits = w.pure(Op::ULessThanEqual, bool, &[end, buffer.capacity]);
        Ok((w.unsigned(Op::ShiftLeftLogical, &[first, two]), fits))
    }

    /// Stores a word of the records.
    fn store(&self, w: &mut Writer<'_>, buffer: Buffer, place: Word, value: Word) -> Result<()> {
        let two = w.constant(2);
        let chain = [buffer.pointer, two, place];
        let to = w.pure(Op::AccessChain, self.buffer.word, &chain);
        w.store_word(to, value)
    }

    /// Loads the number of the draw.
    fn draw(&self, w: &mut Writer<'_>) -> Word {
        let u32 = self.types.u32;
        let (block, member) = self.inputs.draw;
        let pointer = (w.builder).type_pointer(None, StorageClass::PushConstant, u32);
        let member = w.constant(member);
        let draw = w.pure(Op::AccessChain, pointer, &[block, member]);
        w.unsigned(Op::Load, &[draw])
    }

    /// Selects one of four values.
    fn select(&self, w: &mut Writer<'_>, place: Word, values: [Word; 4]) -> Word {
        let [first, rest @ ..] = values;
        let mut chosen = first;
        for (number, value) in (1..).zip(rest) {
            let number = w.constant(number);
            let is_it = w.pure(Op::IEqual, self.types.bool, &[place, number]);
            chosen = w.unsigned(Op::Select, &[is_it, value, chosen]);
        }
        chosen
    }

    /// Offset from a lane to another lane of its quad.
    fn offset_between(&self, w: &mut Writer<'_>, to: Word, from: Word) -> LaneOffset {
        let Types { f32, bool, .. } = self.types;
        let one = w.constant(1);
        let [right, down] = [0, 1].map(|bit| {
            let bit = w.constant(bit);
            let [to, from] = [to, from].map(|lane| {
                let lane = w.unsigned(Op::ShiftRightLogical, &[lane, bit]);
                let lane = w.unsigned(Op::BitwiseAnd, &[lane, one]);
                w.pure(Op::ConvertUToF, f32, &[lane])
            });
            w.pure(Op::FSub, f32, &[to, from])
        });
        LaneOffset {
            types: self.types,
            right,
            down,
            both: w.pure(Op::FMul, f32, &[right, down]),
            is_none: w.pure(Op::IEqual, bool, &[to, from]),
        }
    }
}

/// Offset between two lanes of a quad.
struct LaneOffset {
    types: Types,
    right: Word,
    down: Word,
    both: Word,
    is_none: Word,
}

impl LaneOffset {
    /// Coordinates at the end of the offset. `slopes` are the change to the right, the change downwards, and
    /// the change of the first along the second.
    fn coordinates(&self, w: &mut Writer<'_>, at: Word, slopes: [Word; 3]) -> Word {
        let Types { vec2, f32, .. } = self.types;
        let mut found = at;
        for (slope, by) in slopes.into_iter().zip([self.right, self.down, self.both]) {
            let change = w.pure(Op::VectorTimesScalar, vec2, &[slope, by]);
            found = w.pure(Op::FAdd, vec2, &[found, change]);
        }
        // At offset zero, use the exact coordinates instead of extrapolated ones, which may be NaN.
        let parts = [0, 1].map(|axis| {
            let [own, other] = [at, found].map(|of| w.extracted(of, axis, f32));
            w.pure(Op::Select, f32, &[self.is_none, own, other])
        });
        w.pure(Op::CompositeConstruct, vec2, &parts)
    }
}

const NO_PARAMETERS: InjectError = InjectError::Malformed("parameters");

fn is_not_zero(w: &mut Writer<'_>, value: Word) -> Word {
    let zero = w.constant(0);
    w.pure(Op::INotEqual, w.types.bool, &[value, zero])
}

/// Whether a bit is the lowest one in a mask.
fn is_lowest(w: &mut Writer<'_>, mask: Word, bit: Word) -> Word {
    let zero = w.constant(0);
    let negative = w.unsigned(Op::ISub, &[zero, mask]);
    let lowest = w.unsigned(Op::BitwiseAnd, &[mask, negative]);
    w.pure(Op::IEqual, w.types.bool, &[lowest, bit])
}

/// Mask with the first bit of each quad that has active lanes.
fn quads_of(w: &mut Writer<'_>, votes: Word) -> Word {
    let mut any = votes;
    for by in [1, 2] {
        let by = w.constant(by);
        let shifted = w.unsigned(Op::ShiftRightLogical, &[any, by]);
        any = w.unsigned(Op::BitwiseOr, &[any, shifted]);
    }
    let firsts = w.constant(0x1111_1111);
    w.unsigned(Op::BitwiseAnd, &[any, firsts])
}

/// Id of the GLSL instruction set, which most modules import.
fn extended_instructions(builder: &mut Builder) -> Word {
    const NAME: &str = "GLSL.std.450";
    let imports = &builder.module_ref().ext_inst_imports;
    let own = imports
        .iter()
        .find(|import| import.operands.first() == Some(&Operand::LiteralString(NAME.to_owned())));
    match own.and_then(|import| import.result_id) {
        Some(own) => own,
        None => builder.ext_inst_import(NAME),
    }
}
