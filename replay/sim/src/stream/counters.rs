//! Counters of a frame that a GPU can maintain, for the orders of the next frame.

use super::expand::TileBuffers;
use super::{Frame, StreamError, TileLines};
use crate::order::rays::ray_passes;
use crate::order::{Counters, PlanInputs, TileRef, View, ViewCounters, Views, views};
use formats::raytrace::{RayTile, RaytraceTables};
use formats::view::Eye;

/// Maximum distance in columns between a row's best shift and the shift of infinity.
const SHIFTS: i32 = 8;

/// The distinct lines and the primitives of a tile, both ascending.
#[derive(Default)]
struct Own {
    lines: Vec<u32>,
    primitives: Vec<u32>,
}

impl Own {
    fn of(tile: &TileLines) -> Self {
        // Streams without all lines list the distinct lines of each quad.
        let lines = match tile.lines.is_empty() {
            true => tile.distinct.clone(),
            false => tile.lines.clone(),
        };
        let primitives = tile.list().map(|of| of.primitive);
        Self::distinct(lines, primitives.collect())
    }

    fn distinct(mut lines: Vec<u32>, mut primitives: Vec<u32>) -> Self {
        for list in [&mut lines, &mut primitives] {
            list.sort_unstable();
            list.dedup();
        }
        Self { lines, primitives }
    }

    /// The lines of the visits, and the primitives that primary rays hit.
    fn of_rays(tile: &RayTile, tables: &RaytraceTables, line_bytes: u32) -> Self {
        let lines = tile.visits.iter().flat_map(|&visit| {
            let first = tables.bvh.address(visit);
            let last = first + u64::from(tables.bvh.visit_bytes(visit)).max(1) - 1;
            let line = |address: u64| (address / u64::from(line_bytes)) as u32;
            line(first)..=line(last)
        });
        let hits = tile.pixels.iter().filter_map(|pixel| pixel.hit.as_ref());
        Self::distinct(lines.collect(), hits.map(|hit| hit.primitive).collect())
    }
}

/// Counts the common members of two ascending lists without repeats.
fn common(a: &[u32], b: &[u32]) -> u32 {
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    let mut count = 0;
    while let (Some(x), Some(y)) = (a.peek(), b.peek()) {
        let order = x.cmp(y);
        count += u32::from(order.is_eq());
        if order.is_le() {
            a.next();
        }
        if order.is_ge() {
            b.next();
        }
    }
    count
}

/// The number of lines of the tiles of a row; a line counts once per tile.
fn lines_of(row: &[Own]) -> u32 {
    row.iter().map(|own| own.lines.len() as u32).sum()
}

fn nothing(view: View) -> ViewCounters {
    ViewCounters {
        view,
        bytes: 0,
        primitive_shift: Vec::new(),
        line_shift: Vec::new(),
    }
}

fn pair_counters<E>(
    eyes: [View; 2],
    inputs: &PlanInputs<'_>,
    mut row: impl FnMut(View, Option<u32>) -> Result<Vec<Own>, E>,
) -> Result<ViewCounters, E> {
    let offset = inputs.offset(eyes);
    let rows = eyes[0].tiles[1];
    let mut counted = nothing(eyes[0]);
    for y in 0..rows {
        let other = y.checked_add_signed(-offset[1]);
        let left = row(eyes[0], Some(y))?;
        let right = row(eyes[1], other)?;
        let at = |x: usize, shift: i32| right.get(x.checked_add_signed(-shift as isize)?);
        let agreement = |shift: i32, of: fn(&Own) -> &[u32]| -> u32 {
            let tiles = left.iter().enumerate();
            let pairs = tiles.filter_map(|(x, own)| Some((own, at(x, shift)?)));
            pairs.map(|(l, r)| common(of(l), of(r))).sum()
        };
        let best = |of: fn(&Own) -> &[u32]| {
            let shifts = offset[0] - SHIFTS..=offset[0] + SHIFTS;
            // If equal, the shift nearest to that of infinity wins, then the larger one, which suits near
            // surfaces.
            shifts
                .max_by_key(|&shift| {
                    let far = (shift - offset[0]).abs();
                    (agreement(shift, of), -far, shift)
                })
                .unwrap_or(offset[0])
        };
        let both = lines_of(&left) + lines_of(&right);
        let lines = both - agreement(offset[0], |own| &own.lines);
        counted.bytes += u64::from(lines) * u64::from(inputs.line_bytes);
        counted.line_shift.push(best(|own| &own.lines));
        counted.primitive_shift.push(best(|own| &own.primitives));
    }
    Ok(counted)
}

/// The counters of a frame of rays, whose tiles `tile` decodes.
///
/// # Errors
/// A tile that cannot be decoded.
pub fn ray_counters<E>(
    tables: &RaytraceTables,
    inputs: &PlanInputs<'_>,
    mut tile: impl FnMut(Eye, u32, &mut RayTile) -> Result<(), E>,
) -> Result<Counters, E> {
    let passes = ray_passes(tables, 0);
    let view = |at: usize| View::of(at as u32, at as u32, &passes[at]);
    let mut data = RayTile::default();
    let counted = pair_counters([view(0), view(1)], inputs, |view, y| {
        let [columns, rows] = view.tiles;
        let eye = [Eye::Left, Eye::Right][view.pass as usize];
        let first = y.filter(|&y| y < rows).map(|y| y * columns);
        let tiles = first.map_or(0..0, |first| first..first + columns);
        tiles
            .map(|index| {
                tile(eye, index, &mut data)?;
                Ok(Own::of_rays(&data, tables, inputs.line_bytes))
            })
            .collect()
    })?;
    Ok(Counters {
        views: vec![counted],
    })
}

impl Frame<'_> {
    /// Counts the views of the frame.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn counters(&self, inputs: &PlanInputs<'_>) -> Result<Counters, StreamError> {
        let passes = &self.expander().source().tables().passes;
        let mut work = self.expander().work();
        let mut counted = Vec::new();
        for phase in views(passes, self.number()) {
            counted.push(match phase {
                Views::One(view) => self.count_view(view, inputs, &mut work)?,
                Views::Pair(left, right) => self.count_pair([left, right], inputs, &mut work)?,
            });
        }
        Ok(Counters { views: counted })
    }

    fn count_view(
        &self,
        view: View,
        inputs: &PlanInputs<'_>,
        work: &mut TileBuffers,
    ) -> Result<ViewCounters, StreamError> {
        let mut counted = nothing(view);
        for y in 0..view.tiles[1] {
            let lines = lines_of(&self.row(view, Some(y), work)?);
            counted.bytes += u64::from(lines) * u64::from(inputs.line_bytes);
        }
        Ok(counted)
    }

    fn count_pair(
        &self,
        eyes: [View; 2],
        inputs: &PlanInputs<'_>,
        work: &mut TileBuffers,
    ) -> Result<ViewCounters, StreamError> {
        pair_counters(eyes, inputs, |view, y| self.row(view, y, work))
    }

    /// The tiles of a row; none outside of the grid.
    fn row(
        &self,
        view: View,
        y: Option<u32>,
        work: &mut TileBuffers,
    ) -> Result<Vec<Own>, StreamError> {
        let Some(y) = y.filter(|&y| y < view.tiles[1]) else {
            return Ok(Vec::new());
        };
        let mut row = Vec::with_capacity(view.tiles[0] as usize);
        for x in 0..view.tiles[0] {
            let at = TileRef {
                pass: view.pass,
                tile: y * view.tiles[0] + x,
            };
            row.push(match self.kept(at) {
                Some(tile) => Own::of(tile),
                None => {
                    self.expander().expand(at, work)?;
                    Own::of(&work.lines)
                }
            });
        }
        Ok(row)
    }
}

#[cfg(test)]
mod tests {
    use super::common;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn members_of_both_lists_are_counted(
            a in prop::collection::btree_set(0_u32..40, 0..30),
            b in prop::collection::btree_set(0_u32..40, 0..30),
        ) {
            let list = |set: &BTreeSet<u32>| set.iter().copied().collect::<Vec<u32>>();
            prop_assert_eq!(common(&list(&a), &list(&b)) as usize, a.intersection(&b).count());
        }
    }
}
