//! Divides a view into regions whose records fit the capturer's memory.
//!
//! An overflowing region is captured again in parts, each with its own scissor rectangle. This is possible
//! because pixels of different tiles do not depend on each other. A region is first divided into bands of
//! tile rows, then into parts of a row. Memory is limited to the records of one region for frames of any
//! size. The tiles of each region are complete, so they can be written at once.

use super::capturer::{Captured, Capturer, Region};
use super::error::RecordError;
use super::raw::{RawRecord, RawRecords};
use formats::view::TILE_SIZE_PX;

/// Edge in tiles of the squares that llvmpipe draws one after the other, so that their records are
/// consecutive. Building tiles in this order keeps a square's records in the CPU's cache.
const BLOCK_TILES: u32 = 64 / TILE_SIZE_PX;

/// A rectangle of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileRect {
    /// First column and row.
    pub origin: [u32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl TileRect {
    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Column and row of the `index`th tile, row by row.
    pub fn tile(&self, index: usize) -> [u32; 2] {
        let index = index as u32;
        [
            self.origin[0] + index % self.size[0],
            self.origin[1] + index / self.size[0],
        ]
    }

    /// Indices of all tiles, square by square of [`BLOCK_TILES`].
    pub fn by_blocks(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.count()).collect();
        order.sort_by_key(|&index| {
            let [column, row] = self.tile(index).map(|at| at / BLOCK_TILES);
            [row, column]
        });
        order
    }

    /// Index of the tile with a record's quad; `None` if it is outside.
    pub fn index(&self, record: &RawRecord) -> Option<usize> {
        let column = (record.qx() / 8)
            .checked_sub(self.origin[0])
            .filter(|c| *c < self.size[0])?;
        let row = (record.qy() / 8)
            .checked_sub(self.origin[1])
            .filter(|r| *r < self.size[1])?;
        Some((row * self.size[0] + column) as usize)
    }
}

/// Captures a whole view of `size_px`. `sink` is called with the tiles of each region and its records; tiles
/// ascend over all calls. `parts` is the initial number of bands. Returns the number of regions that were
/// needed, which is a good start for the next view.
///
/// # Errors
/// [`RecordError::Budget`] if a single tile overflows, errors of the capturer, and errors of `sink`.
pub(crate) fn capture_view<C: Capturer>(
    capturer: &mut C,
    size_px: [u32; 2],
    parts: u32,
    sink: &mut dyn FnMut(&TileRect, RawRecords<'_>) -> Result<(), RecordError>,
) -> Result<u32, C::Error> {
    let whole = TileRect {
        origin: [0, 0],
        size: size_px.map(|s| s.div_ceil(TILE_SIZE_PX)),
    };
    let capacity = capturer.record_capacity();
    // A stack with the next region on top.
    let mut open = split(&whole, parts);
    let mut captured = 0;
    while let Some(rect) = open.pop() {
        let region = region(&rect, size_px);
        match capturer.capture(region, &mut |records| sink(&rect, records))? {
            Captured::Complete => captured += 1,
            Captured::Overflow { needed } if rect.count() == 1 => {
                return Err(C::Error::from(RecordError::Budget {
                    tx: rect.origin[0],
                    ty: rect.origin[1],
                    needed,
                    capacity,
                }));
            }
            Captured::Overflow { needed } => {
                // Records are unevenly distributed, so use a quarter more parts than for an even
                // distribution.
                let parts = (needed.saturating_mul(5) / 4)
                    .div_ceil(capacity.max(1))
                    .max(2);
                open.extend(split(&rect, parts.min(u64::from(u32::MAX)) as u32));
            }
        }
    }
    Ok(captured)
}

/// Divides a rectangle into up to `parts` bands of whole rows, or a single row into runs of tiles. The first
/// part is last in the result.
fn split(rect: &TileRect, parts: u32) -> Vec<TileRect> {
    let axis = usize::from(rect.size[1] > 1);
    let length = rect.size[axis];
    let parts = parts.clamp(1, length.max(1));
    let edge = |k: u32| (u64::from(length) * u64::from(k) / u64::from(parts)) as u32;
    (0..parts)
        .rev()
        .map(|k| {
            let mut part = *rect;
            part.origin[axis] += edge(k);
            part.size[axis] = edge(k + 1) - edge(k);
            part
        })
        .collect()
}

/// Pixels of a rectangle of tiles, clipped at the edge of the view.
fn region(rect: &TileRect, size_px: [u32; 2]) -> Region {
    let origin_px = rect.origin.map(|t| t * TILE_SIZE_PX);
    let size = [0, 1]
        .map(|axis: usize| (rect.size[axis] * TILE_SIZE_PX).min(size_px[axis] - origin_px[axis]));
    Region {
        origin_px,
        size_px: size,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_the_rectangle_in_order_without_overlap() {
        for (size, parts) in [([60, 68], 5), ([60, 68], 1000), ([60, 1], 7), ([1, 1], 3)] {
            let rect = TileRect {
                origin: [3, 4],
                size,
            };
            let mut tiles = Vec::new();
            for part in split(&rect, parts).into_iter().rev() {
                tiles.extend((0..part.count()).map(|i| part.tile(i)));
            }
            let all: Vec<[u32; 2]> = (0..rect.count()).map(|i| rect.tile(i)).collect();
            assert_eq!(tiles, all);
        }
    }

    #[test]
    fn tiles_by_blocks_are_complete_and_squares_consecutive() {
        let rect = TileRect {
            origin: [3, 4],
            size: [6, 5],
        };
        let order = rect.by_blocks();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..rect.count()).collect::<Vec<_>>());
        let blocks: Vec<[u32; 2]> = order.iter().map(|&i| rect.tile(i).map(|t| t / 4)).collect();
        assert_eq!(blocks.chunk_by(|a, b| a == b).count(), 3 * 2);
    }

    #[test]
    fn the_last_tiles_are_clipped_at_the_edge_of_the_view() {
        let rect = TileRect {
            origin: [1, 2],
            size: [2, 1],
        };
        let expected = Region {
            origin_px: [16, 32],
            size_px: [24, 8],
        };
        assert_eq!(region(&rect, [40, 40]), expected);
    }
}
