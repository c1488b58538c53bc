//! Builds the instructions of a function, at the end of its last block.

use super::declare::{Input, Types, id, literal};
use super::{COUNTER_BYTES, InjectError};
use rspirv::dr::{Builder, InsertPoint, Instruction, Operand};
use rspirv::spirv::{
    Decoration, FunctionControl, LoopControl, MemoryAccess, Op, Scope, SelectionControl,
    StorageClass, Word,
};

pub(super) type Result<T = Word> = std::result::Result<T, InjectError>;

/// Pointer types for the record buffer.
#[derive(Clone, Copy)]
pub(super) struct BufferTypes {
    /// Pointer to the buffer.
    pub buffer: Word,
    /// Pointer to a word of the buffer.
    pub word: Word,
}

impl BufferTypes {
    /// `struct Buffer { uint count; uint capacity; uint words[]; }`
    pub fn new(builder: &mut Builder, types: Types) -> Self {
        // New types instead of existing equal ones, because the decorations must not apply to types of the
        // shader.
        let mut declare = |opcode: Op, operands: &[Word]| {
            let result = builder.id();
            let operands = operands.iter().copied().map(id).collect();
            let globals = &mut builder.module_mut().types_global_values;
            globals.push(Instruction::new(opcode, None, Some(result), operands));
            result
        };
        let words = declare(Op::TypeRuntimeArray, &[types.u32]);
        let buffer = declare(Op::TypeStruct, &[types.u32, types.u32, words]);
        builder.decorate(words, Decoration::ArrayStride, [literal(4)]);
        builder.decorate(buffer, Decoration::Block, []);
        for (member, offset) in [0, 4, COUNTER_BYTES as u32].into_iter().enumerate() {
            let offset = [literal(offset)];
            builder.member_decorate(buffer, member as u32, Decoration::Offset, offset);
        }
        let class = StorageClass::PhysicalStorageBuffer;
        Self {
            buffer: builder.type_pointer(None, class, buffer),
            word: builder.type_pointer(None, class, types.u32),
        }
    }
}

/// A function under construction.
pub(super) struct Writer<'a> {
    pub builder: &'a mut Builder,
    pub types: Types,
    /// Label of the current block.
    block: Word,
}

/// A conditional branch: its header and its merge block.
pub(super) struct Guard {
    header: Word,
    end: Word,
}

/// A loop: its header, continue target and merge block.
pub(super) struct Loop {
    header: Word,
    next: Word,
    end: Word,
}

impl<'a> Writer<'a> {
    /// Begins a function without a result. Returns its id and those of its parameters.
    pub fn begin(
        builder: &'a mut Builder,
        types: Types,
        parameters: &[Word],
    ) -> Result<(Self, Word, Vec<Word>)> {
        let of = builder.type_function(types.void, parameters.to_vec());
        let function = builder.begin_function(types.void, None, FunctionControl::NONE, of);
        let function = function.map_err(builder_error)?;
        let ids: std::result::Result<_, _> = (parameters.iter())
            .map(|of| builder.function_parameter(*of))
            .collect();
        let ids = ids.map_err(builder_error)?;
        let mut writer = Self {
            builder,
            types,
            block: 0,
        };
        let block = writer.builder.id();
        writer.start(block)?;
        Ok((writer, function, ids))
    }

    /// Returns from the function.
    pub fn end(&mut self) -> Result<()> {
        self.builder.ret().map_err(builder_error)?;
        self.builder.end_function().map_err(builder_error)
    }

    fn start(&mut self, block: Word) -> Result<()> {
        self.block = block;
        let started = self.builder.begin_block(Some(block));
        started.map(drop).map_err(builder_error)
    }

    /// Starts a block that is executed only if a condition holds.
    pub fn guard(&mut self, condition: Word) -> Result<Guard> {
        let [yes, end] = [self.builder.id(), self.builder.id()];
        let header = self.block;
        let none = SelectionControl::NONE;
        (self.builder.selection_merge(end, none)).map_err(builder_error)?;
        (self.builder.branch_conditional(condition, yes, end, [])).map_err(builder_error)?;
        self.start(yes)?;
        Ok(Guard { header, end })
    }

    /// Starts the merge block of a guard.
    pub fn merge(&mut self, guard: &Guard) -> Result<()> {
        self.builder.branch(guard.end).map_err(builder_error)?;
        self.start(guard.end)
    }

    /// Starts the merge block of a guard. Returns `value` if the condition held, and `other` if not.
    pub fn merge_value(&mut self, guard: &Guard, value: Word, other: Word) -> Result {
        let from = self.block;
        self.merge(guard)?;
        let pairs = [value, from, other, guard.header];
        Ok(self.pure(Op::Phi, self.types.u32, &pairs))
    }

    /// Starts a loop that is executed at least once. Each pair in `values` has the value for the first
    /// iteration, and the id of the value for the next iteration, which is defined later.
    pub fn turn(&mut self, values: &[(Word, Word)]) -> Result<(Loop, Vec<Word>)> {
        let [header, body, next, end] = [0; 4].map(|_| self.builder.id());
        let before = self.block;
        self.builder.branch(header).map_err(builder_error)?;
        self.start(header)?;
        let of_turn = values
            .iter()
            .map(|(first, later)| {
                self.pure(Op::Phi, self.types.u32, &[*first, before, *later, next])
            })
            .collect();
        let none = LoopControl::NONE;
        (self.builder.loop_merge(end, next, none, [])).map_err(builder_error)?;
        self.builder.branch(body).map_err(builder_error)?;
        self.start(body)?;
        Ok((Loop { header, next, end }, of_turn))
    }

    /// Repeats a loop if a condition holds.
    pub fn again(&mut self, turn: &Loop, condition: Word) -> Result<()> {
        self.builder.branch(turn.next).map_err(builder_error)?;
        self.start(turn.next)?;
        let ways = (turn.header, turn.end);
        (self
            .builder
            .branch_conditional(condition, ways.0, ways.1, []))
        .map_err(builder_error)?;
        self.start(turn.end)
    }

    /// Loads an input as an unsigned number.
    pub fn loaded(&mut self, input: Input) -> Word {
        let value = self.pure(Op::Load, input.of, &[input.variable]);
        if input.of == self.types.u32 {
            return value;
        }
        self.pure(Op::Bitcast, self.types.u32, &[value])
    }

    /// Loads a word from the record buffer.
    pub fn load_word(&mut self, pointer: Word) -> Result {
        let aligned = Some(MemoryAccess::ALIGNED);
        let loaded = (self.builder).load(self.types.u32, None, pointer, aligned, [literal(4)]);
        loaded.map_err(builder_error)
    }

    /// Stores a word to the record buffer.
    pub fn store_word(&mut self, pointer: Word, value: Word) -> Result<()> {
        let aligned = Some(MemoryAccess::ALIGNED);
        let stored = self.builder.store(pointer, value, aligned, [literal(4)]);
        stored.map_err(builder_error)
    }

    /// Extracts a component.
    pub fn extracted(&mut self, of: Word, place: u32, part_type: Word) -> Word {
        self.add(
            Op::CompositeExtract,
            part_type,
            vec![id(of), literal(place)],
        )
    }

    /// An unsigned constant.
    pub fn constant(&mut self, value: u32) -> Word {
        self.builder.constant_bit32(self.types.u32, value)
    }

    /// Adds an operation on unsigned numbers.
    pub fn unsigned(&mut self, opcode: Op, operands: &[Word]) -> Word {
        self.pure(opcode, self.types.u32, operands)
    }

    /// The bits of a float.
    pub fn bits(&mut self, float: Word) -> Word {
        self.unsigned(Op::Bitcast, &[float])
    }

    /// Adds an operation on a subgroup.
    pub fn of_subgroup(&mut self, opcode: Op, of: Word, operands: &[Word]) -> Word {
        let mut all = vec![self.constant(Scope::Subgroup as u32)];
        all.extend(operands);
        self.pure(opcode, of, &all)
    }

    /// Adds an operation whose operands are ids.
    pub fn pure(&mut self, opcode: Op, of: Word, operands: &[Word]) -> Word {
        self.add(opcode, of, operands.iter().copied().map(id).collect())
    }

    /// Adds an operation.
    pub fn add(&mut self, opcode: Op, of: Word, operands: Vec<Operand>) -> Word {
        let result = self.builder.id();
        self.add_named(result, opcode, of, operands);
        result
    }

    /// Adds an operation whose result id is already in use.
    pub fn add_named(&mut self, result: Word, opcode: Op, of: Word, operands: Vec<Operand>) {
        let instruction = Instruction::new(opcode, Some(of), Some(result), operands);
        // Every caller has an open block.
        let _ = (self.builder).insert_into_block(InsertPoint::End, instruction);
    }
}

fn builder_error(_: rspirv::dr::Error) -> InjectError {
    InjectError::Malformed("functions")
}
