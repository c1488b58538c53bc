//! The texture-unit utilisation that the Z2 paper's own table implies for a pair of miss rates.

/// Texture-unit utilisation as a function of the miss rates, fitted to the 48 rows of the Z2 paper's table
/// 2 (mean absolute error 0.20 points, largest 0.65).
///
/// `l1_miss` is footprint misses over footprints, `l2_miss` line misses over line look-ups, both 0 to 1.
/// For comparison only: the cycle model does not use it.
pub fn closed_form(l1_miss: f64, l2_miss: f64) -> f64 {
    let any_l1_miss = 1.0 - (1.0 - l1_miss).powf(17.12);
    let any_l2_miss = 1.0 - (1.0 - l1_miss * l2_miss).powf(9.64);
    1.0 / (1.0 + 0.124 * (any_l1_miss - any_l2_miss) + 0.767 * any_l2_miss)
}

#[cfg(test)]
mod tests {
    use super::closed_form;

    #[test]
    fn the_closed_form_matches_the_papers_rows() {
        // Z2 paper table 2: L1 miss, L2 miss and utilisation in percent.
        for (l1, l2, utilization) in [
            (7.65, 52.07, 76.75),
            (16.14, 61.23, 66.12),
            (8.76, 54.81, 74.51),
            (2.52, 38.31, 90.83),
            (36.83, 74.60, 57.48),
            (35.48, 34.99, 62.68),
        ] {
            let found = 100.0 * closed_form(l1 / 100.0, l2 / 100.0);
            assert!(
                (found - utilization).abs() < 0.7,
                "{l1} {l2}: {found} not {utilization}"
            );
        }
    }

    #[test]
    fn without_misses_every_cycle_is_useful() {
        assert_eq!(closed_form(0.0, 0.7), 1.0);
    }
}
