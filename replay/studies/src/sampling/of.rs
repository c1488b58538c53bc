//! The figures that a sample of frames can answer for.

use super::estimate::Pair;
use super::values::FrameCounts;
use clap::ValueEnum;

/// A figure of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Of {
    /// External bytes saved over the baseline order, %.
    Saving,
    /// External bytes per frame.
    Bytes,
    /// Footprints that miss in the L1, %.
    L1Misses,
    /// Line look-ups that miss in the L2, %.
    L2Misses,
    /// Cycles per frame (timed mode).
    Cycles,
}

impl Of {
    /// Whether the figure is a share, which is shown in percent and promised in points.
    pub const fn is_share(self) -> bool {
        matches!(self, Self::Saving | Self::L1Misses | Self::L2Misses)
    }

    /// What the figure is multiplied by to be shown.
    pub const fn scale(self) -> f64 {
        if self.is_share() { 100.0 } else { 1.0 }
    }

    /// Numerator and denominator in a frame, from its counts and those of the baseline order.
    pub fn pair(self, frame: &FrameCounts, baseline: &FrameCounts) -> Pair {
        let [a, b] = match self {
            // Of the saving, the ratio that is left: both of its totals are positive.
            Self::Saving => [frame.external_bytes, baseline.external_bytes],
            Self::Bytes => [frame.external_bytes, 1],
            Self::L1Misses => [frame.l1_footprint_misses, frame.footprints],
            Self::L2Misses => [frame.l2_line_misses, frame.l2_line_lookups],
            Self::Cycles => [frame.cycles, 1],
        };
        [a as f64, b as f64]
    }
}
