//! Peak signal-to-noise ratio of 8-bit pictures.

use crate::Picture;

/// Value for identical pictures, whose ratio is infinite (JSON has no infinity).
pub const IDENTICAL_DB: f64 = 100.0;

/// `10 log10(255^2 / MSE)` over all pixels and channels, at most [`IDENTICAL_DB`].
pub fn psnr_db(reference: &Picture, test: &Picture) -> f64 {
    let channels = |p: &Picture| 3 * p.pixels.len();
    let count = channels(reference).min(channels(test));
    let squares: u64 = reference
        .pixels
        .iter()
        .flatten()
        .zip(test.pixels.iter().flatten())
        .map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2))
        .sum();
    psnr_of_squares(squares, count)
}

/// Ratio over several pictures of the same size, from their ratios: the decibels of the mean squared error.
/// A mean of decibels would hide a bad picture among identical ones.
pub fn pooled_db(of_pictures: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut pictures) = (0.0, 0_u32);
    for db in of_pictures {
        pictures += 1;
        if db < IDENTICAL_DB {
            sum += 10.0_f64.powf(-db / 10.0);
        }
    }
    if sum == 0.0 {
        return IDENTICAL_DB;
    }
    (-10.0 * (sum / f64::from(pictures)).log10()).min(IDENTICAL_DB)
}

/// The ratio from the sum of squared differences of 8-bit codes and the number of codes.
pub(crate) fn psnr_of_squares(squares: u64, count: usize) -> f64 {
    if squares == 0 || count == 0 {
        return IDENTICAL_DB;
    }
    let mean_square = squares as f64 / count as f64;
    (10.0 * (255.0 * 255.0 / mean_square).log10()).min(IDENTICAL_DB)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::noise;

    #[test]
    fn one_code_of_difference_everywhere_is_48_db() {
        let a = Picture::filled([4, 4], [10; 3]);
        let b = Picture::filled([4, 4], [11; 3]);
        assert!((psnr_db(&a, &b) - 48.1308).abs() < 1e-4);
    }

    #[test]
    fn the_ratio_over_several_pictures_is_that_of_one_picture_with_all_their_pixels() {
        let [a, b] = [noise([8, 8], 1), noise([8, 8], 2)];
        let join = |x: &Picture, y: &Picture| Picture {
            size_px: [8, 16],
            pixels: [x.pixels.clone(), y.pixels.clone()].concat(),
        };
        for (first, second) in [(&a, &b), (&a, &a), (&b, &a)] {
            // The second of two pictures may be identical.
            let whole = psnr_db(&join(&a, &a), &join(first, second));
            let pooled = pooled_db([psnr_db(&a, first), psnr_db(&a, second)]);
            assert!((whole - pooled).abs() < 1e-9, "{whole} {pooled}");
        }
        assert_eq!(pooled_db([]), IDENTICAL_DB);
    }

    #[test]
    fn identical_pictures_have_the_cap() {
        let a = noise([9, 7], 3);
        assert_eq!(psnr_db(&a, &a), IDENTICAL_DB);
    }
}
