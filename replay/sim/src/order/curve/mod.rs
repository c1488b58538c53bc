//! Curves: the order in which the cells of a grid are visited. One per file.
//!
//! A curve depends on a grid of cells, not on eyes. A new one is a file with a `Path` and a row of the table.

mod adaptive;
mod band;
mod generalised_hilbert;
mod hilbert;
mod morton;
mod random;
mod scanline;
mod strip;
mod zig_zag;

pub(super) use random::shuffle;

use super::cost::Cost;
use crate::palette::{BLUE, GREEN, GREY, ORANGE, PURPLE, Rgb, SKY_BLUE, VERMILION, YELLOW};
use crate::registry::{Named, registry};
use adaptive::Adaptive;
use band::Band;
use generalised_hilbert::GeneralisedHilbert;
use hilbert::Hilbert;
use morton::Morton;
use random::Random;
use scanline::Scanline;
use strip::Strip;
use zig_zag::ZigZag;

registry! { CurveRow:
    // constant            name         colour     number that may follow the name           help                                                                     the path
    SCANLINE =   row("scanline",  VERMILION, CurveSize::NONE,                                 "Rows from left to right",                                               &Scanline);
    ZIG_ZAG =    row("zig-zag",   PURPLE,    CurveSize::NONE,                                 "Rows, every other one from right to left",                              &ZigZag);
    MORTON =     row("morton",    ORANGE,    CurveSize::NONE,                                 "Z-order curve of the next power of two",                                &Morton);
    HILBERT =    row("hilbert",   YELLOW,    CurveSize::NONE,                                 "Hilbert curve of the next power of two",                                &Hilbert);
    GILBERT =    row("gilbert",   GREEN,     CurveSize::NONE,                                 "Hilbert curve generalised to any grid",                                 &GeneralisedHilbert);
    STRIP =      row("strip",     BLUE,      CurveSize::new("columns", strip::columns),       "Vertical strips of N columns, rows in alternating direction; without N as wide as the L2 allows", &Strip);
    BAND =       row("band",      SKY_BLUE,  CurveSize::new("rows", |_| band::USUAL_ROWS),    "Horizontal bands of N rows, columns in alternating direction; without N 4 rows", &Band);
    ADAPTIVE =   row("adaptive",  GREEN,     CurveSize::new("KiB of L2", adaptive::l2_kib),   "Rows if the L2 holds a row, otherwise bands, by the lines of the last frame", &Adaptive);
    RANDOM =     row("random",    GREY,      CurveSize::NONE,                                 "Shuffled cells: a control",                                           &Random);
    #[cfg(test)]
    COLUMNS =    row("test-columns", GREY,   CurveSize::NONE,                                 "Columns from the top",                                                  &super::tests::columns::Columns);
}

/// A curve by name.
pub type Curve = Named<CurveRow>;

/// A row of the table of curves.
#[derive(Debug)]
pub struct CurveRow {
    name: &'static str,
    color: Rgb,
    size: CurveSize,
    help: &'static str,
    path: &'static (dyn Path + Sync),
}

/// The number that may follow a curve's name.
#[derive(Debug)]
pub struct CurveSize {
    /// Its unit; empty if the curve has no number.
    unit: &'static str,
    /// The default, given the size of the L2 in bytes.
    usual: fn(u64) -> u32,
}

impl CurveSize {
    const NONE: Self = Self::new("", |_| 0);

    const fn new(unit: &'static str, usual: fn(u64) -> u32) -> Self {
        Self { unit, usual }
    }
}

const fn row(
    name: &'static str,
    color: Rgb,
    size: CurveSize,
    help: &'static str,
    path: &'static (dyn Path + Sync),
) -> CurveRow {
    CurveRow {
        name,
        color,
        size,
        help,
        path,
    }
}

impl Curve {
    /// Colour, the same in every plot.
    pub fn color(self) -> Rgb {
        self.row().color
    }

    /// The unit of the number after the name; none for a curve without a number.
    pub fn size_unit(self) -> Option<&'static str> {
        Some(self.row().size.unit).filter(|unit| !unit.is_empty())
    }

    /// The default of the number after the name.
    pub fn usual_size(self, l2_bytes: u64) -> u32 {
        (self.row().size.usual)(l2_bytes)
    }

    /// The path.
    pub fn path(self) -> &'static dyn Path {
        self.row().path
    }
}

/// The input of a path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ground {
    /// Columns and rows of cells.
    pub grid: [u32; 2],
    /// The number after the curve's name.
    pub size: u32,
    /// Seed of the random curve.
    pub seed: u64,
    /// Bytes of the lines that the cells accessed in the last frame; none if no counters are known.
    pub frame_bytes: Option<u64>,
}

/// A path through all cells of a grid.
pub trait Path: std::fmt::Debug {
    /// Column and row of each cell in order of traversal. Visits each cell exactly once.
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]>;

    /// Its hardware cost.
    fn cost(&self, grid: [u32; 2]) -> Cost;
}
