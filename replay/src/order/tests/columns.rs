//! An order that only tests know: with its row in the table it is all that an order takes.

use crate::order::TileOrder;

pub struct Columns;

impl TileOrder for Columns {
    fn curve(&self, [columns, rows]: [u32; 2]) -> Vec<[u32; 2]> {
        (0..columns)
            .flat_map(|x| (0..rows).map(move |y| [x, y]))
            .collect()
    }
}
