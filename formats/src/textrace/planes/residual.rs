//! Residuals: pairs of small numbers in classes, larger ones by their width.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use crate::varint::{low_u32, unzigzag, zigzag};

/// A pair (u, v).
pub(super) type Pair = [i32; 2];

/// Bits of a pair in each class, a hexadecimal digit each from the lowest: none where both are 0;
/// 3 within 1; 4 within 2; anything else tells its width.
const CLASS_BITS: u32 = 0x0430;
/// The class that tells its width.
pub(super) const WIDE: u32 = 3;

/// The pairs of the classes 0 to 2: 1, 8 and 16, each class row by row.
const SMALL: [[i8; 2]; 32] = {
    let mut pairs = [[0; 2]; 32];
    let mut at = 0;
    let mut class = 0;
    while class <= 2 {
        let mut u = -class;
        while u <= class {
            let mut v = -class;
            while v <= class {
                let most = if abs(u) > abs(v) { abs(u) } else { abs(v) };
                if most == class {
                    #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
                    {
                        pairs[at] = [u, v];
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

/// First pair of each class, likewise.
const STARTS: u32 = 0x0910;

const fn abs(value: i8) -> i8 {
    if value < 0 { -value } else { value }
}

/// The pair of a class that some bits name.
#[inline(always)]
pub(super) fn small(class: u32, bits: u64) -> Pair {
    let index = nibble(STARTS, class) + (low_u32(bits) & ((1 << class_bits(class)) - 1));
    let [u, v] = SMALL.get(index as usize & 31).copied().unwrap_or_default();
    [u.into(), v.into()]
}

#[inline(always)]
fn nibble(digits: u32, at: u32) -> u32 {
    digits >> (4 * at) & 15
}

/// Bits of a class.
#[inline(always)]
pub(super) fn class_bits(class: u32) -> u32 {
    nibble(CLASS_BITS, class)
}

/// Class of a pair and, unless it is wide, the bits that name it.
pub(super) fn classify([u, v]: Pair) -> (u32, u32) {
    let class = u.unsigned_abs().max(v.unsigned_abs()).min(WIDE);
    if class == WIDE {
        return (WIDE, 0);
    }
    let is = |pair: &[i8; 2]| pair.map(i32::from) == [u, v];
    let index = (0..).zip(&SMALL).find(|(_, pair)| is(pair));
    let index = index.map_or(0, |(index, _)| index);
    (class, index - nibble(STARTS, class))
}

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

/// Which code tells of a group's next residuals, from the classes of the last ones.
#[inline(always)]
pub(super) fn noise(classes: u32) -> usize {
    let sum = (classes & 3) + (classes >> 2 & 3) + (classes >> 4 & 3) + (classes >> 6 & 3);
    match sum {
        0 => 0,
        1 | 2 => 1,
        3 | 4 => 2,
        5 | 6 => 3,
        7..=9 => 4,
        _ => 5,
    }
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

/// `quad + by`, wrapping.
#[inline(always)]
pub(super) fn add(quad: &Quad, by: &Quad) -> Quad {
    let ([a, b, c, d], [e, f, g, h]) = (*quad, *by);
    [sum(a, e), sum(b, f), sum(c, g), sum(d, h)]
}

#[inline(always)]
pub(super) fn sum([a, b]: Pair, [c, d]: Pair) -> Pair {
    [a.wrapping_add(c), b.wrapping_add(d)]
}
