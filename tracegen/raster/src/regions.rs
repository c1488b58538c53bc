//! Renders a view in regions whose records fit the record buffer.
//!
//! Pixels of different tiles do not depend on each other, so an overflowing region is rendered
//! again in parts, each with a scissor rectangle of its own: first bands of tile rows, then parts
//! of a row. Memory stays bounded by one region's records however large the frame, and each
//! region's tiles are complete, so they can be written at once.

use super::backend::{CaptureBackend, Region, Rendered, View};
use super::draws::DrawList;
use super::error::RasterError;
use formats::view::TILE_SIZE_PX;
use record::{RawRecords, TileRect};

/// Renders a whole view with capture; `sink` gets each region's tiles with its records, tiles in
/// ascending order over the calls. `parts` is the number of bands to start with; the number that
/// was needed is returned, as a first guess for the next view.
///
/// # Errors
/// [`RasterError::Budget`] where a single tile overflows, driver errors, and what `sink` returns.
pub fn capture_view(
    backend: &mut dyn CaptureBackend,
    draws: &DrawList,
    view: &View<'_>,
    size_px: [u32; 2],
    parts: u32,
    sink: &mut dyn FnMut(&TileRect, RawRecords<'_>) -> Result<(), RasterError>,
) -> Result<u32, RasterError> {
    let whole = TileRect {
        origin: [0, 0],
        size: size_px.map(|s| s.div_ceil(TILE_SIZE_PX)),
    };
    let capacity = backend.record_capacity();
    // A stack, the next region on top.
    let mut open = split(&whole, parts);
    let mut rendered = 0;
    while let Some(rect) = open.pop() {
        let mut handed_over = false;
        let mut pass_on = |records: RawRecords<'_>| {
            handed_over = true;
            sink(&rect, records)
        };
        match backend.render(draws, view, region(&rect, size_px), true, &mut pass_on)? {
            Rendered::Complete { .. } => {
                if !handed_over {
                    let nothing = RawRecords {
                        quads: &[],
                        depths: &[],
                    };
                    sink(&rect, nothing)?;
                }
                rendered += 1;
            }
            Rendered::Overflow { needed } if rect.count() == 1 => {
                return Err(RasterError::Budget {
                    tx: rect.origin[0],
                    ty: rect.origin[1],
                    needed,
                    capacity,
                });
            }
            Rendered::Overflow { needed } => {
                // Records are spread unevenly: a quarter more parts than an even spread needs.
                let parts = (needed * 5 / 4).div_ceil(capacity).max(2);
                open.extend(split(&rect, parts.min(u64::from(u32::MAX)) as u32));
            }
        }
    }
    Ok(rendered)
}

/// Renders a whole view without capture.
///
/// # Errors
/// Driver errors.
pub fn render_view(
    backend: &mut dyn CaptureBackend,
    draws: &DrawList,
    view: &View<'_>,
    size_px: [u32; 2],
) -> Result<(), RasterError> {
    let whole = Region {
        origin_px: [0, 0],
        size_px,
    };
    backend
        .render(draws, view, whole, false, &mut |_| Ok(()))
        .map(|_| ())
}

/// Cuts a rectangle into up to `parts` bands of whole rows, or a single row into runs of tiles;
/// the first part comes last.
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

/// Pixels of a rectangle of tiles, cut off at the view's edge.
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
    fn the_last_tiles_are_cut_off_at_the_edge_of_the_view() {
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
