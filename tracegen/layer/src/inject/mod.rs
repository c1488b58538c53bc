//! Rewrites SPIR-V modules so that their fragment and vertex shaders record.
//!
//! Before instructions that read texels, the rewritten shader calls a function that appends a record to a
//! buffer: the place of the quad, its draw and primitive, and the coordinates of one or several coordinate
//! groups. The buffer's address is a constant in the shader, so descriptor sets and their layouts do not
//! change. The number of the draw is a push constant.

mod append;
mod calls;
mod declare;
mod find;
mod flow;
mod functions;
mod lanes;
mod numbers;
mod parse;
mod reads;
mod rewrite;
mod shader;
mod sites;
mod writer;

pub use reads::{ReadCounts, texel_reads, workgroup_size};

use rspirv::spirv::{BuiltIn, ExecutionMode, ExecutionModel, Op, StorageClass};
use shader::Shader;
use spool::{DepthTests, Site};
use thiserror::Error;

/// Properties of the device and the pipeline that a recording shader depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Device address of the record buffer.
    pub address: u64,
    /// Offset of the draw's number in the push constants.
    pub push_constant_bytes: u32,
    /// Whether ballots can determine the active lanes of a quad.
    pub ballots: bool,
    /// Whether the render pass has several views.
    pub multiview: bool,
}

/// Reasons why a module is not rewritten.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum InjectError {
    /// SPIR-V that the library does not support.
    #[error("SPIR-V that cannot be parsed: {0}")]
    Parse(String),
    /// A module that is too large.
    #[error("a module of {0} words")]
    TooLarge(usize),
    /// A module without the requested fragment shader.
    #[error("no fragment entry point")]
    NoFragmentEntry,
    /// A violation of a rule of SPIR-V that the rewriting relies on.
    #[error("malformed SPIR-V: {0}")]
    Malformed(&'static str),
    /// More image instructions than the numbers in records can represent.
    #[error("{0} instructions that read texels: more than 65536")]
    TooManySites(usize),
    /// Push constants of the program at the place of the draw's number.
    #[error("push constants at byte {0} and above")]
    PushConstants(u32),
}

/// A recording fragment or vertex shader.
#[derive(Clone, Debug, PartialEq)]
pub struct Rewritten {
    /// The module.
    pub words: Vec<u32>,
    /// The sites where it records.
    pub sites: Vec<Site>,
    /// Order of depth test and shading.
    pub tests: DepthTests,
    /// Instructions of a vertex shader whose reads it does not record.
    pub unrecorded: ReadCounts,
}

/// Analyses a fragment shader without rewriting it.
///
/// # Errors
/// The module cannot be parsed.
pub fn depth_tests(words: &[u32], entry: Option<&str>) -> Result<DepthTests, InjectError> {
    Ok(tests_of(&Shader::parse(words, entry)?))
}

/// Rewrites the shader `entry` of a stage in a module, or its only one, so that it records: all texel reads of a
/// fragment shader, and those reads of a vertex shader that have an explicit level.
///
/// # Errors
/// The module cannot be rewritten.
pub fn instrument(
    words: &[u32],
    entry: Option<&str>,
    stage: ExecutionModel,
    target: &Target,
) -> Result<Rewritten, InjectError> {
    let shader = Shader::parse_stage(words, entry, stage)?;
    let target = Target {
        // Vertices have no quads, so each lane reserves space for itself.
        ballots: target.ballots && !shader.is_vertex(),
        ..*target
    };
    rewrite::rewrite(shader, &target)
}

fn tests_of(shader: &Shader) -> DepthTests {
    if shader.is_vertex() {
        return DepthTests::Late;
    }
    if shader.has_mode(ExecutionMode::EarlyFragmentTests) {
        return DepthTests::Early;
    }
    let writes_mask = shader.builtin(BuiltIn::SampleMask, StorageClass::Output);
    let writes_depth = shader.has_mode(ExecutionMode::DepthReplacing);
    let late =
        writes_depth || writes_mask.is_some() || shader.instructions().any(writes_memory(shader));
    let discards = shader.instructions().any(|instruction| {
        matches!(
            instruction.class.opcode,
            Op::Kill | Op::TerminateInvocation | Op::DemoteToHelperInvocation
        )
    });
    match (late, discards) {
        (true, _) => DepthTests::Late,
        (false, true) => DepthTests::EarlyLateWrite,
        (false, false) => DepthTests::Either,
    }
}

/// Whether an instruction writes memory that other fragments may read.
fn writes_memory(shader: &Shader) -> impl Fn(&rspirv::dr::Instruction) -> bool {
    use rspirv::dr::Operand;
    let has_buffer_blocks = shader.module.annotations.iter().any(|a| {
        let decoration = rspirv::spirv::Decoration::BufferBlock;
        a.operands.get(1) == Some(&Operand::Decoration(decoration))
    });
    move |instruction| match instruction.class.opcode {
        Op::ImageWrite => true,
        Op::Store | Op::CopyMemory | Op::CopyMemorySized => {
            let pointer = shader::ids(instruction).first().copied();
            let class = pointer
                .and_then(|pointer| shader.type_of(pointer))
                .and_then(|of| of.operands.first());
            match class {
                Some(Operand::StorageClass(class)) => match class {
                    StorageClass::StorageBuffer | StorageClass::PhysicalStorageBuffer => true,
                    StorageClass::Uniform => has_buffer_blocks,
                    _ => false,
                },
                _ => false,
            }
        }
        opcode => is_atomic(opcode),
    }
}

fn is_atomic(opcode: Op) -> bool {
    let number = opcode as u32;
    let base = Op::AtomicLoad as u32..=Op::AtomicXor as u32;
    base.contains(&number)
        || matches!(
            opcode,
            Op::AtomicFlagTestAndSet
                | Op::AtomicFlagClear
                | Op::AtomicFAddEXT
                | Op::AtomicFMinEXT
                | Op::AtomicFMaxEXT
        )
}

#[cfg(test)]
mod tests;
