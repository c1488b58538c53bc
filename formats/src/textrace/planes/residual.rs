//! Residuals: pairs of small numbers in classes, larger ones by their width.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use crate::varint::{low_u32, unzigzag, zigzag};

/// A pair (u, v).
pub(super) type Pair = [i32; 2];

/// Number of classes of a pair: 0 both are 0; 1 one of them is 1 or -1, the other one 0; 2 both are 1 or
/// -1; 3 the larger one is 2 or -2; 4 anything else.
const CLASSES: u32 = 5;
/// The class that tells its width.
pub(super) const WIDE: u32 = 4;
/// How many codes tell the classes of a mode.
pub(super) const NOISES: usize = 6;
/// Symbols of the classes of four pairs, and the one after which they follow as numbers.
pub(super) const ESCAPE_SIZES: u32 = CLASSES.pow(4);
/// Bits of such a number.
pub(super) const CLASS_NUMBER_BITS: u32 = 3;

/// Bits that name a pair in each class, a hexadecimal digit each from the lowest.
const CLASS_BITS: u32 = 0x0_4220;
/// First pair of each class, likewise.
const STARTS: u32 = 0x0_9510;

/// The pairs of the classes 0 to 3, each class by u, then v.
const SMALL: [[i8; 2]; 32] = {
    let mut pairs = [[0; 2]; 32];
    let mut at = 0;
    let mut class = 0;
    while class <= 3 {
        let mut u = -2;
        while u <= 2 {
            let mut v = -2;
            while v <= 2 {
                if class_of(u, v) == class {
                    #[allow(
                        clippy::indexing_slicing,
                        clippy::cast_possible_truncation,
                        reason = "evaluated when compiled"
                    )]
                    {
                        pairs[at] = [u as i8, v as i8];
                    }
                    at += 1;
                }
                v += 1;
            }
            u += 1;
        }
        class += 1;
    }
    pairs
};

const fn class_of(u: i32, v: i32) -> u32 {
    match (u.unsigned_abs(), v.unsigned_abs()) {
        (0, 0) => 0,
        (0, 1) | (1, 0) => 1,
        (1, 1) => 2,
        (u, v) if u <= 2 && v <= 2 => 3,
        _ => WIDE,
    }
}

/// What the classes of a quad's four pairs come to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Classes {
    /// The classes, four bits each, of dx, dy, cross and uv from the lowest.
    pub digits: u16,
    /// Which code tells of the group's next residuals.
    pub noise: u8,
    /// One of them is wide.
    pub wide: bool,
}

impl Classes {
    /// From each class.
    #[allow(clippy::cast_possible_truncation, reason = "classes take three bits")]
    pub const fn new([dx, dy, cross, uv]: [u32; 4]) -> Self {
        const SIZE: u32 = 0x3_2110;
        let size = nibble(SIZE, dx) + nibble(SIZE, dy) + nibble(SIZE, cross) + nibble(SIZE, uv);
        let noise = match size {
            0 => 0,
            1 | 2 => 1,
            3 | 4 => 2,
            5 | 6 => 3,
            7..=9 => 4,
            _ => 5,
        };
        Self {
            digits: (dx | dy << 4 | cross << 8 | uv << 12) as u16,
            noise,
            wide: dx >= WIDE || dy >= WIDE || cross >= WIDE || uv >= WIDE,
        }
    }

    /// From a symbol below [`ESCAPE_SIZES`].
    #[inline(always)]
    pub fn of_symbol(symbol: u32) -> Self {
        OF_SYMBOL.get(symbol as usize).copied().unwrap_or_default()
    }

    /// Of each pair.
    #[inline(always)]
    pub fn each(self) -> [u32; 4] {
        let digits = u32::from(self.digits);
        // `map` of an array is not always inlined, and costs a tenth of a tile's time then.
        [
            digits & 15,
            digits >> 4 & 15,
            digits >> 8 & 15,
            digits >> 12,
        ]
    }

    /// The symbol.
    pub fn symbol(self) -> u32 {
        let joined = self.each().into_iter().rev();
        joined.fold(0, |joined, class| joined * CLASSES + class)
    }
}

const OF_SYMBOL: [Classes; ESCAPE_SIZES as usize] = {
    let mut table = [Classes {
        digits: 0,
        noise: 0,
        wide: false,
    }; ESCAPE_SIZES as usize];
    let mut s = 0;
    while s < ESCAPE_SIZES {
        #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
        {
            table[s as usize] = Classes::new([s % 5, s / 5 % 5, s / 25 % 5, s / 125]);
        }
        s += 1;
    }
    table
};

/// By class and the next four bits: the pair that as many of them as the class has name. Further
/// classes fill it up to a power of two.
const BY_BITS: [[i32; 2]; 128] = {
    let mut pairs = [[0; 2]; 128];
    let mut at = 0u32;
    while at < 128 {
        let class = at >> 4;
        let index = at & ((1 << class_bits(class)) - 1);
        #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
        {
            let [u, v] = SMALL[(nibble(STARTS, class) + index) as usize];
            pairs[at as usize] = [u as i32, v as i32];
        }
        at += 1;
    }
    pairs
};

/// The pair of a class that some bits name.
#[inline(always)]
pub(super) fn small(class: u32, bits: u64) -> Pair {
    let at = class << 4 | low_u32(bits) & 15;
    BY_BITS.get(at as usize & 127).copied().unwrap_or_default()
}

#[inline(always)]
const fn nibble(digits: u32, at: u32) -> u32 {
    digits >> (4 * at) & 15
}

/// Residuals none of which is wide, and their bits; a wide one is taken for 0.
#[inline(always)]
pub(super) fn small_pairs(classes: Classes, bits: u64) -> (Quad, u32) {
    let [of_dx, of_dy, of_cross, of_uv] = classes.each();
    let dx_end = class_bits(of_dx);
    let dy_end = dx_end + class_bits(of_dy);
    let cross_end = dy_end + class_bits(of_cross);
    let end = cross_end + class_bits(of_uv);
    let quad = [
        small(of_uv, bits >> cross_end),
        small(of_dx, bits),
        small(of_dy, bits >> dx_end),
        small(of_cross, bits >> dy_end),
    ];
    (quad, end)
}

/// Bits of a class.
#[inline(always)]
pub(super) const fn class_bits(class: u32) -> u32 {
    nibble(CLASS_BITS, class)
}

/// Class of a pair and, unless it is wide, the bits that name it.
pub(super) fn classify([u, v]: Pair) -> (u32, u32) {
    let place = |number: i32| usize::try_from(number.checked_add(2)?).ok();
    let found = place(u)
        .zip(place(v))
        .and_then(|(u, v)| NAMES.get(u)?.get(v));
    found.copied().unwrap_or((WIDE, 0))
}

/// Class and index of each pair from (-2, -2) to (2, 2).
const NAMES: [[(u32, u32); 5]; 5] = {
    let mut names = [[(0, 0); 5]; 5];
    let mut at = 0;
    while at < 25 {
        #[allow(
            clippy::indexing_slicing,
            clippy::cast_possible_truncation,
            reason = "evaluated when compiled"
        )]
        {
            let [u, v] = SMALL[at];
            let class = class_of(u as i32, v as i32);
            names[(u + 2) as usize][(v + 2) as usize] = (class, at as u32 - nibble(STARTS, class));
        }
        at += 1;
    }
    names
};

/// Bits that the larger of a pair needs.
pub(super) fn width(pair: Pair) -> u32 {
    let [u, v] = pair.map(fold);
    32 - (u | v).leading_zeros()
}

/// A number as it is stored: 0, -1, 1, -2, ...
pub(super) fn fold(number: i32) -> u32 {
    low_u32(zigzag(number.into()))
}

#[inline(always)]
pub(super) fn unfold(bits: u64) -> i32 {
    low_u32(unzigzag(u64::from(low_u32(bits))).cast_unsigned()).cast_signed()
}

/// `quad - expected`, wrapping.
pub(super) fn difference(quad: &Quad, expected: &Quad) -> Quad {
    let mut left = *quad;
    for (pair, of) in left.iter_mut().zip(expected) {
        for (number, of) in pair.iter_mut().zip(of) {
            *number = number.wrapping_sub(*of);
        }
    }
    left
}

#[inline(always)]
pub(super) fn sum([a, b]: Pair, [c, d]: Pair) -> Pair {
    [a.wrapping_add(c), b.wrapping_add(d)]
}
