//! Half floats (IEEE 754 binary16), in which colours are stored.

/// The half float nearest to a value, ties to even; values beyond its range become its largest.
#[must_use]
pub fn encode(value: f32) -> u16 {
    const LARGEST: f32 = 65504.0;
    let bits = value.clamp(-LARGEST, LARGEST).to_bits();
    let sign = ((bits >> 16) & 0x8000) as u16;
    let magnitude = bits & 0x7FFF_FFFF;
    if magnitude > 0x7F80_0000 {
        return sign | 0x7E00;
    }
    // Below 2^-14 a half is a multiple of 2^-24: adding 0.5 makes f32 round to just that.
    if magnitude < 0x3880_0000 {
        let aligned = f32::from_bits(magnitude) + 0.5;
        return sign | (aligned.to_bits() - 0.5f32.to_bits()) as u16;
    }
    let odd = (magnitude >> 13) & 1;
    let rounded = magnitude + 0x0FFF + odd;
    sign | ((rounded - 0x3800_0000) >> 13) as u16
}

/// The value of a half float.
#[must_use]
pub fn decode(half: u16) -> f32 {
    let sign = u32::from(half & 0x8000) << 16;
    let exponent = u32::from(half >> 10) & 0x1F;
    let mantissa = u32::from(half & 0x3FF);
    let magnitude = match exponent {
        0 => (mantissa as f32 / (1u32 << 24) as f32).to_bits(),
        31 => 0x7F80_0000 | mantissa << 13,
        _ => (exponent + 112) << 23 | mantissa << 13,
    };
    f32::from_bits(sign | magnitude)
}

/// A colour as it will be read back.
#[must_use]
pub fn round3(color: [f32; 3]) -> [f32; 3] {
    color.map(|c| decode(encode(if c.is_nan() { 0.0 } else { c })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_survives_both_ways() {
        for half in 0..=u16::MAX {
            let value = decode(half);
            if value.is_finite() {
                assert_eq!(encode(value), half, "{value}");
            }
        }
    }

    #[test]
    fn rounding_takes_the_nearest_half_and_the_even_one_of_two() {
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
    fn values_beyond_the_range_become_the_largest() {
        assert_eq!(decode(encode(1e9)), 65504.0);
        assert_eq!(decode(encode(f32::NEG_INFINITY)), -65504.0);
        assert_eq!(round3([f32::NAN, 0.5, 2.0]), [0.0, 0.5, 2.0]);
    }
}
