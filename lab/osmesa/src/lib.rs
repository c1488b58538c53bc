//! Capture through OSMesa, Mesa's OpenGL without a window, on llvmpipe or on softpipe, a rasteriser
//! that shares little code with it.
//!
//! Only plain frames are supported, whose layers are the eyes' own pictures. Fragments are recorded
//! one by one, because GLSL has no ballots here. Primitives are numbered by their vertices, because
//! softpipe loses draws that read the primitive number.

mod gl;
mod glsl;
mod programs;
mod targets;
mod upload;

use gl::{Buffer, Gl, Vertices};
use programs::Programs;
use raster::backend::{CaptureBackend, Fragments, RecordRequest, View, Work};
use raster::batches::{self, Plan};
use raster::draws::{DrawList, DrawMode};
use raster::error::RasterError;
use raster::frame::Frame;
use raster::roles::{MaterialState, Purpose};
use raster::shader::VIEW_BINDINGS;
use raster::uniforms::ViewData;
use record::{
    Captured, DEPTH_BYTES, MergedQuads, RECORD_BYTES, RawDepth, RawRecord, RawRecords, Region,
};
use scene::Scene;
use std::time::Instant;
use targets::{ShadowMaps, Target};
use techniques::Start;
use techniques::plan::PictureSource;
use textures::TextureSet;
use upload::SceneObjects;

/// Why OSMesa does not capture.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The library is missing: the name of the file, and the loader's message.
    #[error(
        "{0} (OSMesa, Mesa without a window) cannot be loaded: {1}; install it with: apt-get install libosmesa6 (Mesa 25.1 and later have none)"
    )]
    NoLibrary(&'static str, String),
    /// The library lacks a feature, or the driver failed.
    #[error(transparent)]
    Driver(#[from] RasterError),
}

/// The scene uploaded to OSMesa.
pub struct Osmesa {
    gl: Gl,
    driver: String,
    programs: Programs,
    scene: SceneObjects,
    /// A vertex array without attributes.
    nothing: Vertices,
    buffers: RecordBuffers,
    /// Target of each layer, by its position in the frame's plan.
    layers: Vec<Option<Target>>,
    shadow_maps: ShadowMaps,
    /// Bindings of each material.
    materials: Vec<MaterialState>,
    work: Work,
}

/// Buffers shared by the rendering of all layers.
struct RecordBuffers {
    /// The layer's `View`.
    view: Buffer,
    /// Number of appended records, including those beyond the capacity.
    counter: Buffer,
    records: Buffer,
    /// As long as `records` if draws are masked.
    depths: Buffer,
    capacity: u32,
}

impl Osmesa {
    /// Loads the library and uploads the scene. A region is split if its raw records exceed
    /// `record_budget_bytes`, capped by the driver's limit of a storage block.
    ///
    /// # Errors
    /// No library, driver errors, sizes beyond the driver's limits.
    pub fn new(
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
        record_budget_bytes: u64,
    ) -> Result<Self, OpenError> {
        let gl = Gl::open()?;
        let limit = gl.limit(glow::MAX_SHADER_STORAGE_BLOCK_SIZE);
        let capacity = (record_budget_bytes.min(limit) / RECORD_BYTES).max(1);
        let is_masked = draws.calls.iter().any(|c| c.mode == DrawMode::Masked);
        let depths = if is_masked { capacity } else { 1 };
        let buffers = RecordBuffers {
            view: gl.empty_buffer(size_of::<ViewData>() as u64)?,
            counter: gl.empty_buffer(4)?,
            records: gl.empty_buffer(capacity * RECORD_BYTES)?,
            depths: gl.empty_buffer(depths * DEPTH_BYTES)?,
            capacity: capacity as u32,
        };
        let uploaded = SceneObjects::new(&gl, scene, draws, textures)?;
        Ok(Self {
            driver: gl.driver(),
            programs: Programs::new(&gl)?,
            nothing: gl.vertices(&[])?,
            buffers,
            layers: Vec::new(),
            shadow_maps: ShadowMaps::new(&gl, draws.cascades)?,
            materials: (scene.materials.iter().zip(&draws.groups))
                .map(|(material, groups)| MaterialState::new(material, groups))
                .collect(),
            work: Work {
                samplers: uploaded.samplers as u64,
                ..Work::default()
            },
            scene: uploaded,
            gl,
        })
    }

    /// The error for a feature that this backend does not support.
    fn lacks<T>(&self, what: &str) -> Result<T, RasterError> {
        Err(RasterError::Unsupported {
            driver: format!("the OSMesa backend ({})", self.driver),
            what: what.to_owned(),
        })
    }

    /// The target of a layer, created unless the last frame's target fits.
    fn target(&mut self, number: usize, size_px: [u32; 2]) -> Result<Target, RasterError> {
        if self.layers.len() <= number {
            self.layers.resize(number + 1, None);
        }
        let target = &mut self.layers[number];
        target.take_if(|target| target.size_px != size_px);
        match target {
            Some(target) => Ok(*target),
            None => Ok(*target.insert(Target::new(&self.gl, size_px)?)),
        }
    }

    /// Batches a list of draws and creates the missing programs. The list stays in the instance
    /// buffer until the next plan.
    fn plan(
        &mut self,
        draws: &DrawList,
        visible: &[u32],
        purpose: Purpose,
    ) -> Result<Plan, RasterError> {
        let plan = batches::plan(draws, &self.materials, visible, purpose);
        for (_, key) in &plan {
            self.programs.prepare(&self.gl, key)?;
        }
        let meshes = &self.scene.meshes;
        self.work.add_draws(draws, &plan, |mesh| {
            let vertices = meshes[mesh].as_ref().map_or(0, |m| m.vertices.count);
            [vertices, vertices / 3]
        });
        self.gl
            .write(self.scene.instance_draws, 0, bytemuck::cast_slice(visible));
        self.work.bytes_uploaded += size_of_val(visible) as u64;
        Ok(plan)
    }

    /// Binds the shader's inputs and outputs, except for the material.
    fn bind(&self, view: &ViewData) {
        let gl = &self.gl;
        gl.write(self.buffers.view, 0, bytemuck::bytes_of(view));
        gl.write(self.buffers.counter, 0, &[0; 4]);
        gl.bind_uniform(glsl::VIEW_BLOCK, self.buffers.view);
        for (binding, name) in (0..).zip(VIEW_BINDINGS) {
            let buffer = match name {
                "INSTANCES" => self.scene.instances,
                "COUNTER" => self.buffers.counter,
                "RECORDS" => self.buffers.records,
                "DEPTHS" => self.buffers.depths,
                _ => continue,
            };
            gl.bind_storage(binding, buffer);
        }
        let maps = &self.shadow_maps;
        gl.bind_texture(glsl::SHADOW_UNIT, true, maps.texture, maps.sampler);
    }

    /// Draws a plan.
    fn issue(&mut self, draws: &DrawList, plan: &Plan) {
        let mut material = None;
        for (batch, key) in plan {
            let call = &draws.calls[batch.draw as usize];
            let (Some(mesh), Some(pipeline)) =
                (&self.scene.meshes[call.mesh], self.programs.get(key))
            else {
                // Unreachable: every draw's mesh is uploaded, and a plan prepares its pipelines.
                continue;
            };
            pipeline.set(&self.gl);
            self.work.state_changes += 2;
            if material.replace(call.material) != Some(call.material) {
                let objects = &self.scene.materials[call.material];
                self.gl.bind_uniform(glsl::MATERIAL_BLOCK, objects.uniform);
                for (unit, &(texture, sampler)) in (glsl::MATERIAL_UNITS..).zip(&objects.units) {
                    self.gl.bind_texture(unit, false, texture, sampler);
                }
                self.work.state_changes += 1;
            }
            self.gl.draw(&mesh.vertices, batch.range.clone());
        }
    }

    /// The target of a rendered layer.
    fn rendered(&self, layer: usize) -> Result<Target, RasterError> {
        (self.layers.get(layer).copied().flatten())
            .ok_or_else(|| RasterError::Scene(format!("layer {layer} has not been rendered")))
    }

    /// Passes the records to the sink.
    fn hand_over(&self, recording: RecordRequest<'_, '_>) -> Result<Captured, RasterError> {
        let mut counted = [0_u32];
        self.gl
            .read(self.buffers.counter, bytemuck::cast_slice_mut(&mut counted));
        self.gl.check("reading the counter")?;
        let needed = counted[0];
        if needed > self.buffers.capacity {
            let needed = needed.into();
            return Ok(Captured::Overflow { needed });
        }
        if needed == 0 {
            return Ok(Captured::Complete);
        }
        let mut quads = vec![RawRecord::default(); needed as usize];
        self.gl
            .read(self.buffers.records, bytemuck::cast_slice_mut(&mut quads));
        // Without the depth test, the alpha-test replay of masked draws is not needed either.
        let is_replayed = recording.fragments == Fragments::DepthTested
            && self.buffers.depths.bytes >= u64::from(needed) * DEPTH_BYTES;
        let depths = if is_replayed { needed as usize } else { 0 };
        let mut depths = vec![RawDepth::default(); depths];
        if is_replayed {
            self.gl
                .read(self.buffers.depths, bytemuck::cast_slice_mut(&mut depths));
        }
        self.gl.check("reading the records")?;
        let merged = MergedQuads::new(RawRecords {
            quads: &quads,
            depths: &depths,
        });
        (recording.sink)(merged.records())?;
        Ok(Captured::Complete)
    }
}

impl CaptureBackend for Osmesa {
    fn name(&self) -> &'static str {
        "osmesa"
    }

    fn driver(&self) -> &str {
        &self.driver
    }

    fn record_capacity(&self) -> u64 {
        self.buffers.capacity.into()
    }

    fn records_fragments_because(&self) -> Option<&str> {
        Some("ballots")
    }

    fn work(&self) -> Work {
        Work {
            pipelines: self.programs.count(),
            ..self.work
        }
    }

    fn pose(&mut self, scene: &Scene, draws: &DrawList) {
        self.work.bytes_uploaded += self.scene.pose(&self.gl, scene, draws);
    }

    fn render_shadows(&mut self, draws: &DrawList, frame: &Frame) -> Result<(), RasterError> {
        use raster::draws::SHADOW_SIZE;
        let lighting = &frame.lighting;
        for (number, cascade) in lighting.cascades.iter().enumerate() {
            if !frame.cascades_seen[number] {
                continue;
            }
            let plan = self.plan(draws, &frame.casters[number], Purpose::Shadow)?;
            self.work.shadow_maps += 1;
            self.bind(&ViewData::of_cascade(cascade, lighting));
            let size = [SHADOW_SIZE; 2];
            self.gl
                .target(self.shadow_maps.layers[number], size, [[0; 2], size]);
            self.gl.clear_depth();
            self.issue(draws, &plan);
            self.gl.check("rendering a shadow cascade")?;
        }
        self.gl.finish();
        Ok(())
    }

    fn render(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        region: Region,
        recording: Option<RecordRequest<'_, '_>>,
    ) -> Result<Captured, RasterError> {
        if view.layer.mask.is_some() || view.layer.start != Start::Sky {
            return self.lacks("layers with masks, or that start with other layers");
        }
        let start = Instant::now();
        let target = self.target(view.target, view.layer.size_px)?;
        self.bind(&ViewData::of_eye(view, self.buffers.capacity));
        self.work.regions += 1;
        self.work.bytes_uploaded += size_of::<ViewData>() as u64 + 4;
        let scissor = [region.origin_px, region.size_px];
        self.gl.target(target.framebuffer, target.size_px, scissor);
        self.programs.background.set(&self.gl);
        self.gl.draw_whole(&self.nothing);
        for &purpose in Purpose::of(recording.as_ref()) {
            let plan = self.plan(draws, view.visible, purpose)?;
            self.issue(draws, &plan);
        }
        self.gl.check("rendering a layer")?;
        if let Some(recording) = recording {
            return self.hand_over(recording);
        }
        let submitted = Instant::now();
        self.gl.finish();
        self.work.submitting += submitted - start;
        self.work.waiting += submitted.elapsed();
        Ok(Captured::Complete)
    }

    fn layer_depth(&mut self, layer: usize) -> Result<Vec<f32>, RasterError> {
        let target = self.rendered(layer)?;
        let depth = self.gl.depths(target.framebuffer, target.size_px);
        self.gl.check("reading depth")?;
        Ok(depth)
    }

    fn picture(&mut self, frame: &Frame, number: usize) -> Result<Vec<u8>, RasterError> {
        let PictureSource::Layer(layer) = frame.plan.pictures[number] else {
            return self.lacks("pictures that are composed of layers");
        };
        let target = self.rendered(layer)?;
        let pixels = self.gl.pixels(target.framebuffer, target.size_px);
        self.gl.check("reading a picture")?;
        Ok(pixels)
    }
}
