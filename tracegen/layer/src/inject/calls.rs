//! Generates calls of the recording functions with their arguments.

use super::declare::{self, Input, Inputs, Types, id, literal};
use super::functions::Functions;
use super::rewrite::put;
use super::shader::Shader;
use super::{InjectError, Target};
use rspirv::dr::{Builder, Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};
use std::collections::HashMap;

/// Generates calls in a module.
pub(super) struct CallEmitter {
    pub builder: Builder,
    types: Types,
    place: Input,
    zero: Word,
    uzero: Word,
    functions: Functions,
    /// `void quads(uint group, vec2 at[n])`, by n.
    quads: HashMap<usize, Word>,
    /// `void depth(uint group, float depth)`
    depth: Option<Word>,
    /// `void fragment(uint group, uint element, vec3 at, float lod, vec3 dx, vec3 dy)`
    fragment: Option<Word>,
}

impl CallEmitter {
    /// Declares what the recording functions need.
    pub fn new(shader: &Shader, target: &Target) -> Result<Self, InjectError> {
        let mut builder = declare::builder(shader, target);
        let vulkan_memory = declare::use_addresses(&mut builder)?;
        let types = Types::new(&mut builder);
        let inputs = Inputs::new(&mut builder, shader, target, types)?;
        Ok(Self {
            types,
            place: inputs.place,
            zero: builder.constant_bit32(types.f32, 0),
            uzero: builder.constant_bit32(types.u32, 0),
            functions: Functions::new(&mut builder, types, inputs, target, vulkan_memory),
            quads: HashMap::new(),
            depth: None,
            fragment: None,
            builder,
        })
    }

    /// The module.
    pub fn finish(self) -> Module {
        self.builder.module()
    }

    /// Computes what all records of a fragment have in common.
    pub fn begin(&mut self, out: &mut Vec<Instruction>) -> Result<(), InjectError> {
        let function = self.functions.begin(&mut self.builder)?;
        self.call(vec![function], out);
        Ok(())
    }

    /// Records the active lanes of a quad and their coordinates.
    pub fn record_quads(
        &mut self,
        group: u16,
        all: &[Vec<Word>],
        out: &mut Vec<Instruction>,
    ) -> Result<(), InjectError> {
        let function = match self.quads.get(&all.len()) {
            Some(function) => *function,
            None => {
                let made = (self.functions).quads(&mut self.builder, all.len() as u32)?;
                self.quads.insert(all.len(), made);
                made
            }
        };
        let mut arguments = vec![function, self.group(group)];
        for at in all {
            let parts = [0, 1].map(|axis| id(at.get(axis).copied().unwrap_or(self.zero)));
            arguments.push(self.put(out, Op::CompositeConstruct, self.types.vec2, parts.to_vec()));
        }
        self.call(arguments, out);
        Ok(())
    }

    /// Records the active lanes and their depth as coordinate u.
    pub fn record_depth(
        &mut self,
        group: u16,
        out: &mut Vec<Instruction>,
    ) -> Result<(), InjectError> {
        let Input { variable, of } = self.place;
        let place = self.put(out, Op::Load, of, vec![id(variable)]);
        let depth = self.extracted(place, 2, out);
        let function = match self.depth {
            Some(function) => function,
            None => *(self.depth).insert(self.functions.depth(&mut self.builder)?),
        };
        let arguments = vec![function, self.group(group), depth];
        self.call(arguments, out);
        Ok(())
    }

    /// Records the active lanes without coordinates.
    pub fn record_presence(
        &mut self,
        group: u16,
        out: &mut Vec<Instruction>,
    ) -> Result<(), InjectError> {
        self.record_quads(group, &[], out)
    }

    /// Records the coordinates of a fragment, with its level and derivatives if it has any.
    pub fn record_fragment(
        &mut self,
        group: u16,
        element: Option<Word>,
        at: &[Word],
        lod: Option<Word>,
        gradients: Option<[Vec<Word>; 2]>,
        out: &mut Vec<Instruction>,
    ) -> Result<(), InjectError> {
        let function = match self.fragment {
            Some(function) => function,
            None => *(self.fragment).insert(self.functions.fragment(&mut self.builder)?),
        };
        let at = self.vec3(at, out);
        let [dx, dy] = gradients.unwrap_or_default().map(|of| self.vec3(&of, out));
        let element = element.unwrap_or(self.uzero);
        let lod = lod.unwrap_or(self.zero);
        let arguments = vec![function, self.group(group), element, at, lod, dx, dy];
        self.call(arguments, out);
        Ok(())
    }

    fn group(&mut self, group: u16) -> Word {
        self.builder.constant_bit32(self.types.u32, group.into())
    }

    fn call(&mut self, function_and_arguments: Vec<Word>, out: &mut Vec<Instruction>) {
        let operands = function_and_arguments.into_iter().map(id).collect();
        self.put(out, Op::FunctionCall, self.types.void, operands);
    }

    /// Derivatives of coordinates over the quad.
    pub fn derivatives(&mut self, at: &[Word], out: &mut Vec<Instruction>) -> [Vec<Word>; 2] {
        [Op::DPdxFine, Op::DPdyFine].map(|opcode| {
            let f32 = self.types.f32;
            let of = at
                .iter()
                .map(|part| self.put(out, opcode, f32, vec![id(*part)]));
            of.collect()
        })
    }

    /// The components of a scalar or vector as 32-bit floats.
    pub fn floats(&mut self, shader: &Shader, of: Word, out: &mut Vec<Instruction>) -> Vec<Word> {
        let Some(kind) = shader.type_of(of) else {
            return Vec::new();
        };
        let part_type = kind.operands.first().and_then(Operand::id_ref_any);
        match (kind.class.opcode, part_type, kind.operands.get(1)) {
            (Op::TypeVector, Some(part_type), Some(Operand::LiteralBit32(count))) => (0..(*count)
                .min(4))
                .map(|place| {
                    let operands = vec![id(of), literal(place)];
                    let part = self.put(out, Op::CompositeExtract, part_type, operands);
                    self.converted(shader, part, part_type, out)
                })
                .collect(),
            _ => vec![self.float(shader, of, out)],
        }
    }

    /// A scalar as a 32-bit float.
    pub fn float(&mut self, shader: &Shader, of: Word, out: &mut Vec<Instruction>) -> Word {
        match shader.definition(of).and_then(|d| d.result_type) {
            Some(of_type) => self.converted(shader, of, of_type, out),
            None => self.zero,
        }
    }

    /// A scalar as an unsigned number.
    pub fn unsigned(&mut self, shader: &Shader, of: Word, out: &mut Vec<Instruction>) -> Word {
        let of_type = shader.type_of(of);
        let is_32 = of_type.is_some_and(|t| t.operands.first() == Some(&literal(32)));
        match shader.definition(of).and_then(|d| d.result_type) {
            Some(already) if already == self.types.u32 => of,
            Some(_) if is_32 => self.put(out, Op::Bitcast, self.types.u32, vec![id(of)]),
            Some(_) => self.put(out, Op::UConvert, self.types.u32, vec![id(of)]),
            None => self.uzero,
        }
    }

    /// Divides two floats.
    pub fn divided(&mut self, a: Word, b: Word, out: &mut Vec<Instruction>) -> Word {
        self.put(out, Op::FDiv, self.types.f32, vec![id(a), id(b)])
    }

    fn converted(
        &mut self,
        shader: &Shader,
        of: Word,
        of_type: Word,
        out: &mut Vec<Instruction>,
    ) -> Word {
        let Some(kind) = shader.definition(of_type) else {
            return of;
        };
        let is_32 = kind.operands.first() == Some(&literal(32));
        let is_signed = kind.operands.get(1) == Some(&literal(1));
        let opcode = match kind.class.opcode {
            Op::TypeInt if is_signed => Op::ConvertSToF,
            Op::TypeInt => Op::ConvertUToF,
            Op::TypeFloat if !is_32 => Op::FConvert,
            _ => return of,
        };
        self.put(out, opcode, self.types.f32, vec![id(of)])
    }

    fn vec3(&mut self, parts: &[Word], out: &mut Vec<Instruction>) -> Word {
        let parts = [0, 1, 2].map(|axis| id(parts.get(axis).copied().unwrap_or(self.zero)));
        self.put(out, Op::CompositeConstruct, self.types.vec3, parts.to_vec())
    }

    fn extracted(&mut self, of: Word, place: u32, out: &mut Vec<Instruction>) -> Word {
        let operands = vec![id(of), literal(place)];
        self.put(out, Op::CompositeExtract, self.types.f32, operands)
    }

    fn put(
        &mut self,
        out: &mut Vec<Instruction>,
        opcode: Op,
        of: Word,
        operands: Vec<Operand>,
    ) -> Word {
        put(&mut self.builder, out, opcode, of, operands)
    }
}
