//! Counts image instructions of shaders whose reads are not recorded.

use super::InjectError;
use super::find::{find, reads_texels};
use super::shader::{Shader, ids};
use rspirv::dr::Operand;
use rspirv::spirv::{BuiltIn, Decoration, ExecutionMode, ExecutionModel, Op, Word};
use spool::{Shape, What};
use std::collections::BTreeMap;

/// Words before the first instruction of a module.
const HEADER_WORDS: usize = 5;

/// Numbers of instructions that read texels, by kind of texture.
pub type ReadCounts = BTreeMap<String, u32>;

/// Number of instructions that read texels, by kind of texture, in the shader `entry` of a stage.
///
/// # Errors
/// The module cannot be parsed.
pub fn texel_reads(
    words: &[u32],
    entry: Option<&str>,
    stage: ExecutionModel,
) -> Result<ReadCounts, InjectError> {
    let mut counts = ReadCounts::new();
    // Most shaders before the fragment shader read no texels and need no parsing.
    if !opcodes(words).any(reads_texels) {
        return Ok(counts);
    }
    let shader = Shader::parse_stage(words, entry, stage)?;
    for found in shader.instructions().filter_map(|i| find(&shader, i)) {
        if let Some(what) = kind_of_texture(found.what) {
            *counts.entry(what).or_default() += 1;
        }
    }
    Ok(counts)
}

/// Name of the kind of texture that an instruction reads.
pub(super) fn kind_of_texture(what: What) -> Option<String> {
    match what {
        What::Texture(of) => Some(match of.shape {
            Shape::Flat => "two-dimensional textures".to_owned(),
            Shape::Array => "texture arrays".to_owned(),
            Shape::Cube => "cube maps".to_owned(),
        }),
        What::LeftOut(what) => Some(what),
        What::Coverage | What::Survival => None,
    }
}

/// Opcodes of a module's instructions.
fn opcodes(words: &[u32]) -> impl Iterator<Item = Op> {
    let mut rest = words.get(HEADER_WORDS..).unwrap_or_default();
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let length = ((first >> 16) as usize).max(1);
        rest = rest.get(length..).unwrap_or_default();
        Some(Op::from_u32(first & 0xffff).unwrap_or(Op::Nop))
    })
}

/// Size of the workgroups of the compute shader `entry`. `specialized` gives the value of a specialisation
/// constant by its number.
///
/// # Errors
/// The module cannot be parsed.
pub fn workgroup_size(
    words: &[u32],
    entry: Option<&str>,
    specialized: impl Fn(u32) -> Option<u32>,
) -> Result<[u32; 3], InjectError> {
    let shader = Shader::parse_stage(words, entry, ExecutionModel::GLCompute)?;
    let decoration = |target: Word, wanted: Decoration| {
        shader.module.annotations.iter().find_map(|annotation| {
            let of = &annotation.operands;
            let is_wanted = annotation.class.opcode == Op::Decorate
                && of.first() == Some(&Operand::IdRef(target))
                && of.get(1) == Some(&Operand::Decoration(wanted));
            of.get(2).filter(|_| is_wanted)
        })
    };
    let value = |id: Word| {
        let number = match decoration(id, Decoration::SpecId) {
            Some(Operand::LiteralBit32(number)) => Some(*number),
            _ => None,
        };
        let default = match shader.definition(id)?.operands.first()? {
            Operand::LiteralBit32(value) => Some(*value),
            _ => None,
        };
        number.and_then(&specialized).or(default)
    };
    let sizes = |of: Vec<Word>| -> Option<[u32; 3]> {
        let sizes: Option<Vec<u32>> = of.into_iter().map(value).collect();
        sizes?.try_into().ok()
    };
    // The built-in takes precedence over the execution modes.
    let is_size = Some(&Operand::BuiltIn(BuiltIn::WorkgroupSize));
    let globals = shader.module.types_global_values.iter();
    let mut own = globals.filter(|global| {
        let id = global.result_id;
        id.is_some_and(|id| decoration(id, Decoration::BuiltIn) == is_size)
    });
    if let Some(found) = own.next().and_then(|composite| sizes(ids(composite))) {
        return Ok(found);
    }
    let mut modes = shader.module.execution_modes.iter();
    let found = modes.find_map(|mode| {
        let of = &mode.operands;
        match of.get(1)? {
            _ if of.first() != Some(&Operand::IdRef(shader.main)) => None,
            Operand::ExecutionMode(ExecutionMode::LocalSize) => {
                let literal = |operand: &Operand| match operand {
                    Operand::LiteralBit32(value) => Some(*value),
                    _ => None,
                };
                let sizes: Vec<u32> = of.get(2..)?.iter().filter_map(literal).collect();
                sizes.try_into().ok()
            }
            Operand::ExecutionMode(ExecutionMode::LocalSizeId) => sizes(
                of.get(2..)?
                    .iter()
                    .filter_map(Operand::id_ref_any)
                    .collect(),
            ),
            _ => None,
        }
    });
    found.ok_or(InjectError::Malformed("a compute shader without a size"))
}
