//! Inserts calls of the recording functions and the declarations that they need.

use super::calls::CallEmitter;
use super::find::Found;
use super::shader::Shader;
use super::sites::{Batch, Sites, stays_first};
use super::{InjectError, Rewritten, Target, tests_of};
use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Operand};
use rspirv::spirv::{ExecutionMode, Op, Word};
use spool::DepthTests;
use spool::{Form, Lod, What};

/// Rewrites a module.
pub(super) fn rewrite(shader: Shader, target: &Target) -> Result<Rewritten, InjectError> {
    let tests = tests_of(&shader);
    let mut sites = Sites::new(&shader, tests)?;
    let (functions, main) = (shader.functions.clone(), shader.main);
    let mut calls = CallEmitter::new(&shader, target)?;
    if tests == DepthTests::Either || tests == DepthTests::EarlyLateWrite {
        // The rewritten discarding shader is used by an additional draw, which writes nothing.
        calls
            .builder
            .execution_mode(main, ExecutionMode::EarlyFragmentTests, []);
    }
    // Only the primitives of a draw whose fragments may be discarded are compared again.
    let needs_depth = tests == DepthTests::EarlyLateWrite;
    for function in functions {
        let is_main = sites.main == function;
        let blocks = calls.builder.module_ref().functions[function].blocks.len();
        for block in 0..blocks {
            let body = &mut calls.builder.module_mut().functions[function].blocks[block];
            let old = std::mem::take(&mut body.instructions);
            let mut new = Vec::with_capacity(2 * old.len());
            let mut starts = is_main && block == 0;
            for (place, instruction) in old.into_iter().enumerate() {
                if starts && !stays_first(&instruction) {
                    starts = false;
                    calls.begin(&mut new)?;
                    if let Some(group) = sites.entry {
                        match needs_depth {
                            true => calls.record_depth(group, &mut new)?,
                            false => calls.record_presence(group, &mut new)?,
                        }
                    }
                }
                if let Some(batch) = sites.batches.remove(&(function, block, place)) {
                    record(&mut calls, &shader, &batch, &mut new)?;
                }
                if instruction.class.opcode == Op::Return
                    && is_main
                    && let Some(group) = sites.end
                {
                    calls.record_presence(group, &mut new)?;
                }
                new.push(instruction);
            }
            calls.builder.module_mut().functions[function].blocks[block].instructions = new;
        }
    }
    Ok(Rewritten {
        words: calls.finish().assemble(),
        sites: sites.sites,
        tests,
        unrecorded: sites.unrecorded,
    })
}

/// Inserts the recording of coordinate groups before an instruction.
fn record(
    calls: &mut CallEmitter,
    shader: &Shader,
    batch: &Batch,
    out: &mut Vec<Instruction>,
) -> Result<(), InjectError> {
    match &batch.of[..] {
        [found] if matches!(found.what, What::LeftOut(_)) => {
            calls.record_presence(batch.group, out)
        }
        [found] if found.form == Form::Fragment => {
            record_fragment(calls, shader, batch.group, found, out)
        }
        all => {
            let at: Vec<Vec<Word>> = (all.iter())
                .map(|found| coordinates(calls, shader, found, out))
                .collect();
            calls.record_quads(batch.group, &at, out)
        }
    }
}

/// Coordinates as 32-bit floats, divided if the instruction divides them.
fn coordinates(
    calls: &mut CallEmitter,
    shader: &Shader,
    found: &Found,
    out: &mut Vec<Instruction>,
) -> Vec<Word> {
    let mut at = calls.floats(shader, found.coordinate, out);
    if let Some(divisor) = found.divisor
        && let Some(&q) = at.get(divisor as usize)
    {
        at.truncate(divisor as usize);
        for part in &mut at {
            *part = calls.divided(*part, q, out);
        }
    }
    at
}

fn record_fragment(
    calls: &mut CallEmitter,
    shader: &Shader,
    group: u16,
    found: &Found,
    out: &mut Vec<Instruction>,
) -> Result<(), InjectError> {
    let at = coordinates(calls, shader, found, out);
    let lod = found.lod.map(|lod| calls.float(shader, lod, out));
    let gradients = match (&found.what, found.gradients) {
        (_, Some(named)) => Some(named.map(|id| calls.floats(shader, id, out))),
        (What::Texture(of), None) if matches!(of.lod, Lod::Derivatives | Lod::Bias(_)) => {
            Some(calls.derivatives(&at, out))
        }
        _ => None,
    };
    let element = found.element.map(|id| calls.unsigned(shader, id, out));
    calls.record_fragment(group, element, &at, lod, gradients, out)
}

/// Appends an instruction with a result, and returns the id of the result.
pub(super) fn put(
    builder: &mut rspirv::dr::Builder,
    out: &mut Vec<Instruction>,
    opcode: Op,
    result_type: Word,
    operands: Vec<Operand>,
) -> Word {
    let id = builder.id();
    out.push(Instruction::new(
        opcode,
        Some(result_type),
        Some(id),
        operands,
    ));
    id
}
