//! Counts fragments per pixel by additive blending: a check of the capture that shares neither
//! ballots nor atomics nor post-processing with it.

use super::Lavapipe;
use super::pipelines::DEPTH_FORMAT;
use crate::backend::View;
use crate::draws::{DrawList, DrawMode};
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;

impl Lavapipe {
    /// Fragments of all opaque and blended draws that pass the early depth test, by pixel.
    ///
    /// # Errors
    /// Driver errors.
    ///
    /// # Panics
    /// Where a draw is alpha-masked.
    pub fn count_fragments(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
    ) -> Result<Vec<u32>, RasterError> {
        assert!(
            draws.calls.iter().all(|c| c.mode != DrawMode::Masked),
            "alpha tests need the in-order replay"
        );
        let every: Vec<u32> = (0..draws.calls.len() as u32).collect();
        let plan = self.plan(draws, &every, Purpose::Count)?;
        let [width, height] = view.layer.size_px;
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let texture = |format, usage| {
            self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let counts = texture(wgpu::TextureFormat::R16Float, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::empty());
        let row_bytes = (width * 2).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let readback = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let data = ViewData::of_eye(view, self.buffers.capacity);
        self.gpu
            .queue
            .write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (count_view, depth_view) = (
            counts.create_view(&Default::default()),
            depth.create_view(&Default::default()),
        );
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &count_view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.eye_bindings, &[]);
        self.issue(&mut pass, draws, &plan);
        drop(pass);
        encoder.copy_texture_to_buffer(
            counts.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            size,
        );
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read(&readback, 0..readback.size(), |bytes| {
            let row = |row: &[u8]| -> Vec<u32> {
                row.chunks_exact(2)
                    .take(width as usize)
                    .map(|h| half_to_integer(u16::from_le_bytes([h[0], h[1]])))
                    .collect()
            };
            Ok(bytes
                .chunks_exact(row_bytes as usize)
                .flat_map(row)
                .collect())
        })
    }
}

impl Lavapipe {
    /// Depths of a layer that has been rendered, row by row.
    ///
    /// # Errors
    /// Driver errors.
    pub fn depths(&self, layer: usize) -> Result<Vec<f32>, RasterError> {
        let texture = self.target(layer)?.depth_view.texture();
        let size = texture.size();
        let row_bytes = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let readback = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes) * u64::from(size.height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            size,
        );
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read(&readback, 0..readback.size(), |bytes| {
            let row = |row: &[u8]| -> Vec<f32> {
                let texels = row.chunks_exact(4).take(size.width as usize);
                texels.map(bytemuck::pod_read_unaligned).collect()
            };
            Ok(bytes
                .chunks_exact(row_bytes as usize)
                .flat_map(row)
                .collect())
        })
    }
}

/// A non-negative integer up to 2048 in half precision.
fn half_to_integer(bits: u16) -> u32 {
    let exponent = i32::from(bits >> 10) - 15;
    let mantissa = f32::from(bits & 1023 | 1024) / 1024.0;
    if bits == 0 {
        0
    } else {
        (mantissa * (exponent as f32).exp2()) as u32
    }
}
