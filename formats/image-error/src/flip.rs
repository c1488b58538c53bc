//! FLIP, a difference evaluator for alternating images (Andersson et al., HPG 2020), in its variant for low
//! dynamic range. It predicts the visible difference of two pictures flipped between in place.
//!
//! The kernels are sampled per degree of visual angle, so every value depends on the pixels per degree;
//! [`crate::pixels_per_degree`] computes them for an eye.

use crate::Picture;
use crate::color;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Exponent of the colour difference (paper's q_c).
const COLOR_EXPONENT: f32 = 0.7;
/// Share of the largest colour difference (p_c) that is mapped to [`COLOR_KNEE_ERROR`].
const COLOR_KNEE: f32 = 0.4;
/// Error at the knee (p_t).
const COLOR_KNEE_ERROR: f32 = 0.95;
/// Width of the feature detectors in degrees (w).
const FEATURE_WIDTH_DEG: f32 = 0.082;

/// Amplitude and scale of a Gaussian of the contrast sensitivity functions (table 1).
type Lobe = (f32, f32);
const ACHROMATIC: Lobe = (1.0, 0.0047);
const RED_GREEN: Lobe = (1.0, 0.0053);
const BLUE_YELLOW: [Lobe; 2] = [(34.1, 0.04), (13.5, 0.025)];

/// A picture's error map and its summary.
#[derive(Clone, Debug)]
pub struct FlipMap {
    /// Error of each pixel, 0 (same) to 1.
    pub errors: Vec<f32>,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Pixels per degree used for the kernels.
    pub pixels_per_degree: f32,
}

impl FlipMap {
    /// Mean error.
    pub fn mean(&self) -> f64 {
        crate::mean(&self.errors)
    }

    /// 99th percentile of the error.
    pub fn p99(&self) -> f64 {
        f64::from(crate::quantile(&self.errors, 0.99))
    }

    /// The map in FLIP's usual colours.
    pub fn picture(&self) -> Picture {
        Picture {
            size_px: self.size_px,
            pixels: self
                .errors
                .par_iter()
                .map(|&e| crate::colormap::magma(e))
                .collect(),
        }
    }
}

/// A filtered picture. A reference is filtered once for many comparisons.
#[derive(Clone, Debug)]
pub struct Prepared {
    size_px: [u32; 2],
    pixels_per_degree: f32,
    /// Filtered colour in Hunt-adjusted CIELAB.
    lab: Vec<[f32; 3]>,
    /// Edge and point strength.
    features: Vec<[f32; 2]>,
}

impl Prepared {
    /// Filters a picture for viewing at a number of pixels per degree.
    pub fn new(picture: &Picture, pixels_per_degree: f32) -> Self {
        let size = [picture.width(), picture.height()];
        let linear: [f32; 256] =
            std::array::from_fn(|code| color::linear_from_srgb(code as f32 / 255.0));
        let opponent: Vec<[f32; 3]> = picture
            .pixels
            .par_iter()
            .map(|pixel| {
                let linear = pixel.map(|code| linear[usize::from(code)]);
                color::ycxcz_from_xyz(color::xyz_from_linear(linear))
            })
            .collect();
        Self {
            size_px: picture.size_px,
            pixels_per_degree,
            lab: filtered_lab(&opponent, size, pixels_per_degree),
            features: feature_strengths(&opponent, size, pixels_per_degree),
        }
    }

    /// Pixels per degree used for the filters.
    pub fn pixels_per_degree(&self) -> f32 {
        self.pixels_per_degree
    }

    /// Error map of a test picture against this reference, for pixels inside both pictures.
    pub fn compare(&self, test: &Self) -> FlipMap {
        let largest = largest_color_distance();
        let errors = self
            .lab
            .par_iter()
            .zip(&self.features)
            .zip(test.lab.par_iter().zip(&test.features))
            .map(|((lab_a, feature_a), (lab_b, feature_b))| {
                let color = color_error(hyab(*lab_a, *lab_b), largest);
                let edge = (feature_a[0] - feature_b[0]).abs();
                let point = (feature_a[1] - feature_b[1]).abs();
                // The features' exponent q_f is one half.
                let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
                color.powf(1.0 - feature.min(1.0))
            })
            .collect();
        FlipMap {
            errors,
            size_px: self.size_px,
            pixels_per_degree: self.pixels_per_degree,
        }
    }
}

/// FLIP of a test picture against a reference.
pub fn flip(reference: &Picture, test: &Picture, pixels_per_degree: f32) -> FlipMap {
    Prepared::new(reference, pixels_per_degree).compare(&Prepared::new(test, pixels_per_degree))
}

/// Applies the contrast sensitivity functions and converts to Hunt-adjusted CIELAB.
fn filtered_lab(opponent: &[[f32; 3]], size: [usize; 2], ppd: f32) -> Vec<[f32; 3]> {
    let radius = (3.0 * (BLUE_YELLOW[0].1 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as usize;
    let a = gaussian(ACHROMATIC, radius, ppd);
    let rg = gaussian(RED_GREEN, radius, ppd);
    // A sum of two Gaussians is not separable, but each Gaussian is.
    let by = BLUE_YELLOW.map(|lobe| gaussian(lobe, radius, ppd));
    let sum = |k: &[f32]| k.iter().sum::<f32>();
    let norm_a = 1.0 / (sum(&a) * sum(&a));
    let norm_rg = 1.0 / (sum(&rg) * sum(&rg));
    let norm_by = 1.0 / by.iter().map(|k| sum(k) * sum(k)).sum::<f32>();

    let horizontal = convolve(opponent, size, Axis::Horizontal, radius, |window| {
        let mut out = [0.0; 4];
        for (i, p) in window.enumerate() {
            out[0] += a[i] * p[0];
            out[1] += rg[i] * p[1];
            out[2] += by[0][i] * p[2];
            out[3] += by[1][i] * p[2];
        }
        out
    });
    convolve(&horizontal, size, Axis::Vertical, radius, |window| {
        let mut out = [0.0; 3];
        for (i, p) in window.enumerate() {
            out[0] += a[i] * p[0];
            out[1] += rg[i] * p[1];
            out[2] += by[0][i] * p[2] + by[1][i] * p[3];
        }
        let filtered = [out[0] * norm_a, out[1] * norm_rg, out[2] * norm_by];
        let linear =
            color::linear_from_xyz(color::xyz_from_ycxcz(filtered)).map(|c| c.clamp(0.0, 1.0));
        hunt(color::lab_from_xyz(color::xyz_from_linear(linear)))
    })
}

/// Samples of `sqrt(a sqrt(pi/b)) exp(-pi^2 x^2 / b)`, whose outer product with itself is a lobe.
fn gaussian((a, b): Lobe, radius: usize, ppd: f32) -> Vec<f32> {
    let amplitude = (a * (PI / b).sqrt()).sqrt();
    (0..=2 * radius)
        .map(|i| {
            let x_deg = (i as f32 - radius as f32) / ppd;
            let weight = (-PI * PI * x_deg * x_deg / b).exp();
            // Denormal weights have no effect on the result and slow down every product.
            amplitude * if weight < 1e-30 { 0.0 } else { weight }
        })
        .collect()
}

/// Edge (first derivative) and point (second derivative) strength of the achromatic channel.
fn feature_strengths(opponent: &[[f32; 3]], size: [usize; 2], ppd: f32) -> Vec<[f32; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH_DEG * ppd;
    let radius = (3.0 * deviation).ceil() as usize;
    let at = |i: usize| i as f32 - radius as f32;
    let g: Vec<f32> = (0..=2 * radius)
        .map(|i| (-at(i) * at(i) / (2.0 * deviation * deviation)).exp())
        .collect();
    let first = balanced(g.iter().enumerate().map(|(i, g)| -at(i) * g).collect());
    let second = balanced(
        g.iter()
            .enumerate()
            .map(|(i, g)| (at(i) * at(i) / (deviation * deviation) - 1.0) * g)
            .collect(),
    );
    let sum: f32 = g.iter().sum();
    let g: Vec<f32> = g.iter().map(|v| v / sum).collect();

    let horizontal = convolve(opponent, size, Axis::Horizontal, radius, |window| {
        let mut out = [0.0; 3];
        for (i, p) in window.enumerate() {
            let lightness = (p[0] + 16.0) / 116.0;
            out[0] += g[i] * lightness;
            out[1] += first[i] * lightness;
            out[2] += second[i] * lightness;
        }
        out
    });
    convolve(&horizontal, size, Axis::Vertical, radius, |window| {
        let (mut edge, mut point) = ([0.0; 2], [0.0; 2]);
        for (i, p) in window.enumerate() {
            edge[0] += g[i] * p[1];
            edge[1] += first[i] * p[0];
            point[0] += g[i] * p[2];
            point[1] += second[i] * p[0];
        }
        [edge[0].hypot(edge[1]), point[0].hypot(point[1])]
    })
}

/// Scales positive weights to sum to 1 and negative ones to sum to -1.
fn balanced(mut weights: Vec<f32>) -> Vec<f32> {
    let positive: f32 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f32 = -weights.iter().filter(|w| **w < 0.0).sum::<f32>();
    for w in &mut weights {
        let sum = if *w > 0.0 { positive } else { negative };
        if sum > 0.0 {
            *w /= sum;
        }
    }
    weights
}

#[derive(Clone, Copy)]
enum Axis {
    Horizontal,
    Vertical,
}

/// Slides a window of `2 * radius + 1` pixels along an axis, edge pixels repeated.
fn convolve<const N: usize, const M: usize>(
    source: &[[f32; N]],
    [width, height]: [usize; 2],
    axis: Axis,
    radius: usize,
    kernel: impl Fn(Window<N>) -> [f32; M] + Sync,
) -> Vec<[f32; M]> {
    let mut out = vec![[0.0; M]; source.len()];
    if source.is_empty() {
        return out;
    }
    out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let (first, stride, length, at) = match axis {
                Axis::Horizontal => (y * width, 1, width, x),
                Axis::Vertical => (x, width, height, y),
            };
            *pixel = kernel(Window {
                source,
                first,
                stride,
                last: length - 1,
                radius,
                steps: at..at + 2 * radius + 1,
            });
        }
    });
    out
}

/// The pixels around one, along a line of a picture.
struct Window<'a, const N: usize> {
    source: &'a [[f32; N]],
    /// Index of the line's first pixel.
    first: usize,
    /// From a pixel of the line to the next.
    stride: usize,
    /// Number of the line's last pixel.
    last: usize,
    radius: usize,
    /// Remaining pixels, starting `radius` before the line.
    steps: std::ops::Range<usize>,
}

impl<const N: usize> Iterator for Window<'_, N> {
    type Item = [f32; N];

    #[inline(always)]
    fn next(&mut self) -> Option<[f32; N]> {
        let step = self.steps.next()?;
        let at = step.saturating_sub(self.radius).min(self.last);
        Some(self.source[self.first + at * self.stride])
    }
}

/// Hunt effect: chroma has more weight at higher luminance.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// City-block distance in lightness, Euclidean in chroma (Abasi et al. 2020).
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// The largest colour distance: green against blue.
fn largest_color_distance() -> f32 {
    let lab = |rgb| hunt(color::lab_from_xyz(color::xyz_from_linear(rgb)));
    hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT)
}

/// Compresses a colour distance to 0..1, most of the range for small distances.
fn color_error(distance: f32, largest: f32) -> f32 {
    let distance = distance.powf(COLOR_EXPONENT);
    let knee = COLOR_KNEE * largest;
    if distance < knee {
        COLOR_KNEE_ERROR / knee * distance
    } else {
        COLOR_KNEE_ERROR + (distance - knee) / (largest - knee) * (1.0 - COLOR_KNEE_ERROR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{noise, scene_like, shifted};

    /// The authors' C++ implementation.
    fn reference_flip(a: &Picture, b: &Picture, ppd: f32) -> Vec<f32> {
        let wrap = |p: &Picture| {
            let bytes: Vec<u8> = p.pixels.iter().flatten().copied().collect();
            nv_flip::FlipImageRgb8::with_data(p.size_px[0], p.size_px[1], &bytes)
        };
        nv_flip::flip(wrap(a), wrap(b), ppd).to_vec()
    }

    #[test]
    fn every_pixel_agrees_with_the_authors_implementation() {
        let scene = scene_like([97, 61]);
        let pairs = [
            (scene.clone(), shifted(&scene, 1)),
            (scene.clone(), noise([97, 61], 7)),
            (noise([97, 61], 1), noise([97, 61], 2)),
        ];
        for (i, (a, b)) in pairs.iter().enumerate() {
            for ppd in [7.0, 8.94, 20.0, 67.0] {
                let ours = flip(a, b, ppd).errors;
                let theirs = reference_flip(a, b, ppd);
                let worst = ours
                    .iter()
                    .zip(&theirs)
                    .map(|(x, y)| (x - y).abs())
                    .fold(0.0, f32::max);
                assert!(worst < 2e-4, "pair {i}, {ppd} px/degree: off by {worst}");
            }
        }
    }

    #[test]
    fn identical_pictures_have_no_error() {
        let a = scene_like([40, 30]);
        assert!(flip(&a, &a, 9.0).errors.iter().all(|&e| e == 0.0));
    }

    #[test]
    fn white_against_black_is_the_largest_error() {
        let a = Picture::filled([8, 8], [0; 3]);
        let b = Picture::filled([8, 8], [255; 3]);
        let mean = flip(&a, &b, 7.0).mean();
        assert!(mean > 0.95 && mean <= 1.0, "{mean}");
    }

    #[test]
    fn the_error_of_a_fine_pattern_fades_with_more_pixels_per_degree() {
        let grey = Picture::filled([64, 64], [128; 3]);
        let mut checks = grey.clone();
        for (i, p) in checks.pixels.iter_mut().enumerate() {
            *p = [if (i + i / 64) % 2 == 0 { 108 } else { 148 }; 3];
        }
        let near = flip(&grey, &checks, 7.0).mean();
        let far = flip(&grey, &checks, 67.0).mean();
        assert!(near > 2.0 * far, "{near} {far}");
    }
}
