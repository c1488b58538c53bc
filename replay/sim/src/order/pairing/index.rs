//! Tiles of the same column and row, as the Z2 paper pairs them.

use super::{Placement, Rule, tiles};
use crate::order::cost::Cost;
use crate::order::{PlanInputs, View};

/// Pairs by column and row.
#[derive(Debug)]
pub struct Index;

impl Rule for Index {
    fn place(&self, eyes: [View; 2], _inputs: &PlanInputs<'_>) -> Placement {
        Placement {
            grid: [0, 1].map(|axis: usize| eyes[0].tiles[axis].max(eyes[1].tiles[axis])),
            cells: eyes.map(|view| tiles(view).collect()),
        }
    }

    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(0)
    }
}
