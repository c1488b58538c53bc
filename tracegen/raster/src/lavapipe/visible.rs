//! Depth for occlusion culling, and the visibility of all draws, found by drawing everything.

use super::pipelines::{DEPTH_FORMAT, FARTHEST};
use super::targets::{attachment, depth_attachment};
use super::{Lavapipe, bind_view};
use crate::backend::{Marks, View};
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;
use formats::view::Lens;
use glam::Mat4;

impl Lavapipe {
    /// Renders only the depth of a view's opaque and masked draws and reads it: row by row, 0 where
    /// nothing was drawn.
    ///
    /// # Errors
    /// Driver errors.
    pub fn depth(&mut self, draws: &DrawList, view: &View<'_>) -> Result<Vec<f32>, RasterError> {
        let data = ViewData::of_eye(view, 0);
        (self.gpu.queue).write_buffer(&self.buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        let depth = self.depth_texture(view);
        self.draw_alone(draws, view.visible, Purpose::Depth, &depth, None)?;
        self.readback.texels(&self.gpu, &depth)
    }

    /// Draws everything, culled or not, and returns for each draw whether it is visible in a view.
    /// A draw is visible if one of its fragments passes the depth test against the final depth (and
    /// its alpha test).
    ///
    /// # Errors
    /// Driver errors, and a device that cannot capture.
    pub fn marks(
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
        // Two words per draw, zero until one of its fragments is visible.
        let words = self.gpu.buffer(
            8 * every.len().max(1) as u64,
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::MAP_READ,
        );
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
        let usage = wgpu::TextureUsages::COPY_SRC;
        attachment(&self.gpu, view.layer.size_px, 1, 1, DEPTH_FORMAT, usage)
    }

    /// Draws without colour. Depth is cleared first, unless marks are made against it; group 0 is
    /// then `marking`.
    fn draw_alone(
        &mut self,
        draws: &DrawList,
        list: &[u32],
        purpose: Purpose,
        depth: &wgpu::Texture,
        marking: Option<&wgpu::BindGroup>,
    ) -> Result<(), RasterError> {
        let plan = self.plan(draws, list, purpose)?;
        let clear = marking.is_none().then_some(FARTHEST);
        self.gpu.submit("rendering depth alone", |encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                depth_stencil_attachment: depth_attachment(
                    &depth.create_view(&Default::default()),
                    clear,
                ),
                ..Default::default()
            });
            pass.set_bind_group(0, marking.unwrap_or(&self.eye_bindings), &[]);
            self.issue(&mut pass, draws, &plan);
        })
    }
}

/// A lens in pixels of a view: centre and inverse radii.
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
