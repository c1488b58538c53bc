//! The picture of both eyes, side by side.

use super::frame::EyeImage;
use glam::Vec3;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::io::Write;

/// Writes both eyes side by side as a PNG.
///
/// Errors of writing.
/// When writing fails.
pub fn write_png(images: &[EyeImage; 2], to: impl Write) -> image::ImageResult<()> {
    let [left, right] = images;
    let [width, height] = left.size_px;
    let mut rgb = Vec::with_capacity(width as usize * height as usize * 6);
    let stride = width.max(1) as usize;
    for (l, r) in left.pixels.chunks(stride).zip(right.pixels.chunks(stride)) {
        for pixel in l.iter().chain(r) {
            rgb.extend(displayed(*pixel));
        }
    }
    PngEncoder::new(to).write_image(&rgb, 2 * width, height, ExtendedColorType::Rgb8)
}

/// Radiance as sRGB bytes, with the same ACES filmic curve (Narkowicz 2015) as in the raster path.
pub fn displayed(radiance: Vec3) -> [u8; 3] {
    let c = radiance.max(Vec3::ZERO);
    let mapped = (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14);
    mapped.to_array().map(|v| {
        let encoded = scene::srgb::encode(v.clamp(0.0, 1.0).into());
        (encoded * 255.0).round() as u8
    })
}
