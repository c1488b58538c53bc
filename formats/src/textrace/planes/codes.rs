//! Prefix codes: canonical, from the lengths in [`super::lengths`].
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::lengths::LENGTHS;
use super::mode::Mode;
use super::residual::NOISES;
use super::widths::{CORRECTION, Choices, DX_AND_UV, DY_AND_CROSS};
use crate::varint::low_u32;
use std::sync::{LazyLock, OnceLock};

/// Longest code.
pub(super) const MOST_BITS: u32 = 10;
const ENTRIES: usize = 1 << MOST_BITS;
/// A prefix code, for both directions.
pub(super) struct Code {
    /// Its place in [`LENGTHS`].
    #[cfg_attr(not(test), expect(dead_code, reason = "training counts by it"))]
    pub number: usize,
    /// By the next [`MOST_BITS`] bits: symbol * 16 + length.
    by_bits: [u16; ENTRIES],
    /// By symbol: bits as they are written, lowest first, and their number (0: not in the code).
    by_symbol: Vec<(u32, u32)>,
}

impl Code {
    /// From the length of each symbol's code, a hexadecimal digit each, 0 for none.
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

    /// Symbol and length of the code that the bits start with.
    #[inline(always)]
    pub fn decode(&self, bits: u64) -> (u32, u32) {
        let low = bits & (ENTRIES as u64 - 1);
        #[allow(clippy::cast_possible_truncation, reason = "less than ENTRIES")]
        let entry = self.by_bits.get(low as usize).copied().unwrap_or_default();
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

/// Most codes of a family.
const MOST_CONTEXTS: usize = 32;

/// Codes of which a context chooses one.
pub(super) struct Family {
    pub codes: Vec<Code>,
    /// [`Code::by_bits`] of each, one after the other.
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

    /// Symbol and length of the code that the bits start with; (0, 0) where the context has no code.
    #[inline(always)]
    pub fn decode(&self, context: usize, bits: u64) -> (u32, u32) {
        let low = low_u32(bits) as usize & (ENTRIES - 1);
        let at = (context % MOST_CONTEXTS) << MOST_BITS | low;
        // Never beyond the end, which the compiler sees.
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
    /// Widths of what no class holds.
    pub later: Code,
    /// Widths of a correction's start, slopes to the right, slopes down, and tilt.
    pub correction: Code,
    /// Mode and level, by [`super::parents::level_context`]; nothing tells them in its first one.
    pub level: Family,
    /// Highest bit of the step to a run's primitive; and whether the draw is another.
    pub header: Code,
    /// Highest bit of a run's records.
    pub count: Code,
    /// Highest bit of how far back a first quad's parent is.
    pub parent: Code,
    /// Where a run starts, against where the last one did.
    pub start: Code,
    choices: OnceLock<WidthChoices>,
}

/// Which symbols the encoder chooses to tell widths.
pub(super) struct WidthChoices {
    pub first: Choices<2>,
    /// By [`rest_context`].
    pub rest: Vec<Choices<2>>,
    pub correction: Choices<4>,
}

/// Codes of step and mask.
const PLACES: usize = 17;
/// Codes of classes.
const SIZES: usize = NOISES * Mode::ALL.len();
/// Codes of a first quad's dy and cross; wider dx than the last one's are few, and have that one.
const RESTS: usize = 6;
/// Codes of mode and level.
const LEVELS: usize = 4;
/// Number of codes.
pub(super) const CODES: usize = PLACES + SIZES + 1 + RESTS + 1 + 1 + LEVELS + 4;

/// Which code tells the classes of a quad's residuals.
#[inline(always)]
pub(super) fn sizes_context(mode: Mode, noise: usize) -> usize {
    mode as usize * NOISES + noise
}

/// Contexts that [`rest_context`] gives.
const REST_CONTEXTS: usize = 8;

/// Which code tells the widths of a first quad's dy and cross, by the symbol of the other two.
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

    /// For the encoder alone.
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
