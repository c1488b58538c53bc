//! A Hilbert curve for any grid. A rectangle is divided into two along its longer side, or into three as the
//! Hilbert curve divides a square, down to single rows of cells. Nearly all steps go to a neighbour, and no
//! outside cells are visited.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// The generalised Hilbert curve.
#[derive(Debug)]
pub(super) struct GeneralisedHilbert;

impl Path for GeneralisedHilbert {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid.map(|n| n as i32);
        let mut cells = Vec::with_capacity(columns as usize * rows as usize);
        if columns > 0 && rows > 0 {
            let (across, down) = ([columns, 0], [0, rows]);
            let sides = if columns >= rows {
                [across, down]
            } else {
                [down, across]
            };
            fill([0, 0], sides, &mut cells);
        }
        cells
    }

    /// A stack of rectangles of 12 bytes each. Its depth is how often the longer side can be halved.
    fn cost(&self, grid: [u32; 2]) -> Cost {
        let halvings = grid[0].max(1).ilog2() + grid[1].max(1).ilog2() + 2;
        Cost::state(12 * halvings).deciding_in(halvings)
    }
}

fn length([x, y]: [i32; 2]) -> i32 {
    (x + y).abs()
}

fn sum(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn difference(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Half of a side, made even unless one half would become empty.
fn half(side: [i32; 2]) -> [i32; 2] {
    let half = side.map(|n| n / 2);
    if length(half) % 2 == 1 && length(side) > 2 {
        sum(half, side.map(i32::signum))
    } else {
        half
    }
}

/// Visits a rectangle given by the corner `at` and two sides, from that corner to the other end of the first
/// side.
fn fill(at: [i32; 2], [first, second]: [[i32; 2]; 2], cells: &mut Vec<[u32; 2]>) {
    let [step, across] = [first, second].map(|side| side.map(i32::signum));
    if length(second) == 1 || length(first) == 1 {
        let (step, count) = if length(second) == 1 {
            (step, length(first))
        } else {
            (across, length(second))
        };
        for n in 0..count {
            cells.push([0, 1].map(|axis| (at[axis] + n * step[axis]) as u32));
        }
        return;
    }
    if 2 * length(first) > 3 * length(second) {
        let half = half(first);
        fill(at, [half, second], cells);
        fill(sum(at, half), [difference(first, half), second], cells);
        return;
    }
    let (half_first, half_second) = (first.map(|n| n / 2), half(second));
    fill(at, [half_second, half_first], cells);
    let rest = difference(second, half_second);
    fill(sum(at, half_second), [first, rest], cells);
    let end = sum(difference(first, step), difference(half_second, across));
    let back = [half_second.map(|n| -n), difference(half_first, first)];
    fill(sum(at, end), back, cells);
}
