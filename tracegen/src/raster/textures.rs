//! The scene's images as the driver gets them.

use super::backend::DeviceTexture;
use crate::scene::{Image, Scene};
use formats::texture::{ColorSpace, TexelFormat};
use rayon::prelude::*;

/// Compresses every image with its mip levels.
#[must_use]
pub fn for_device(scene: &Scene) -> Vec<DeviceTexture> {
    scene.images.par_iter().map(compress).collect()
}

fn compress(image: &Image) -> DeviceTexture {
    let size = image.size.map(|s| s.max(4).next_multiple_of(4));
    let mut rgba = image::imageops::resize(
        &image::RgbaImage::from_raw(image.size[0], image.size[1], image.rgba.to_vec()).unwrap_or_default(),
        size[0],
        size[1],
        image::imageops::FilterType::Triangle,
    );
    let mut levels = Vec::new();
    loop {
        let (w, h) = rgba.dimensions();
        let mut out = vec![0; texpresso::Format::Bc1.compressed_size(w as usize, h as usize)];
        texpresso::Format::Bc1.compress(
            rgba.as_raw(),
            w as usize,
            h as usize,
            texpresso::Params {
                algorithm: texpresso::Algorithm::RangeFit,
                ..Default::default()
            },
            &mut out,
        );
        levels.push(out);
        if (w, h) == (1, 1) {
            break;
        }
        rgba = image::imageops::resize(&rgba, (w / 2).max(1), (h / 2).max(1), image::imageops::FilterType::Triangle);
    }
    DeviceTexture {
        size,
        format: TexelFormat::Bc1,
        srgb: image.color_space == ColorSpace::Srgb,
        levels,
    }
}
