//! Orders given as lists of items. A search finds them from the accesses of the frame, so hardware cannot
//! implement them.

use super::cost::{Cost, Information};
use super::parts::Parts;
use super::{Order, OrderRow, TileRef, View, Views, WorkItem, frames, views};
use crate::palette::GREY;
use formats::textrace::Pass;
use std::fmt;
use std::sync::{Mutex, PoisonError};

/// The orders that configurations accept by name.
static NAMED: Mutex<Vec<Order>> = Mutex::new(Vec::new());

/// The order that was named so.
pub(super) fn by_name(name: &str) -> Option<Order> {
    let named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
    named.iter().find(|order| order.name() == name).copied()
}

/// Items that do not visit every tile of both views exactly once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotAnOrder {
    /// Index of the item; the number of items if something is missing.
    pub item: usize,
    /// What was expected there.
    pub expected: &'static str,
    /// What was found.
    pub found: FoundTiles,
}

/// Tiles that a list must not hold, or lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundTiles {
    /// A tile that is unknown or was listed before.
    Wrong(TileRef),
    /// This many tiles are not listed.
    Missing(usize),
}

impl fmt::Display for FoundTiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wrong(at) => write!(f, "{}:{}", at.pass, at.tile),
            Self::Missing(tiles) => write!(f, "{tiles} tiles not listed"),
        }
    }
}

/// Checks that items visit every tile of two views exactly once.
///
/// # Errors
/// The first item that does not.
pub fn check_items(items: &[WorkItem], eyes: [View; 2]) -> Result<(), NotAnOrder> {
    let mut seen = eyes.map(|view| vec![false; (view.tiles[0] * view.tiles[1]) as usize]);
    for (item, of) in items.iter().enumerate() {
        for at in of.tiles() {
            let eye = eyes.iter().position(|view| view.pass == at.pass);
            let is_seen = eye.and_then(|eye| seen[eye].get_mut(at.tile as usize));
            match is_seen {
                Some(is_seen) if !*is_seen => *is_seen = true,
                _ => {
                    return Err(NotAnOrder {
                        item,
                        expected: "a tile of these passes that was not listed yet",
                        found: FoundTiles::Wrong(at),
                    });
                }
            }
        }
    }
    let missing = seen.iter().flatten().filter(|seen| !**seen).count();
    if missing == 0 {
        return Ok(());
    }
    Err(NotAnOrder {
        item: items.len(),
        expected: "every tile of both passes",
        found: FoundTiles::Missing(missing),
    })
}

/// The items of pairs of views, by the left view's pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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

    /// A listed order that configurations accept by its name. An order with the same name and items is reused;
    /// with other items, it is replaced. A name with `@` never equals the name of another kind of order.
    pub fn own(name: &str, parts: Parts, listed: Listed) -> Self {
        let mut named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = named.iter().position(|order| order.name() == name) {
            if named[at].row().listed == Some(&listed) {
                return named[at];
            }
            named.swap_remove(at);
        }
        let order = Self::listed(name, parts, listed);
        named.push(order);
        order
    }

    /// Checks that a listed order visits every tile of every pair of views of these passes. Other orders do.
    ///
    /// # Errors
    /// The first pair, by the index of its left pass, whose items do not.
    pub fn check_for(self, passes: &[Pass]) -> Result<(), (u32, NotAnOrder)> {
        if self.row().listed.is_none() {
            return Ok(());
        }
        for phase in frames(passes)
            .into_iter()
            .flat_map(|frame| views(passes, frame))
        {
            if let Views::Pair(left, right) = phase {
                let items = self.listed_items(left).unwrap_or_default();
                check_items(items, [left, right]).map_err(|fault| (left.pass, fault))?;
            }
        }
        Ok(())
    }

    /// The listed items of a pair of views.
    pub(super) fn listed_items(self, left: View) -> Option<&'static [WorkItem]> {
        let pairs = &self.row().listed?.pairs;
        let found = pairs.iter().find(|(pass, _)| *pass == left.pass);
        found.map(|(_, items)| items.as_slice())
    }
}
