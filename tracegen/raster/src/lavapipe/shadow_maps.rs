//! The shadow maps, and their copies in a smaller format.

use super::device::Gpu;
use super::pipelines::DEPTH_FORMAT;
use super::readback::Readback;
use super::targets::attachment;
use crate::draws::SHADOW_SIZE;
use crate::error::RasterError;
use formats::texture::TexelFormat;
use rayon::prelude::*;
use textures::bc4;
use wgpu::TextureFormat;

/// The shadow map array: one view to sample, and one per layer to render.
pub struct ShadowMaps {
    /// All layers, as draws sample them.
    pub sampled: wgpu::TextureView,
    /// Each layer.
    pub layers: Vec<wgpu::TextureView>,
    format: TexelFormat,
}

impl ShadowMaps {
    /// An array of `cascades` layers that are sampled in a format; without any, a single texel that no
    /// pipeline samples.
    pub fn new(gpu: &Gpu, cascades: u32, format: TexelFormat) -> Self {
        let size_px = [if cascades == 0 { 1 } else { SHADOW_SIZE }; 2];
        let array = |format, usage| {
            let usage = usage | wgpu::TextureUsages::TEXTURE_BINDING;
            attachment(gpu, size_px, cascades.max(1), 1, format, usage)
        };
        let rendered = array(DEPTH_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let layers = (0..cascades)
            .map(|layer| {
                rendered.create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: layer,
                    array_layer_count: Some(1),
                    ..Default::default()
                })
            })
            .collect();
        let sampled = match format {
            TexelFormat::R32f => rendered,
            // Depths of BC4 are sampled decoded.
            _ => array(TextureFormat::Depth16Unorm, wgpu::TextureUsages::COPY_DST),
        };
        Self {
            sampled: sampled.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            layers,
            format,
        }
    }

    /// Stores the rendered layers in the format that is sampled.
    ///
    /// # Errors
    /// Driver errors.
    pub fn store(&self, gpu: &Gpu, readback: &Readback) -> Result<(), RasterError> {
        if self.format == TexelFormat::R32f {
            return Ok(());
        }
        let depths: Vec<f32> = readback.texels(gpu, self.layers[0].texture())?;
        let texels = stored(&depths, self.format);
        let to = self.sampled.texture();
        gpu.queue.write_texture(
            to.as_image_copy(),
            bytemuck::cast_slice(&texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(2 * SHADOW_SIZE),
                rows_per_image: Some(SHADOW_SIZE),
            },
            to.size(),
        );
        Ok(())
    }
}

/// Depths of maps as a format stores them, in 16 bits. They are rounded away from the light, because a depth
/// that is too near shades the surface that it belongs to.
fn stored(depths: &[f32], format: TexelFormat) -> Vec<u16> {
    let above = |depth: &f32| (f64::from(*depth) * f64::from(u16::MAX)).ceil() as u16;
    let mut stored: Vec<u16> = depths.par_iter().map(above).collect();
    if format == TexelFormat::Bc4 {
        let width = SHADOW_SIZE as usize;
        stored.par_chunks_mut(4 * width).for_each(|rows| {
            for column in (0..width).step_by(4) {
                let at = |texel: usize| texel / 4 * width + column + texel % 4;
                let depths = std::array::from_fn(|texel| rows[at(texel)]);
                for (texel, depth) in bc4::decode(bc4::encode(&depths)).into_iter().enumerate() {
                    rows[at(texel)] = depth;
                }
            }
        });
    }
    stored
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_depths_are_not_nearer_than_those_rendered() {
        let size = SHADOW_SIZE as usize;
        let depth = |texel: usize| {
            let [x, y] = [texel % size, texel / size].map(|at| at as f32);
            // Stairs on a slope, beside what nothing was drawn on.
            let stairs = (x / 50.0).floor() * 0.01 + y * 1e-6;
            if x + y > 3000.0 { 1.0 } else { 0.2 + stairs }
        };
        let depths: Vec<f32> = (0..8 * size).map(depth).collect();
        for (format, most) in [
            (TexelFormat::D16, 1.01 / 65535.0),
            (TexelFormat::Bc4, 0.6 / 255.0),
        ] {
            let far = |(found, depth): (&u16, &f32)| f32::from(*found) / 65535.0 - depth;
            let stored = stored(&depths, format);
            let errors: Vec<f32> = stored.iter().zip(&depths).map(far).collect();
            assert!(
                errors.iter().all(|error| (0.0..=most).contains(error)),
                "{format:?}"
            );
        }
    }
}
