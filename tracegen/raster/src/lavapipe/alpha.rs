//! Copies of what alpha tests sample: a base colour's alpha alone, as floats.
//!
//! llvmpipe decodes four channels of compressed blocks, and the curve of three, for every texel that
//! a filter reads. A masked draw that is captured needs one of them, twice. The driver itself makes the
//! copies, texel by texel, and filters them by the same code, in floats, as it does sRGB: the alpha
//! that a shader gets is the same to the last bit.

use super::bindings;
use super::device::Gpu;
use super::targets::attachment;
use super::whole::Whole;
use crate::draws::{DrawList, DrawMode};
use crate::error::RasterError;
use formats::texture::{ColorSpace, Texture};
use scene::{Material, Scene};
use std::collections::{BTreeMap, BTreeSet};
use textures::TextureSet;

/// Format of the copies.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// Copies that would take more are not made.
const BUDGET_BYTES: u64 = 256 << 20;

/// The texture that a material's alpha test samples, by its number in `set`.
pub fn of_material(material: &Material, set: &TextureSet) -> Option<usize> {
    let texture = material.base_color_texture?;
    (*set.of_image.get(texture.image)?).filter(|&index| {
        (set.textures.get(index)).is_some_and(|texture| !texture.blocks.is_empty())
    })
}

/// The textures to be copied, by their numbers in `set`: all that alpha-masked draws sample, or none.
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
    // llvmpipe filters linear colours of 8 bits in fixed point, and so not as floats.
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
        let source = include_str!("../shaders/alpha_copies.wgsl");
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("alpha"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
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
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &level_view(&to, level),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
    }
    to.create_view(&Default::default())
}
