//! Who takes the next work item, where the cores come for it one by one.

use crate::access::FrameClients;
use crate::config::Assign;
use crate::memory::{DelayedFill, SecondLevel};
use crate::order::WorkItem;
use crate::stream::{Cores, StreamError};

/// The items of a phase that are left.
pub(super) struct Items<'a, 'f> {
    items: &'a [WorkItem],
    assign: Assign,
    /// First idle: the next item of all. Static: the next item by core.
    next: Vec<usize>,
    cores: usize,
    /// The other clients of memory, which follow the items.
    clients: Option<&'a mut FrameClients<'f>>,
}

impl<'a, 'f> Items<'a, 'f> {
    pub(super) fn new(
        items: &'a [WorkItem],
        assign: Assign,
        cores: usize,
        clients: Option<&'a mut FrameClients<'f>>,
    ) -> Self {
        let next = match assign {
            Assign::FirstIdle => vec![0],
            Assign::Static => (0..cores).collect(),
        };
        Self {
            items,
            assign,
            next,
            cores,
            clients,
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

/// A core starts an item `now`: the other clients do their part of it, and lines of the item that comes next are prefetched, if
/// the L2's prefetcher wants them.
#[inline(always)]
pub(super) fn start_item<D: DelayedFill>(
    l2: &mut SecondLevel<D>,
    work: &mut Cores<'_>,
    items: &mut Items<'_, '_>,
    core: usize,
    item: &WorkItem,
    now: u64,
) -> Result<(), StreamError> {
    work.load(core, item)?;
    if let Some(clients) = &mut items.clients {
        clients.start_item(core, item)?;
        clients.send(|access| l2.client_access(core, access, now));
    }
    let most = l2.lines_of_next_item();
    if most > 0
        && let Some(item) = items.upcoming(core)
    {
        l2.prefetch_item(core, &work.lines_of(item, most)?, now);
    }
    Ok(())
}
