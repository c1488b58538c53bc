//! Who takes the next work item, where the cores come for it one by one.

use crate::config::Assign;
use crate::memory::{DelayedFill, SecondLevel};
use crate::order::WorkItem;
use crate::stream::{Cores, StreamError};

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

    /// The item that comes next, for whichever core takes it (first idle) or for this one (static).
    pub(super) fn upcoming(&self, core: usize) -> Option<&'a WorkItem> {
        let next = match self.assign {
            Assign::FirstIdle => self.next[0],
            Assign::Static => self.next[core],
        };
        self.items.get(next)
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

/// As a core starts an item `now`: prefetches lines of the one that comes next, if the L2's prefetcher wants them.
#[inline(always)]
pub(super) fn prefetch_upcoming<D: DelayedFill>(
    l2: &mut SecondLevel<D>,
    work: &mut Cores<'_>,
    items: &Items<'_>,
    core: usize,
    now: u64,
) -> Result<(), StreamError> {
    let most = l2.lines_of_next_item();
    if most > 0
        && let Some(item) = items.upcoming(core)
    {
        l2.prefetch_item(core, &work.lines_of(item, most)?, now);
    }
    Ok(())
}
