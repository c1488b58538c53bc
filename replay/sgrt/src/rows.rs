//! The left rows that error detection needs.
//!
//! For parallel eyes with equal frusta, the sources of a right row lie in the left row with the same
//! number, which is the only one the paper prefetches. For canted eyes, or eyes with different vertical
//! fields of view, the sources of a right row are spread over many left rows. DMA then fetches all of these
//! rows for every band of tiles.

use super::config::Gbuffer;
use super::frame::Frame;
use super::reads::Reads;
use super::reproject::Reprojection;
use formats::view::TILE_SIZE_PX;
use serde::{Deserialize, Serialize};

/// Smaller shifts are rounding errors.
const STILL_PX: f32 = 1.0 / 64.0;

/// Maximum number of left rows that the sources of a right row on an epipolar line occupy: a fractional
/// shift spreads them over two rows, only a rotation over more.
const LINE_ROWS: f64 = 2.0;

/// The left rows needed for the right image.
#[derive(Clone, Debug)]
pub struct RowNeeds {
    /// By band of tiles: number of left rows whose pixels arrive in the band.
    band: Vec<u64>,
    /// The same for the band and its adjacent rows.
    band_and_beside: Vec<u64>,
    /// By band of tiles: first and last of these left rows, and of those with the adjacent rows.
    spans: Vec<[Option<[u64; 2]>; 2]>,
    /// Properties of the eyes that follow from the rows.
    pub summary: RowSummary,
}

/// Whether the sources of a right row form a left row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct RowSummary {
    /// Share of visible left pixels that arrive in a row with another number.
    pub other_row_pct: f64,
    /// Mean number of left rows that the pixels of a right row come from.
    pub left_rows_per_right_row: f64,
    /// False if the paper's row test does not apply, because the sources of a right row do not lie in one
    /// left row (or two, for a fractional shift). All rows needed are fetched and charged.
    pub row_test_applies: bool,
}

impl RowNeeds {
    /// Analyses where left samples arrive.
    pub fn new(frame: &Frame, arrived: &Reprojection) -> Self {
        let [width, height] = frame.size_px.map(|s| s as usize);
        let words = height.div_ceil(64);
        // One bit per left row, by right row.
        let mut sources = vec![0u64; height * words];
        let (mut seen, mut elsewhere) = (0u64, 0u64);
        for (source, projected) in arrived.projected.iter().enumerate() {
            let Some([_, landed]) = projected.pixel(frame.size_px) else {
                continue;
            };
            let [_, own] = frame.position_px(source);
            let y = source / width;
            let is_still = (projected.at_px[1] - own).abs() < STILL_PX;
            let row = if is_still { y } else { landed as usize };
            seen += 1;
            elsewhere += u64::from(row != y);
            sources[row * words + y / 64] |= 1 << (y % 64);
        }
        let count = |first: usize, end: usize| -> u64 {
            let rows = &sources[first * words..end.min(height) * words];
            let union = |word: usize| rows.iter().skip(word).step_by(words).fold(0, |a, b| a | b);
            (0..words).map(|w| u64::from(union(w).count_ones())).sum()
        };
        let span = |first: usize, end: usize| -> Option<[u64; 2]> {
            let is_needed = |y: &usize| needs_row(&sources, words, first, end.min(height), *y);
            let first = (0..height).find(is_needed)?;
            let last = (0..height).rev().find(is_needed)?;
            Some([first as u64, last as u64])
        };
        let tile = TILE_SIZE_PX as usize;
        let bands = || (0..height).step_by(tile);
        let per_row: Vec<u64> = (0..height)
            .map(|y| count(y, y + 1))
            .filter(|n| *n > 0)
            .collect();
        let left_rows_per_right_row =
            per_row.iter().sum::<u64>() as f64 / per_row.len().max(1) as f64;
        Self {
            band: bands().map(|y| count(y, y + tile)).collect(),
            band_and_beside: bands()
                .map(|y| count(y.saturating_sub(1), y + tile + 1))
                .collect(),
            spans: bands()
                .map(|y| {
                    let beside = span(y.saturating_sub(1), y + tile + 1);
                    [span(y, y + tile), beside]
                })
                .collect(),
            summary: RowSummary {
                other_row_pct: 100.0 * elsewhere as f64 / seen.max(1) as f64,
                left_rows_per_right_row,
                row_test_applies: left_rows_per_right_row <= LINE_ROWS,
            },
        }
    }

    /// Left rows that a tile's band needs, without and with its adjacent rows.
    pub fn of_tile(&self, frame: &Frame, tile: u32) -> [u64; 2] {
        let band = (tile / frame.tables.tiles()[0]) as usize;
        [self.band[band], self.band_and_beside[band]]
    }

    /// Bytes of the largest band of rows that detection fetches, of `row_px` pixels each.
    pub(super) fn largest_band(&self, reads: Reads, g: &Gbuffer, row_px: u64) -> u64 {
        let bands = self.band.iter().zip(&self.band_and_beside);
        let bytes = bands.map(|(&band, &beside)| reads.fetched_bytes(g, band, beside, row_px));
        bytes.max().unwrap_or(0)
    }

    /// Left rows alive at most if they stay on chip and bands of left and right tiles alternate: a band of right tiles
    /// follows the last band of left tiles that it needs, and keeps every row that it or a later band needs.
    pub(super) fn rows_on_chip(&self, with_adjacent_rows: bool) -> u64 {
        let tile = u64::from(TILE_SIZE_PX);
        let mut most = 0;
        // By band: the oldest row that it or a later one needs.
        let mut needed_from: Vec<u64> = Vec::with_capacity(self.spans.len());
        let mut later = u64::MAX;
        for spans in self.spans.iter().rev() {
            if let Some([first, _]) = spans[usize::from(with_adjacent_rows)] {
                later = later.min(first);
            }
            needed_from.push(later);
        }
        needed_from.reverse();
        let mut traced = 0;
        for (spans, from) in self.spans.iter().zip(needed_from) {
            if let Some([_, last]) = spans[usize::from(with_adjacent_rows)] {
                traced = traced.max((last / tile + 1) * tile);
                most = most.max(traced.saturating_sub(from));
            }
        }
        most
    }
}

/// True if any right row from `first` to `end` needs a left row.
fn needs_row(sources: &[u64], words: usize, first: usize, end: usize, left: usize) -> bool {
    (first..end).any(|right| sources[right * words + left / 64] >> (left % 64) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproject::reproject;
    use crate::testing::{View, frame, wall};

    fn needs(view: View) -> (Frame, RowNeeds) {
        let frame = frame(&wall(3.0, [50.0, 50.0], 0.0, 1), view);
        let needs = RowNeeds::new(&frame, &reproject(&frame));
        (frame, needs)
    }

    #[test]
    fn parallel_eyes_need_the_row_itself_and_its_neighbours() {
        let (frame, needs) = needs(View::default());
        assert_eq!(needs.summary.other_row_pct, 0.0);
        assert_eq!(needs.summary.left_rows_per_right_row, 1.0);
        assert!(needs.summary.row_test_applies);
        let tiles_a_band = frame.tables.tiles()[0];
        // 40 rows form two whole bands and half a band.
        let bands = [0, 1, 2].map(|band| needs.of_tile(&frame, band * tiles_a_band));
        assert_eq!(bands, [[16, 17], [16, 18], [8, 9]]);
        // Without adjacent rows, a band's own; with them, the next band and the last row of the one before.
        assert_eq!(needs.rows_on_chip(false), 16);
        assert_eq!(needs.rows_on_chip(true), 33);
    }

    #[test]
    fn a_frustum_shifted_by_whole_rows_needs_no_additional_rows() {
        // A tangent of 1.2 spans 40 rows, so 0.06 spans two.
        let (_, needs) = needs(View {
            right_tilt: 0.06,
            ..View::default()
        });
        assert!(needs.summary.other_row_pct > 99.0);
        assert!(needs.summary.row_test_applies, "{:?}", needs.summary);
    }

    #[test]
    fn canted_eyes_need_many_rows_and_the_row_test_does_not_apply() {
        let (frame, needs) = needs(View {
            cant_deg: 10.0,
            ..View::default()
        });
        let summary = needs.summary;
        assert!(summary.other_row_pct > 50.0, "{summary:?}");
        assert!(summary.left_rows_per_right_row > 2.0, "{summary:?}");
        assert!(!summary.row_test_applies);
        assert!(needs.of_tile(&frame, frame.tables.tiles()[0])[0] > 16);
    }
}
