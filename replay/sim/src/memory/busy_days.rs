//! Which of the next cycles have events, one bit each: the index of a calendar queue.

/// One bit per day; cycles share a day if they are equal modulo the number of days.
#[derive(Clone, Debug)]
pub struct BusyDays {
    words: Vec<u64>,
}

impl BusyDays {
    /// No busy days. `days` is a power of two, at least 64.
    pub fn new(days: usize) -> Self {
        debug_assert!(days.is_power_of_two() && days >= 64);
        Self {
            words: vec![0; days / 64],
        }
    }

    /// Marks a day as busy.
    pub fn set(&mut self, day: usize) {
        self.words[day / 64] |= 1 << (day % 64);
    }

    /// Marks a day as free.
    pub fn clear(&mut self, day: usize) {
        self.words[day / 64] &= !(1 << (day % 64));
    }

    /// The first cycle from `start` on whose day is busy; all busy days belong to cycles from `start` on.
    pub fn first_from(&self, start: u64) -> Option<u64> {
        let words = self.words.len();
        let last_day = 64 * words - 1;
        let first = start as usize & last_day;
        // The first word is visited twice: from the first day on and, after wrapping around, up to it.
        for step in 0..=words {
            let index = (first / 64 + step) % words;
            let mut word = self.words[index];
            if step == 0 {
                word &= u64::MAX << (first % 64);
            }
            if word != 0 {
                let day = index * 64 + word.trailing_zeros() as usize;
                return Some(start + (day.wrapping_sub(first) & last_day) as u64);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_first_busy_day_is_that_of_a_search(
            start in 0_u64..1000, ahead in prop::collection::btree_set(0_u64..256, 0..8),
        ) {
            let mut busy = BusyDays::new(256);
            for day in &ahead {
                busy.set((start + day) as usize % 256);
            }
            prop_assert_eq!(busy.first_from(start), ahead.first().map(|day| start + day));
            if let Some(first) = ahead.first() {
                busy.clear((start + first) as usize % 256);
                prop_assert_eq!(busy.first_from(start), ahead.iter().nth(1).map(|day| start + day));
            }
        }
    }
}
