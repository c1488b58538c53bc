//! Widths of several pairs, coded by one symbol.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::Code;
use super::residual::{Pair, width};
use std::array::from_fn;

/// Largest width of pairs that can be read from one peek at the bits. Wider ones have 32 bits, which hold
/// any number.
pub(super) const MOST_WIDTH: u32 = 28;

/// Widths of a first quad's dx, dy and uv, by level.
pub(super) const EACH: [u8; 32] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25,
    26, 27, 28, 32, 32, 32,
];
/// Widths of its cross.
pub(super) const CROSS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 16, 20, 32];
/// Widths of a correction's start.
pub(super) const START: [u8; 4] = [1, 2, 3, 5];
/// Widths of a correction's slopes.
pub(super) const SLOPE: [u8; 8] = [1, 2, 3, 4, 5, 6, 7, 9];
/// Widths of a correction's tilt.
pub(super) const TILT: [u8; 8] = [4, 5, 6, 7, 8, 9, 11, 16];

/// Structure of a symbol: a level for each of several pairs, from its lowest bits on. The highest symbol
/// has the largest widths of all pairs, so it must be in every code.
#[derive(Clone, Copy)]
pub(super) struct Layout<const PAIRS: usize>(pub [&'static [u8]; PAIRS]);

/// dx and uv of a first quad.
pub(super) const DX_AND_UV: Layout<2> = Layout([&EACH, &EACH]);
/// dy and cross of a first quad.
pub(super) const DY_AND_CROSS: Layout<2> = Layout([&EACH, &CROSS]);
/// Start, slopes to the right and down, and tilt of a correction.
pub(super) const CORRECTION: Layout<4> = Layout([&START, &SLOPE, &SLOPE, &TILT]);

/// Width of a level.
#[inline(always)]
pub(super) fn of_level<const N: usize>(levels: &[u8; N], level: u32) -> u32 {
    let width = levels.get(level as usize % N).copied();
    width.unwrap_or_default().into()
}

impl<const PAIRS: usize> Layout<PAIRS> {
    /// Number of symbols.
    pub fn symbols(&self) -> usize {
        self.0.iter().map(|levels| levels.len()).product()
    }

    /// The width of each pair.
    pub fn widths(&self, mut symbol: u32) -> [u32; PAIRS] {
        self.0.map(|levels| {
            let width = levels.get(symbol as usize % levels.len()).copied();
            symbol >>= levels.len().ilog2();
            width.unwrap_or_default().into()
        })
    }
}

/// A symbol, its widths, and the number of bits of the symbol and the numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chosen<const PAIRS: usize> {
    pub symbol: u32,
    pub widths: [u32; PAIRS],
    pub bits: u32,
}

/// The symbols of a code that encode pairs in the fewest bits.
pub(super) struct Choices<const PAIRS: usize> {
    /// By width, the narrowest sufficient level of each pair, as part of a symbol.
    narrowest: [[usize; 33]; PAIRS],
    /// The best symbol, by the symbol of the narrowest levels.
    best: Vec<Chosen<PAIRS>>,
}

impl<const PAIRS: usize> Choices<PAIRS> {
    pub fn new(code: &Code, layout: Layout<PAIRS>) -> Self {
        let mut best: Vec<Chosen<PAIRS>> = (0u32..)
            .take(layout.symbols())
            .map(|symbol| {
                let widths = layout.widths(symbol);
                // Symbols that are not in the code are never the best.
                let bits = code.length(symbol, 1 << 16) + 2 * widths.iter().sum::<u32>();
                Chosen {
                    symbol,
                    widths,
                    bits,
                }
            })
            .collect();
        for at in (0..best.len()).rev() {
            let mut step = 1;
            for levels in layout.0 {
                // More bits for one of the pairs.
                if at / step % levels.len() + 1 < levels.len() {
                    let wider = best.get(at + step).copied();
                    let own = best.get_mut(at);
                    if let Some((own, wider)) = own.zip(wider).filter(|(o, w)| w.bits < o.bits) {
                        *own = wider;
                    }
                }
                step *= levels.len();
            }
        }
        let mut step = 1;
        let narrowest = layout.0.map(|levels| {
            let of_width =
                from_fn(|width| step * levels.partition_point(|level| usize::from(*level) < width));
            step *= levels.len();
            of_width
        });
        Self { narrowest, best }
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "widths up to 32, no wider than the widest level"
    )]
    pub fn choose(&self, pairs: &[Pair; PAIRS]) -> Chosen<PAIRS> {
        let levels = self.narrowest.iter().zip(pairs);
        self.best[levels
            .map(|(narrowest, pair)| narrowest[width(*pair) as usize])
            .sum::<usize>()]
    }
}
