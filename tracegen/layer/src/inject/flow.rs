//! Finds the blocks of an entry point that every fragment executes once.

use super::shader::ids;
use rspirv::dr::{Block, Function};
use rspirv::spirv::{Op, Word};
use std::collections::{HashMap, HashSet};

/// Indices of the blocks that every fragment executes exactly once, unless it is discarded or returns
/// earlier: the first block, its unconditional successors, and the merge blocks of branches and loops that do
/// not return.
pub(super) fn unconditional(function: &Function) -> HashSet<usize> {
    let labels: HashMap<Word, usize> = (function.blocks.iter().enumerate())
        .filter_map(|(place, block)| Some((block.label.as_ref()?.result_id?, place)))
        .collect();
    let flow = Flow {
        blocks: &function.blocks,
        labels,
    };
    let mut found = HashSet::new();
    let mut at = (!function.blocks.is_empty()).then_some(0);
    while let Some(block) = at.filter(|block| found.insert(*block)) {
        at = flow.next(block);
    }
    found
}

struct Flow<'a> {
    blocks: &'a [Block],
    labels: HashMap<Word, usize>,
}

impl Flow<'_> {
    /// The next block that all fragments of a block execute once.
    fn next(&self, block: usize) -> Option<usize> {
        let instructions = &self.blocks[block].instructions;
        let merge = instructions
            .iter()
            .find(|i| matches!(i.class.opcode, Op::SelectionMerge | Op::LoopMerge));
        if let Some(merge) = merge {
            let end = *self.labels.get(ids(merge).first()?)?;
            return (!self.returns(block, end)).then_some(end);
        }
        let last = instructions.last()?;
        let target = *self.labels.get(ids(last).first()?)?;
        // The header of a loop is executed several times.
        let is_loop = self.blocks[target].instructions.iter();
        let is_loop = is_loop.clone().any(|i| i.class.opcode == Op::LoopMerge);
        (last.class.opcode == Op::Branch && !is_loop).then_some(target)
    }

    /// Whether a block between a header and its merge block returns.
    fn returns(&self, header: usize, end: usize) -> bool {
        let mut seen = HashSet::from([end]);
        let mut open = vec![header];
        while let Some(block) = open.pop() {
            if !seen.insert(block) {
                continue;
            }
            let Some(last) = self.blocks[block].instructions.last() else {
                return true;
            };
            match last.class.opcode {
                Op::Branch | Op::BranchConditional | Op::Switch => {
                    open.extend(ids(last).iter().filter_map(|id| self.labels.get(id)));
                }
                // Discarded fragments are detected in another way.
                Op::Kill | Op::TerminateInvocation | Op::Unreachable => {}
                _ => return true,
            }
        }
        false
    }
}
