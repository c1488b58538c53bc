//! A vertex shader whose outputs are the inputs of a fragment shader.

use crate::reflect::Fragment;
use rspirv::binary::Assemble;
use rspirv::dr::{Builder, Instruction, Operand};
use rspirv::spirv::{
    AddressingModel, BuiltIn, Capability, Decoration, ExecutionModel, FunctionControl, MemoryModel,
    Op, StorageClass, Word,
};

/// SPIR-V of the shader. Each number of its outputs depends on the vertex, so that the driver cannot replace it by a
/// constant. All vertices are at one place outside the view.
pub fn words(of: &Fragment) -> Result<Vec<u32>, String> {
    let mut b = Builder::new();
    b.set_version(1, 3);
    b.capability(Capability::Shader);
    b.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
    let (void, float, int) = (b.type_void(), b.type_float(32, None), b.type_int(32, 1));
    let vector = b.type_vector(float, 4);
    let mut built_in = |class, of_type, which| {
        let pointer = b.type_pointer(None, class, of_type);
        let variable = b.variable(pointer, None, class, None);
        b.decorate(variable, Decoration::BuiltIn, [Operand::BuiltIn(which)]);
        variable
    };
    let index = built_in(StorageClass::Input, int, BuiltIn::VertexIndex);
    let position = built_in(StorageClass::Output, vector, BuiltIn::Position);
    let mut interface = vec![index, position];
    let mut outputs = Vec::new();
    for input in of.located(StorageClass::Input) {
        let value_type = copied(&mut b, of, input.value_type)?;
        let pointer = b.type_pointer(None, StorageClass::Output, value_type);
        let output = b.variable(pointer, None, StorageClass::Output, None);
        for (found, operands) in of.decorations(input.id) {
            use Decoration::{Centroid, Component, Flat, Location, NoPerspective};
            if matches!(
                found,
                Location | Component | Flat | NoPerspective | Centroid
            ) {
                b.decorate(output, found, operands.to_vec());
            }
        }
        interface.push(output);
        outputs.push((output, value_type));
    }
    let function = b.type_function(void, []);
    let made = |e: rspirv::dr::Error| e.to_string();
    let main = b
        .begin_function(void, None, FunctionControl::NONE, function)
        .map_err(made)?;
    b.begin_block(None).map_err(made)?;
    let index = b.load(int, None, index, None, []).map_err(made)?;
    let mut values = Values {
        index,
        float: b.convert_s_to_f(float, None, index).map_err(made)?,
        count: 0,
    };
    let two = b.constant_bit32(float, 2.0_f32.to_bits());
    let outside = b
        .composite_construct(vector, None, [two; 4])
        .map_err(made)?;
    let far = b.constant_bit32(float, 100.0_f32.to_bits());
    let outside = b
        .composite_insert(vector, None, far, outside, [0])
        .map_err(made)?;
    b.store(position, outside, None, []).map_err(made)?;
    for (output, value_type) in outputs {
        let value = values.next(&mut b, value_type)?;
        b.store(output, value, None, []).map_err(made)?;
    }
    b.ret().map_err(made)?;
    b.end_function().map_err(made)?;
    b.entry_point(ExecutionModel::Vertex, main, "main", interface);
    Ok(b.module().assemble())
}

/// Declares a type of the fragment shader.
fn copied(b: &mut Builder, of: &Fragment, original: Word) -> Result<Word, String> {
    let definition = of.definition(original)?.clone();
    Ok(match (definition.class.opcode, &definition.operands[..]) {
        (Op::TypeFloat, _) => b.type_float(32, None),
        (Op::TypeInt, [_, Operand::LiteralBit32(signed)]) => b.type_int(32, *signed),
        (Op::TypeVector, [Operand::IdRef(part), Operand::LiteralBit32(count)]) => {
            let part = copied(b, of, *part)?;
            b.type_vector(part, *count)
        }
        (Op::TypeMatrix, [Operand::IdRef(column), Operand::LiteralBit32(count)]) => {
            let column = copied(b, of, *column)?;
            b.type_matrix(column, *count)
        }
        (Op::TypeArray, [Operand::IdRef(element), Operand::IdRef(length)]) => {
            let element = copied(b, of, *element)?;
            let unsigned = b.type_int(32, 0);
            let length = b.constant_bit32(unsigned, of.constant(*length)?);
            b.type_array(element, length)
        }
        (Op::TypeStruct, members) => {
            let members = members.iter().filter_map(Operand::id_ref_any);
            let members: Result<Vec<_>, _> = members.map(|member| copied(b, of, member)).collect();
            b.type_struct(members?)
        }
        (other, _) => return Err(format!("an input of {other:?}")),
    })
}

/// Values that depend on the vertex.
struct Values {
    index: Word,
    float: Word,
    count: u32,
}

impl Values {
    fn next(&mut self, b: &mut Builder, of: Word) -> Result<Word, String> {
        let globals = &b.module_ref().types_global_values;
        let find = |id: Word| globals.iter().find(|i| i.result_id == Some(id)).cloned();
        let definition: Instruction = find(of).ok_or("a type")?;
        let made = |e: rspirv::dr::Error| e.to_string();
        let parts: Vec<Word> = match (definition.class.opcode, &definition.operands[..]) {
            (Op::TypeFloat, _) => {
                self.count += 1;
                let by = b.constant_bit32(of, (0.1 * self.count as f32).to_bits());
                return b.f_mul(of, None, self.float, by).map_err(made);
            }
            (Op::TypeInt, [_, Operand::LiteralBit32(1)]) => return Ok(self.index),
            (Op::TypeInt, _) => return b.bitcast(of, None, self.index).map_err(made),
            (Op::TypeArray, [Operand::IdRef(element), Operand::IdRef(length)]) => {
                let length = find(*length).and_then(|length| match length.operands.first() {
                    Some(Operand::LiteralBit32(length)) => Some(*length),
                    _ => None,
                });
                vec![*element; length.unwrap_or(1) as usize]
            }
            (_, [Operand::IdRef(part), Operand::LiteralBit32(count)]) => {
                vec![*part; *count as usize]
            }
            (_, members) => members.iter().filter_map(Operand::id_ref_any).collect(),
        };
        let parts: Result<Vec<_>, _> = parts.into_iter().map(|part| self.next(b, part)).collect();
        b.composite_construct(of, None, parts?).map_err(made)
    }
}
