//! Colour spaces of the error metrics: sRGB, CIE XYZ, CIELAB and the opponent space YCxCz.

/// Reciprocal of the D65 reference white in XYZ (FLIP's, from the sRGB primaries).
const INVERSE_WHITE: [f32; 3] = [1.052_156_9, 1.0, 0.918_357_7];

/// Linear value of an sRGB-encoded value, both 0 to 1.
pub fn linear_from_srgb(value: f32) -> f32 {
    if value > 0.04045 {
        ((value + 0.055) / 1.055).powf(2.4)
    } else {
        value / 12.92
    }
}

/// sRGB encoding of a linear value, clamped to 0..1; NaN becomes 0.
pub fn srgb_from_linear(value: f32) -> f32 {
    let value = if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    };
    if value > 0.003_130_8 {
        1.055 * value.powf(1.0 / 2.4) - 0.055
    } else {
        12.92 * value
    }
}

/// 8-bit sRGB code of a linear value.
pub fn srgb8_from_linear(value: f32) -> u8 {
    (srgb_from_linear(value) * 255.0 + 0.5) as u8
}

/// CIE XYZ of linear RGB with sRGB primaries.
pub fn xyz_from_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        0.412_386_56 * r + 0.357_591_49 * g + 0.180_450_49 * b,
        0.212_636_82 * r + 0.715_182_98 * g + 0.072_180_2 * b,
        0.019_330_62 * r + 0.119_197_16 * g + 0.950_372_6 * b,
    ]
}

/// Linear RGB of CIE XYZ.
pub fn linear_from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
}

/// Opponent space of FLIP's contrast sensitivity filters (achromatic, red-green, blue-yellow).
pub fn ycxcz_from_xyz(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_to_white(xyz);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Inverse of [`ycxcz_from_xyz`].
pub fn xyz_from_ycxcz([yy, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (yy + 16.0) / 116.0;
    let x = y + cx / 500.0;
    let z = y - cz / 200.0;
    [
        x / INVERSE_WHITE[0],
        y / INVERSE_WHITE[1],
        z / INVERSE_WHITE[2],
    ]
}

/// CIELAB of CIE XYZ.
pub fn lab_from_xyz(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| {
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let [x, y, z] = relative_to_white(xyz).map(f);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// XYZ over the white point.
fn relative_to_white(xyz: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| xyz[c] * INVERSE_WHITE[c])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_code_is_unchanged_by_decoding_and_encoding() {
        for code in 0..=255u8 {
            let linear = linear_from_srgb(f32::from(code) / 255.0);
            assert_eq!(srgb8_from_linear(linear), code);
        }
        assert_eq!(srgb8_from_linear(f32::NAN), 0);
        assert_eq!(srgb8_from_linear(7.0), 255);
    }

    #[test]
    fn opponent_space_and_xyz_are_inverse() {
        for rgb in [[0.2, 0.7, 0.1], [1.0, 1.0, 1.0], [0.0, 0.3, 0.9]] {
            let there = ycxcz_from_xyz(xyz_from_linear(rgb));
            let back = linear_from_xyz(xyz_from_ycxcz(there));
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 2e-5, "{rgb:?} {back:?}");
            }
        }
    }

    #[test]
    fn white_is_lightness_100_without_chroma() {
        let lab = lab_from_xyz(xyz_from_linear([1.0; 3]));
        assert!((lab[0] - 100.0).abs() < 1e-3, "{lab:?}");
        assert!(lab[1].abs() < 0.02 && lab[2].abs() < 0.02, "{lab:?}");
    }
}
