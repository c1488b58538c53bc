//! Half floats (IEEE 754 binary16), used for colours.

use half::f16;

/// The half float nearest to a value, ties to even; values out of range are clamped to the largest.
pub fn encode(value: f32) -> u16 {
    f16::from_f32(value.clamp(f16::MIN.into(), f16::MAX.into())).to_bits()
}

/// The value of a half float.
pub fn decode(half: u16) -> f32 {
    f16::from_bits(half).into()
}

/// A colour rounded as it will be read.
pub fn round3(color: [f32; 3]) -> [f32; 3] {
    color.map(|c| decode(encode(if c.is_nan() { 0.0 } else { c })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_is_unchanged_by_decoding_and_encoding() {
        for half in 0..=u16::MAX {
            let value = decode(half);
            if value.is_finite() {
                assert_eq!(encode(value), half, "{value}");
            }
        }
    }

    #[test]
    fn rounding_takes_the_nearest_half_and_ties_to_even() {
        for half in 0..0x7BFFu16 {
            let (low, high) = (decode(half), decode(half + 1));
            let middle = (low + high) / 2.0;
            let even = if half % 2 == 0 { half } else { half + 1 };
            assert_eq!(encode(middle), even);
            assert_eq!(encode(f32::from_bits(middle.to_bits() - 1)), half);
            assert_eq!(encode(f32::from_bits(middle.to_bits() + 1)), half + 1);
        }
    }

    #[test]
    fn values_out_of_range_become_the_largest() {
        assert_eq!(decode(encode(1e9)), 65504.0);
        assert_eq!(decode(encode(f32::NEG_INFINITY)), -65504.0);
        assert_eq!(round3([f32::NAN, 0.5, 2.0]), [0.0, 0.5, 2.0]);
    }
}
