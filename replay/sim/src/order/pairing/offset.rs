//! Shifts the right eye's tiles by a constant of the display, so that distant points fall into the same cell.

use super::{Placement, Rule, tiles};
use crate::order::cost::{Cost, Information};
use crate::order::{PlanInputs, View};

/// Pairs with a constant shift.
#[derive(Debug)]
pub struct Offset;

impl Rule for Offset {
    fn place(&self, eyes: [View; 2], inputs: &PlanInputs<'_>) -> Placement {
        let offset = inputs.offset(eyes);
        Placement::new([0, 1].map(|eye: usize| {
            let cell = |tile: [u32; 2]| {
                let at = tile.map(|n| n as i32);
                [0, 1].map(|axis: usize| at[axis] + if eye == 1 { offset[axis] } else { 0 })
            };
            tiles(eyes[eye]).map(cell).collect()
        }))
    }

    /// Two registers that a driver writes once.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(4)
            .deciding_in(1)
            .with_information(Information::Display)
    }
}
