//! Both eyes in one submission, and tests of the driver's multiview.
//!
//! lavapipe of Mesa 22.3 drops triangles across an edge of clip space in view 1. Therefore a small
//! scene of such triangles is drawn with and without multiview first, and then the first frame.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT, Pipelines, VIEW_COUNT, VIEWS};
use super::readback::Readback;
use super::targets::{attachment, color_attachment};
use super::{Lavapipe, bind_view, state_changes};
use crate::backend::{CaptureBackend, View};
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::roles::Purpose;
use crate::uniforms::ViewData;
use record::Region;
use std::time::Instant;

/// Pixels along an edge of the test scene.
const EDGE_PX: u32 = 64;
/// Triangles of the test scene.
const TRIANGLES: u32 = 96;

/// Resources for drawing both eyes at once.
pub struct Multiview {
    /// Pipelines for two views.
    pub pipelines: Pipelines,
    /// The `View` of each eye.
    pub uniform: wgpu::Buffer,
    /// Attachments of two layers.
    pub targets: Targets,
}

/// Test results of the driver's multiview.
#[derive(Clone, Debug, Default)]
pub enum Trust {
    /// Not tried yet.
    #[default]
    Unknown,
    /// Both methods give the same picture of the test scene.
    Likely,
    /// Both methods also give the same picture of a frame.
    Sound,
    /// The pictures differ, or the driver has no multiview.
    Defect(String),
}

impl Lavapipe {
    /// Defect of the driver's multiview; `None` if it works. Draws the test scene with both methods
    /// on first use.
    ///
    /// # Errors
    /// Driver errors.
    pub fn multiview_defect(&mut self) -> Result<Option<String>, RasterError> {
        if let Trust::Unknown = self.multiview_trust {
            self.multiview_trust = if self.gpu.has_multiview {
                match differing_px(&self.gpu)? {
                    0 => Trust::Likely,
                    differing => Trust::Defect(format!(
                        "{}: {differing} of {} pixels of a known scene differ from drawing view by view",
                        self.gpu.driver,
                        2 * EDGE_PX * EDGE_PX
                    )),
                }
            } else {
                Trust::Defect(format!("{} has none", self.gpu.driver))
            };
        }
        Ok(match &self.multiview_trust {
            Trust::Defect(defect) => Some(defect.clone()),
            Trust::Unknown | Trust::Likely | Trust::Sound => None,
        })
    }

    /// Renders the left and the right layer, whole and of equal size, with one list of draws for
    /// both: in one submission if the driver's multiview is sound, or else one by one.
    /// [`crate::backend::Work`] counts one submission either way.
    ///
    /// # Errors
    /// Driver errors.
    pub fn render_both(
        &mut self,
        draws: &DrawList,
        views: [&View<'_>; 2],
    ) -> Result<(), RasterError> {
        let list = union(views[0].visible, views[1].visible);
        let both = views.map(|view| View {
            visible: &list,
            ..*view
        });
        let mut at_once = None;
        if self.multiview_defect()?.is_none() {
            self.draw_at_once(draws, &both)?;
            if let Trust::Sound = self.multiview_trust {
                return Ok(());
            }
            at_once = Some((self.both_pictures(&both)?, self.work));
        }
        let before = self.work;
        for view in &both {
            let whole = Region {
                origin_px: [0, 0],
                size_px: view.layer.size_px,
            };
            self.render(draws, view, whole, None)?;
        }
        if let Some((at_once, counted)) = at_once {
            // The first frame is the second test: both methods must agree on it.
            let differing = differing(&at_once, &self.both_pictures(&both)?);
            self.multiview_trust = match differing {
                0 => Trust::Sound,
                _ => Trust::Defect(format!(
                    "{}: {differing} pixels of the first frame differ from drawing view by view",
                    self.gpu.driver
                )),
            };
            self.work = counted;
            return Ok(());
        }
        // Counted as one submission.
        self.work.draws = before.draws;
        self.work.calls = before.calls;
        self.work.vertices = before.vertices;
        self.work.triangles = before.triangles;
        self.work.bytes_uploaded = before.bytes_uploaded + size_of::<[ViewData; 2]>() as u64;
        let plan = self.plan(draws, &list, Purpose::Plain)?;
        self.work.state_changes = before.state_changes + state_changes(draws, &plan);
        Ok(())
    }

    fn both_pictures(&self, views: &[View<'_>; 2]) -> Result<Vec<u8>, RasterError> {
        let mut both = Vec::new();
        for view in views {
            let color = &self.target(view.target)?.color.view;
            both.extend(self.readback.texels::<u8>(&self.gpu, color.texture())?);
        }
        Ok(both)
    }

    fn draw_at_once(&mut self, draws: &DrawList, views: &[View<'_>; 2]) -> Result<(), RasterError> {
        let start = Instant::now();
        let size_px = views[0].layer.size_px;
        for view in views {
            self.prepare_target(view)?;
        }
        let mut multiview = match self.multiview.take() {
            Some(made) if made.targets.size_px == size_px => made,
            _ => Multiview::new(&self.gpu, size_px)?,
        };
        // The pipelines for two views temporarily replace those for one.
        std::mem::swap(&mut self.pipelines, &mut multiview.pipelines);
        let drawn = self.submit_both(draws, views, &multiview, start);
        std::mem::swap(&mut self.pipelines, &mut multiview.pipelines);
        self.multiview = Some(multiview);
        drawn
    }

    fn submit_both(
        &mut self,
        draws: &DrawList,
        views: &[View<'_>; 2],
        multiview: &Multiview,
        start: Instant,
    ) -> Result<(), RasterError> {
        let plan = self.plan(draws, views[0].visible, Purpose::Plain)?;
        self.work.regions += 1;
        self.work.state_changes += state_changes(draws, &plan);
        let data = views.each_ref().map(|view| ViewData::of_eye(view, 0));
        self.work.bytes_uploaded += size_of_val(&data) as u64;
        let gpu = &self.gpu;
        gpu.queue
            .write_buffer(&multiview.uniform, 0, bytemuck::cast_slice(&data));
        let bindings = bind_view(
            gpu,
            &self.pipelines,
            &self.scene,
            &self.buffers,
            &self.buffers.records,
            &multiview.uniform,
            &self.shadow_maps.sampled,
        );
        let targets = [self.target(views[0].target)?, self.target(views[1].target)?];
        gpu.submit("rendering both views", |encoder| {
            let mut pass = multiview.targets.pass(encoder);
            pass.set_bind_group(0, &bindings, &[]);
            if let Some(any) = self.scene.materials.first() {
                pass.set_bind_group(1, any, &[]);
            }
            pass.set_pipeline(self.pipelines.background.of(true));
            pass.draw(0..3, 0..1);
            self.issue(&mut pass, draws, &plan);
            drop(pass);
            for (layer, target) in (0..).zip(targets) {
                let mut from = multiview.targets.color.as_image_copy();
                from.origin.z = layer;
                let [width, height] = multiview.targets.size_px;
                let size = wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                };
                let to = target.color.view.texture().as_image_copy();
                encoder.copy_texture_to_texture(from, to, size);
            }
        })?;
        let submitted = Instant::now();
        gpu.wait("rendering both views")?;
        self.work.submitting += submitted - start;
        self.work.waiting += submitted.elapsed();
        Ok(())
    }
}

/// Merges two ascending lists.
fn union(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut merged = [a, b].concat();
    merged.sort_unstable();
    merged.dedup();
    merged
}

/// Colour and depth of both views.
pub struct Targets {
    /// Pixels of a view.
    pub size_px: [u32; 2],
    /// Colour, one layer per view.
    pub color: wgpu::Texture,
    color_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl Multiview {
    /// Compiles the shader for two views of `size_px`.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self, RasterError> {
        let pipelines = Pipelines::for_both_views(gpu)?;
        let targets = gpu.checked("making targets for both views", || {
            Targets::new(gpu, size_px)
        })?;
        Ok(Self {
            pipelines,
            uniform: gpu.buffer(
                u64::from(VIEW_COUNT) * size_of::<ViewData>() as u64,
                wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            ),
            targets,
        })
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: [u32; 2]) -> Self {
        let texture = |format, usage| attachment(gpu, size_px, VIEW_COUNT, 1, format, usage);
        let view = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let color = texture(COLOR_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::empty());
        Self {
            size_px,
            color_view: view(&color),
            depth_view: view(&depth),
            color,
        }
    }

    /// A render pass over both views.
    pub fn pass<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        pass(encoder, &self.color_view, &self.depth_view, Some(VIEWS))
    }
}

fn pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    color: &wgpu::TextureView,
    depth: &wgpu::TextureView,
    multiview_mask: Option<std::num::NonZeroU32>,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[color_attachment(color, Some(wgpu::Color::BLACK))],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        multiview_mask,
        ..Default::default()
    })
}

/// Number of pixels of the test scene that differ between multiview and separate views.
///
/// # Errors
/// Driver errors.
pub fn differing_px(gpu: &Gpu) -> Result<u32, RasterError> {
    let module = gpu.module("clip edges", include_str!("../shaders/clip_edges.wgsl"));
    let both = gpu.checked("drawing both views at once", || {
        let targets = Targets::new(gpu, [EDGE_PX; 2]);
        let pipeline = pipeline(gpu, &module, "vertex_both", 0, Some(VIEWS));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = targets.pass(&mut encoder);
        pass.set_pipeline(&pipeline);
        draw_triangles(&mut pass);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        targets
    })?;
    let alone = gpu.checked("drawing view by view", || {
        let targets = Targets::new(gpu, [EDGE_PX; 2]);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for view in 0..VIEW_COUNT {
            let pipeline = pipeline(gpu, &module, "vertex_one", view, None);
            let layer = |texture: &wgpu::TextureView| {
                texture.texture().create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: view,
                    array_layer_count: Some(1),
                    ..Default::default()
                })
            };
            let (color, depth) = (layer(&targets.color_view), layer(&targets.depth_view));
            let mut pass = pass(&mut encoder, &color, &depth, None);
            pass.set_pipeline(&pipeline);
            draw_triangles(&mut pass);
        }
        gpu.queue.submit([encoder.finish()]);
        targets
    })?;
    let readback = Readback::default();
    let read = |targets: &Targets| readback.texels::<u8>(gpu, &targets.color);
    Ok(differing(&read(&both)?, &read(&alone)?))
}

/// Number of pixels in which two pictures differ.
fn differing(a: &[u8], b: &[u8]) -> u32 {
    let pairs = a.chunks_exact(4).zip(b.chunks_exact(4));
    pairs.filter(|(a, b)| a != b).count() as u32
}

/// One draw per triangle, so that the driver cannot reuse results between triangles.
fn draw_triangles(pass: &mut wgpu::RenderPass<'_>) {
    for triangle in 0..TRIANGLES {
        pass.draw(3 * triangle..3 * triangle + 3, 0..1);
    }
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    entry_point: &'static str,
    view: u32,
    multiview_mask: Option<std::num::NonZeroU32>,
) -> wgpu::RenderPipeline {
    let constants = [("VIEW", f64::from(view))];
    let constants: &[(&str, f64)] = if multiview_mask.is_some() {
        &[]
    } else {
        &constants
    };
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    ..Default::default()
                },
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("fragment_color"),
                compilation_options: Default::default(),
                targets: &[Some(COLOR_FORMAT.into())],
            }),
            multiview_mask,
            cache: None,
        })
}
