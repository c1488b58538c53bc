//! Reproducible pseudo-random numbers.

/// SplitMix64 (Steele, Lea and Flood 2014), constructed from its seed.
///
/// Built-in scenes, tile orders and results follow from this sequence, so it does not change.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// An integer from 0 to `end - 1`; 0 if `end` is not positive.
    #[inline]
    pub fn below<N: TryFrom<u64> + TryInto<u64> + Default>(&mut self, end: N) -> N {
        let end: u64 = end.try_into().unwrap_or(0);
        let scaled = (u128::from(self.bits()) * u128::from(end)) >> 64;
        N::try_from(scaled as u64).unwrap_or_default()
    }

    /// One of the items.
    ///
    /// # Panics
    /// If there are none.
    pub fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// A number from 0 up to but not including 1, in steps of 2^-24.
    #[inline]
    pub fn unit_f32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1_u32 << 24) as f32
    }

    /// A number from 0 up to but not including 1, in steps of 2^-53.
    #[inline]
    pub fn unit_f64(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A source of numbers as of [`Random::unit_f32`].
pub fn units(seed: u64) -> impl FnMut() -> f32 {
    let mut random = Random(seed);
    move || random.unit_f32()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_of_seed_1234567_is_the_published_one() {
        let mut random = Random(1_234_567);
        assert_eq!(
            [0; 3].map(|_| random.bits()),
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423
            ]
        );
    }

    #[test]
    fn numbers_stay_in_range() {
        let mut random = Random(0);
        for end in 1..200_u8 {
            assert!(random.below(end) < end);
            assert!((0.0..1.0).contains(&random.unit_f32()));
            assert!((0.0..1.0).contains(&random.unit_f64()));
        }
        assert_eq!(random.below(0_usize), 0);
    }
}
