//! Parses the words of a module.

use super::InjectError;
use rspirv::binary::{Consumer, ParseAction, parse_words};
use rspirv::dr::{Instruction, Loader, Module, ModuleHeader};
use rspirv::spirv::Op;

/// rspirv's loader, which refuses `OpExecutionModeId`.
struct WithModes {
    loader: Loader,
    modes: Vec<Instruction>,
}

impl Consumer for WithModes {
    fn initialize(&mut self) -> ParseAction {
        self.loader.initialize()
    }

    fn finalize(&mut self) -> ParseAction {
        self.loader.finalize()
    }

    fn consume_header(&mut self, header: ModuleHeader) -> ParseAction {
        self.loader.consume_header(header)
    }

    fn consume_instruction(&mut self, instruction: Instruction) -> ParseAction {
        if instruction.class.opcode == Op::ExecutionModeId {
            self.modes.push(instruction);
            return ParseAction::Continue;
        }
        self.loader.consume_instruction(instruction)
    }
}

/// Parses a module.
pub(super) fn module(words: &[u32]) -> Result<Module, InjectError> {
    let mut parsed = WithModes {
        loader: Loader::new(),
        modes: Vec::new(),
    };
    parse_words(words, &mut parsed).map_err(|e| InjectError::Parse(e.to_string()))?;
    let mut module = parsed.loader.module();
    module.execution_modes.append(&mut parsed.modes);
    Ok(module)
}
