//! Samples of visible fragments, filtered by the driver's texture unit, for verifying the records.

use super::Lavapipe;
use super::pipelines::{DEPTH_FORMAT, FARTHEST, PRIMITIVE_FORMAT, TEXEL_FORMAT};
use super::targets::{attachment, color_attachment, depth_attachment};
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
            color_attachment(
                view,
                Some(wgpu::Color {
                    r: none,
                    ..wgpu::Color::default()
                }),
            )
        };
        gpu.submit("rendering texels", |encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[
                    cleared(color_view, 0.0),
                    cleared(primitive_view, f64::from(Texels::NO_PRIMITIVE)),
                ],
                depth_stencil_attachment: depth_attachment(depth_view, Some(FARTHEST)),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.eye_bindings, &[]);
            self.issue(&mut pass, draws, &plan);
        })?;
        Ok(Texels {
            colors: self.readback.texels(gpu, &colors)?,
            primitives: self.readback.texels(gpu, &primitives)?,
        })
    }
}
