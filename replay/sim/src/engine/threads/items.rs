//! Assignment of work items to cores that take them one by one.

use crate::access::FrameClients;
use crate::config::Assign;
use crate::memory::Access;
use crate::order::WorkItem;
use crate::stream::StreamError;

/// The remaining items of a phase.
pub(super) struct Items<'a, 'f> {
    items: &'a [WorkItem],
    assign: Assign,
    /// First idle: index of the next item. Static: index of each core's next item.
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

    /// The next item for any core (first idle) or for this core (static).
    pub(super) fn upcoming(&self, core: usize) -> Option<&'a WorkItem> {
        let next = match self.assign {
            Assign::FirstIdle => self.next[0],
            Assign::Static => self.next[core],
        };
        self.items.get(next)
    }

    /// Takes the core's next item.
    pub(super) fn next(&mut self, core: usize) -> Option<&'a WorkItem> {
        let (next, step) = match self.assign {
            Assign::FirstIdle => (&mut self.next[0], 1),
            Assign::Static => (&mut self.next[core], self.cores),
        };
        let item = self.items.get(*next);
        *next += step;
        item
    }

    /// Performs the accesses of the other clients for an item, if they are simulated.
    pub(super) fn send_clients(
        &mut self,
        core: usize,
        item: &WorkItem,
        access: impl FnMut(&Access) -> u64,
    ) -> Result<(), StreamError> {
        if let Some(clients) = &mut self.clients {
            clients.start_item(core, item)?;
            clients.send(access);
        }
        Ok(())
    }
}
