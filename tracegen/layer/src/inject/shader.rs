//! A parsed module and one of its entry points: definitions, types, descriptors, and the reachable functions.

use super::InjectError;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, ExecutionMode, ExecutionModel, Op, StorageClass, Word};
use std::cell::Cell;
use std::collections::{HashMap, HashSet};

/// A shader in its module.
pub(super) struct Shader {
    pub module: Module,
    /// Index of its entry point in the module.
    pub entry: usize,
    /// Function of the entry point.
    pub main: Word,
    /// Indices of the functions that it can reach, including itself.
    pub functions: Vec<usize>,
    /// Instruction that defines each result.
    definitions: HashMap<Word, Instruction>,
    /// Function and index of each parameter.
    parameters: HashMap<Word, (Word, usize)>,
    /// Arguments of every call of a function.
    calls: HashMap<Word, Vec<Vec<Word>>>,
    /// Set and binding of the variables that have them.
    bindings: HashMap<Word, (u32, u32)>,
    /// Number of definitions that the current search may still visit.
    steps_left: Cell<u32>,
}

/// Limits of a search for a descriptor: depth, and number of visited definitions. In a malformed module,
/// functions may call themselves.
const MOST_STEPS: (u32, u32) = (16, 1000);

/// Largest number of words of a module that is rewritten, about a hundred times that of usual modules.
const MOST_WORDS: usize = 1 << 22;

impl Shader {
    /// Parses a module and finds its fragment entry point `name`, or its only one.
    pub fn parse(words: &[u32], name: Option<&str>) -> Result<Self, InjectError> {
        Self::parse_stage(words, name, ExecutionModel::Fragment)
    }

    /// Parses a module and finds its entry point `name` of a stage, or its only one.
    pub fn parse_stage(
        words: &[u32],
        name: Option<&str>,
        stage: ExecutionModel,
    ) -> Result<Self, InjectError> {
        if words.len() > MOST_WORDS {
            return Err(InjectError::TooLarge(words.len()));
        }
        check_lengths(words)?;
        let module = super::parse::module(words)?;
        let is_wanted = |entry: &Instruction| {
            let of_name = match entry.operands.get(2) {
                Some(Operand::LiteralString(found)) => name.is_none_or(|name| name == found),
                _ => false,
            };
            let model = Some(&Operand::ExecutionModel(stage));
            of_name && entry.operands.first() == model
        };
        let entry =
            (module.entry_points.iter().position(is_wanted)).ok_or(InjectError::NoFragmentEntry)?;
        let main = (module.entry_points[entry].operands.get(1))
            .and_then(Operand::id_ref_any)
            .ok_or(InjectError::NoFragmentEntry)?;
        let mut shader = Self {
            entry,
            main,
            functions: Vec::new(),
            definitions: HashMap::new(),
            parameters: HashMap::new(),
            calls: HashMap::new(),
            bindings: HashMap::new(),
            steps_left: Cell::new(0),
            module,
        };
        shader.index();
        shader.functions = shader.reachable()?;
        Ok(shader)
    }

    fn index(&mut self) {
        let module = &self.module;
        let globals = module.types_global_values.iter();
        let imports = module.ext_inst_imports.iter();
        for instruction in globals.chain(imports) {
            if let Some(id) = instruction.result_id {
                self.definitions.insert(id, instruction.clone());
            }
        }
        for function in &module.functions {
            let Some(id) = function.def.as_ref().and_then(|def| def.result_id) else {
                continue;
            };
            for (place, parameter) in function.parameters.iter().enumerate() {
                if let Some(result) = parameter.result_id {
                    self.parameters.insert(result, (id, place));
                    self.definitions.insert(result, parameter.clone());
                }
            }
            for instruction in function.blocks.iter().flat_map(|block| &block.instructions) {
                if let Some(result) = instruction.result_id {
                    self.definitions.insert(result, instruction.clone());
                }
                if instruction.class.opcode == Op::FunctionCall {
                    let ids = ids(instruction);
                    if let Some((called, arguments)) = ids.split_first() {
                        let calls = self.calls.entry(*called).or_default();
                        calls.push(arguments.to_vec());
                    }
                }
            }
        }
        for annotation in &module.annotations {
            if let (
                Op::Decorate,
                [
                    Operand::IdRef(target),
                    Operand::Decoration(decoration),
                    Operand::LiteralBit32(value),
                ],
            ) = (annotation.class.opcode, &annotation.operands[..])
            {
                let of = self.bindings.entry(*target).or_insert((u32::MAX, u32::MAX));
                match decoration {
                    Decoration::DescriptorSet => of.0 = *value,
                    Decoration::Binding => of.1 = *value,
                    _ => {}
                }
            }
        }
        self.bindings
            .retain(|_, (set, binding)| *set != u32::MAX && *binding != u32::MAX);
    }

    fn reachable(&self) -> Result<Vec<usize>, InjectError> {
        let functions = &self.module.functions;
        let of_id = |id: Word| {
            let has_id =
                |f: &rspirv::dr::Function| f.def.as_ref().and_then(|def| def.result_id) == Some(id);
            functions.iter().position(has_id)
        };
        let main = of_id(self.main).ok_or(InjectError::NoFragmentEntry)?;
        let (mut found, mut open) = (HashSet::from([main]), vec![main]);
        while let Some(function) = open.pop() {
            let instructions = functions[function]
                .blocks
                .iter()
                .flat_map(|b| &b.instructions);
            let calls = instructions.filter(|i| i.class.opcode == Op::FunctionCall);
            for called in calls.filter_map(|call| ids(call).first().copied()) {
                let called =
                    of_id(called).ok_or(InjectError::Malformed("a call of no function"))?;
                if found.insert(called) {
                    open.push(called);
                }
            }
        }
        let mut found: Vec<usize> = found.into_iter().collect();
        found.sort_unstable();
        Ok(found)
    }

    /// Instruction that defines a result.
    pub fn definition(&self, id: Word) -> Option<&Instruction> {
        self.definitions.get(&id)
    }

    /// Instruction that defines the type of a result.
    pub fn type_of(&self, id: Word) -> Option<&Instruction> {
        self.definition(self.definition(id)?.result_type?)
    }

    /// Set and binding of a variable.
    pub fn binding(&self, variable: Word) -> Option<(u32, u32)> {
        self.bindings.get(&variable).copied()
    }

    /// Arguments for a parameter, by call; `None` for other values.
    pub fn arguments(&self, parameter: Word) -> Option<Vec<Word>> {
        let (function, place) = self.parameters.get(&parameter)?;
        let calls = self.calls.get(function).map_or(&[][..], Vec::as_slice);
        calls.iter().map(|call| call.get(*place).copied()).collect()
    }

    /// Starts a search for a descriptor.
    pub fn start_steps(&self) {
        self.steps_left.set(MOST_STEPS.1);
    }

    /// Counts a step of the search. Returns false if a limit is exceeded.
    pub fn may_step(&self, depth: u32) -> bool {
        let left = self.steps_left.get();
        self.steps_left.set(left.saturating_sub(1));
        left > 0 && depth < MOST_STEPS.0
    }

    /// Value of a constant, or the bits of a float; `None` for specialisation constants.
    pub fn constant(&self, id: Word) -> Option<u32> {
        let definition = self.definition(id)?;
        match (definition.class.opcode, definition.operands.first()) {
            (Op::Constant, Some(Operand::LiteralBit32(value))) => Some(*value),
            (Op::ConstantNull, _) => Some(0),
            _ => None,
        }
    }

    /// Instructions of the functions that the entry point can reach.
    pub fn instructions(&self) -> impl Iterator<Item = &Instruction> {
        let functions = self.functions.iter().map(|f| &self.module.functions[*f]);
        functions
            .flat_map(|function| &function.blocks)
            .flat_map(|block| &block.instructions)
    }

    /// Whether it is a vertex shader.
    pub fn is_vertex(&self) -> bool {
        let model = Some(&Operand::ExecutionModel(ExecutionModel::Vertex));
        self.module.entry_points[self.entry].operands.first() == model
    }

    /// Whether the entry point has an execution mode.
    pub fn has_mode(&self, wanted: ExecutionMode) -> bool {
        self.module.execution_modes.iter().any(|mode| {
            mode.operands.first() == Some(&Operand::IdRef(self.main))
                && mode.operands.get(1) == Some(&Operand::ExecutionMode(wanted))
        })
    }

    /// The interface variable of the entry point for a built-in.
    pub fn builtin(&self, wanted: BuiltIn, class: StorageClass) -> Option<Word> {
        let interface = self.module.entry_points[self.entry].operands.get(3..)?;
        let is_wanted = |id: &Word| {
            let decorated = self.module.annotations.iter().any(|a| {
                a.class.opcode == Op::Decorate
                    && a.operands.first() == Some(&Operand::IdRef(*id))
                    && a.operands.get(2) == Some(&Operand::BuiltIn(wanted))
            });
            let class = Some(&Operand::StorageClass(class));
            decorated
                && self
                    .definition(*id)
                    .is_some_and(|d| d.operands.first() == class)
        };
        (interface.iter().filter_map(Operand::id_ref_any)).find(is_wanted)
    }
}

/// Rejects instructions that extend beyond the module, because the parser does not check this.
fn check_lengths(words: &[u32]) -> Result<(), InjectError> {
    const HEADER_WORDS: usize = 5;
    let mut rest = words.get(HEADER_WORDS..).unwrap_or_default();
    while let Some(first) = rest.first() {
        let length = (first >> 16) as usize;
        rest = (rest.get(length..).filter(|_| length > 0))
            .ok_or(InjectError::Malformed("an instruction's length"))?;
    }
    Ok(())
}

/// The ids in an instruction's operands.
pub(super) fn ids(instruction: &Instruction) -> Vec<Word> {
    let operands = instruction.operands.iter();
    operands.filter_map(Operand::id_ref_any).collect()
}
