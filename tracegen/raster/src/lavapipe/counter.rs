//! Counts fragments per pixel by additive blending. This check is independent of the capture: it
//! uses neither ballots nor atomics nor post-processing.

use super::Lavapipe;
use super::pipelines::{DEPTH_FORMAT, FARTHEST};
use super::targets::{attachment, color_attachment, depth_attachment};
use crate::backend::View;
use crate::draws::{DrawList, DrawMode};
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;

impl Lavapipe {
    /// Number of fragments of all opaque and blended draws that pass the early depth test, per
    /// pixel.
    ///
    /// # Errors
    /// Driver errors.
    ///
    /// # Panics
    /// If a draw is alpha-masked.
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
        let texture =
            |format, usage| attachment(&self.gpu, view.layer.size_px, 1, 1, format, usage);
        let counts = texture(wgpu::TextureFormat::R16Float, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::empty());
        let data = ViewData::of_eye(view, self.buffers.capacity);
        self.gpu
            .queue
            .write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let (count_view, depth_view) = (
            counts.create_view(&Default::default()),
            depth.create_view(&Default::default()),
        );
        self.gpu.submit("counting fragments", |encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[color_attachment(&count_view, Some(wgpu::Color::default()))],
                depth_stencil_attachment: depth_attachment(&depth_view, Some(FARTHEST)),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.eye_bindings, &[]);
            self.issue(&mut pass, draws, &plan);
        })?;
        let halves: Vec<u16> = self.readback.texels(&self.gpu, &counts)?;
        Ok(halves.into_iter().map(half_to_integer).collect())
    }

    /// Depths of a layer that has been rendered, row by row.
    ///
    /// # Errors
    /// Driver errors.
    pub fn depths(&self, layer: usize) -> Result<Vec<f32>, RasterError> {
        (self.readback).texels(&self.gpu, self.target(layer)?.depth_view.texture())
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
