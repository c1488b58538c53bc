//! Capture through lavapipe, Mesa's Vulkan driver on llvmpipe.

mod alpha;
mod bindings;
mod compose;
mod counter;
pub mod device;
mod missing;
mod multiview;
mod pipelines;
mod readback;
mod records;
mod shadow_maps;
mod starts;
mod targets;
mod texels;
mod upload;
mod visible;
mod whole;

use super::backend::{CaptureBackend, Fragments, RecordRequest, View, Work};
use super::batches::{self, Batch, Plan};
use super::draws::{DrawList, DrawMode};
use super::error::RasterError;
use super::frame::Frame;
use super::roles::{MaterialState, PipelineKey, Purpose};
use super::shader::{AlphaSource, Granularity, VIEW_BINDINGS};
use super::uniforms::ViewData;
use compose::Composer;
use device::Gpu;
use formats::texture::TexelFormat;
use multiview::{Multiview, Trust};
use pipelines::Pipelines;
use readback::Readback;
use record::{Captured, DEPTH_BYTES, MergedQuads, RECORD_BYTES, RawRecords, Region};
use records::RecordBuffers;
use scene::Scene;
use shadow_maps::ShadowMaps;
use starts::{Drawn, Starts};
use std::sync::Arc;
use std::time::Instant;
use targets::{ColorTarget, LayerMask, LayerTarget, depth_attachment};
use techniques::Start;
use techniques::plan::PictureSource;
use techniques::start::Opening;
use textures::TextureSet;
use upload::SceneBuffers;

/// The scene uploaded to lavapipe.
pub struct Lavapipe {
    gpu: Gpu,
    pipelines: Pipelines,
    scene: SceneBuffers,
    buffers: RecordBuffers,
    /// Target of each layer, by its position in the frame's plan.
    layers: Vec<Option<LayerTarget>>,
    /// Target of each composed picture, by its number in the plan.
    composed: Vec<Option<ColorTarget>>,
    /// Created when a plan first needs it.
    composer: Option<Composer>,
    readback: Readback,
    shadow_maps: ShadowMaps,
    /// Group 0 for the eyes.
    eye_bindings: wgpu::BindGroup,
    /// Bindings of each material.
    materials: Vec<MaterialState>,
    /// Multiview. Created on first use.
    multiview: Option<Multiview>,
    multiview_trust: Trust,
    /// Initial contents of layers other than the sky. Created on first use.
    starts: Option<Starts>,
    work: Work,
}

impl Lavapipe {
    /// The device is the processor.
    pub fn is_software(&self) -> bool {
        self.gpu.is_software
    }

    /// Uploads the scene to an opened device. A region is split if its raw records exceed
    /// `record_budget_bytes`, capped by the driver's limit of 128 MiB.
    ///
    /// # Errors
    /// Driver errors, sizes beyond the device's limits.
    pub fn new(
        gpu: Gpu,
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
        view_size_px: [u32; 2],
        record_budget_bytes: u64,
    ) -> Result<Self, RasterError> {
        let copies = alpha::planned(&gpu, scene, draws, textures);
        let source = if copies.is_empty() {
            AlphaSource::Color
        } else {
            AlphaSource::Copy
        };
        let pipelines = Pipelines::new(&gpu, source)?;
        let buffers = SceneBuffers::new(&gpu, &pipelines.layouts, scene, draws, textures, &copies)?;
        let masked = draws.calls.iter().any(|c| c.mode == DrawMode::Masked);
        targets::check_size(&gpu, view_size_px)?;
        let record_buffers = RecordBuffers::new(&gpu, record_budget_bytes, masked)?;
        let shadow_maps = gpu.checked("making the shadow maps", || {
            ShadowMaps::new(&gpu, draws.cascades, draws.shadow_format)
        })?;
        let eye_bindings = bind_view(
            &gpu,
            &pipelines,
            &buffers,
            &record_buffers,
            &record_buffers.records,
            &record_buffers.view_uniform,
            &shadow_maps.sampled,
        );
        let materials = (scene.materials.iter().zip(&draws.groups))
            .map(|(material, groups)| MaterialState::new(material, groups))
            .collect();
        let work = Work {
            samplers: buffers.samplers as u64,
            ..Work::default()
        };
        Ok(Self {
            gpu,
            pipelines,
            scene: buffers,
            buffers: record_buffers,
            layers: Vec::new(),
            composed: Vec::new(),
            composer: None,
            readback: Readback::default(),
            shadow_maps,
            eye_bindings,
            materials,
            multiview: None,
            multiview_trust: Trust::Unknown,
            starts: None,
            work,
        })
    }

    /// The target of a prepared layer.
    fn target(&self, number: usize) -> Result<&LayerTarget, RasterError> {
        let target = self.layers.get(number).and_then(Option::as_ref);
        target.ok_or_else(|| RasterError::Scene(format!("layer {number} has not been rendered")))
    }

    /// Creates the target of a layer unless the last frame's target fits.
    fn prepare_target(&mut self, view: &View<'_>) -> Result<(), RasterError> {
        let size_px = view.layer.size_px;
        let gpu = &self.gpu;
        if self.layers.len() <= view.target {
            self.layers.resize_with(view.target + 1, || None);
        }
        let target = &mut self.layers[view.target];
        target.take_if(|target| target.color.size_px != size_px);
        let target = match target {
            Some(target) => target,
            None => target.insert(LayerTarget::new(gpu, size_px)?),
        };
        let wanted = view.layer.mask.as_ref();
        let found = target.mask.as_ref().map(|mask| &mask.mask);
        if wanted.map(Arc::as_ptr) == found.map(Arc::as_ptr) {
            return Ok(());
        }
        target.mask = match wanted {
            None => None,
            Some(mask) => {
                self.work.bytes_uploaded += mask.flags().len() as u64;
                let composer = match &mut self.composer {
                    Some(composer) => composer,
                    None => self.composer.insert(Composer::new(gpu)?),
                };
                Some(LayerMask {
                    bindings: composer.bind_mask(gpu, mask),
                    bounds: (mask.bounds_px())
                        .map(|[origin_px, size_px]| Region { origin_px, size_px }),
                    mask: Arc::clone(mask),
                })
            }
        };
        target.clear(gpu)
    }

    /// Creates the targets of the frame's layers that differ from the last frame's. The same
    /// techniques reuse memory and masks from frame to frame.
    ///
    /// # Errors
    /// Driver errors.
    pub fn prepare(&mut self, frame: &Frame) -> Result<(), RasterError> {
        for view in frame.views() {
            self.prepare_target(&view)?;
        }
        self.gpu.wait("preparing the targets")
    }

    /// Batches a list of draws and creates the missing pipelines. The list stays in the instance
    /// buffer until the next plan's submission.
    fn plan(
        &mut self,
        draws: &DrawList,
        visible: &[u32],
        purpose: Purpose,
    ) -> Result<Plan, RasterError> {
        let plan = batches::plan(draws, &self.materials, visible, purpose);
        for (_, key) in &plan {
            self.pipelines.prepare(&self.gpu, *key)?;
        }
        let meshes = &self.scene.meshes;
        self.work.add_draws(draws, &plan, |mesh| {
            (meshes[mesh].as_ref()).map_or([0; 2], |m| [m.vertex_count, m.index_count / 3])
        });
        self.gpu
            .queue
            .write_buffer(&self.scene.instance_draws, 0, bytemuck::cast_slice(visible));
        self.work.bytes_uploaded += size_of_val(visible) as u64;
        Ok(plan)
    }

    /// Initial contents of a layer; `None` if that is only the sky.
    fn start(&self, start: &Start) -> Result<Option<Drawn<'_>>, RasterError> {
        let Some(starts) = &self.starts else {
            return Ok(None);
        };
        let gpu = &self.gpu;
        Ok(match start {
            Start::Sky => None,
            Start::Nearer { end } => Some(starts.nearer(gpu, *end)),
            Start::Behind([left, right]) => {
                let of = |opening: &Opening| self.target(opening.nearer);
                let openings = [(left, of(left)?), (right, of(right)?)];
                Some(starts.behind(gpu, openings))
            }
            Start::Composed(composition) => {
                let nearer = self.target(composition.nearer)?;
                let farther = self.target(composition.farther)?;
                Some(starts.composed(gpu, composition, nearer, farther))
            }
            Start::Reused(reuse) => Some(starts.reused(gpu, reuse, self.target(reuse.from)?)),
        })
    }

    /// Begins a render pass over a region of a layer with its initial contents and its mask.
    fn layer_pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        target: &LayerTarget,
        region: Region,
        start: Option<&Drawn<'_>>,
        picture: bool,
    ) -> wgpu::RenderPass<'e> {
        let mut pass = target.pass(encoder, picture);
        pass.set_scissor_rect(
            region.origin_px[0],
            region.origin_px[1],
            region.size_px[0],
            region.size_px[1],
        );
        pass.set_bind_group(0, &self.eye_bindings, &[]);
        if let Some(any) = self.scene.materials.first() {
            pass.set_bind_group(1, any, &[]);
        }
        if start.is_none_or(|start| start.over_sky) {
            pass.set_pipeline(self.pipelines.background.of(picture));
            pass.draw(0..3, 0..1);
        }
        if let Some(start) = start {
            pass.set_pipeline(start.pipeline.of(picture));
            pass.set_bind_group(0, &start.bindings, &[]);
            pass.draw(0..3, 0..1);
        }
        if let (Some(mask), Some(composer)) = (&target.mask, &self.composer) {
            pass.set_pipeline(composer.mask.of(picture));
            pass.set_bind_group(0, &mask.bindings, &[]);
            pass.draw(0..3, 0..1);
        }
        pass.set_bind_group(0, &self.eye_bindings, &[]);
        pass
    }

    /// Encodes a plan and sets only the state that changes.
    fn issue(&self, pass: &mut wgpu::RenderPass<'_>, draws: &DrawList, plan: &Plan) {
        let mut last = None;
        pass.set_vertex_buffer(1, self.scene.instance_draws.slice(..));
        for (batch, key) in plan {
            let state = State::new(draws, batch, *key);
            let (Some(mesh), Some(pipeline)) =
                (&self.scene.meshes[state.mesh], self.pipelines.get(key))
            else {
                // Unreachable: every draw's mesh is uploaded, and a plan prepares its pipelines.
                continue;
            };
            let [new_pipeline, new_material, new_mesh] = state.changes(last.replace(state));
            if new_pipeline {
                pass.set_pipeline(pipeline);
            }
            if new_material {
                pass.set_bind_group(1, &self.scene.materials[state.material], &[]);
            }
            if new_mesh {
                pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                if let Some(colors) = &mesh.colors {
                    pass.set_vertex_buffer(2, colors.slice(..));
                }
                pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            }
            pass.draw_indexed(0..mesh.index_count, 0, batch.range.clone());
        }
    }
}

/// State set by a draw call.
#[derive(Clone, Copy)]
struct State {
    key: PipelineKey,
    material: usize,
    mesh: usize,
}

impl State {
    fn new(draws: &DrawList, batch: &Batch, key: PipelineKey) -> Self {
        let call = &draws.calls[batch.draw as usize];
        Self {
            key,
            material: call.material,
            mesh: call.mesh,
        }
    }

    /// Whether pipeline, material and mesh differ from those of the previous call.
    fn changes(&self, last: Option<Self>) -> [bool; 3] {
        last.map_or([true; 3], |last| {
            [
                last.key != self.key,
                last.material != self.material,
                last.mesh != self.mesh,
            ]
        })
    }
}

/// Number of state changes of a plan.
fn state_changes(draws: &DrawList, plan: &Plan) -> u64 {
    let mut last = None;
    let changes = plan.iter().map(|(batch, key)| {
        let state = State::new(draws, batch, *key);
        let changes = state.changes(last.replace(state));
        changes.iter().filter(|changed| **changed).count() as u64
    });
    changes.sum()
}

impl CaptureBackend for Lavapipe {
    fn name(&self) -> &'static str {
        "lavapipe"
    }

    fn driver(&self) -> &str {
        &self.gpu.driver
    }

    fn record_capacity(&self) -> u64 {
        self.buffers.capacity.into()
    }

    fn work(&self) -> Work {
        Work {
            pipelines: self.pipelines.count(),
            ..self.work
        }
    }

    fn pose(&mut self, scene: &Scene, draws: &DrawList) {
        self.work.bytes_uploaded += self.scene.pose(&self.gpu, scene, draws);
    }

    fn render_shadows(&mut self, draws: &DrawList, frame: &Frame) -> Result<(), RasterError> {
        let lighting = &frame.lighting;
        if lighting.cascades.is_empty() {
            return Ok(());
        }
        // The map cannot be bound while it is rendered, so a placeholder is bound for the casters.
        let stand_in = ShadowMaps::new(&self.gpu, 0, TexelFormat::R32f);
        for (number, (cascade, visible)) in lighting.cascades.iter().zip(&frame.casters).enumerate()
        {
            if !frame.cascades_seen[number] {
                continue;
            }
            let plan = self.plan(draws, visible, Purpose::Shadow)?;
            self.work.shadow_maps += 1;
            let uniform = self.gpu.buffer_of(
                &[ViewData::of_cascade(cascade, lighting)],
                wgpu::BufferUsages::UNIFORM,
            );
            let bindings = bind_view(
                &self.gpu,
                &self.pipelines,
                &self.scene,
                &self.buffers,
                &self.buffers.records,
                &uniform,
                &stand_in.sampled,
            );
            self.gpu.submit("rendering a shadow cascade", |encoder| {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    depth_stencil_attachment: depth_attachment(
                        &self.shadow_maps.layers[number],
                        Some(1.0),
                    ),
                    ..Default::default()
                });
                pass.set_bind_group(0, &bindings, &[]);
                self.issue(&mut pass, draws, &plan);
            })?;
        }
        self.shadow_maps.store(&self.gpu, &self.readback)?;
        self.gpu.wait("rendering the shadow cascades")
    }

    fn render(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        region: Region,
        recording: Option<RecordRequest<'_, '_>>,
    ) -> Result<Captured, RasterError> {
        if let (Some(_), Some(what)) = (&recording, &self.gpu.no_capture) {
            return Err(RasterError::Unsupported {
                driver: self.gpu.driver.clone(),
                what: what.clone(),
            });
        }
        let start = Instant::now();
        self.prepare_target(view)?;
        // Tiles without pixels to draw are not rasterised.
        let Some(region) = self.target(view.target)?.open_part(region) else {
            return Ok(Captured::Complete);
        };
        let plans = (Purpose::of(recording.as_ref()).iter())
            .map(|purpose| Ok((*purpose, self.plan(draws, view.visible, *purpose)?)))
            .collect::<Result<Vec<_>, RasterError>>()?;
        self.work.regions += 1;
        self.work.bytes_uploaded += size_of::<ViewData>() as u64 + 4;
        if view.layer.start != Start::Sky && self.starts.is_none() {
            self.starts = Some(Starts::new(&self.gpu)?);
        }
        let start_drawn = self.start(&view.layer.start)?;
        let gpu = &self.gpu;
        let (buffers, target) = (&self.buffers, self.target(view.target)?);
        let data = ViewData::of_eye(view, buffers.capacity);
        gpu.queue
            .write_buffer(&buffers.view_uniform, 0, bytemuck::bytes_of(&data));
        gpu.queue.write_buffer(&buffers.counter, 0, &[0; 4]);
        gpu.submit("rendering a layer", |encoder| {
            for (purpose, plan) in &plans {
                let start = start_drawn.as_ref();
                let picture = purpose.has_picture();
                let mut pass = self.layer_pass(encoder, target, region, start, picture);
                self.issue(&mut pass, draws, plan);
            }
        })?;
        self.work.state_changes += (plans.iter())
            .map(|(_, plan)| state_changes(draws, plan))
            .sum::<u64>();
        let Some(RecordRequest {
            fragments, sink, ..
        }) = recording
        else {
            let submitted = Instant::now();
            gpu.wait("rendering a layer")?;
            self.work.submitting += submitted - start;
            self.work.waiting += submitted.elapsed();
            return Ok(Captured::Complete);
        };
        let needed = u64::from(gpu.read(&buffers.counter, 0..4, |bytes| {
            Ok(bytemuck::pod_read_unaligned::<u32>(bytes))
        })?);
        if needed > u64::from(buffers.capacity) {
            return Ok(Captured::Overflow { needed });
        }
        if needed > 0 {
            // Without the depth test, the alpha-test replay of masked draws is not needed either.
            let depths = if buffers.has_depths && fragments == Fragments::DepthTested {
                needed * DEPTH_BYTES
            } else {
                0
            };
            let mut hand_over = |records: RawRecords<'_>| {
                if gpu.granularity() == Granularity::Quads {
                    return Ok(sink(records)?);
                }
                Ok(sink(MergedQuads::new(records).records())?)
            };
            gpu.read(&buffers.records, 0..needed * RECORD_BYTES, |quads| {
                let quads = records_of(quads)?;
                if depths == 0 {
                    return hand_over(RawRecords { quads, depths: &[] });
                }
                gpu.read(&buffers.depths, 0..depths, |depths| {
                    let depths = records_of(depths)?;
                    hand_over(RawRecords { quads, depths })
                })
            })?;
        }
        Ok(Captured::Complete)
    }

    fn records_fragments_because(&self) -> Option<&str> {
        self.gpu.by_fragment.as_deref()
    }

    fn compose(&mut self, frame: &Frame) -> Result<(), RasterError> {
        let start = Instant::now();
        let mut composes = false;
        for (number, picture) in frame.plan.pictures.iter().enumerate() {
            let PictureSource::Composed { size_px, parts } = picture else {
                continue;
            };
            composes = true;
            if self.composed.len() <= number {
                self.composed.resize_with(number + 1, || None);
            }
            let gpu = &self.gpu;
            let target = &mut self.composed[number];
            target.take_if(|target| target.size_px != *size_px);
            if target.is_none() {
                targets::check_size(gpu, *size_px)?;
                *target = Some(ColorTarget::new(gpu, *size_px)?);
            }
            if self.composer.is_none() {
                self.composer = Some(Composer::new(gpu)?);
            }
            let layers = (parts.iter())
                .map(|part| Ok((part, self.target(part.layer)?)))
                .collect::<Result<Vec<_>, RasterError>>()?;
            if let (Some(composer), Some(target)) = (&self.composer, &self.composed[number]) {
                composer.compose(gpu, target, &layers)?;
            }
        }
        if composes {
            self.gpu.wait("composing the pictures")?;
            self.work.composing += start.elapsed();
        }
        Ok(())
    }

    fn layer_depth(&mut self, layer: usize) -> Result<Vec<f32>, RasterError> {
        let depth = self.target(layer)?.depth_view.texture();
        self.readback.texels(&self.gpu, depth)
    }

    fn picture(&mut self, frame: &Frame, number: usize) -> Result<Vec<u8>, RasterError> {
        let picture = match frame.plan.pictures[number] {
            PictureSource::Layer(layer) => &self.target(layer)?.color,
            PictureSource::Composed { .. } => (self.composed.get(number).and_then(Option::as_ref))
                .ok_or_else(|| {
                    RasterError::Scene(format!("picture {number} has not been composed"))
                })?,
        };
        self.readback.texels(&self.gpu, picture.view.texture())
    }

    fn lavapipe(&mut self) -> Option<&mut Lavapipe> {
        Some(self)
    }
}

fn records_of<T: bytemuck::Pod>(bytes: &[u8]) -> Result<&[T], RasterError> {
    bytemuck::try_cast_slice(bytes).map_err(|e| RasterError::Driver {
        doing: "reading the records",
        message: e.to_string(),
    })
}

fn bind_view(
    gpu: &Gpu,
    pipelines: &Pipelines,
    scene: &SceneBuffers,
    buffers: &RecordBuffers,
    records: &wgpu::Buffer,
    uniform: &wgpu::Buffer,
    shadow_map: &wgpu::TextureView,
) -> wgpu::BindGroup {
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::LessEqual),
        ..Default::default()
    });
    let resources: [_; VIEW_BINDINGS.len()] = [
        uniform.as_entire_binding(),
        scene.instances.as_entire_binding(),
        buffers.counter.as_entire_binding(),
        records.as_entire_binding(),
        wgpu::BindingResource::TextureView(shadow_map),
        wgpu::BindingResource::Sampler(&sampler),
        buffers.depths.as_entire_binding(),
    ];
    bindings::group(gpu, "view", &pipelines.layouts.view, (0..).zip(resources))
}
