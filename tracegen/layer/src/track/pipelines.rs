//! Shader modules, pipeline layouts, and graphics pipelines.

use super::descriptors::SetState;
use ash::vk::{self, Handle};
use spool::{DepthInfo, ShaderInfo, StageReads};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Name of the stage whose texture reads are recorded or counted.
pub const VERTEX: &str = "vertex";

/// Parts of a pipeline (`VK_EXT_graphics_pipeline_library`).
pub type Parts = vk::GraphicsPipelineLibraryFlagsEXT;

/// A pipeline layout.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// Stages of the ranges with the draw's number; empty if there is no room for it.
    pub stages: vk::ShaderStageFlags,
    /// Its sets before any descriptor is written: those that are pushed start from them. Their layouts may be
    /// destroyed before.
    pub sets: Vec<SetState>,
}

/// The recording pipeline of a program's pipeline.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Handle of the recording pipeline.
    pub handle: vk::Pipeline,
    /// Its recording shader.
    pub shader: Arc<ShaderInfo>,
    /// Whether it writes nothing and is drawn before the program's pipeline.
    pub twice: bool,
    /// Dynamic states of the program's pipeline that it fixes.
    pub fixed: Vec<vk::DynamicState>,
    /// Its recording vertex shader, if any.
    pub vertex: Option<RecordedVertex>,
}

/// A recording vertex shader of a pipeline.
#[derive(Clone, Debug)]
pub struct RecordedVertex {
    /// The shader.
    pub shader: Arc<ShaderInfo>,
    /// Set and binding of the textures that it may read.
    pub bindings: Vec<(u32, u32)>,
    /// Its texture reads that are not recorded.
    pub unrecorded: Vec<StageReads>,
}

/// State of a pipeline that the description of draws needs.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// Dynamic states.
    pub dynamic: HashSet<i32>,
    /// First viewport.
    pub viewport: Option<vk::Viewport>,
    /// First scissor rectangle.
    pub scissor: Option<vk::Rect2D>,
    /// Topology of primitives.
    pub topology: vk::PrimitiveTopology,
    /// Depth test.
    pub depth: DepthInfo,
    /// Written channels of each colour attachment.
    pub color_masks: Vec<u32>,
    /// Whether colours are blended.
    pub blends: bool,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether alpha-to-coverage removes samples after shading.
    pub alpha_to_coverage: bool,
    /// Reasons why records are less exact.
    pub caveats: Vec<String>,
    /// Texture reads of the shaders before the fragment shader.
    pub reads: Vec<StageReads>,
}

impl State {
    /// Whether a state is dynamic.
    pub fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state.as_raw())
    }

    /// Adds the state of the parts of a library.
    pub fn add(&mut self, library: &Self, parts: Parts) {
        self.dynamic.extend(&library.dynamic);
        for caveat in &library.caveats {
            if !self.caveats.contains(caveat) {
                self.caveats.push(caveat.clone());
            }
        }
        if parts.contains(Parts::VERTEX_INPUT_INTERFACE) {
            self.topology = library.topology;
        }
        if parts.contains(Parts::PRE_RASTERIZATION_SHADERS) {
            self.viewport = library.viewport;
            self.scissor = library.scissor;
            self.reads.extend_from_slice(&library.reads);
        }
        if parts.contains(Parts::FRAGMENT_SHADER) {
            self.depth = library.depth;
        }
        if parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE) {
            self.color_masks.clone_from(&library.color_masks);
            self.blends = library.blends;
            self.samples = library.samples;
            self.alpha_to_coverage = library.alpha_to_coverage;
        }
    }
}

/// A library: parts of a pipeline that are linked later.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// Its parts, with those of its own libraries.
    pub parts: Parts,
    /// State of its parts.
    pub state: State,
    /// Its pipeline layout.
    pub layout: vk::PipelineLayout,
    /// Recording shader of its fragment shader, or the reason why there is none; `None` without a fragment
    /// shader.
    pub shader: Option<Result<Arc<ShaderInfo>, String>>,
    /// Recording shader of its vertex shader, if any.
    pub vertex: Option<RecordedVertex>,
    /// The library with the recording shaders.
    pub recording: Option<vk::Pipeline>,
    /// The library with the recording shaders, if it has any, and without writes.
    pub quiet: Option<vk::Pipeline>,
    /// Dynamic states of the library that `quiet` fixes.
    pub fixed: Vec<vk::DynamicState>,
}

/// A graphics pipeline.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// Number, in the order of creation.
    pub number: u32,
    /// Its pipeline layout.
    pub layout: vk::PipelineLayout,
    /// Stages with the draw's number.
    pub stages: vk::ShaderStageFlags,
    /// Its recording pipeline, if any.
    pub recorded: Option<Recorded>,
    /// Reason why it is not recorded.
    pub unrecorded: Option<String>,
    /// Set and binding of the textures that its fragment shader may read.
    pub bindings: Vec<(u32, u32)>,
    /// Its state.
    pub state: State,
}

impl Pipeline {
    /// Texture reads of the shaders before its fragment shader that are not recorded, while it records or not.
    pub fn unrecorded_reads(&self, records: bool) -> Vec<StageReads> {
        let recorded = self.recorded.as_ref().filter(|_| records);
        let Some(vertex) = recorded.and_then(|of| of.vertex.as_ref()) else {
            return self.state.reads.clone();
        };
        let of_others = self.state.reads.iter().filter(|of| of.stage != VERTEX);
        of_others.chain(&vertex.unrecorded).cloned().collect()
    }
}

/// A compute pipeline whose shader reads textures.
#[derive(Clone, Debug, Default)]
pub struct Compute {
    /// Size of a workgroup.
    pub workgroup: [u32; 3],
    /// Texture reads of its shader.
    pub reads: Vec<StageReads>,
}

/// Modules, layouts and pipelines by handle.
#[derive(Debug, Default)]
pub struct Pipelines {
    modules: HashMap<u64, Arc<[u32]>>,
    layouts: HashMap<u64, Layout>,
    /// Layouts that pipelines use. They are kept after the program destroys them, because draws still need
    /// them.
    used: HashSet<u64>,
    pipelines: HashMap<u64, Arc<Pipeline>>,
    libraries: HashMap<u64, Arc<Library>>,
    computes: HashMap<u64, Arc<Compute>>,
    created: u32,
    shaders: u32,
}

impl Pipelines {
    pub(super) fn numbered_from(first: u32) -> Self {
        Self {
            created: first,
            shaders: first,
            ..Self::default()
        }
    }

    /// Adds a shader module.
    pub fn create_module(&mut self, module: vk::ShaderModule, words: &[u32]) {
        self.modules.insert(module.as_raw(), words.into());
    }

    /// Removes a shader module.
    pub fn destroy_module(&mut self, module: vk::ShaderModule) {
        self.modules.remove(&module.as_raw());
    }

    /// Words of a shader module.
    pub fn module(&self, module: vk::ShaderModule) -> Option<Arc<[u32]>> {
        self.modules.get(&module.as_raw()).cloned()
    }

    /// Adds a pipeline layout.
    pub fn create_layout(&mut self, layout: vk::PipelineLayout, of: Layout) {
        self.layouts.insert(layout.as_raw(), of);
    }

    /// The pipeline layout of a handle.
    pub fn layout(&self, layout: vk::PipelineLayout) -> Option<&Layout> {
        self.layouts.get(&layout.as_raw())
    }

    /// Handles the destruction of a layout by the program. Returns true if no pipeline uses the layout.
    pub fn destroy_layout(&mut self, layout: vk::PipelineLayout) -> bool {
        !self.used.contains(&layout.as_raw())
    }

    /// Number of the next recording shader.
    pub fn next_shader(&mut self) -> u32 {
        self.shaders += 1;
        self.shaders - 1
    }

    /// Adds a graphics pipeline and sets its number.
    pub fn create(&mut self, handle: vk::Pipeline, mut pipeline: Pipeline) {
        pipeline.number = self.created;
        self.created += 1;
        if pipeline.recorded.is_some() {
            self.used.insert(pipeline.layout.as_raw());
        }
        self.pipelines.insert(handle.as_raw(), Arc::new(pipeline));
    }

    /// Adds a library. A pipeline that is linked from it may have no other layout.
    pub fn create_library(&mut self, handle: vk::Pipeline, library: Library) {
        if library.recording.is_some() || library.quiet.is_some() {
            self.used.insert(library.layout.as_raw());
        }
        self.libraries.insert(handle.as_raw(), Arc::new(library));
    }

    /// Adds a compute pipeline whose shader reads textures.
    pub fn create_compute(&mut self, handle: vk::Pipeline, compute: Compute) {
        self.computes.insert(handle.as_raw(), Arc::new(compute));
    }

    /// The compute pipeline of a handle, if its shader reads textures.
    pub fn compute(&self, handle: vk::Pipeline) -> Option<Arc<Compute>> {
        self.computes.get(&handle.as_raw()).cloned()
    }

    /// The library of a handle.
    pub fn library(&self, handle: vk::Pipeline) -> Option<Arc<Library>> {
        self.libraries.get(&handle.as_raw()).cloned()
    }

    /// Removes a pipeline or library. Returns the handles of its recording pipelines.
    pub fn destroy(&mut self, handle: vk::Pipeline) -> Vec<vk::Pipeline> {
        let pipeline = self.pipelines.remove(&handle.as_raw());
        let library = self.libraries.remove(&handle.as_raw());
        self.computes.remove(&handle.as_raw());
        let recorded = pipeline.and_then(|of| of.recorded.as_ref().map(|r| r.handle));
        let variants = library.map_or([None; 2], |of| [of.recording, of.quiet]);
        recorded
            .into_iter()
            .chain(variants.into_iter().flatten())
            .collect()
    }

    /// The graphics pipeline of a handle.
    pub fn get(&self, handle: vk::Pipeline) -> Option<&Arc<Pipeline>> {
        self.pipelines.get(&handle.as_raw())
    }
}
