//! Builds the instructions of a function, at the end of its last block.

use super::InjectError;
use super::declare::{Input, Types, id, literal};
use rspirv::dr::{Builder, InsertPoint, Instruction, Operand};
use rspirv::spirv::{FunctionControl, MemoryAccess, Op, Scope, SelectionControl, Word};

pub(super) type Result<T = Word> = std::result::Result<T, InjectError>;

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

    /// Ends the fragment in a guard, and starts the guard's merge block.
    pub fn kill(&mut self, guard: &Guard) -> Result<()> {
        self.builder.kill().map_err(builder_error)?;
        self.start(guard.end)
    }

    /// Starts the merge block of a guard. Returns `value` if the condition held, and `other` if not.
    pub fn merge_value(&mut self, guard: &Guard, value: Word, other: Word) -> Result {
        let from = self.block;
        self.merge(guard)?;
        let pairs = [value, from, other, guard.header];
        Ok(self.pure(Op::Phi, self.types.u32, &pairs))
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

    /// Stores a value to the record buffer.
    pub fn store_aligned(&mut self, pointer: Word, value: Word, bytes: u32) -> Result<()> {
        let aligned = Some(MemoryAccess::ALIGNED);
        let stored = (self.builder).store(pointer, value, aligned, [literal(bytes)]);
        stored.map_err(builder_error)
    }

    /// Loads an unsigned variable.
    pub fn variable(&mut self, variable: Word) -> Word {
        self.unsigned(Op::Load, &[variable])
    }

    /// Stores to a variable.
    pub fn store_variable(&mut self, variable: Word, value: Word) -> Result<()> {
        (self.builder.store(variable, value, None, [])).map_err(builder_error)
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

    /// A constant.
    pub fn float(&mut self, value: f32) -> Word {
        self.builder.constant_bit32(self.types.f32, value.to_bits())
    }

    /// Selects one of four words.
    pub fn select_word(&mut self, place: Word, words: [Word; 4]) -> Word {
        let [first, rest @ ..] = words;
        (1..).zip(rest).fold(first, |chosen, (number, word)| {
            let number = self.constant(number);
            let is_it = self.pure(Op::IEqual, self.types.bool, &[place, number]);
            self.unsigned(Op::Select, &[is_it, word, chosen])
        })
    }

    /// Whether both conditions hold.
    pub fn both(&mut self, a: Word, b: Word) -> Word {
        self.pure(Op::LogicalAnd, self.types.bool, &[a, b])
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
        let instruction = Instruction::new(opcode, Some(of), Some(result), operands);
        // Every caller has an open block.
        let _ = (self.builder).insert_into_block(InsertPoint::End, instruction);
        result
    }
}

fn builder_error(_: rspirv::dr::Error) -> InjectError {
    InjectError::Malformed("functions")
}
