//! Tile orders, one a file: pure functions from the tile grids to a sequence of work.
//!
//! A frame's monoscopic passes (shadow maps) come first, each alone in the order's single-view
//! curve; then the two main passes, as the order combines them. Every order visits every tile of
//! every pass exactly once.

mod hilbert;
mod morton;
mod random;
mod scanline;
mod z2_lrta;
mod z2_sta;
mod z2_sta_merge;
mod zig_zag;

pub use hilbert::Hilbert;
pub use morton::Morton;
pub use random::Random;
pub use scanline::Scanline;
pub use z2_lrta::Z2Lrta;
pub use z2_sta::Z2Sta;
pub use z2_sta_merge::Z2StaMerge;
pub use zig_zag::ZigZag;

use crate::config::OrderKind;
use formats::textrace::{Pass, PassKind};
use formats::view::Eye;

/// A tile of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileRef {
    /// Index of the pass in the trace.
    pub pass: u32,
    /// Tile number, row by row.
    pub tile: u32,
}

/// How the triangle lists of two tiles become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interleave {
    /// One of the left, one of the right, in turn; then the rest of the longer list.
    Alternate,
    /// By primitive number, left first, so that the same triangle is adjacent.
    Merge,
}

/// What a core is given at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkItem {
    /// One tile.
    Tile(TileRef),
    /// Two tiles rendered together on one core.
    Pair(TileRef, TileRef, Interleave),
}

impl WorkItem {
    /// The tiles of the item, the first one first.
    pub fn tiles(&self) -> impl Iterator<Item = TileRef> {
        let (first, second) = match *self {
            Self::Tile(tile) => (tile, None),
            Self::Pair(left, right, _) => (left, Some(right)),
        };
        std::iter::once(first).chain(second)
    }
}

/// A view to traverse: a pass and its tile grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View {
    /// Index of the pass in the trace.
    pub pass: u32,
    /// Tile columns and rows.
    pub tiles: [u32; 2],
}

impl View {
    /// The tile at a column and row, if the grid has it.
    #[must_use]
    pub fn tile(&self, [x, y]: [u32; 2]) -> Option<TileRef> {
        (x < self.tiles[0] && y < self.tiles[1]).then(|| TileRef {
            pass: self.pass,
            tile: y * self.tiles[0] + x,
        })
    }
}

/// A tile order.
pub trait TileOrder {
    /// Columns and rows of one view's tiles in the order of traversal: each exactly once.
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]>;

    /// Work of a stereo pair. A single-view order renders the whole left view, then the whole
    /// right view.
    fn stereo(&self, left: View, right: View) -> Vec<WorkItem> {
        let mut items = self.mono(left);
        items.extend(self.mono(right));
        items
    }

    /// Work of one view alone.
    fn mono(&self, view: View) -> Vec<WorkItem> {
        self.curve(view.tiles)
            .into_iter()
            .filter_map(|at| view.tile(at).map(WorkItem::Tile))
            .collect()
    }
}

/// The order of that name.
#[must_use]
pub fn by_kind(kind: OrderKind, seed: u64) -> Box<dyn TileOrder> {
    match kind {
        OrderKind::Scanline => Box::new(Scanline),
        OrderKind::ZigZag => Box::new(ZigZag),
        OrderKind::Morton => Box::new(Morton),
        OrderKind::Hilbert => Box::new(Hilbert),
        OrderKind::Z2Lrta => Box::new(Z2Lrta),
        OrderKind::Z2Sta => Box::new(Z2Sta),
        OrderKind::Z2StaMerge => Box::new(Z2StaMerge),
        OrderKind::Random => Box::new(Random { seed }),
    }
}

/// Work that may run at the same time; the next phase waits for it (a picture needs its shadow
/// map, a frame the one before).
pub type Phase = Vec<WorkItem>;

/// All work of a trace: frame after frame, monoscopic passes before the stereo pair.
#[must_use]
pub fn plan(order: &dyn TileOrder, passes: &[Pass]) -> Vec<Phase> {
    let mut frames: Vec<u32> = passes.iter().map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    let mut phases = Vec::new();
    for frame in frames {
        let views = |eye: Option<Eye>| {
            let of_frame = passes
                .iter()
                .enumerate()
                .filter(move |(_, p)| p.frame == frame);
            of_frame.filter(move |(_, p)| eye == p.eye.filter(|_| p.kind == PassKind::Main))
        };
        let view = |(index, pass): (usize, &Pass)| View {
            pass: index as u32,
            tiles: pass.tiles,
        };
        phases.extend(views(None).map(|mono| order.mono(view(mono))));
        let mut lefts = views(Some(Eye::Left)).map(view);
        let mut rights = views(Some(Eye::Right)).map(view);
        loop {
            match (lefts.next(), rights.next()) {
                (Some(left), Some(right)) => phases.push(order.stereo(left, right)),
                (Some(alone), None) | (None, Some(alone)) => phases.push(order.mono(alone)),
                (None, None) => break,
            }
        }
    }
    phases
}

/// Work of two views whose tiles at the same place are taken together, along `curve` over the
/// larger of the two grids; `join` says what becomes of a pair.
fn paired(
    left: View,
    right: View,
    curve: &[[u32; 2]],
    mut join: impl FnMut(TileRef, TileRef, &mut Vec<WorkItem>),
) -> Vec<WorkItem> {
    let mut items = Vec::with_capacity(2 * curve.len());
    for &at in curve {
        match (left.tile(at), right.tile(at)) {
            (Some(l), Some(r)) => join(l, r, &mut items),
            (Some(alone), None) | (None, Some(alone)) => items.push(WorkItem::Tile(alone)),
            (None, None) => {}
        }
    }
    items
}

/// The smallest grid that covers both views.
fn covering(left: View, right: View) -> [u32; 2] {
    [0, 1].map(|axis| left.tiles[axis].max(right.tiles[axis]))
}

#[cfg(test)]
mod tests;
