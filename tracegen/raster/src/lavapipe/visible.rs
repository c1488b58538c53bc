//! Depth alone, for occlusion culling, and which draws are visible, by drawing everything.

use super::pipelines::DEPTH_FORMAT;
use super::{Lavapipe, bind_view};
use crate::backend::{Marks, View};
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;
use formats::view::Lens;
use glam::Mat4;

impl Lavapipe {
    /// Depth of the view's opaque and masked draws, row by row.
    pub(super) fn read_depth(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
    ) -> Result<Vec<f32>, RasterError> {
        let data = ViewData::of_eye(view, 0);
        (self.gpu.queue).write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let depth = self.depth_texture(view);
        self.draw_alone(draws, view.visible, Purpose::Depth, &depth, None)?;
        let [width, height] = view.layer.size_px;
        let row_bytes = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("depth on its way back"),
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            depth.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            depth.size(),
        );
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read(&buffer, 0..buffer.size(), |bytes| {
            let row = |row: &[u8]| -> Vec<f32> {
                (row.chunks_exact(4).take(width as usize))
                    .map(|texel| f32::from_le_bytes([texel[0], texel[1], texel[2], texel[3]]))
                    .collect()
            };
            Ok(bytes
                .chunks_exact(row_bytes as usize)
                .flat_map(row)
                .collect())
        })
    }

    /// What is visible of every draw, those left out of the view too.
    pub(super) fn read_marks(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        lens: &Lens,
    ) -> Result<Vec<Marks>, RasterError> {
        if let Some(what) = &self.gpu.no_capture {
            return Err(RasterError::Unsupported {
                driver: self.gpu.driver.clone(),
                what: what.clone(),
            });
        }
        let every: Vec<u32> = (0..draws.calls.len() as u32).collect();
        let data = ViewData::of_eye(view, 0).with_lens(lens_px(lens, view));
        (self.gpu.queue).write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let depth = self.depth_texture(view);
        self.draw_alone(draws, &every, Purpose::Depth, &depth, None)?;
        // Two words a draw; zero until a fragment of it is seen.
        let words = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("marks"),
            size: 8 * every.len().max(1) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let bindings = bind_view(
            &self.gpu,
            &self.pipelines,
            &self.scene,
            &self.buffers,
            &words,
            &self.buffers.view_uniform,
            &self.shadow_maps.sampled,
        );
        self.draw_alone(draws, &every, Purpose::Mark, &depth, Some(&bindings))?;
        self.gpu.read(&words, 0..words.size(), |bytes| {
            let mark = |words: &[u8]| Marks {
                picture: words[..4] != [0; 4],
                lens: words[4..] != [0; 4],
            };
            Ok(bytes.chunks_exact(8).take(every.len()).map(mark).collect())
        })
    }

    fn depth_texture(&self, view: &View<'_>) -> wgpu::Texture {
        let [width, height] = view.layer.size_px;
        self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("depth alone"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// Draws without colour: depth is cleared first, unless there are marks to be made against it,
    /// for which group 0 is `marking`.
    fn draw_alone(
        &mut self,
        draws: &DrawList,
        list: &[u32],
        purpose: Purpose,
        depth: &wgpu::Texture,
        marking: Option<&wgpu::BindGroup>,
    ) -> Result<(), RasterError> {
        let plan = self.plan(draws, list, purpose)?;
        let load = match marking {
            Some(_) => wgpu::LoadOp::Load,
            None => wgpu::LoadOp::Clear(1.0),
        };
        self.gpu.checked("rendering depth alone", || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &depth.create_view(&Default::default()),
                    depth_ops: Some(wgpu::Operations {
                        load,
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_bind_group(0, marking.unwrap_or(&self.eye_bindings), &[]);
            self.issue(&mut pass, draws, &plan);
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
        })
    }
}

/// A lens in pixels of a view: centre, and inverse radii.
fn lens_px(lens: &Lens, view: &View<'_>) -> [f32; 4] {
    let projection = Mat4::from_cols_array_2d(&view.layer.view.eye_to_clip);
    let [width, height] = view.layer.size_px.map(|extent| extent as f32 / 2.0);
    let [x, y] = lens.center;
    let ndc_x = projection.x_axis.x * x - projection.z_axis.x;
    let ndc_y = projection.y_axis.y * y - projection.z_axis.y;
    [
        (ndc_x + 1.0) * width,
        (1.0 - ndc_y) * height,
        1.0 / (projection.x_axis.x * lens.radius * width),
        1.0 / (projection.y_axis.y * lens.radius * height),
    ]
}
