//! Descriptors, inputs and outputs of a fragment shader.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Dim, ExecutionModel, Op, StorageClass, Word};
use std::collections::HashMap;

/// A fragment shader and its definitions.
pub struct Fragment {
    pub words: Vec<u32>,
    pub module: Module,
    /// Name of the entry point.
    pub name: String,
    interface: Vec<Word>,
    definitions: HashMap<Word, Instruction>,
}

/// A descriptor.
pub struct Descriptor {
    pub set: u32,
    pub binding: u32,
    pub count: u32,
    pub kind: Kind,
}

/// What a descriptor refers to.
pub enum Kind {
    Image(ImageKind),
    Sampler,
    Uniform,
    Storage,
}

/// Type of an image.
pub struct ImageKind {
    pub dim: Dim,
    pub arrayed: bool,
    pub depth: bool,
    pub multisampled: bool,
    pub sampled: bool,
    pub with_sampler: bool,
    pub numbers: Numbers,
}

/// Numbers that an image or an output holds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Numbers {
    Float,
    Signed,
    Unsigned,
}

/// An input or output with a location.
pub struct Variable {
    pub id: Word,
    pub value_type: Word,
    pub location: u32,
}

impl Fragment {
    /// Parses a module with one fragment entry point.
    pub fn of(words: &[u32]) -> Result<Self, String> {
        let module = rspirv::dr::load_words(words).map_err(|e| e.to_string())?;
        let model = Operand::ExecutionModel(ExecutionModel::Fragment);
        let entry = module
            .entry_points
            .iter()
            .find(|e| e.operands.first() == Some(&model));
        let entry = entry.ok_or("no fragment entry point")?;
        let Some(Operand::LiteralString(name)) = entry.operands.get(2) else {
            return Err("an entry point without a name".to_owned());
        };
        let globals = module.types_global_values.iter();
        Ok(Self {
            words: words.to_vec(),
            name: name.clone(),
            interface: entry.operands[3..]
                .iter()
                .filter_map(Operand::id_ref_any)
                .collect(),
            definitions: globals
                .filter_map(|i| Some((i.result_id?, i.clone())))
                .collect(),
            module,
        })
    }

    /// Number of instructions that read texels.
    pub fn samples(&self) -> usize {
        let all = self
            .module
            .functions
            .iter()
            .flat_map(|f| &f.blocks)
            .flat_map(|b| &b.instructions);
        let first = Op::ImageSampleImplicitLod as u32;
        let reads = first..=Op::ImageRead as u32;
        all.filter(|i| reads.contains(&(i.class.opcode as u32)))
            .count()
    }

    /// Definition of a type or constant.
    pub fn definition(&self, id: Word) -> Result<&Instruction, String> {
        self.definitions
            .get(&id)
            .ok_or(format!("%{id} is not defined"))
    }

    /// Decorations of an id with their operands.
    pub fn decorations(&self, id: Word) -> impl Iterator<Item = (Decoration, &[Operand])> {
        self.module
            .annotations
            .iter()
            .filter_map(move |a| match &a.operands[..] {
                [Operand::IdRef(of), Operand::Decoration(found), rest @ ..]
                    if *of == id && a.class.opcode == Op::Decorate =>
                {
                    Some((*found, rest))
                }
                _ => None,
            })
    }

    fn number(&self, id: Word, wanted: Decoration) -> Option<u32> {
        self.decorations(id)
            .find_map(|(found, operands)| match operands {
                [Operand::LiteralBit32(value), ..] if found == wanted => Some(*value),
                _ => None,
            })
    }

    /// The element of an array, and the number of elements. Arrays without a size have eight.
    fn element(&self, array: Word) -> Result<(Word, u32), String> {
        let (mut of, mut count) = (array, 1);
        loop {
            let definition = self.definition(of)?;
            let ids: Vec<Word> = definition
                .operands
                .iter()
                .filter_map(Operand::id_ref_any)
                .collect();
            match (definition.class.opcode, &ids[..]) {
                (Op::TypeArray, [element, length]) => {
                    count *= self.constant(*length)?;
                    of = *element;
                }
                (Op::TypeRuntimeArray, [element]) => {
                    count *= 8;
                    of = *element;
                }
                _ => return Ok((of, count)),
            }
        }
    }

    /// Value of a constant.
    pub fn constant(&self, id: Word) -> Result<u32, String> {
        match self.definition(id)?.operands.first() {
            Some(Operand::LiteralBit32(value)) => Ok(*value),
            _ => Err("an array whose size is no constant".to_owned()),
        }
    }

    fn variables(&self, class: StorageClass) -> impl Iterator<Item = (Word, Word)> {
        let is_of = move |i: &&Instruction| {
            i.class.opcode == Op::Variable
                && i.operands.first() == Some(&Operand::StorageClass(class))
        };
        let variables = self.module.types_global_values.iter().filter(is_of);
        variables.filter_map(|variable| {
            let pointer = self.definitions.get(&variable.result_type?)?;
            Some((variable.result_id?, pointer.operands.get(1)?.id_ref_any()?))
        })
    }

    /// Descriptors of the module.
    pub fn descriptors(&self) -> Result<Vec<Descriptor>, String> {
        let mut found: Vec<Descriptor> = Vec::new();
        for class in [
            StorageClass::UniformConstant,
            StorageClass::Uniform,
            StorageClass::StorageBuffer,
        ] {
            for (variable, of) in self.variables(class) {
                let set = self.number(variable, Decoration::DescriptorSet);
                let (Some(set), Some(binding)) = (set, self.number(variable, Decoration::Binding))
                else {
                    continue;
                };
                // Variables may share a binding.
                if found.iter().any(|d| (d.set, d.binding) == (set, binding)) {
                    continue;
                }
                let (element, count) = self.element(of)?;
                let kind = self.kind(element, class)?;
                found.push(Descriptor {
                    set,
                    binding,
                    count,
                    kind,
                });
            }
        }
        Ok(found)
    }

    fn kind(&self, of: Word, class: StorageClass) -> Result<Kind, String> {
        let definition = self.definition(of)?;
        let inner = definition.operands.first().and_then(Operand::id_ref_any);
        let is_storage = class == StorageClass::StorageBuffer
            || self
                .decorations(of)
                .any(|(found, _)| found == Decoration::BufferBlock);
        Ok(match (definition.class.opcode, inner) {
            (Op::TypeSampler, _) => Kind::Sampler,
            (Op::TypeSampledImage, Some(image)) => Kind::Image(self.image(image, true)?),
            (Op::TypeImage, _) => Kind::Image(self.image(of, false)?),
            _ if is_storage => Kind::Storage,
            _ => Kind::Uniform,
        })
    }

    fn image(&self, of: Word, with_sampler: bool) -> Result<ImageKind, String> {
        let operands = &self.definition(of)?.operands;
        let flag = |place: usize| operands.get(place) == Some(&Operand::LiteralBit32(1));
        let (Some(Operand::IdRef(texel)), Some(Operand::Dim(dim))) =
            (operands.first(), operands.get(1))
        else {
            return Err("an image without a type".to_owned());
        };
        Ok(ImageKind {
            dim: *dim,
            depth: flag(2),
            arrayed: flag(3),
            multisampled: flag(4),
            sampled: flag(5),
            with_sampler,
            numbers: self.numbers(*texel)?,
        })
    }

    /// Numbers of a scalar, or of the parts of a vector.
    pub fn numbers(&self, of: Word) -> Result<Numbers, String> {
        let definition = self.definition(of)?;
        match (definition.class.opcode, &definition.operands[..]) {
            (Op::TypeVector, [Operand::IdRef(part), ..]) => self.numbers(*part),
            (Op::TypeInt, [_, Operand::LiteralBit32(1)]) => Ok(Numbers::Signed),
            (Op::TypeInt, _) => Ok(Numbers::Unsigned),
            _ => Ok(Numbers::Float),
        }
    }

    /// Inputs or outputs of the entry point that have a location.
    pub fn located(&self, class: StorageClass) -> Vec<Variable> {
        let all = self
            .variables(class)
            .filter(|(id, _)| self.interface.contains(id));
        let located = all.filter_map(|(id, value_type)| {
            let location = self.number(id, Decoration::Location)?;
            Some(Variable {
                id,
                value_type,
                location,
            })
        });
        located.collect()
    }

    /// Numbers of each colour output, by location.
    pub fn outputs(&self) -> Result<Vec<Option<Numbers>>, String> {
        let mut found = Vec::new();
        for output in self.located(StorageClass::Output) {
            let (element, count) = self.element(output.value_type)?;
            let end = (output.location + count) as usize;
            found.resize(found.len().max(end), None);
            let numbers = self.numbers(element)?;
            found[output.location as usize..end].fill(Some(numbers));
        }
        Ok(found)
    }
}
