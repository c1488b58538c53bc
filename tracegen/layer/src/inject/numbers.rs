//! Finds equal values in a block, so that one record can serve several image instructions.
//!
//! Value numbering: two results have the same number if the same pure operation computes them from operands
//! with the same numbers. Values loaded from inputs and uniforms are constant. A value loaded from a variable
//! of the shader is the value last stored to it.

use super::shader::{Shader, ids};
use rspirv::dr::{Instruction, Operand};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};
use std::collections::HashMap;

/// Number of a value.
pub(super) type Number = u32;

/// Definition of a value number.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Key {
    /// A value identified by its id.
    Id(Word),
    /// A pure operation: opcode, type and operands.
    Operation(Op, Word, Vec<OperandKey>),
    /// Memory behind a pointer, unchanged since a point in time.
    Memory(Number, u32),
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum OperandKey {
    Number(Number),
    Literal(u32),
}

/// Numbers of the values of one function.
#[derive(Default)]
pub(super) struct Numbers {
    numbers: HashMap<Key, Number>,
    of_ids: HashMap<Word, Number>,
    next: Number,
    /// Number of memory changes so far.
    time: u32,
    /// Time of the last change that may have affected all variables of the shader.
    all_changed: u32,
    /// Time of the last change of a single variable.
    changed: HashMap<Word, u32>,
}

impl Numbers {
    /// Processes the next instruction of the function, in order.
    pub fn take(&mut self, shader: &Shader, instruction: &Instruction) {
        match instruction.class.opcode {
            Op::Store => self.store(shader, &ids(instruction)),
            _ if changes_memory(instruction) => self.forget(),
            _ => {}
        }
        if let Some(id) = instruction.result_id {
            let key = self.key(shader, instruction, id);
            let number = self.number_of(key);
            self.of_ids.insert(id, number);
        }
    }

    /// Assumes that all variables have changed. Called at the start of a block, which may have several
    /// predecessors.
    pub fn forget(&mut self) {
        self.time += 1;
        self.all_changed = self.time;
    }

    fn store(&mut self, shader: &Shader, operands: &[Word]) {
        let (Some(&pointer), Some(&value)) = (operands.first(), operands.get(1)) else {
            return self.forget();
        };
        let Some(variable) = variable(shader, pointer) else {
            return self.forget();
        };
        self.time += 1;
        self.changed.insert(variable, self.time);
        let (pointer, value) = (self.of(pointer), self.of(value));
        self.numbers
            .insert(Key::Memory(pointer, 1 + self.time), value);
    }

    /// Number of a value.
    pub fn of(&mut self, id: Word) -> Number {
        if let Some(&number) = self.of_ids.get(&id) {
            return number;
        }
        let number = self.number_of(Key::Id(id));
        self.of_ids.insert(id, number);
        number
    }

    fn number_of(&mut self, key: Key) -> Number {
        let next = self.next;
        let number = *self.numbers.entry(key).or_insert(next);
        self.next += u32::from(number == next);
        number
    }

    fn key(&mut self, shader: &Shader, instruction: &Instruction, id: Word) -> Key {
        let opcode = instruction.class.opcode;
        let Some(result_type) = instruction.result_type else {
            return Key::Id(id);
        };
        if opcode == Op::Load {
            let pointer = ids(instruction).first().copied();
            return pointer
                .and_then(|pointer| self.loaded(shader, pointer))
                .unwrap_or(Key::Id(id));
        }
        if !is_pure(opcode) {
            return Key::Id(id);
        }
        let mut parts = Vec::with_capacity(instruction.operands.len());
        for operand in &instruction.operands {
            parts.push(match operand {
                Operand::IdRef(id) => OperandKey::Number(self.of(*id)),
                Operand::LiteralBit32(value) | Operand::LiteralExtInstInteger(value) => {
                    OperandKey::Literal(*value)
                }
                _ => return Key::Id(id),
            });
        }
        Key::Operation(opcode, result_type, parts)
    }

    /// Current memory behind a pointer; `None` if other fragments may change it.
    fn loaded(&mut self, shader: &Shader, pointer: Word) -> Option<Key> {
        let time = match memory(shader, pointer) {
            Memory::Constant => 0,
            Memory::Own => {
                let variable = variable(shader, pointer)?;
                let changed = self.changed.get(&variable).copied();
                // Starts at 1, because 0 is the time of constants.
                1 + changed.unwrap_or(0).max(self.all_changed)
            }
            Memory::Shared => return None,
        };
        Some(Key::Memory(self.of(pointer), time))
    }
}

/// The variable that contains the pointer's target.
fn variable(shader: &Shader, pointer: Word) -> Option<Word> {
    let mut at = pointer;
    // No compiler creates longer chains.
    for _ in 0..8 {
        let definition = shader.definition(at)?;
        match definition.class.opcode {
            Op::Variable => return Some(at),
            Op::AccessChain | Op::InBoundsAccessChain | Op::CopyObject => {
                at = *ids(definition).first()?;
            }
            _ => return None,
        }
    }
    None
}

/// Which fragments can change the target of a pointer.
enum Memory {
    /// Constant during a draw.
    Constant,
    /// Only the fragment itself.
    Own,
    /// Any fragment.
    Shared,
}

fn memory(shader: &Shader, pointer: Word) -> Memory {
    let class = shader.type_of(pointer).and_then(|of| of.operands.first());
    match class {
        Some(Operand::StorageClass(class)) => match class {
            StorageClass::Input | StorageClass::UniformConstant | StorageClass::PushConstant => {
                Memory::Constant
            }
            // In old modules, storage buffers also have this class.
            StorageClass::Uniform if has_buffer_blocks(shader) => Memory::Shared,
            StorageClass::Uniform => Memory::Constant,
            StorageClass::Function | StorageClass::Private => Memory::Own,
            _ => Memory::Shared,
        },
        _ => Memory::Shared,
    }
}

fn has_buffer_blocks(shader: &Shader) -> bool {
    let decoration = Some(&Operand::Decoration(Decoration::BufferBlock));
    let annotations = &shader.module.annotations;
    annotations.iter().any(|a| a.operands.get(1) == decoration)
}

/// `Modf` and `Frexp` of the GLSL instruction set, which store through a pointer.
const STORING_EXTENDED: [u32; 2] = [35, 51];

fn changes_memory(instruction: &Instruction) -> bool {
    match instruction.class.opcode {
        Op::CopyMemory | Op::CopyMemorySized | Op::FunctionCall => true,
        Op::ExtInst => instruction.operands.iter().any(|operand| {
            matches!(operand, Operand::LiteralExtInstInteger(number) if STORING_EXTENDED.contains(number))
        }),
        _ => false,
    }
}

/// Whether the result depends only on the operands.
fn is_pure(opcode: Op) -> bool {
    use Op::*;
    matches!(
        opcode,
        AccessChain
            | InBoundsAccessChain
            | ExtInst
            | VectorExtractDynamic
            | VectorInsertDynamic
            | VectorShuffle
            | CompositeConstruct
            | CompositeExtract
            | CompositeInsert
            | CopyObject
            | Transpose
            | ConvertFToU
            | ConvertFToS
            | ConvertSToF
            | ConvertUToF
            | UConvert
            | SConvert
            | FConvert
            | QuantizeToF16
            | Bitcast
            | SNegate
            | FNegate
            | IAdd
            | FAdd
            | ISub
            | FSub
            | IMul
            | FMul
            | UDiv
            | SDiv
            | FDiv
            | UMod
            | SRem
            | SMod
            | FRem
            | FMod
            | VectorTimesScalar
            | MatrixTimesScalar
            | VectorTimesMatrix
            | MatrixTimesVector
            | MatrixTimesMatrix
            | OuterProduct
            | Dot
            | Any
            | All
            | IsNan
            | IsInf
            | LogicalEqual
            | LogicalNotEqual
            | LogicalOr
            | LogicalAnd
            | LogicalNot
            | Select
            | IEqual
            | INotEqual
            | UGreaterThan
            | SGreaterThan
            | UGreaterThanEqual
            | SGreaterThanEqual
            | ULessThan
            | SLessThan
            | ULessThanEqual
            | SLessThanEqual
            | FOrdEqual
            | FUnordEqual
            | FOrdNotEqual
            | FUnordNotEqual
            | FOrdLessThan
            | FUnordLessThan
            | FOrdGreaterThan
            | FUnordGreaterThan
            | FOrdLessThanEqual
            | FUnordLessThanEqual
            | FOrdGreaterThanEqual
            | FUnordGreaterThanEqual
            | ShiftRightLogical
            | ShiftRightArithmetic
            | ShiftLeftLogical
            | BitwiseOr
            | BitwiseXor
            | BitwiseAnd
            | Not
            | BitFieldInsert
            | BitFieldSExtract
            | BitFieldUExtract
            | BitReverse
            | BitCount
    )
}
