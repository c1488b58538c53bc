//! Reserves space in the record buffer and stores records.

use super::Target;
use super::declare::{Inputs, Known, Types, id, literal};
use super::lanes::Lanes;
use super::writer::{Result, Writer};
use rspirv::dr::{Builder, Instruction};
use rspirv::spirv::{Decoration, Op, Scope, StorageClass, Word};
use spool::UNIT_BYTES;
use spool::buffer::{self, COUNTER_BYTES};

/// The record buffer: its address and types.
pub(super) struct Append {
    address: u64,
    scope: Scope,
    u64: Word,
    /// Pointers to the buffer, and to one of its first words.
    buffer: Word,
    word: Word,
    /// Pointers to a part of a record, and to a pair of words in it.
    part: Word,
    pair: Word,
}

/// What a record occupies space for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Each {
    Quad,
    Lane,
}

impl Append {
    /// Declares `struct Buffer { uint count; uint capacity; }` and `struct Part { uint64_t pairs[]; }`.
    pub fn new(builder: &mut Builder, types: Types, target: &Target, vulkan_memory: bool) -> Self {
        let u64 = builder.type_int(64, 0);
        // New types instead of existing equal ones, because the decorations must not apply to types of the
        // shader.
        let mut declare = |opcode: Op, operands: &[Word]| {
            let result = builder.id();
            let operands = operands.iter().copied().map(id).collect();
            let globals = &mut builder.module_mut().types_global_values;
            globals.push(Instruction::new(opcode, None, Some(result), operands));
            result
        };
        let buffer = declare(Op::TypeStruct, &[types.u32, types.u32]);
        let pairs = declare(Op::TypeRuntimeArray, &[u64]);
        let part = declare(Op::TypeStruct, &[pairs]);
        builder.decorate(pairs, Decoration::ArrayStride, [literal(8)]);
        for (block, members) in [(buffer, 2), (part, 1)] {
            builder.decorate(block, Decoration::Block, []);
            for member in 0..members {
                builder.member_decorate(block, member, Decoration::Offset, [literal(4 * member)]);
            }
        }
        let mut pointer = |of| builder.type_pointer(None, StorageClass::PhysicalStorageBuffer, of);
        Self {
            buffer: pointer(buffer),
            word: pointer(types.u32),
            part: pointer(part),
            pair: pointer(u64),
            address: target.address,
            u64,
            scope: if vulkan_memory {
                Scope::QueueFamily
            } else {
                Scope::Device
            },
        }
    }

    /// Loads the capacity of the buffer, which is 0 while recording is off.
    pub fn capacity(&self, w: &mut Writer<'_>) -> Result {
        let capacity = self.first_word(w, 1);
        w.load_word(capacity)
    }

    /// Reserves space for records of `units` units. Returns the address of the record, and whether there was
    /// space.
    pub fn reserve(
        &self,
        w: &mut Writer<'_>,
        lanes: &Lanes,
        known: Known,
        units: u32,
        each: Each,
    ) -> Result<(Word, Word)> {
        let Types { u32, bool, .. } = w.types;
        let units = w.constant(units);
        let zero = w.constant(0);
        let capacity = w.variable(known.capacity);
        let is_open = w.pure(Op::INotEqual, bool, &[capacity, zero]);
        let (takes, all, before) = match &lanes.subgroup {
            None => (is_open, units, zero),
            Some(subgroup) => {
                let (occupied, below) = match each {
                    Each::Quad => (subgroup.quads(w), subgroup.below_quad),
                    Each::Lane => (subgroup.votes, subgroup.below_lane),
                };
                let before = w.unsigned(Op::BitwiseAnd, &[occupied, below]);
                let [all, before] = [occupied, before].map(|of| {
                    let count = w.unsigned(Op::BitCount, &[of]);
                    w.unsigned(Op::IMul, &[count, units])
                });
                let is_first = subgroup.is_first(w);
                (w.both(is_first, is_open), all, before)
            }
        };
        // One lane reserves the space for all.
        let counter = self.first_word(w, 0);
        let scope = w.constant(self.scope as u32);
        let guard = w.guard(takes)?;
        let taken = w.unsigned(Op::AtomicIAdd, &[counter, scope, zero, all]);
        let taken = w.merge_value(&guard, taken, zero)?;
        let base = match lanes.subgroup {
            Some(_) => w.of_subgroup(Op::GroupNonUniformBroadcastFirst, u32, &[taken]),
            None => taken,
        };
        let first = w.unsigned(Op::IAdd, &[base, before]);
        let end = w.unsigned(Op::IAdd, &[base, all]);
        let fits = w.pure(Op::ULessThanEqual, bool, &[end, capacity]);
        let records = self.number(w, self.address + COUNTER_BYTES);
        let record = self.after(w, records, first, UNIT_BYTES);
        Ok((record, fits))
    }

    fn number(&self, w: &mut Writer<'_>, value: u64) -> Word {
        w.builder.constant_bit64(self.u64, value)
    }

    /// The address after `count` parts of `bytes` bytes.
    fn after(&self, w: &mut Writer<'_>, address: Word, count: Word, bytes: u64) -> Word {
        let count = w.pure(Op::UConvert, self.u64, &[count]);
        let bytes = self.number(w, bytes);
        let offset = w.pure(Op::IMul, self.u64, &[count, bytes]);
        w.pure(Op::IAdd, self.u64, &[address, offset])
    }

    /// The address after `count` pairs of words.
    pub fn after_pairs(&self, w: &mut Writer<'_>, address: Word, count: Word) -> Word {
        self.after(w, address, count, 8)
    }

    /// Stores two words after an address; `offset` counts pairs.
    pub fn pair(
        &self,
        w: &mut Writer<'_>,
        address: Word,
        offset: u32,
        words: [Word; 2],
    ) -> Result<()> {
        let (zero, offset) = (w.constant(0), w.constant(offset));
        let part = w.pure(Op::ConvertUToPtr, self.part, &[address]);
        let to = w.pure(Op::AccessChain, self.pair, &[part, zero, offset]);
        let both = w.pure(Op::CompositeConstruct, w.types.uvec2, &words);
        let both = w.pure(Op::Bitcast, self.u64, &[both]);
        w.store_aligned(to, both, 8)
    }

    fn first_word(&self, w: &mut Writer<'_>, member: u32) -> Word {
        let member = w.constant(member);
        let address = self.number(w, self.address);
        let buffer = w.pure(Op::ConvertUToPtr, self.buffer, &[address]);
        w.pure(Op::AccessChain, self.word, &[buffer, member])
    }
}

/// The first unit of a record.
pub(super) fn header(
    w: &mut Writer<'_>,
    inputs: &Inputs,
    group: Word,
    lanes: Word,
    kind: u32,
) -> [Word; 4] {
    let [shift, kind] = [buffer::LANES_SHIFT, kind].map(|v| w.constant(v));
    let lanes = w.unsigned(Op::ShiftLeftLogical, &[lanes, shift]);
    let header = w.unsigned(Op::BitwiseOr, &[group, lanes]);
    let header = w.unsigned(Op::BitwiseOr, &[header, kind]);
    let draw = draw(w, inputs);
    let packed = w.variable(inputs.known.packed);
    let primitive = w.loaded(inputs.primitive);
    [header, draw, packed, primitive]
}

/// Loads the number of the draw.
fn draw(w: &mut Writer<'_>, inputs: &Inputs) -> Word {
    let (block, member) = inputs.draw;
    let pointer = (w.builder).type_pointer(None, StorageClass::PushConstant, w.types.u32);
    let member = w.constant(member);
    let draw = w.pure(Op::AccessChain, pointer, &[block, member]);
    w.unsigned(Op::Load, &[draw])
}
