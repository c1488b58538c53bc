//! Accesses that change nothing in any cache: to the line that its set used last.
//!
//! Whatever the replacement policy, such a line is there, and where it stands in its set stays as it is. The lines
//! of a set are those of several sets of a larger cache, so what holds for so many sets holds for more.
//! Quads of a primitive in a tile follow each other on one core in every order; before and after them
//! orders differ. So only accesses within such a run are known to be idle.

/// The line that each set of a cache used last in the run at hand.
#[derive(Debug)]
pub(super) struct LastUsed {
    /// The run, in the upper half, and the line. A run begins without clearing all sets.
    sets: Vec<u64>,
    run: u32,
}

impl LastUsed {
    /// For a cache of so many sets, a power of two.
    pub(super) fn new(sets: u32) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            sets: vec![0; sets as usize],
            run: 0,
        }
    }

    /// A run begins: nothing is known of what was used last.
    pub(super) fn begin(&mut self) {
        self.run = self.run.wrapping_add(1);
        if self.run == 0 {
            // Numbers start again: what was written with them is forgotten.
            self.sets.fill(0);
            self.run = 1;
        }
    }

    /// Uses a line. True if its set used it last.
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
        fn a_line_is_idle_where_it_was_the_last_of_its_set_in_the_run(
            runs in prop::collection::vec(prop::collection::vec(0_u32..24, 0..40), 1..5),
        ) {
            // Runs' numbers start again.
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
