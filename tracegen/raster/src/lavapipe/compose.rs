//! What is done with whole layers: masks before their draws, pictures of them after.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT};
use super::targets::{ColorTarget, LayerTarget};
use crate::error::RasterError;
use formats::view::TILE_SIZE_PX;
use techniques::Mask;
use techniques::plan::{Filter, Part};
use wgpu::util::DeviceExt;

/// Pipelines that mask layers and compose pictures.
pub struct Composer {
    mask_layout: wgpu::BindGroupLayout,
    part_layout: wgpu::BindGroupLayout,
    /// Writes the nearest depth wherever a layer's mask is not set.
    pub mask: wgpu::RenderPipeline,
    filters: [(Filter, wgpu::RenderPipeline); 3],
    /// Stands for the mask of a layer and the tiles of a part that have none.
    absent: wgpu::TextureView,
}

/// The shader's `Part`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PartData {
    origin: [i32; 2],
    coarseness: [i32; 2],
    some_tiles: [u32; 4],
}

impl Composer {
    /// Compiles the shader.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gpu: &Gpu) -> Result<Self, RasterError> {
        gpu.checked("compiling the shader of the layers", || {
            let source = format!(
                "const TILE_SIZE: i32 = {TILE_SIZE_PX};\n{}",
                include_str!("../shaders/layers.wgsl")
            );
            let module = gpu
                .device
                .create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some("layers"),
                    source: wgpu::ShaderSource::Wgsl(source.into()),
                });
            let flags = texture_of(wgpu::TextureSampleType::Uint);
            let mask_layout = layout(gpu, &[flags]);
            let uniform = wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            };
            let color = texture_of(wgpu::TextureSampleType::Float { filterable: false });
            let part_layout = layout(gpu, &[uniform, color, flags]);
            let depth = wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            };
            let compose = |entry_point| {
                pipeline(
                    gpu,
                    &module,
                    &[&mask_layout, &part_layout],
                    entry_point,
                    None,
                )
            };
            Self {
                mask: pipeline(gpu, &module, &[&mask_layout], "fragment_mask", Some(depth)),
                filters: [
                    (Filter::Copy, compose("fragment_copy")),
                    (Filter::Bilinear, compose("fragment_bilinear")),
                    (Filter::FillQuads, compose("fragment_fill")),
                ],
                absent: upload(gpu, &Mask::new([1, 1], |_, _| true)),
                mask_layout,
                part_layout,
            }
        })
    }

    /// Uploads a layer's mask: what [`Self::mask`] is drawn with.
    pub fn bind_mask(&self, gpu: &Gpu, mask: &Mask) -> wgpu::BindGroup {
        self.mask_bindings(gpu, &upload(gpu, mask))
    }

    fn mask_bindings(&self, gpu: &Gpu, flags: &wgpu::TextureView) -> wgpu::BindGroup {
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("mask"),
            layout: &self.mask_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(flags),
            }],
        })
    }

    /// Makes a picture of parts of layers.
    ///
    /// # Errors
    /// Driver errors.
    pub fn compose(
        &self,
        gpu: &Gpu,
        picture: &ColorTarget,
        parts: &[(&Part, &LayerTarget)],
    ) -> Result<(), RasterError> {
        let unmasked = self.mask_bindings(gpu, &self.absent);
        gpu.checked("composing a picture", || {
            let bound: Vec<_> = (parts.iter())
                .map(|(part, layer)| self.bind_part(gpu, part, layer))
                .collect();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &picture.view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            });
            for ((part, layer), bindings) in parts.iter().zip(&bound) {
                let covers = |axis: usize| {
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
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        })
    }

    fn bind_part(&self, gpu: &Gpu, part: &Part, layer: &LayerTarget) -> wgpu::BindGroup {
        let data = PartData {
            origin: part.origin_px.map(|px| px as i32),
            coarseness: part.coarseness.map(|n| n as i32),
            some_tiles: [u32::from(part.tiles.is_some()), 0, 0, 0],
        };
        let uniform = gpu
            .device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("part"),
                contents: bytemuck::bytes_of(&data),
                usage: wgpu::BufferUsages::UNIFORM,
            });
        let tiles = part.tiles.as_ref().map(|tiles| upload(gpu, tiles));
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&layer.color.view),
            wgpu::BindingResource::TextureView(tiles.as_ref().unwrap_or(&self.absent)),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("part"),
            layout: &self.part_layout,
            entries: &entries,
        })
    }
}

fn texture_of(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

/// What fragments read, binding by binding.
fn layout(gpu: &Gpu, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: *ty,
            count: None,
        })
        .collect();
    gpu.device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("layers"),
            entries: &entries,
        })
}

/// Draws the fragment entry point over the whole target.
fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    groups: &[&wgpu::BindGroupLayout],
    entry_point: &str,
    depth_stencil: Option<wgpu::DepthStencilState>,
) -> wgpu::RenderPipeline {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    let layout = gpu
        .device
        .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("vertex_whole"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                targets: &[Some(COLOR_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
}

/// A texture of a byte a pixel: 1 where the mask is set.
fn upload(gpu: &Gpu, mask: &Mask) -> wgpu::TextureView {
    let [width, height] = mask.size_px();
    let bytes: Vec<u8> = mask.flags().iter().map(|flag| u8::from(*flag)).collect();
    let descriptor = wgpu::TextureDescriptor {
        label: Some("mask"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    gpu.device
        .create_texture_with_data(&gpu.queue, &descriptor, order, &bytes)
        .create_view(&Default::default())
}
