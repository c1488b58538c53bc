//! Shader modules, pipeline layouts, and graphics pipelines.

use crate::spool::{DepthInfo, ShaderInfo};
use ash::vk::{self, Handle};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A pipeline layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Stages of the ranges with the draw's number; empty if there is no room for it.
    pub stages: vk::ShaderStageFlags,
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
    /// Reasons why records are less exact.
    pub caveats: Vec<String>,
}

impl State {
    /// Whether a state is dynamic.
    #[must_use]
    pub fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state.as_raw())
    }
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

/// Modules, layouts and pipelines by handle.
#[derive(Debug, Default)]
pub struct Pipelines {
    modules: HashMap<u64, Arc<[u32]>>,
    layouts: HashMap<u64, Layout>,
    /// Layouts that pipelines use. They are kept after the program destroys them, because draws still need
    /// them.
    used: HashSet<u64>,
    pipelines: HashMap<u64, Arc<Pipeline>>,
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
    #[must_use]
    pub fn module(&self, module: vk::ShaderModule) -> Option<Arc<[u32]>> {
        self.modules.get(&module.as_raw()).cloned()
    }

    /// Adds a pipeline layout.
    pub fn create_layout(&mut self, layout: vk::PipelineLayout, of: Layout) {
        self.layouts.insert(layout.as_raw(), of);
    }

    /// The pipeline layout of a handle.
    #[must_use]
    pub fn layout(&self, layout: vk::PipelineLayout) -> Option<Layout> {
        self.layouts.get(&layout.as_raw()).copied()
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

    /// Removes a pipeline. Returns the handle of its recording pipeline.
    pub fn destroy(&mut self, handle: vk::Pipeline) -> Option<vk::Pipeline> {
        let pipeline = self.pipelines.remove(&handle.as_raw())?;
        pipeline.recorded.as_ref().map(|recorded| recorded.handle)
    }

    /// The graphics pipeline of a handle.
    #[must_use]
    pub fn get(&self, handle: vk::Pipeline) -> Option<&Arc<Pipeline>> {
        self.pipelines.get(&handle.as_raw())
    }
}
