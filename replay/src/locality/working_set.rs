//! Working sets (Denning 1968) by tiles: how many distinct lines a stretch of tiles uses, on average
//! over all stretches of a length.
//!
//! The mean over all stretches follows from the gaps between the uses of a line (Denning & Schwartz
//! 1972), so a pass that counts gaps answers all lengths. Gaps are counted in bins that end at powers
//! of two, each with its sum, so lengths that are powers of two are exact.

use super::last_use::{LastUse, Span};
use super::place::TileOfEye;

/// Bins up to 2^32.
const BINS: usize = 33;

/// How many numbers up to a power of two, and their sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Bin {
    count: u64,
    sum: u64,
}

#[derive(Clone, Copy, Debug)]
struct Bins([Bin; BINS]);

impl Default for Bins {
    fn default() -> Self {
        Self([Bin::default(); BINS])
    }
}

impl Bins {
    fn add(&mut self, number: u32) {
        // The first power of two that is not less.
        let bin = u64::from(number).next_power_of_two().ilog2() as usize;
        self.0[bin].count += 1;
        self.0[bin].sum += u64::from(number);
    }

    /// Numbers up to 2^power: how many, and their sum.
    fn up_to(&self, power: usize) -> Bin {
        self.0[..=power]
            .iter()
            .fold(Bin::default(), |all, bin| Bin {
                count: all.count + bin.count,
                sum: all.sum + bin.sum,
            })
    }
}

/// The gaps between the uses of the lines that something uses.
#[derive(Clone, Debug, Default)]
struct Gaps {
    firsts: Bins,
    gaps: Bins,
    /// Tiles beyond the first of the items of all uses.
    beyond: u64,
}

impl Gaps {
    /// A line that was used in `before` is used in `now`, a later item.
    #[inline(always)]
    fn used(&mut self, before: Span, now: Span) {
        if before.is_none() {
            self.firsts.add(now.first());
        } else {
            self.gap(before, now.first());
        }
    }

    /// A line was used last in `last`; the clock stopped at `tiles`.
    fn ended(&mut self, last: Span, tiles: u32) {
        if !last.is_none() {
            self.gap(last, tiles + 1);
        }
    }

    fn gap(&mut self, before: Span, next: u32) {
        // A stretch sees the use from the item's first tile until the stretch begins behind its
        // last one.
        self.gaps.add(next - before.first() - before.beyond());
        self.beyond += u64::from(before.beyond());
    }

    /// Distinct lines of every stretch of 2^power tiles, summed over the stretches.
    fn lines(&self, power: usize) -> u64 {
        let length = 1_u64 << power;
        let short = self.gaps.up_to(power);
        let all = self.gaps.up_to(BINS - 1);
        let seen = short.sum + (all.count - short.count) * length + self.beyond;
        // Stretches that would begin before the first tile.
        let early = self.firsts.up_to(power);
        seen - (early.count * length - early.sum)
    }
}

/// Distinct lines of all stretches of a length. The means are these over `stretches`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkingSet {
    /// Length of the stretches in tiles.
    pub tiles: u64,
    /// Number of stretches.
    pub stretches: u64,
    /// Lines that any tile of the stretch uses.
    pub lines: u64,
    /// Lines that the left eye's tiles use, and the right eye's.
    pub lines_of_eye: [u64; 2],
    /// Lines that tiles of either eye use.
    pub lines_of_either: u64,
}

impl WorkingSet {
    /// Lines that tiles of both eyes use.
    #[must_use]
    pub fn lines_of_both(&self) -> u64 {
        self.lines_of_eye[0] + self.lines_of_eye[1] - self.lines_of_either
    }

    /// Adds the stretches of another core.
    pub(super) fn add(&mut self, other: &Self) {
        self.stretches += other.stretches;
        self.lines += other.lines;
        self.lines_of_either += other.lines_of_either;
        for (lines, other) in self.lines_of_eye.iter_mut().zip(other.lines_of_eye) {
            *lines += other;
        }
    }
}

/// The gaps of each kind that is counted apart.
#[derive(Clone, Debug, Default)]
pub(super) struct WorkingSets {
    any: Gaps,
    eyes: [Gaps; 2],
    either: Gaps,
}

impl WorkingSets {
    /// A line is used at a place in an item that are not both those of its last use.
    pub(super) fn used(&mut self, last: &mut LastUse, here: TileOfEye, now: Span) {
        if last.span < now {
            self.any.used(last.span, now);
            last.span = now;
        }
        let Some(eye) = here.eye() else { return };
        let [left, right] = last.span_of_eye;
        if left.max(right) < now {
            self.either.used(left.max(right), now);
        }
        if last.span_of_eye[eye] < now {
            self.eyes[eye].used(last.span_of_eye[eye], now);
            last.span_of_eye[eye] = now;
        }
    }

    /// The stream is over: this was the last use of a line, and the clock stopped at `tiles`.
    pub(super) fn ended(&mut self, last: &LastUse, tiles: u32) {
        let [left, right] = last.span_of_eye;
        self.any.ended(last.span, tiles);
        self.either.ended(left.max(right), tiles);
        for (gaps, span) in self.eyes.iter_mut().zip([left, right]) {
            gaps.ended(span, tiles);
        }
    }

    /// Every length that is a power of two and fits into `tiles`.
    pub(super) fn curve(&self, tiles: u32) -> Vec<WorkingSet> {
        let lengths = (0..32).take_while(|power| 1 << power <= u64::from(tiles));
        lengths
            .map(|power| WorkingSet {
                tiles: 1 << power,
                stretches: u64::from(tiles) + 1 - (1 << power),
                lines: self.any.lines(power),
                lines_of_eye: self.eyes.each_ref().map(|gaps| gaps.lines(power)),
                lines_of_either: self.either.lines(power),
            })
            .collect()
    }
}
