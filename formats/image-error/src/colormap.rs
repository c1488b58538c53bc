//! Colours of error maps.

/// Matplotlib's magma at 17 equidistant points; interpolation deviates by at most 2/255 from the full
/// table.
const MAGMA: [[u8; 3]; 17] = [
    [0, 0, 4],
    [10, 8, 34],
    [29, 17, 70],
    [54, 16, 106],
    [80, 18, 124],
    [105, 28, 129],
    [130, 38, 129],
    [156, 46, 127],
    [182, 55, 121],
    [207, 65, 112],
    [230, 81, 99],
    [245, 105, 92],
    [251, 135, 97],
    [254, 165, 113],
    [254, 195, 135],
    [253, 224, 162],
    [252, 253, 191],
];

/// Magma colour of a value, clamped to 0..1: black for no error, pale yellow for 1.
pub fn magma(value: f32) -> [u8; 3] {
    let last = MAGMA.len() - 1;
    let value = if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    };
    let at = value * last as f32;
    let low = (at as usize).min(last - 1);
    let share = at - low as f32;
    std::array::from_fn(|c| {
        let (a, b) = (f32::from(MAGMA[low][c]), f32::from(MAGMA[low + 1][c]));
        (a + (b - a) * share).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_get_lighter_with_the_error() {
        let sum = |v: f32| magma(v).iter().map(|&c| u32::from(c)).sum::<u32>();
        let values: Vec<u32> = (0..=50).map(|i| sum(i as f32 / 50.0)).collect();
        assert!(values.windows(2).all(|w| w[1] > w[0]), "{values:?}");
        assert_eq!(magma(f32::NAN), MAGMA[0]);
        assert_eq!(magma(2.0), MAGMA[16]);
    }

    #[test]
    fn the_table_is_within_two_codes_of_the_reference_table() {
        let table = nv_flip::magma_lut().to_vec();
        for (i, reference) in table.chunks_exact(3).enumerate() {
            let ours = magma(i as f32 / 255.0);
            for c in 0..3 {
                assert!(
                    ours[c].abs_diff(reference[c]) <= 3,
                    "{i}: {ours:?} {reference:?}"
                );
            }
        }
    }
}
