//! Samples of visible fragments, filtered by the driver's texture unit, for verifying the records.

use super::Lavapipe;
use super::pipelines::{DEPTH_FORMAT, FARTHEST, PRIMITIVE_FORMAT, TEXEL_FORMAT};
use super::targets::attachment;
use crate::backend::{Texels, View};
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;
use scene::TextureSlot;

impl Lavapipe {
    /// Renders a view's opaque and masked draws with the filtered texels of the materials' textures in
    /// `slot` in place of colour.
    ///
    /// # Errors
    /// Driver errors.
    pub fn texels(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        slot: TextureSlot,
    ) -> Result<Texels, RasterError> {
        let plan = self.plan(draws, view.visible, Purpose::Texel)?;
        let gpu = &self.gpu;
        let texture = |format, usage| attachment(gpu, view.layer.size_px, 1, 1, format, usage);
        let copied = wgpu::TextureUsages::COPY_SRC;
        let (colors, primitives) = (
            texture(TEXEL_FORMAT, copied),
            texture(PRIMITIVE_FORMAT, copied),
        );
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::empty());
        let data = ViewData::of_eye(view, 0).with_texture_slot(slot);
        gpu.queue
            .write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let views = [&colors, &primitives, &depth].map(|t| t.create_view(&Default::default()));
        let [color_view, primitive_view, depth_view] = &views;
        let cleared = |view, none: f64| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color {
                        r: none,
                        ..wgpu::Color::default()
                    }),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        gpu.checked("rendering texels", || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[
                    cleared(color_view, 0.0),
                    cleared(primitive_view, f64::from(Texels::NO_PRIMITIVE)),
                ],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: depth_view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(FARTHEST),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.eye_bindings, &[]);
            self.issue(&mut pass, draws, &plan);
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        })?;
        Ok(Texels {
            colors: self.readback.texels(gpu, &colors)?,
            primitives: self.readback.texels(gpu, &primitives)?,
        })
    }
}
