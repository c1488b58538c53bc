//! Orders given as lists of items. A search finds them from the accesses of the frame, so hardware cannot
//! implement them.

use super::cost::{Cost, Information};
use super::parts::Parts;
use super::{Order, OrderRow, View, WorkItem};
use crate::palette::GREY;

/// The items of pairs of views, by the left view's pass.
#[derive(Clone, Debug, Default)]
pub struct Listed {
    /// The pass of the left view, and the items in order.
    pub pairs: Vec<(u32, Vec<WorkItem>)>,
}

impl Listed {
    /// The whole list, and knowledge of the frame's accesses.
    pub(super) fn cost(&self) -> Cost {
        let longest = self.pairs.iter().map(|(_, items)| items.len()).max();
        let items = longest.unwrap_or(0) as u64;
        let two = self.pairs.iter().flat_map(|(_, items)| items);
        let buffers = two.map(|item| item.tiles().count()).max().unwrap_or(1);
        Cost::state(4)
            .with_table(4 * items)
            .deciding_in(1)
            .with_tile_buffers(buffers as u32)
            .with_information(Information::Future)
    }
}

impl Order {
    /// An order for one trace: pairs of views as listed, other views by these parts. It is kept until the
    /// program ends.
    #[must_use]
    pub fn listed(name: &str, parts: Parts, listed: Listed) -> Self {
        let name: &'static str = name.to_owned().leak();
        Self::new(Box::leak(Box::new(OrderRow {
            name,
            title: name,
            color: GREY,
            help: "",
            parts,
            listed: Some(Box::leak(Box::new(listed))),
        })))
    }

    /// The listed items of a pair of views.
    pub(super) fn listed_items(self, left: View) -> Option<&'static [WorkItem]> {
        let pairs = &self.row().listed?.pairs;
        let found = pairs.iter().find(|(pass, _)| *pass == left.pass);
        found.map(|(_, items)| items.as_slice())
    }
}
