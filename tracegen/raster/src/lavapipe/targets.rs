//! Buffers and attachments that a view is rendered into.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT};
use crate::draws::SHADOW_SIZE;
use crate::error::RasterError;
use crate::uniforms::ViewData;
use record::{DEPTH_BYTES, RECORD_BYTES};

/// Attachments, record buffer and read-back buffer of a view.
pub struct Targets {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// The picture.
    pub color: wgpu::Texture,
    /// View of the picture.
    pub color_view: wgpu::TextureView,
    /// View of the depth buffer.
    pub depth_view: wgpu::TextureView,
    /// Raw records.
    pub records: wgpu::Buffer,
    /// Raw depths, one a record.
    pub depths: wgpu::Buffer,
    /// `depths` is as long as `records`; without masked draws it is a stand-in.
    pub has_depths: bool,
    /// Records appended, those beyond the capacity counted too.
    pub counter: wgpu::Buffer,
    /// Records that fit.
    pub capacity: u32,
    /// The eye's `View`.
    pub view_uniform: wgpu::Buffer,
    /// The picture on its way back.
    readback: wgpu::Buffer,
    row_bytes: u32,
}

impl Targets {
    /// Makes the attachments for views of `size_px` and a record buffer of at most
    /// `budget_bytes`, within the device's limit for one binding,
    /// with depths beside them if `has_depths`.
    ///
    /// # Errors
    /// A size of 0 or beyond the device's limit, and driver errors.
    pub fn new(
        gpu: &Gpu,
        size_px: [u32; 2],
        budget_bytes: u64,
        has_depths: bool,
    ) -> Result<Self, RasterError> {
        let limits = gpu.device.limits();
        // Records hold 12 bits of quad column and row.
        let limit = limits.max_texture_dimension_2d.min(8192);
        for extent in size_px {
            if extent == 0 || extent > limit {
                return Err(RasterError::TooLarge {
                    what: "pixels along a view's edge (at least 1)".into(),
                    found: extent.into(),
                    limit: limit.into(),
                });
            }
        }
        let binding = u64::from(limits.max_storage_buffer_binding_size as u32);
        let captures = gpu.no_capture.is_none();
        let budget_bytes = if captures { budget_bytes } else { 0 };
        let capacity =
            (budget_bytes.min(binding).min(limits.max_buffer_size) / RECORD_BYTES).max(1);
        let depths = if has_depths { capacity } else { 1 };
        let row_bytes = (size_px[0] * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        gpu.checked("making the render targets", || {
            let color = attachment(gpu, size_px, 1, COLOR_FORMAT, wgpu::TextureUsages::COPY_SRC);
            let depth = attachment(gpu, size_px, 1, DEPTH_FORMAT, wgpu::TextureUsages::empty());
            let buffer = |size, usage| {
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            use wgpu::BufferUsages as Usage;
            let recorded = if captures {
                Usage::STORAGE | Usage::MAP_READ
            } else {
                Usage::STORAGE
            };
            Self {
                size_px,
                color_view: color.create_view(&Default::default()),
                depth_view: depth.create_view(&Default::default()),
                color,
                records: buffer(capacity * RECORD_BYTES, recorded),
                depths: buffer(depths * DEPTH_BYTES, recorded),
                has_depths,
                counter: buffer(4, recorded | Usage::COPY_DST),
                capacity: capacity as u32,
                view_uniform: buffer(
                    size_of::<ViewData>() as u64,
                    Usage::UNIFORM | Usage::COPY_DST,
                ),
                readback: buffer(
                    u64::from(row_bytes) * u64::from(size_px[1]),
                    Usage::MAP_READ | Usage::COPY_DST,
                ),
                row_bytes,
            }
        })
    }

    /// Reads the picture: RGBA8 rows without padding.
    ///
    /// # Errors
    /// Driver errors.
    pub fn read_picture(&self, gpu: &Gpu) -> Result<Vec<u8>, RasterError> {
        let [width, height] = self.size_px;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.color.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.row_bytes),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
        );
        gpu.queue.submit([encoder.finish()]);
        gpu.read(&self.readback, 0..self.readback.size(), |bytes| {
            Ok(bytes
                .chunks_exact(self.row_bytes as usize)
                .flat_map(|row| row.iter().take(width as usize * 4))
                .copied()
                .collect())
        })
    }
}

/// The shadow map array: one view to sample, one a layer to render.
pub struct ShadowMaps {
    /// All layers.
    pub sampled: wgpu::TextureView,
    /// Each layer.
    pub layers: Vec<wgpu::TextureView>,
}

impl ShadowMaps {
    /// An array of `cascades` layers; without any, a single texel that no pipeline samples.
    #[must_use]
    pub fn new(gpu: &Gpu, cascades: u32) -> Self {
        let size = if cascades == 0 { 1 } else { SHADOW_SIZE };
        let texture = attachment(
            gpu,
            [size; 2],
            cascades.max(1),
            DEPTH_FORMAT,
            wgpu::TextureUsages::TEXTURE_BINDING,
        );
        let layers = (0..cascades)
            .map(|layer| {
                texture.create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: layer,
                    array_layer_count: Some(1),
                    ..Default::default()
                })
            })
            .collect();
        Self {
            sampled: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            layers,
        }
    }
}

fn attachment(
    gpu: &Gpu,
    size_px: [u32; 2],
    layers: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size_px[0],
            height: size_px[1],
            depth_or_array_layers: layers,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    })
}
