//! Traversal-stack prefetch (Tozlu, Naithani, Zhou, "TTP: A Hardware-Efficient Design for Precise Prefetching in Ray
//! Tracing", arXiv 2605.16253, 2026): when a ray pops entries in a row, it is on its way up, and the next entries of its
//! stack are fetched.

use super::{PrefetchRow, RayPrefetcher, Step};
use formats::raytrace::ChildKind;

pub(super) const ROW: PrefetchRow = PrefetchRow {
    name: "ttp",
    help: "The next `stack_entries` of a ray's traversal stack at each pop after another (arXiv 2605.16253)",
    build: Some(|config, _, _| {
        let entries = config.stack_entries as usize;
        Box::new(Ttp { entries })
    }),
};

struct Ttp {
    entries: usize,
}

impl RayPrefetcher for Ttp {
    fn observe(&self, step: &Step<'_>, ahead: &mut Vec<ChildKind>) {
        if step.pops >= 2 {
            ahead.extend(step.stack.iter().rev().take(self.entries));
        }
    }
}
