//! Prefix codes: canonical, from the lengths in [`super::lengths`].
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::lengths::LENGTHS;
use std::array::from_fn;
use std::sync::LazyLock;

/// Longest code.
pub(super) const MOST_BITS: u32 = 11;
const ENTRIES: usize = 1 << MOST_BITS;
/// Codes of at most 9 bits, nearly all that occur, are looked up in tables small enough to stay in
/// the nearest cache all together.
const FEW_ENTRIES: usize = 1 << 9;

/// A prefix code, for both directions.
pub(super) struct Code {
    /// Its place in [`LENGTHS`].
    #[cfg_attr(not(test), expect(dead_code, reason = "training counts by it"))]
    pub number: usize,
    /// By the next [`MOST_BITS`] bits: symbol * 16 + length.
    by_bits: Box<[u16; ENTRIES]>,
    /// The same by fewer bits; 0 where the code is longer.
    by_few_bits: [u16; FEW_ENTRIES],
    /// By symbol: bits as they are written, lowest first, and their number (0: not in the code).
    by_symbol: Vec<(u32, u32)>,
}

impl Code {
    /// From the length of each symbol's code, a hexadecimal digit each, 0 for none.
    pub fn new(number: usize, lengths: &str) -> Self {
        let lengths: Vec<u32> = lengths.chars().filter_map(|c| c.to_digit(16)).collect();
        let mut by_bits = Box::new([0; ENTRIES]);
        let mut by_symbol = vec![(0, 0); lengths.len()];
        let mut next = 0u32;
        for length in 1u16.. {
            let bits = u32::from(length);
            if bits > MOST_BITS {
                break;
            }
            next <<= 1;
            let symbols = lengths.iter().zip(&mut by_symbol).zip(0u16..);
            for ((_, entry), symbol) in symbols.filter(|((l, _), _)| **l == bits) {
                let code = next.reverse_bits() >> (32 - bits);
                *entry = (code, bits);
                let places = by_bits.iter_mut().skip(code as usize);
                places
                    .step_by(1 << bits)
                    .for_each(|place| *place = symbol << 4 | length);
                next += 1;
            }
        }
        let mut by_few_bits = [0; FEW_ENTRIES];
        for (few, of) in by_few_bits.iter_mut().zip(by_bits.iter()) {
            // The same entry stands wherever the bits above its length differ.
            *few = if of & 15 <= 9 { *of } else { 0 };
        }
        Self {
            number,
            by_bits,
            by_few_bits,
            by_symbol,
        }
    }

    /// Symbol and length of the code that the bits start with.
    #[inline(always)]
    pub fn decode(&self, bits: u64) -> (u32, u32) {
        let entry = lookup(&self.by_few_bits, bits);
        let entry = if entry == 0 {
            lookup(&self.by_bits, bits)
        } else {
            entry
        };
        (u32::from(entry >> 4), u32::from(entry & 15))
    }

    /// Bits and their number; `None` for a symbol that is not in the code.
    #[inline]
    pub fn encode(&self, symbol: u32) -> Option<(u32, u32)> {
        let found = self.by_symbol.get(symbol as usize).copied();
        found.filter(|(_, length)| *length > 0)
    }

    /// Bits that a symbol takes, `otherwise` if it is not in the code.
    #[inline]
    pub fn length(&self, symbol: u32, otherwise: u32) -> u32 {
        self.encode(symbol).map_or(otherwise, |(_, length)| length)
    }
}

/// The entry of the lowest bits; `N` is a power of two.
#[inline(always)]
fn lookup<const N: usize>(entries: &[u16; N], bits: u64) -> u16 {
    let low = bits & (N as u64 - 1);
    #[allow(clippy::cast_possible_truncation, reason = "less than N")]
    let entry = entries.get(low as usize).copied();
    entry.unwrap_or_default()
}

/// All codes.
pub(super) struct Codes {
    /// Step and mask, by [`super::state::State::place_context`].
    pub place: [Code; 17],
    /// Classes of a quad's residuals, by those of the group's last quad.
    pub sizes: [Code; 6],
    /// Widths of a first quad's dx, dy, cross and uv.
    pub first: [Code; 4],
    /// Widths of what no class holds.
    pub later: Code,
    /// Widths of a correction's start, slopes to the right, slopes down, and tilt.
    pub correction: [Code; 4],
    /// Level of the correction, by the records of the run.
    pub level: [Code; 4],
    /// Highest bit of the step to a run's primitive; and whether the draw is another.
    pub header: Code,
    /// Highest bit of a run's records.
    pub count: Code,
    /// Highest bit of how far back a first quad's parent is.
    pub parent: Code,
    /// Where a run starts, against where the last one did.
    pub start: Code,
}

/// Number of codes.
pub(super) const CODES: usize = 17 + 6 + 4 + 1 + 4 + 4 + 4;

static ALL: LazyLock<Codes> = LazyLock::new(|| Codes::new(&LENGTHS));

impl Codes {
    pub fn get() -> &'static Self {
        &ALL
    }

    pub fn new<S: AsRef<str>>(lengths: &[S; CODES]) -> Self {
        let mut left = (0..).zip(lengths);
        let mut next = || {
            let (number, lengths) = left.next().expect("a code for each of CODES");
            Code::new(number, lengths.as_ref())
        };
        Self {
            place: from_fn(|_| next()),
            sizes: from_fn(|_| next()),
            first: from_fn(|_| next()),
            later: next(),
            correction: from_fn(|_| next()),
            level: from_fn(|_| next()),
            header: next(),
            count: next(),
            parent: next(),
            start: next(),
        }
    }
}
