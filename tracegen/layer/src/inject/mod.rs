//! SPIR-V words in, recording SPIR-V words out.
//!
//! Before instructions that read texels a fragment shader calls a function that appends a record to a buffer: where the
//! quad is, what it belongs to, its coordinates at one or several of them. The buffer's address is a constant of the shader, so that neither
//! descriptor sets nor their layouts change. The number of the draw is a push constant.

mod buffer;
mod declare;
mod find;
mod flow;
mod functions;
mod numbers;
mod recorder;
mod rewrite;
mod shader;
mod site;
mod sites;
mod writer;

pub use buffer::{COUNTER_BYTES, RawFragment, RawQuad, RawSample, UNIT_BYTES, Unit, unpack};
pub use site::{Access, Binding, Form, Lod, Shape, Site, TextureSite, What};

use rspirv::spirv::{BuiltIn, ExecutionMode, Op, StorageClass};
use shader::Shader;
use thiserror::Error;

/// Properties of the device and of the pipeline that a recording shader depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Device address of the record buffer.
    pub address: u64,
    /// Offset of the draw's number among the push constants.
    pub push_constant_bytes: u32,
    /// Whether lanes of a quad can exchange their coverage.
    pub ballots: bool,
    /// The pass renders several views at once.
    pub multiview: bool,
}

/// Why a module is not rewritten.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum InjectError {
    /// Not SPIR-V that the library supports.
    #[error("SPIR-V that cannot be parsed: {0}")]
    Parse(String),
    /// Too many words.
    #[error("a module of {0} words")]
    TooLarge(usize),
    /// No such fragment shader.
    #[error("no fragment entry point")]
    NoFragmentEntry,
    /// It breaks a rule of SPIR-V that the rewriting relies on.
    #[error("malformed SPIR-V: {0}")]
    Malformed(&'static str),
    /// It has more instructions than records can name.
    #[error("{0} instructions that read texels: more than 65536")]
    TooManySites(usize),
    /// It uses what it would have to be told of by the same means.
    #[error("push constants at byte {0} and above")]
    PushConstants(u32),
}

/// When fragments of a shader are tested for depth, as far as its own text decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthTests {
    /// Before or after it, without a difference: it neither discards nor writes anything but colours.
    #[default]
    Either,
    /// Before it: it says so.
    Early,
    /// Before it, but the depth is written after it: it discards.
    EarlyLateWrite,
    /// After it: it writes depth, sample mask or memory.
    Late,
}

/// A fragment shader that records.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The module.
    pub words: Vec<u32>,
    /// What it records.
    pub sites: Vec<Site>,
    /// When its fragments are tested for depth.
    pub tests: DepthTests,
}

/// Analyses a fragment shader without rewriting it.
///
/// # Errors
/// A module that cannot be read.
pub fn depth_tests(words: &[u32], entry: Option<&str>) -> Result<DepthTests, InjectError> {
    Ok(tests_of(&Shader::parse(words, entry)?))
}

/// Rewrites the fragment shader `entry` of a module, or its only one, so that it records.
///
/// # Errors
/// A module that cannot be rewritten.
pub fn instrument(
    words: &[u32],
    entry: Option<&str>,
    target: &Target,
) -> Result<Recording, InjectError> {
    let shader = Shader::parse(words, entry)?;
    let tests = tests_of(&shader);
    let (words, sites) = rewrite::rewrite(shader, tests, target)?;
    Ok(Recording {
        words,
        sites,
        tests,
    })
}

fn tests_of(shader: &Shader) -> DepthTests {
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

/// An instruction changes what others may read.
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
