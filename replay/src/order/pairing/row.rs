//! Each row at a shift of its own, by what the tiles of the last frame had in common: what lies near falls on other cells
//! than what is far away.

use super::offset::Offset;
use super::{Placement, Rule, tiles};
use crate::order::cost::{Cost, Knows};
use crate::order::known::ViewCounters;
use crate::order::{Known, View};

/// Pairs at a shift a row.
#[derive(Debug)]
pub struct Row {
    shifts: fn(&ViewCounters) -> &[i32],
}

/// By primitives.
pub const PRIMITIVES: Row = Row {
    shifts: |of| &of.primitive_shift,
};

/// By lines.
pub const LINES: Row = Row {
    shifts: |of| &of.line_shift,
};

impl Rule for Row {
    fn place(&self, eyes: [View; 2], known: &Known<'_>) -> Placement {
        let Some(counted) = known.counted(eyes[0]) else {
            return Offset.place(eyes, known);
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

    /// A byte a row.
    fn cost(&self, [_, rows]: [u32; 2]) -> Cost {
        Cost::state(4)
            .with_table(rows.into())
            .deciding_in(1)
            .knowing(Knows::LastFrame)
    }
}
