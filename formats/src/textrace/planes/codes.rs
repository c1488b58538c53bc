//! Canonical prefix codes, built from the lengths in [`super::lengths`].
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::lengths::LENGTHS;
use super::mode::Mode;
use super::residual::NOISES;
use super::widths::{CORRECTION, Choices, DX_AND_UV, DY_AND_CROSS};
use crate::varint::low_u32;
use std::sync::{LazyLock, OnceLock};

/// Maximum length of a code.
pub(super) const MOST_BITS: u32 = 10;
const ENTRIES: usize = 1 << MOST_BITS;
/// A prefix code, for both directions.
pub(super) struct Code {
    /// Its index in [`LENGTHS`].
    #[cfg_attr(not(test), expect(dead_code, reason = "training counts by it"))]
    pub number: usize,
    /// By the next [`MOST_BITS`] bits: symbol * 16 + length.
    by_bits: [u16; ENTRIES],
    /// By symbol: the bits in writing order, lowest first, and their number (0: not in the code).
    by_symbol: Vec<(u32, u32)>,
}

impl Code {
    /// Builds a code from the length of each symbol, one hexadecimal digit each, 0 for none.
    pub fn new(number: usize, lengths: &str) -> Self {
        let lengths: Vec<u32> = lengths.chars().filter_map(|c| c.to_digit(16)).collect();
        let mut by_bits = [0; ENTRIES];
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
        Self {
            number,
            by_bits,
            by_symbol,
        }
    }

    /// Decodes the code at the start of the bits: symbol and length.
    #[inline(always)]
    pub fn decode(&self, bits: u64) -> (u32, u32) {
        let low = bits & (ENTRIES as u64 - 1);
        #[allow(clippy::cast_possible_truncation, reason = "less than ENTRIES")]
        let entry = self.by_bits.get(low as usize).copied().unwrap_or_default();
        (u32::from(entry >> 4), u32::from(entry & 15))
    }

    /// The bits of a symbol and their number; `None` for a symbol that is not in the code.
    #[inline]
    pub fn encode(&self, symbol: u32) -> Option<(u32, u32)> {
        let found = self.by_symbol.get(symbol as usize).copied();
        found.filter(|(_, length)| *length > 0)
    }

    /// Number of bits of a symbol, `otherwise` if it is not in the code.
    #[inline]
    pub fn length(&self, symbol: u32, otherwise: u32) -> u32 {
        self.encode(symbol).map_or(otherwise, |(_, length)| length)
    }
}

/// Maximum number of codes in a family.
const MOST_CONTEXTS: usize = 32;

/// Codes that are selected by a context.
pub(super) struct Family {
    pub codes: Vec<Code>,
    /// [`Code::by_bits`] of all codes, concatenated.
    by_bits: Box<[u16; MOST_CONTEXTS << MOST_BITS]>,
}

impl Family {
    fn new(codes: Vec<Code>) -> Self {
        let mut by_bits: Vec<u16> = codes.iter().flat_map(|code| code.by_bits).collect();
        by_bits.resize(MOST_CONTEXTS << MOST_BITS, 0);
        let by_bits = by_bits.try_into();
        Self {
            codes,
            by_bits: by_bits.expect("it has this size now"),
        }
    }

    /// Decodes the code at the start of the bits: symbol and length; (0, 0) if the context has no code.
    #[inline(always)]
    pub fn decode(&self, context: usize, bits: u64) -> (u32, u32) {
        let low = low_u32(bits) as usize & (ENTRIES - 1);
        let at = (context % MOST_CONTEXTS) << MOST_BITS | low;
        // The index is always in range, which lets the compiler remove the check.
        let entry = self.by_bits.get(at).copied().unwrap_or_default();
        (u32::from(entry >> 4), u32::from(entry & 15))
    }
}

/// All codes.
pub(super) struct Codes {
    /// Step and mask, by [`super::places::Last::context`].
    pub place: Family,
    /// Classes of a quad's residuals, by [`sizes_context`].
    pub sizes: Family,
    /// Widths of a first quad's dx and uv.
    pub first: Code,
    /// Widths of its dy and cross, by [`rest_context`].
    pub rest: Family,
    /// Widths of pairs that are in no class.
    pub later: Code,
    /// Widths of a correction's start, slopes to the right, slopes down, and tilt.
    pub correction: Code,
    /// Mode and level, by [`super::parents::level_context`]; not coded in its first context.
    pub level: Family,
    /// Highest bit of the step to a run's primitive, and whether the draw changes.
    pub header: Code,
    /// Highest bit of a run's number of records.
    pub count: Code,
    /// Highest bit of the distance to a first quad's parent.
    pub parent: Code,
    /// Start of a run, XOR the start of the run before.
    pub start: Code,
    choices: OnceLock<WidthChoices>,
}

/// The encoder's choice of symbols for widths.
pub(super) struct WidthChoices {
    pub first: Choices<2>,
    /// By [`rest_context`].
    pub rest: Vec<Choices<2>>,
    pub correction: Choices<4>,
}

/// Number of codes for step and mask.
const PLACES: usize = 17;
/// Number of codes for classes.
const SIZES: usize = NOISES * Mode::ALL.len();
/// Number of codes for a first quad's dy and cross. Wider dx are rare and use the last code.
const RESTS: usize = 6;
/// Number of codes for mode and level.
const LEVELS: usize = 4;
/// Total number of codes.
pub(super) const CODES: usize = PLACES + SIZES + 1 + RESTS + 1 + 1 + LEVELS + 4;

/// Index of the code for the classes of a quad's residuals.
#[inline(always)]
pub(super) fn sizes_context(mode: Mode, noise: usize) -> usize {
    mode as usize * NOISES + noise
}

/// Number of contexts of [`rest_context`].
const REST_CONTEXTS: usize = 8;

/// Index of the code for the widths of a first quad's dy and cross, by the symbol of dx and uv.
#[inline(always)]
pub(super) fn rest_context(first: u32) -> usize {
    (first >> 2 & 7) as usize
}

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
            place: Family::new((0..PLACES).map(|_| next()).collect()),
            sizes: Family::new((0..SIZES).map(|_| next()).collect()),
            first: next(),
            rest: Family::new({
                let mut codes: Vec<Code> = (0..RESTS).map(|_| next()).collect();
                let last = &lengths[PLACES + SIZES + RESTS];
                codes.resize_with(REST_CONTEXTS, || {
                    Code::new(PLACES + SIZES + RESTS, last.as_ref())
                });
                codes
            }),
            later: next(),
            correction: next(),
            level: Family::new((0..LEVELS).map(|_| next()).collect()),
            header: next(),
            count: next(),
            parent: next(),
            start: next(),
            choices: OnceLock::new(),
        }
    }

    /// Used only by the encoder.
    pub fn choices(&self) -> &WidthChoices {
        self.choices.get_or_init(|| WidthChoices {
            first: Choices::new(&self.first, DX_AND_UV),
            rest: self
                .rest
                .codes
                .iter()
                .map(|code| Choices::new(code, DY_AND_CROSS))
                .collect(),
            correction: Choices::new(&self.correction, CORRECTION),
        })
    }
}
