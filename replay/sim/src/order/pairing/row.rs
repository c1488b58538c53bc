//! Shifts each row by its own amount, at which the tiles of the last frame had most in common. Near and distant
//! surfaces need different shifts.

use super::offset::Offset;
use super::{Placement, Rule, tiles};
use crate::order::cost::{Cost, Information};
use crate::order::plan_inputs::ViewCounters;
use crate::order::{PlanInputs, View};

/// Pairs with one shift per row.
#[derive(Debug)]
pub struct RowPairing {
    shifts: fn(&ViewCounters) -> &[i32],
}

/// Compares primitives.
pub(super) const PRIMITIVES: RowPairing = RowPairing {
    shifts: |of| &of.primitive_shift,
};

/// Compares lines.
pub const LINES: RowPairing = RowPairing {
    shifts: |of| &of.line_shift,
};

impl Rule for RowPairing {
    fn place(&self, eyes: [View; 2], inputs: &PlanInputs<'_>) -> Placement {
        let Some(counted) = inputs.counted(eyes[0]) else {
            return Offset.place(eyes, inputs);
        };
        let shifts = (self.shifts)(counted);
        let cells = |eye: usize| -> Vec<[i32; 2]> {
            let cell = |[x, y]: [u32; 2]| {
                let shift = if eye == 1 {
                    shifts.get(y as usize).copied().unwrap_or(0)
                } else {
                    0
                };
                [x as i32 + shift, y as i32]
            };
            tiles(eyes[eye]).map(cell).collect()
        };
        Placement::new([cells(0), cells(1)])
    }

    /// One byte per row.
    fn cost(&self, [_, rows]: [u32; 2]) -> Cost {
        Cost::state(4)
            .with_table(rows.into())
            .deciding_in(1)
            .with_information(Information::LastFrame)
    }
}
