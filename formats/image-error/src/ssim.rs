//! Structural similarity (Wang et al. 2004) of the luma of two pictures.

use crate::Picture;
use rayon::prelude::*;

const WINDOW_RADIUS: usize = 5;
const WINDOW_DEVIATION: f64 = 1.5;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Mean SSIM over all pixels of the Rec. 709 luma (on sRGB codes), with the original's 11x11 Gaussian
/// window of deviation 1.5. Windows are cut and renormalised at the edges.
pub fn ssim(reference: &Picture, test: &Picture) -> f64 {
    if reference.pixels.is_empty() || reference.size_px != test.size_px {
        return if reference == test { 1.0 } else { 0.0 };
    }
    let values = ssim_map(reference, test);
    values.iter().sum::<f64>() / values.len() as f64
}

/// SSIM of each pixel's window, for two pictures of the same size.
pub(crate) fn ssim_map(reference: &Picture, test: &Picture) -> Vec<f64> {
    let size = [reference.width(), reference.height()];
    // Moments: a, b, a^2, b^2, ab; one separable pass each way.
    let moments: Vec<[f64; 5]> = reference
        .pixels
        .par_iter()
        .zip(&test.pixels)
        .map(|(&a, &b)| {
            let (a, b) = (luma(a), luma(b));
            [a, b, a * a, b * b, a * b]
        })
        .collect();
    let horizontal = blur(&moments, size, false);
    let local = blur(&horizontal, size, true);
    local.par_iter().map(|m| local_ssim(*m)).collect()
}

fn luma([r, g, b]: [u8; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

fn local_ssim([a, b, aa, bb, ab]: [f64; 5]) -> f64 {
    let (var_a, var_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
    (2.0 * a * b + C1) * (2.0 * covariance + C2) / ((a * a + b * b + C1) * (var_a + var_b + C2))
}

fn blur(source: &[[f64; 5]], [width, height]: [usize; 2], vertical: bool) -> Vec<[f64; 5]> {
    let weights: Vec<f64> = (0..=2 * WINDOW_RADIUS)
        .map(|i| {
            let x = i as f64 - WINDOW_RADIUS as f64;
            (-x * x / (2.0 * WINDOW_DEVIATION * WINDOW_DEVIATION)).exp()
        })
        .collect();
    let (length, stride) = if vertical {
        (height, width)
    } else {
        (width, 1)
    };
    let mut out = vec![[0.0; 5]; source.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let (at, base) = if vertical { (y, x) } else { (x, y * width) };
            let first = at.saturating_sub(WINDOW_RADIUS);
            let last = (at + WINDOW_RADIUS).min(length - 1);
            let mut sum = 0.0;
            for i in first..=last {
                let weight = weights[i + WINDOW_RADIUS - at];
                sum += weight;
                for (total, moment) in pixel.iter_mut().zip(source[base + i * stride]) {
                    *total += weight * moment;
                }
            }
            for total in pixel.iter_mut() {
                *total /= sum;
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{noise, scene_like, shifted};

    /// The definition, with every window summed in two dimensions.
    fn brute_force(a: &Picture, b: &Picture) -> f64 {
        let (w, h) = (a.width() as i64, a.height() as i64);
        let mut total = 0.0;
        for y in 0..h {
            for x in 0..w {
                let (mut m, mut sum) = ([0.0; 5], 0.0);
                for dy in -5..=5i64 {
                    for dx in -5..=5i64 {
                        let (px, py) = (x + dx, y + dy);
                        if px < 0 || py < 0 || px >= w || py >= h {
                            continue;
                        }
                        let g = (-((dx * dx + dy * dy) as f64) / (2.0 * 1.5 * 1.5)).exp();
                        let at = (py * w + px) as usize;
                        let (p, q) = (luma(a.pixels[at]), luma(b.pixels[at]));
                        sum += g;
                        for (t, v) in m.iter_mut().zip([p, q, p * p, q * q, p * q]) {
                            *t += g * v;
                        }
                    }
                }
                total += local_ssim(m.map(|v| v / sum));
            }
        }
        total / (w * h) as f64
    }

    #[test]
    fn the_separable_windows_agree_with_the_definition() {
        let a = scene_like([33, 21]);
        for b in [shifted(&a, 1), noise([33, 21], 5)] {
            assert!((ssim(&a, &b) - brute_force(&a, &b)).abs() < 1e-9);
        }
    }

    #[test]
    fn it_ranks_errors_as_another_implementation_does() {
        let a = scene_like([120, 90]);
        let grey = |p: &Picture| {
            let codes = p.pixels.iter().map(|&c| luma(c).round() as u8).collect();
            image::GrayImage::from_raw(120, 90, codes).expect("sized")
        };
        for b in [
            a.clone(),
            shifted(&a, 1),
            shifted(&a, 3),
            noise([120, 90], 5),
        ] {
            let theirs = image_compare::gray_similarity_structure(
                &image_compare::Algorithm::MSSIMSimple,
                &grey(&a),
                &grey(&b),
            )
            .expect("same size");
            // That crate averages over 8x8 blocks instead of Gaussian windows.
            let ours = ssim(&a, &b);
            assert!(
                (ours - theirs.score).abs() < 0.08,
                "{ours} {}",
                theirs.score
            );
        }
    }

    #[test]
    fn identical_pictures_have_ssim_one() {
        let a = noise([20, 20], 1);
        assert!((ssim(&a, &a) - 1.0).abs() < 1e-12);
    }
}
