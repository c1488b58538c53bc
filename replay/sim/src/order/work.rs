//! Units of work: tiles, pairs of tiles, and the views that they belong to.

use formats::textrace::{Pass, PassKind};
use formats::view::TILE_SIZE_PX;

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
    /// The upper halves of both tiles in turn, then the lower halves. The fragments in progress fit into one
    /// tile buffer.
    Halves,
}

/// The unit of work of a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkItem {
    /// One tile.
    Tile(TileRef),
    /// Two tiles rendered together on one core.
    Pair(TileRef, TileRef, Interleave),
}

impl WorkItem {
    /// The tiles of the item, in rendering order.
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
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Kind of the pass.
    pub kind: PassKind,
    /// Index among the frame's passes.
    pub number: u32,
}

impl View {
    /// The view of a pass, given its index in its frame.
    pub const fn of(index: u32, number: u32, pass: &Pass) -> Self {
        Self {
            pass: index,
            tiles: pass.tiles,
            size_px: pass.size_px,
            kind: pass.kind,
            number,
        }
    }

    /// An eye's picture that consists of whole tiles.
    pub const fn grid(pass: u32, tiles: [u32; 2]) -> Self {
        Self {
            pass,
            tiles,
            size_px: [tiles[0] * TILE_SIZE_PX, tiles[1] * TILE_SIZE_PX],
            kind: PassKind::Main,
            number: pass,
        }
    }

    /// The tile at a column and row, if the grid has it.
    pub fn tile(&self, [x, y]: [u32; 2]) -> Option<TileRef> {
        (x < self.tiles[0] && y < self.tiles[1]).then(|| TileRef {
            pass: self.pass,
            tile: y * self.tiles[0] + x,
        })
    }
}
