//! Working sets (Denning 1968) over tiles: the distinct lines in a window of tiles, averaged over all
//! windows of a length.
//!
//! The mean over all windows follows from the gaps between uses of a line (Denning & Schwartz 1972), so one
//! pass that counts gaps answers all lengths. Gaps are counted in bins that end at powers of two, each with
//! its sum, so lengths that are powers of two are exact.

use crate::last_use::{LastUse, Span};
use crate::place::TileOfEye;

/// Bins up to 2^32.
const BINS: usize = 33;

/// Count and sum of the numbers in a bin.
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
        // The smallest power of two that is not less.
        let bin = u64::from(number).next_power_of_two().ilog2() as usize;
        self.0[bin].count += 1;
        self.0[bin].sum += u64::from(number);
    }

    /// Count and sum of the numbers up to 2^power.
    fn up_to(&self, power: usize) -> Bin {
        self.0[..=power]
            .iter()
            .fold(Bin::default(), |all, bin| Bin {
                count: all.count + bin.count,
                sum: all.sum + bin.sum,
            })
    }
}

/// The gaps between uses of a set of lines.
#[derive(Clone, Debug, Default)]
struct Gaps {
    firsts: Bins,
    gaps: Bins,
    /// Tiles after the first, summed over the items of all uses.
    beyond: u64,
}

impl Gaps {
    /// Adds a use in `now` of a line last used in the earlier item `before`.
    #[inline(always)]
    fn used(&mut self, before: Span, now: Span) {
        if before.is_none() {
            self.firsts.add(now.first());
        } else {
            self.gap(before, now.first());
        }
    }

    /// Ends a line last used in `last`, with the clock at `tiles`.
    fn ended(&mut self, last: Span, tiles: u32) {
        if !last.is_none() {
            self.gap(last, tiles + 1);
        }
    }

    fn gap(&mut self, before: Span, next: u32) {
        // A window contains the use from the item's first tile until the window starts after the item's last tile.
        self.gaps.add(next - before.first() - before.beyond());
        self.beyond += u64::from(before.beyond());
    }

    /// Distinct lines of every window of 2^power tiles, summed over the windows.
    fn lines(&self, power: usize) -> u64 {
        let length = 1_u64 << power;
        let short = self.gaps.up_to(power);
        let all = self.gaps.up_to(BINS - 1);
        let seen = short.sum + (all.count - short.count) * length + self.beyond;
        // Windows that would start before the first tile.
        let early = self.firsts.up_to(power);
        seen - (early.count * length - early.sum)
    }
}

/// Distinct lines of all windows of a length. Means are these over `stretches`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkingSet {
    /// Length of the windows in tiles.
    pub tiles: u64,
    /// Number of windows.
    pub stretches: u64,
    /// Lines that any tile of the window uses.
    pub lines: u64,
    /// Lines that tiles of the left and of the right eye use.
    pub lines_of_eye: [u64; 2],
    /// Lines that tiles of either eye use.
    pub lines_of_either: u64,
}

impl WorkingSet {
    /// Lines that tiles of both eyes use.
    pub fn lines_of_both(&self) -> u64 {
        self.lines_of_eye[0] + self.lines_of_eye[1] - self.lines_of_either
    }

    /// Adds the windows of another core.
    pub(crate) fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, stretches, lines, lines_of_either);
        for (lines, other) in self.lines_of_eye.iter_mut().zip(other.lines_of_eye) {
            *lines += other;
        }
    }
}

/// The gaps of each class of uses.
#[derive(Clone, Debug, Default)]
pub(crate) struct WorkingSets {
    any: Gaps,
    eyes: [Gaps; 2],
    either: Gaps,
}

impl WorkingSets {
    /// Processes a use whose tile or item differs from the last use.
    pub(crate) fn used(&mut self, last: &mut LastUse, here: TileOfEye, now: Span) {
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

    /// Ends the stream for a line, with the clock at `tiles`.
    pub(crate) fn ended(&mut self, last: &LastUse, tiles: u32) {
        let [left, right] = last.span_of_eye;
        self.any.ended(last.span, tiles);
        self.either.ended(left.max(right), tiles);
        for (gaps, span) in self.eyes.iter_mut().zip([left, right]) {
            gaps.ended(span, tiles);
        }
    }

    /// Every length that is a power of two and at most `tiles`.
    pub(crate) fn curve(&self, tiles: u32) -> Vec<WorkingSet> {
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
