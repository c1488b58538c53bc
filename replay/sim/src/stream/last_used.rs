//! Detects accesses that change nothing in any cache: those to the line that its set used last.
//!
//! Under every replacement policy, such a line is resident and its state stays the same. A set of a small
//! cache is a union of sets of a larger one, so an idle access is also idle with more sets. In every order,
//! the quads of a primitive in a tile are consecutive on one core, but their predecessors and successors
//! differ. Therefore only accesses within such a run are known to be idle.

/// The line that each set used last in the current run.
#[derive(Debug)]
pub(super) struct LastUsed {
    /// Number of the run in the upper half, line in the lower. A new number avoids clearing all sets.
    sets: Vec<u64>,
    run: u32,
}

impl LastUsed {
    /// For a cache with `sets` sets, a power of two.
    pub(super) fn new(sets: u32) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            sets: vec![0; sets as usize],
            run: 0,
        }
    }

    /// Starts a run, in which no set has been used yet.
    pub(super) fn begin(&mut self) {
        self.run = self.run.wrapping_add(1);
        if self.run == 0 {
            // Run numbers wrap around, so entries with old numbers are cleared.
            self.sets.fill(0);
            self.run = 1;
        }
    }

    /// Uses a line. Returns true if its set used it last.
    #[inline(always)]
    pub(super) fn uses_again(&mut self, line: u32) -> bool {
        let set = line as usize & (self.sets.len() - 1);
        let new = u64::from(self.run) << 32 | u64::from(line);
        std::mem::replace(&mut self.sets[set], new) == new
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_line_is_idle_if_it_was_the_last_of_its_set_in_the_run(
            runs in prop::collection::vec(prop::collection::vec(0_u32..24, 0..40), 1..5),
        ) {
            // Starts near the largest run number, so that numbers wrap around.
            let mut last = LastUsed::new(4);
            last.run = u32::MAX - 1;
            for run in &runs {
                last.begin();
                for (index, line) in run.iter().enumerate() {
                    let before = run[..index].iter().rev().find(|other| *other % 4 == line % 4);
                    prop_assert_eq!(last.uses_again(*line), before == Some(line));
                }
            }
        }
    }
}
