//! Pairs tiles that see the same direction. For eyes that are turned outwards, the shift of distant points
//! differs from place to place, and rows of one eye are slanted in the other.

use super::offset::Offset;
use super::{Placement, Rule, tiles};
use crate::order::cost::{Cost, Information};
use crate::order::{PlanInputs, View};

/// Pairs by direction, on the grid of a picture that faces straight ahead of the head.
#[derive(Debug)]
pub(super) struct Infinity;

impl Rule for Infinity {
    /// A right tile shares the cell of the left tile whose centre falls into it. Other tiles get the cell of
    /// their own direction.
    fn place(&self, eyes: [View; 2], inputs: &PlanInputs<'_>) -> Placement {
        let Some(directions) = inputs.directions(eyes) else {
            return Offset.place(eyes, inputs);
        };
        let left: Vec<[i32; 2]> =
            (tiles(eyes[0]).map(|tile| directions.in_head(0, tile))).collect();
        let [columns, rows] = eyes[1].tiles;
        let mut right: Vec<Option<[i32; 2]>> = vec![None; (columns * rows) as usize];
        for (tile, &cell) in tiles(eyes[0]).zip(&left) {
            let Some([x, y]) = directions.in_other_eye(0, tile) else {
                continue;
            };
            let inside =
                (0.0..f64::from(columns)).contains(&x) && (0.0..f64::from(rows)).contains(&y);
            if inside {
                right[(y as u32 * columns + x as u32) as usize].get_or_insert(cell);
            }
        }
        let own = |(tile, cell): ([u32; 2], Option<[i32; 2]>)| {
            cell.unwrap_or_else(|| directions.in_head(1, tile))
        };
        let right = tiles(eyes[1]).zip(right).map(own).collect();
        Placement::new([left, right])
    }

    /// A list of the tiles in traversal order, which a driver writes once per display: two bytes per tile of
    /// both eyes.
    fn cost(&self, [columns, rows]: [u32; 2]) -> Cost {
        let tiles = 2 * u64::from(columns) * u64::from(rows);
        Cost::state(4)
            .with_table(2 * tiles)
            .deciding_in(1)
            .with_information(Information::Display)
    }
}
