//! Who takes the next work item, where the cores come for it one by one.

use crate::config::Assign;
use crate::order::WorkItem;

/// The items of a phase that are left.
pub(super) struct Items<'a> {
    items: &'a [WorkItem],
    assign: Assign,
    /// First idle: the next item of all. Static: the next item by core.
    next: Vec<usize>,
    cores: usize,
}

impl<'a> Items<'a> {
    pub(super) fn new(items: &'a [WorkItem], assign: Assign, cores: usize) -> Self {
        let next = match assign {
            Assign::FirstIdle => vec![0],
            Assign::Static => (0..cores).collect(),
        };
        Self {
            items,
            assign,
            next,
            cores,
        }
    }

    /// The core's next item.
    pub(super) fn next(&mut self, core: usize) -> Option<&'a WorkItem> {
        let (next, step) = match self.assign {
            Assign::FirstIdle => (&mut self.next[0], 1),
            Assign::Static => (&mut self.next[core], self.cores),
        };
        let item = self.items.get(*next);
        *next += step;
        item
    }
}
