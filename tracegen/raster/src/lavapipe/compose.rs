//! Operations on whole layers: masks before their draws, composition of pictures after them.

use super::bindings;
use super::device::Gpu;
use super::pipelines::COLOR_FORMAT;
use super::targets::{ColorTarget, LayerTarget, color_attachment};
use super::whole::{OverLayer, Whole};
use crate::error::RasterError;
use formats::view::TILE_SIZE_PX;
use techniques::Mask;
use techniques::plan::{Filter, PicturePart};

/// Pipelines that mask layers and compose pictures.
pub struct Composer {
    mask_layout: wgpu::BindGroupLayout,
    part_layout: wgpu::BindGroupLayout,
    /// Writes the nearest depth wherever a layer's mask is not set.
    pub mask: OverLayer,
    filters: [(Filter, wgpu::RenderPipeline); 4],
    /// Replaces the mask of layers, and the tiles of parts, that have none.
    absent: wgpu::TextureView,
}

/// The shader's `PicturePart`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PartData {
    origin: [i32; 2],
    coarseness: [i32; 2],
    some_tiles: [u32; 4],
    /// Columns, each padded with one float.
    layer_from_px: [[f32; 4]; 3],
}

impl Composer {
    /// Compiles the shader.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gpu: &Gpu) -> Result<Self, RasterError> {
        gpu.checked("compiling the shader of the layers", || {
            let source = format!(
                "const TILE_SIZE: i32 = {TILE_SIZE_PX};\n{}{}",
                include_str!("../shaders/whole.wgsl"),
                include_str!("../shaders/layers.wgsl")
            );
            let module = gpu.module("layers", source);
            let flags = bindings::texture(wgpu::TextureSampleType::Uint);
            let color = bindings::texture(wgpu::TextureSampleType::Float { filterable: false });
            let layout = |types: &[wgpu::BindingType]| {
                bindings::fragment_layout(gpu, "layers", (0..).zip(types.iter().copied()))
            };
            let mask_layout = layout(&[flags]);
            let part_layout = layout(&[bindings::uniform(), color, flags]);
            let layer = bindings::pipeline_layout(gpu, &[&mask_layout]);
            let part = bindings::pipeline_layout(gpu, &[&mask_layout, &part_layout]);
            let whole = |layout| Whole {
                module: &module,
                layout,
                vertex: "vertex_whole",
                multiview_mask: None,
            };
            let compose = |fragment| whole(&part).over_picture(gpu, fragment, COLOR_FORMAT);
            Self {
                mask: whole(&layer).over_layer(gpu, "fragment_mask"),
                filters: [
                    (Filter::Copy, compose("fragment_copy")),
                    (Filter::Bilinear, compose("fragment_bilinear")),
                    (Filter::FillQuads, compose("fragment_fill")),
                    (Filter::Projective, compose("fragment_projective")),
                ],
                absent: upload(gpu, &Mask::new([1, 1], |_, _| true)),
                mask_layout,
                part_layout,
            }
        })
    }

    /// Uploads a layer's mask and creates the bindings for [`Self::mask`].
    pub fn bind_mask(&self, gpu: &Gpu, mask: &Mask) -> wgpu::BindGroup {
        self.mask_bindings(gpu, &upload(gpu, mask))
    }

    fn mask_bindings(&self, gpu: &Gpu, flags: &wgpu::TextureView) -> wgpu::BindGroup {
        let flags = wgpu::BindingResource::TextureView(flags);
        bindings::group(gpu, "mask", &self.mask_layout, [(0, flags)])
    }

    /// Composes a picture from parts of layers.
    ///
    /// # Errors
    /// Driver errors.
    pub fn compose(
        &self,
        gpu: &Gpu,
        picture: &ColorTarget,
        parts: &[(&PicturePart, &LayerTarget)],
    ) -> Result<(), RasterError> {
        let unmasked = self.mask_bindings(gpu, &self.absent);
        gpu.submit("composing a picture", |encoder| {
            let bound: Vec<_> = (parts.iter())
                .map(|(part, layer)| self.bind_part(gpu, part, layer))
                .collect();
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[color_attachment(&picture.view, Some(wgpu::Color::BLACK))],
                ..Default::default()
            });
            for ((part, layer), bindings) in parts.iter().zip(&bound) {
                let covers = |axis: usize| {
                    if part.layer_from_px.is_some() {
                        return picture.size_px[axis] - part.origin_px[axis];
                    }
                    let end =
                        part.origin_px[axis] + layer.color.size_px[axis] * part.coarseness[axis];
                    end.min(picture.size_px[axis]) - part.origin_px[axis]
                };
                let [x, y] = part.origin_px;
                pass.set_scissor_rect(x, y, covers(0), covers(1));
                let pipeline = self.filters.iter().find(|(f, _)| *f == part.filter);
                if let Some((_, pipeline)) = pipeline {
                    pass.set_pipeline(pipeline);
                }
                let mask = layer.mask.as_ref().map_or(&unmasked, |mask| &mask.bindings);
                pass.set_bind_group(0, mask, &[]);
                pass.set_bind_group(1, bindings, &[]);
                pass.draw(0..3, 0..1);
            }
        })
    }

    fn bind_part(&self, gpu: &Gpu, part: &PicturePart, layer: &LayerTarget) -> wgpu::BindGroup {
        let data = PartData {
            origin: part.origin_px.map(|px| px as i32),
            coarseness: part.coarseness.map(|n| n as i32),
            some_tiles: [u32::from(part.tiles.is_some()), 0, 0, 0],
            layer_from_px: part
                .layer_from_px
                .unwrap_or_default()
                .as_mat3()
                .to_cols_array_2d()
                .map(|[x, y, z]| [x, y, z, 0.0]),
        };
        let uniform = gpu.buffer_of(&[data], wgpu::BufferUsages::UNIFORM);
        let tiles = part.tiles.as_ref().map(|tiles| upload(gpu, tiles));
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&layer.color.view),
            wgpu::BindingResource::TextureView(tiles.as_ref().unwrap_or(&self.absent)),
        ];
        bindings::group(gpu, "part", &self.part_layout, (0..).zip(resources))
    }
}

/// A texture with one byte per pixel: 1 where the mask is set.
fn upload(gpu: &Gpu, mask: &Mask) -> wgpu::TextureView {
    let bytes: Vec<u8> = mask.flags().iter().map(|flag| u8::from(*flag)).collect();
    gpu.texture_of(mask.size_px(), 1, wgpu::TextureFormat::R8Uint, &bytes)
}
