//! Errors inside the visible area: the circle of each eye's image that the lens shows.

use crate::flip::{FlipMap, Prepared};
use crate::psnr::psnr_of_squares;
use crate::{Picture, mean, quantile, ssim};
use formats::view::{FovTangents, Lens};
use serde::Serialize;

/// The pixels of a picture that count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Whether each pixel counts, row by row from the top left.
    pub inside: Vec<bool>,
}

impl Mask {
    /// A mask in which all pixels count.
    pub fn everything(size_px: [u32; 2]) -> Self {
        Self::of(size_px, |_| true)
    }

    /// The pixels of an eye's picture whose centres the lens shows.
    pub fn of_lens(size_px: [u32; 2], fov: &FovTangents, lens: &Lens) -> Self {
        Self::of(size_px, |pixel| lens.pixel_visible(fov, size_px, pixel))
    }

    fn of(size_px: [u32; 2], counts: impl Fn([u32; 2]) -> bool) -> Self {
        let rows = 0..size_px[1];
        let at = rows.flat_map(|y| (0..size_px[0]).map(move |x| [x, y]));
        Self {
            size_px,
            inside: at.map(counts).collect(),
        }
    }

    /// The values of the pixels that count, row by row.
    pub fn select<'a, T: Copy>(&'a self, values: &'a [T]) -> impl Iterator<Item = T> + 'a {
        let counted = values.iter().zip(&self.inside);
        counted.filter(|(_, inside)| **inside).map(|(v, _)| *v)
    }
}

/// Difference of a picture from its reference inside the visible area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PictureError {
    /// Mean FLIP, 0 (same) to 1.
    pub flip_mean: f64,
    /// 99th percentile of FLIP.
    pub flip_p99: f64,
    /// Peak signal-to-noise ratio, at most [`crate::psnr::IDENTICAL_DB`].
    pub psnr_db: f64,
    /// Mean structural similarity, 1 for identical pictures.
    pub ssim: f64,
}

impl PictureError {
    /// No error at all.
    pub const NONE: Self = Self {
        flip_mean: 0.0,
        flip_p99: 0.0,
        psnr_db: crate::psnr::IDENTICAL_DB,
        ssim: 1.0,
    };
}

/// A reference picture, filtered once for all comparisons.
#[derive(Clone, Debug)]
pub struct Reference {
    picture: Picture,
    mask: Mask,
    flip: Prepared,
}

/// Error for a picture whose size differs from its reference's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a picture of {}x{} pixels: expected {}x{}, the size of its reference", found[0], found[1], expected[0], expected[1])]
pub struct SizeError {
    /// Width and height of the reference.
    pub expected: [u32; 2],
    /// Width and height of the picture.
    pub found: [u32; 2],
}

impl Reference {
    /// Prepares a reference for viewing at a number of pixels per degree through a mask.
    ///
    /// # Errors
    /// A mask whose size differs from the picture's.
    pub fn new(picture: Picture, mask: Mask, pixels_per_degree: f32) -> Result<Self, SizeError> {
        same_size(picture.size_px, mask.size_px)?;
        Ok(Self {
            flip: Prepared::new(&picture, pixels_per_degree),
            picture,
            mask,
        })
    }

    /// The picture.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// The pixels that count.
    pub fn mask(&self) -> &Mask {
        &self.mask
    }

    /// The error of `test`. Pixels outside the mask are replaced by the reference's, so they do not affect
    /// the filters' neighbourhoods.
    ///
    /// # Errors
    /// A picture of another size.
    pub fn error(&self, test: &Picture) -> Result<PictureError, SizeError> {
        let Some(seen) = self.seen(test)? else {
            return Ok(PictureError::NONE);
        };
        let map = self
            .flip
            .compare(&Prepared::new(&seen, self.flip.pixels_per_degree()));
        let errors: Vec<f32> = self.mask.select(&map.errors).collect();
        let squares = |(a, b): (&[u8; 3], &[u8; 3])| -> u64 {
            let channels = a.iter().zip(b);
            channels
                .map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2))
                .sum()
        };
        // Outside the mask, the difference is zero.
        let pairs = self.picture.pixels.iter().zip(&seen.pixels);
        let similarity = ssim::ssim_map(&self.picture, &seen);
        let similarity: Vec<f64> = self.mask.select(&similarity).collect();
        Ok(PictureError {
            flip_mean: mean(&errors),
            flip_p99: f64::from(quantile(&errors, 0.99)),
            psnr_db: psnr_of_squares(pairs.map(squares).sum(), 3 * errors.len()),
            ssim: similarity.iter().sum::<f64>() / similarity.len().max(1) as f64,
        })
    }

    /// The map of the FLIP error of `test`, 0 outside the mask.
    ///
    /// # Errors
    /// A picture of another size.
    pub fn flip_map(&self, test: &Picture) -> Result<FlipMap, SizeError> {
        let seen = self.seen(test)?;
        let seen = seen.as_ref().unwrap_or(&self.picture);
        let prepared = Prepared::new(seen, self.flip.pixels_per_degree());
        let mut map = self.flip.compare(&prepared);
        for (error, inside) in map.errors.iter_mut().zip(&self.mask.inside) {
            *error = if *inside { *error } else { 0.0 };
        }
        Ok(map)
    }

    /// The picture with the reference's pixels outside the mask; `None` if it has no difference inside.
    fn seen(&self, test: &Picture) -> Result<Option<Picture>, SizeError> {
        same_size(self.picture.size_px, test.size_px)?;
        let mut seen = self.picture.clone();
        let mut differs = false;
        let pixels = seen.pixels.iter_mut().zip(&test.pixels);
        for ((pixel, test), inside) in pixels.zip(&self.mask.inside) {
            if *inside && pixel != test {
                *pixel = *test;
                differs = true;
            }
        }
        Ok(differs.then_some(seen))
    }
}

fn same_size(expected: [u32; 2], found: [u32; 2]) -> Result<(), SizeError> {
    if expected == found {
        Ok(())
    } else {
        Err(SizeError { expected, found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flip::flip;
    use crate::psnr::psnr_db;
    use crate::testing::{noise, scene_like, shifted};

    const FOV: FovTangents = FovTangents::new(1.0, 1.0, 1.0, 1.0);

    fn circle(size_px: [u32; 2], center: [f32; 2], radius: f32) -> Mask {
        Mask::of_lens(size_px, &FOV, &Lens { center, radius })
    }

    #[test]
    fn without_a_mask_the_figures_are_those_of_the_whole_picture() {
        let a = scene_like([60, 44]);
        let b = shifted(&a, 2);
        let reference = Reference::new(a.clone(), Mask::everything(a.size_px), 7.0).unwrap();
        let error = reference.error(&b).unwrap();
        let map = flip(&a, &b, 7.0);
        assert_eq!((error.flip_mean, error.flip_p99), (map.mean(), map.p99()));
        assert_eq!(error.psnr_db, psnr_db(&a, &b));
        assert!((error.ssim - ssim::ssim(&a, &b)).abs() < 1e-12);
    }

    #[test]
    fn pixels_outside_the_lens_do_not_count() {
        let a = scene_like([64, 64]);
        let mask = circle([64, 64], [0.0, 0.0], 0.8);
        let mut b = a.clone();
        for (pixel, inside) in b.pixels.iter_mut().zip(&mask.inside) {
            if !inside {
                *pixel = [0, 0, 0];
            }
        }
        assert_ne!(a, b);
        let reference = Reference::new(a, mask, 7.0).unwrap();
        assert_eq!(reference.error(&b).unwrap(), PictureError::NONE);
    }

    #[test]
    fn an_error_inside_weighs_by_the_pixels_inside() {
        let grey = Picture::filled([64, 64], [100; 3]);
        let mask = circle([64, 64], [0.0, 0.0], 0.5);
        let all = mask.inside.iter().filter(|i| **i).count();
        let mut test = grey.clone();
        // The halves of the picture differ by one code and by two.
        for (i, pixel) in test.pixels.iter_mut().enumerate() {
            *pixel = if i % 64 < 32 { [101; 3] } else { [102; 3] };
        }
        let reference = Reference::new(grey, mask.clone(), 7.0).unwrap();
        let left = mask
            .select(&(0..64 * 64).map(|i| i % 64 < 32).collect::<Vec<_>>())
            .filter(|l| *l)
            .count();
        let mean_square = (left + 4 * (all - left)) as f64 / all as f64;
        let expected = 10.0 * (255.0 * 255.0 / mean_square).log10();
        assert!((reference.error(&test).unwrap().psnr_db - expected).abs() < 1e-9);
    }

    #[test]
    fn a_circle_has_the_area_and_the_centre_of_the_lens() {
        let mask = circle([400, 200], [0.25, 0.5], 0.4);
        let inside: Vec<usize> = (0..mask.inside.len()).filter(|i| mask.inside[*i]).collect();
        // Pixels of 2/400 by 2/200 tangents.
        let area = inside.len() as f64 * (2.0 / 400.0) * (2.0 / 200.0);
        let expected = std::f64::consts::PI * 0.16;
        assert!((area / expected - 1.0).abs() < 0.01, "{area} {expected}");
        let center = |f: fn(usize) -> usize| {
            inside.iter().map(|i| f(*i) as f64 + 0.5).sum::<f64>() / inside.len() as f64
        };
        assert!((center(|i| i % 400) - 250.0).abs() < 0.1);
        assert!((center(|i| i / 400) - 50.0).abs() < 0.1, "y points up");
    }

    #[test]
    fn a_picture_of_another_size_is_refused() {
        let reference = Reference::new(noise([8, 8], 1), Mask::everything([8, 8]), 7.0).unwrap();
        assert_eq!(
            reference.error(&noise([8, 9], 1)).unwrap_err().to_string(),
            "a picture of 8x9 pixels: expected 8x8, the size of its reference"
        );
    }
}
