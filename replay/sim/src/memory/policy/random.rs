//! Random replacement, seeded.

use super::{Geometry, Policy};

/// An xorshift generator.
pub(super) struct RandomReplacement {
    state: u64,
    ways: u32,
}

impl RandomReplacement {
    pub(super) fn new(geometry: Geometry) -> Self {
        Self {
            // Xorshift must not start at zero.
            state: geometry.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
            ways: geometry.ways,
        }
    }
}

impl Policy for RandomReplacement {
    fn fill(&mut self, _set: u32, _way: u32, _line: u32) {}

    fn victim(&mut self, _set: u32) -> u32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        // Uses the high bits, scaled, because the low bits of xorshift are weak.
        (((self.state >> 32) * u64::from(self.ways)) >> 32) as u32
    }
}
