//! Copies of the alpha that alpha tests sample: only the alpha of a base colour, as floats.
//!
//! For every texel that a filter reads, llvmpipe decodes four channels of compressed blocks and the
//! sRGB curve of three. A captured masked draw needs only alpha, but twice. The driver itself makes
//! the copies texel by texel and filters them with the same float code as sRGB, so the shader gets
//! bit-identical alpha.

use super::bindings;
use super::device::Gpu;
use super::targets::{attachment, color_attachment};
use super::whole::Whole;
use crate::draws::{DrawList, DrawMode};
use crate::error::RasterError;
use formats::texture::{ColorSpace, Texture};
use scene::{Material, Scene, TextureSlot};
use std::collections::{BTreeMap, BTreeSet};
use textures::TextureSet;

/// Format of the copies.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// Largest total size of the copies. Beyond it, none are made.
const BUDGET_BYTES: u64 = 256 << 20;

/// The texture that a material's alpha test samples, by its number in `set`.
pub fn of_material(material: &Material, set: &TextureSet) -> Option<usize> {
    let texture = material.textures[TextureSlot::BaseColor]?;
    (*set.of_image.get(texture.image)?).filter(|&index| {
        (set.textures.get(index)).is_some_and(|texture| !texture.blocks.is_empty())
    })
}

/// The textures to copy, by their numbers in `set`: all that alpha-masked draws sample, or none.
pub fn planned(gpu: &Gpu, scene: &Scene, draws: &DrawList, set: &TextureSet) -> BTreeSet<usize> {
    let masked = draws.calls.iter().filter(|c| c.mode == DrawMode::Masked);
    let sampled: BTreeSet<usize> = masked
        .filter_map(|call| of_material(&scene.materials[call.material], set))
        .collect();
    let bytes = sampled.iter().map(|&index| {
        let texture = &set.textures[index];
        let level_bytes = |level| {
            let [width, height] = texture.texture.level_size(level);
            4 * u64::from(width) * u64::from(height)
        };
        (texture.first_level..texture.texture.levels)
            .map(level_bytes)
            .sum::<u64>()
    });
    // llvmpipe filters linear 8-bit colours in fixed point, not as floats.
    let by_floats = |texture: &Texture| texture.color_space == ColorSpace::Srgb;
    let possible = gpu.no_capture.is_none()
        && (gpu.device.features()).contains(wgpu::Features::FLOAT32_FILTERABLE)
        && (sampled.iter()).all(|&index| by_floats(&set.textures[index].texture))
        && bytes.sum::<u64>() <= BUDGET_BYTES;
    if possible { sampled } else { BTreeSet::new() }
}

/// Makes the copies of uploaded textures.
///
/// # Errors
/// Driver errors.
pub fn copies(
    gpu: &Gpu,
    planned: &BTreeSet<usize>,
    textures: &[wgpu::TextureView],
) -> Result<BTreeMap<usize, wgpu::TextureView>, RasterError> {
    if planned.is_empty() {
        return Ok(BTreeMap::new());
    }
    gpu.checked("copying the alpha of textures", || {
        let source = concat!(
            include_str!("../shaders/whole.wgsl"),
            include_str!("../shaders/alpha_copies.wgsl")
        );
        let module = gpu.module("alpha", source);
        let color = bindings::texture(wgpu::TextureSampleType::Float { filterable: true });
        let layout = bindings::fragment_layout(gpu, "alpha", [(0, color)]);
        let whole = Whole {
            module: &module,
            layout: &bindings::pipeline_layout(gpu, &[&layout]),
            vertex: "vertex_whole",
            multiview_mask: None,
        };
        let pipeline = whole.over_picture(gpu, "fragment_alpha", FORMAT);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let copies = (planned.iter())
            .map(|&index| {
                let from = textures[index].texture();
                let copy = copy(gpu, &mut encoder, &pipeline, &layout, from);
                (index, copy)
            })
            .collect();
        gpu.queue.submit([encoder.finish()]);
        copies
    })
}

/// Copies a texture level by level.
fn copy(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    layout: &wgpu::BindGroupLayout,
    from: &wgpu::Texture,
) -> wgpu::TextureView {
    let size_px = [from.width(), from.height()];
    let usage = wgpu::TextureUsages::TEXTURE_BINDING;
    let to = attachment(gpu, size_px, 1, from.mip_level_count(), FORMAT, usage);
    let level_view = |texture: &wgpu::Texture, level| {
        texture.create_view(&wgpu::TextureViewDescriptor {
            base_mip_level: level,
            mip_level_count: Some(1),
            ..Default::default()
        })
    };
    for level in 0..from.mip_level_count() {
        let from = level_view(from, level);
        let bound = [(0, wgpu::BindingResource::TextureView(&from))];
        let bindings = bindings::group(gpu, "alpha", layout, bound);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[color_attachment(
                &level_view(&to, level),
                Some(wgpu::Color::default()),
            )],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
    }
    to.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use super::super::device;
    use super::super::readback::Readback;
    use super::*;
    use wgpu::TextureFormat::{Bc1RgbaUnormSrgb, Bc3RgbaUnormSrgb, Rgba8UnormSrgb};

    const SIDE_PX: u32 = 256;
    const PAIR: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Float;
    /// Alpha of the texture and of its copy, at scales from many texels per pixel to much less than
    /// one.
    const BOTH: &str = "
@group(0) @binding(0) var color: texture_2d<f32>;
@group(0) @binding(1) var alpha: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;

@fragment
fn fragment_both(@builtin(position) position: vec4<f32>) -> @location(0) vec2<f32> {
    let at = position.xy / 256.0;
    let uv = vec2(at.x * exp2(6.0 * at.y), at.y * at.y * 7.3) - 1.7;
    return vec2(textureSample(color, linear, uv).a, textureSample(alpha, linear, uv).r);
}";

    /// A texture of `side` texels with all its levels, filled with noise.
    fn texture(gpu: &Gpu, format: wgpu::TextureFormat, side: u32) -> wgpu::TextureView {
        let block_bytes = format.block_copy_size(None).unwrap();
        let edge = format.block_dimensions().0;
        let levels = side.ilog2() + 1;
        let bytes = (0..levels).map(|level| (side >> level).div_ceil(edge).pow(2) * block_bytes);
        let mut state = 1_u32;
        let noise: Vec<u8> = (0..bytes.sum::<u32>())
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                state.to_le_bytes()[3]
            })
            .collect();
        gpu.texture_of([side; 2], levels, format, &noise)
    }

    /// A shader's samples of a texture's alpha and of its copy, pixel by pixel.
    fn sampled(
        gpu: &Gpu,
        texture: wgpu::TextureView,
        sampler: &wgpu::SamplerDescriptor<'_>,
    ) -> Vec<[f32; 2]> {
        let textures = [texture];
        let copies = copies(gpu, &BTreeSet::from([0]), &textures).unwrap();
        let module = gpu.module(
            "test",
            format!("{}{BOTH}", include_str!("../shaders/whole.wgsl")),
        );
        let view = bindings::texture(wgpu::TextureSampleType::Float { filterable: true });
        let filters = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = bindings::fragment_layout(gpu, "both", [(0, view), (1, view), (2, filters)]);
        let whole = Whole {
            module: &module,
            layout: &bindings::pipeline_layout(gpu, &[&layout]),
            vertex: "vertex_whole",
            multiview_mask: None,
        };
        let resources = [
            wgpu::BindingResource::TextureView(&textures[0]),
            wgpu::BindingResource::TextureView(&copies[&0]),
            wgpu::BindingResource::Sampler(&gpu.device.create_sampler(sampler)),
        ];
        let bindings = bindings::group(gpu, "both", &layout, (0..).zip(resources));
        let usage = wgpu::TextureUsages::COPY_SRC;
        let target = attachment(gpu, [SIDE_PX; 2], 1, 1, PAIR, usage);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[color_attachment(
                &target.create_view(&Default::default()),
                Some(wgpu::Color::default()),
            )],
            ..Default::default()
        });
        pass.set_pipeline(&whole.over_picture(gpu, "fragment_both", PAIR));
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        Readback::default().texels(gpu, &target).unwrap()
    }

    #[test]
    fn samples_of_a_copy_equal_samples_of_the_original_alpha_bit_for_bit() {
        let gpu = device::open(None).unwrap_or_else(|e| panic!("{e}"));
        assert!((gpu.device.features()).contains(wgpu::Features::FLOAT32_FILTERABLE));
        use wgpu::{AddressMode, FilterMode, MipmapFilterMode};
        let samplers = [
            (
                AddressMode::Repeat,
                FilterMode::Linear,
                MipmapFilterMode::Linear,
            ),
            (
                AddressMode::MirrorRepeat,
                FilterMode::Linear,
                MipmapFilterMode::Nearest,
            ),
            (
                AddressMode::ClampToEdge,
                FilterMode::Nearest,
                MipmapFilterMode::Linear,
            ),
        ];
        for format in [Bc1RgbaUnormSrgb, Bc3RgbaUnormSrgb, Rgba8UnormSrgb] {
            for (wrap, filter, mip) in samplers {
                let sampler = wgpu::SamplerDescriptor {
                    address_mode_u: wrap,
                    address_mode_v: wrap,
                    mag_filter: filter,
                    min_filter: filter,
                    mipmap_filter: mip,
                    ..Default::default()
                };
                let pairs = sampled(&gpu, texture(&gpu, format, 64), &sampler);
                let mut values: Vec<u32> = pairs.iter().map(|[alpha, _]| alpha.to_bits()).collect();
                for [alpha, copy] in &pairs {
                    assert_eq!(alpha.to_bits(), copy.to_bits(), "{format:?} {sampler:?}");
                }
                values.sort_unstable();
                values.dedup();
                let fewest = if filter == FilterMode::Linear {
                    1000
                } else {
                    2
                };
                assert!(
                    values.len() >= fewest,
                    "{format:?}: {} values",
                    values.len()
                );
            }
        }
    }
}
