//! Residuals: pairs of small numbers by class, larger ones by their width.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use crate::varint::{low_u32, zigzag};

/// A pair (u, v).
pub(super) type Pair = [i32; 2];

/// Number of classes of a pair. 0: both are 0. 1: one is 1 or -1, the other 0. 2: both are 1 or -1. 3: the
/// larger one is 2 or -2. 4: anything else.
const CLASSES: u32 = 5;
/// The class whose width is coded.
pub(super) const WIDE: u32 = 4;
/// Number of codes for the classes of a mode.
pub(super) const NOISES: usize = 6;
/// Number of symbols of four classes, and the symbol after which classes follow as numbers.
pub(super) const ESCAPE_SIZES: u32 = CLASSES.pow(4);
/// Number of bits of such a number.
pub(super) const CLASS_NUMBER_BITS: u32 = 3;

/// Number of bits that identify a pair in each class, one hexadecimal digit per class from the lowest.
const CLASS_BITS: u32 = 0x0_4220;
/// Index of each class's first pair, in the same form.
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

/// Facts derived from the classes of a quad's four pairs, as bit fields.
///
/// | bits | content |
/// | --- | --- |
/// | 0 to 4 | number of bits that identify small pairs |
/// | 5 to 8 | number of those bits for the first two pairs |
/// | 9 to 11 | index of the code for the group's next residuals |
/// | 12 | a pair is wide |
/// | 13 | the classes follow as numbers |
/// | 16 to 25, 32 to 41 | index in [`TWO_PAIRS`] for the first two pairs, and for the last two |
/// | 26 to 29 | which pairs are wide |
/// | 48 to 55, 56 to 63 | mask of the bits that identify the first two pairs, and the last two |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Classes(u64);

impl Classes {
    /// The classes of uv, dx, dy and cross.
    pub const fn new([uv, dx, dy, cross]: [u32; 4]) -> Self {
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
        let first = class_bits(uv) + class_bits(dx);
        let last = class_bits(dy) + class_bits(cross);
        let mut wide = (uv >= WIDE) as u32 | ((dx >= WIDE) as u32) << 1;
        wide |= ((dy >= WIDE) as u32) << 2 | ((cross >= WIDE) as u32) << 3;
        let low = (first + last) | first << 5 | noise << 9 | ((wide != 0) as u32) << 12;
        let high = ((1u32 << first) - 1) | (((1 << last) - 1) << 8);
        let middle = two_start(uv, dx) | wide << 10 | two_start(dy, cross) << 16;
        Self(low as u64 | (middle as u64) << 16 | (high as u64) << 48)
    }

    /// The classes of a symbol.
    #[inline(always)]
    pub fn of_symbol(symbol: u32) -> Self {
        let found = OF_SYMBOL.get(symbol as usize % OF_SYMBOL.len());
        found.copied().unwrap_or_default()
    }

    /// Number of bits that identify the small pairs.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        low_u32(self.0) & 31
    }

    /// Index of the code for the group's next residuals.
    #[inline(always)]
    pub fn noise(self) -> usize {
        (low_u32(self.0) >> 9 & 7) as usize
    }

    /// The small pairs identified by bits; wide ones are 0.
    #[inline(always)]
    pub fn small_pairs(self, bits: u64) -> Quad {
        let two = |start: u64, ones: u64, bits: u64| {
            let at = low_u32(start).wrapping_add(low_u32(bits & ones));
            let found = TWO_PAIRS.get(at as usize % TWO_PAIRS.len());
            found.copied().unwrap_or_default()
        };
        let first = self.0 >> 5 & 15;
        let [uv, dx] = two(self.0 >> 16, self.0 >> 48 & 255, bits);
        let [dy, cross] = two(self.0 >> 32, self.0 >> 56, bits >> first);
        [uv, dx, dy, cross]
    }

    /// Whether further decoding is needed: pairs are wide, or the classes follow as numbers.
    #[inline(always)]
    pub fn is_special(self) -> bool {
        low_u32(self.0) >> 12 & 3 != 0
    }

    /// Whether the classes follow as numbers.
    #[inline(always)]
    pub fn is_escape(self) -> bool {
        low_u32(self.0) >> 13 & 1 != 0
    }

    /// Which pairs are wide: 1 for each wide one of uv, dx, dy and cross, else 0.
    #[inline(always)]
    pub fn wide(self) -> [u32; 4] {
        let wide = low_u32(self.0 >> 26);
        [wide & 1, wide >> 1 & 1, wide >> 2 & 1, wide >> 3 & 1]
    }
}

/// Long enough that the compiler can remove index checks.
static OF_SYMBOL: [Classes; 1024] = {
    let mut table = [Classes(1 << 13); 1024];
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

/// The symbol of four classes.
pub(super) fn symbol([uv, dx, dy, cross]: [u32; 4]) -> u32 {
    uv + CLASSES * (dx + CLASSES * (dy + CLASSES * cross))
}

/// Two pairs by their classes, then by the bits that identify them.
static TWO_PAIRS: [[Pair; 2]; 1024] = {
    let mut pairs = [[[0; 2]; 2]; 1024];
    let mut classes = 0;
    while classes < CLASSES * CLASSES {
        let (one, other) = (classes / CLASSES, classes % CLASSES);
        let mut bits = 0;
        while bits < 1 << (class_bits(one) + class_bits(other)) {
            #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
            {
                let [a, b] = small(one, bits);
                let [c, d] = small(other, bits >> class_bits(one));
                pairs[(two_start(one, other) + bits) as usize] =
                    [[a as i32, b as i32], [c as i32, d as i32]];
            }
            bits += 1;
        }
        classes += 1;
    }
    pairs
};

/// Index in [`TWO_PAIRS`] of the first pairs of two classes.
const fn two_start(one: u32, other: u32) -> u32 {
    let mut start = 0;
    let mut before = 0;
    while before < one * CLASSES + other {
        start += 1 << (class_bits(before / CLASSES) + class_bits(before % CLASSES));
        before += 1;
    }
    start
}

/// The pair of a class with these bits.
#[allow(
    clippy::indexing_slicing,
    reason = "evaluated when compiled, or a test"
)]
pub(super) const fn small(class: u32, bits: u32) -> [i8; 2] {
    let index = bits & ((1 << class_bits(class)) - 1);
    SMALL[(nibble(STARTS, class) + index) as usize]
}

#[inline(always)]
const fn nibble(digits: u32, at: u32) -> u32 {
    digits >> (4 * at) & 15
}

/// Number of bits of a class.
#[inline(always)]
pub(super) const fn class_bits(class: u32) -> u32 {
    nibble(CLASS_BITS, class)
}

/// Class of a pair and, unless it is wide, the bits that identify it.
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

/// Number of bits of the larger number of a pair.
pub(super) fn width(pair: Pair) -> u32 {
    let [u, v] = pair.map(fold);
    32 - (u | v).leading_zeros()
}

/// A number in its stored form: 0, -1, 1, -2, ...
pub(super) fn fold(number: i32) -> u32 {
    low_u32(zigzag(number.into()))
}

/// The number with this stored form.
#[inline(always)]
pub(super) fn unfold(stored: u64) -> i32 {
    let stored = low_u32(stored);
    (stored >> 1 ^ (stored & 1).wrapping_neg()).cast_signed()
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
