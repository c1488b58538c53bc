//! Image error as visible in a head-mounted display: FLIP, PSNR and SSIM of a picture inside the visible
//! area of the lens, and flicker between frames.
//!
//! Metrics compare displayed pictures, so all of them use 8-bit sRGB.

pub mod color;
mod colormap;
pub mod flicker;
pub mod flip;
pub mod motion;
pub mod png;
pub mod psnr;
pub mod ssim;
mod visible;

pub use visible::{Mask, PictureError, Reference};

use formats::view::FovTangents;
use rayon::prelude::*;

/// An 8-bit sRGB picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Pixels.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour.
    pub fn filled(size_px: [u32; 2], color: [u8; 3]) -> Self {
        let count = size_px[0] as usize * size_px[1] as usize;
        Self {
            size_px,
            pixels: vec![color; count],
        }
    }

    /// Encodes linear radiance: clamped to 0..1, sRGB transfer curve, rounded to 8 bits. Missing pixels are
    /// black.
    pub fn from_linear(size_px: [u32; 2], linear: &[[f32; 3]]) -> Self {
        let mut picture = Self::filled(size_px, [0; 3]);
        picture
            .pixels
            .par_iter_mut()
            .zip(linear)
            .for_each(|(pixel, radiance)| *pixel = radiance.map(color::srgb8_from_linear));
        picture
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.size_px[0] as usize
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.size_px[1] as usize
    }

    /// Pictures side by side with gaps of `gap_px` black pixels; shorter ones are padded to the tallest.
    pub fn side_by_side(pictures: &[&Self], gap_px: u32) -> Self {
        let height = pictures.iter().map(|p| p.size_px[1]).max().unwrap_or(0);
        let gaps = gap_px * (pictures.len().saturating_sub(1)) as u32;
        let width = pictures.iter().map(|p| p.size_px[0]).sum::<u32>() + gaps;
        let mut out = Self::filled([width, height], [0; 3]);
        let mut left = 0usize;
        for picture in pictures {
            let rows = picture.pixels.chunks_exact(picture.width().max(1));
            for (row, line) in rows.enumerate() {
                let at = row * width as usize + left;
                out.pixels[at..at + line.len()].copy_from_slice(line);
            }
            left += picture.width() + gap_px as usize;
        }
        out
    }

    /// The picture reduced by an integer factor until neither edge is longer than `longest_px`. Each pixel
    /// is the mean of the pixels it covers.
    pub fn shrunk_to(&self, longest_px: u32) -> Self {
        let longest = self.size_px[0].max(self.size_px[1]);
        let factor = longest.div_ceil(longest_px.max(1)).max(1);
        let size_px = self.size_px.map(|s| s.div_ceil(factor));
        let mut out = Self::filled(size_px, [0; 3]);
        for (i, pixel) in out.pixels.iter_mut().enumerate() {
            let (x, y) = (
                i as u32 % size_px[0] * factor,
                i as u32 / size_px[0] * factor,
            );
            let (mut sum, mut count) = ([0u32; 3], 0u32);
            for row in y..(y + factor).min(self.size_px[1]) {
                for column in x..(x + factor).min(self.size_px[0]) {
                    let at = row as usize * self.width() + column as usize;
                    for (total, channel) in sum.iter_mut().zip(self.pixels[at]) {
                        *total += u32::from(channel);
                    }
                    count += 1;
                }
            }
            *pixel = sum.map(|c| ((c + count / 2) / count.max(1)) as u8);
        }
        out
    }
}

/// Range of pixels per degree for FLIP's filters; at the lower end, a degree is a tenth of a pixel.
pub const PIXELS_PER_DEGREE: std::ops::RangeInclusive<f32> = 0.1..=1000.0;

/// Pixels per degree at the centre of an eye's image: `(W/2) / tan(h/2) * pi/180`, with the mean of the
/// horizontal half-angle tangents for off-axis frusta.
pub fn pixels_per_degree(width_px: u32, fov: &FovTangents) -> f32 {
    width_px as f32 / (fov.left + fov.right) * std::f32::consts::PI / 180.0
}

/// The value that a share `q` (0 to 1) of the values does not exceed (nearest rank).
pub fn quantile(values: &[f32], q: f64) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let mut sorted = values.to_vec();
    let rank = ((q * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1;
    *sorted.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// Mean of the values, summed in order in double precision, so that it does not depend on threads.
pub fn mean(values: &[f32]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

#[cfg(test)]
pub(crate) mod testing;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_960_px_eye_of_100_degrees_has_seven_pixels_per_degree() {
        let half = 50f32.to_radians().tan();
        let fov = FovTangents::new(half, half, half, half);
        let ppd = pixels_per_degree(960, &fov);
        assert!((ppd - 7.03).abs() < 0.01, "{ppd}");
    }

    #[test]
    fn the_99th_percentile_of_one_to_a_hundred_is_99() {
        let values: Vec<f32> = (1..=100).rev().map(|v| v as f32).collect();
        assert_eq!(quantile(&values, 0.99), 99.0);
        assert_eq!(quantile(&values, 1.0), 100.0);
        assert_eq!(quantile(&[], 0.5), 0.0);
    }

    #[test]
    fn shrinking_keeps_the_mean_of_each_block() {
        let mut p = Picture::filled([5, 4], [0; 3]);
        p.pixels[0] = [100, 0, 0];
        let small = p.shrunk_to(3);
        assert_eq!(small.size_px, [3, 2]);
        assert_eq!(small.pixels[0], [25, 0, 0]);
        assert_eq!(p.shrunk_to(5), p);
    }

    #[test]
    fn pictures_side_by_side_keep_their_pixels() {
        let a = Picture::filled([2, 2], [1, 2, 3]);
        let b = Picture::filled([1, 2], [4, 5, 6]);
        let both = Picture::side_by_side(&[&a, &b], 1);
        assert_eq!(both.size_px, [4, 2]);
        assert_eq!(both.pixels[4..], [[1, 2, 3], [1, 2, 3], [0; 3], [4, 5, 6]]);
    }
}
