//! The sRGB transfer function (IEC 61966-2-1).

use std::sync::LazyLock;

/// Linear value of each encoded byte.
pub static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| decode(byte as f64 / 255.0) as f32));

/// Linear value of an encoded value, both 0 to 1.
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// [`decode`] in single precision throughout. Its last bit differs for some values; golden ray
/// traces depend on material factors decoded this way.
pub fn decode_f32(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Encoded value of a linear value, both 0 to 1.
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Steps of the inverse table: fine enough that the steepest part, near black, is off by at most
/// 0.05 of a byte.
const FROM_LINEAR_STEPS: usize = 1 << 16;

static FROM_LINEAR: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=FROM_LINEAR_STEPS)
        .map(|i| (encode(i as f64 / FROM_LINEAR_STEPS as f64) * 255.0).round() as u8)
        .collect()
});

/// Encoded byte of a linear value from 0 to 1.
pub fn encode_byte(linear: f32) -> u8 {
    FROM_LINEAR[(linear.clamp(0.0, 1.0) * FROM_LINEAR_STEPS as f32 + 0.5) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for byte in 0..=255u8 {
            let linear = LINEAR[usize::from(byte)];
            assert_eq!((encode(linear.into()) * 255.0).round() as u8, byte);
            assert_eq!(encode_byte(linear), byte);
        }
        assert_eq!([LINEAR[0], LINEAR[255]], [0.0, 1.0]);
    }
}
