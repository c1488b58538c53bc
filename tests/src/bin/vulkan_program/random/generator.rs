//! A seeded generator of numbers.

use formats::random::Random;

pub struct Generator(Random);

impl Generator {
    pub fn new(seed: u64) -> Self {
        Self(Random(seed))
    }

    /// A number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.0.bits() % end as u64) as usize
    }

    /// True once in `times` calls.
    pub fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// A number from 0 to 1.
    pub fn unit(&mut self) -> f32 {
        self.below(1 << 16) as f32 / 65536.0
    }

    /// One of the elements.
    pub fn pick<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        match of.len() {
            0 => None,
            count => Some(&of[self.below(count)]),
        }
    }

    /// A generator that is independent of this one.
    pub fn split(&mut self) -> Self {
        Self::new(self.0.bits())
    }
}
