//! Shader modules, pipeline layouts, and graphics pipelines.

use crate::spool::{DepthInfo, ShaderInfo};
use ash::vk::{self, Handle};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A pipeline layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Stages of the ranges that hold the draw's number; empty where there is no room for it.
    pub stages: vk::ShaderStageFlags,
}

/// A pipeline that records in place of a program's, or before it.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The pipeline.
    pub handle: vk::Pipeline,
    /// Its shader.
    pub shader: Arc<ShaderInfo>,
    /// It writes nothing and is drawn before the program's.
    pub twice: bool,
    /// Dynamic states of the program's pipeline that it has not.
    pub fixed: Vec<vk::DynamicState>,
}

/// State of a pipeline that describes draws.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// States that commands set.
    pub dynamic: HashSet<i32>,
    /// First viewport.
    pub viewport: Option<vk::Viewport>,
    /// First scissor rectangle.
    pub scissor: Option<vk::Rect2D>,
    /// Kind of primitives.
    pub topology: vk::PrimitiveTopology,
    /// Depth test.
    pub depth: DepthInfo,
    /// Channels written of each colour attachment.
    pub color_masks: Vec<u32>,
    /// Colours are blended.
    pub blends: bool,
    /// Samples per pixel.
    pub samples: u32,
    /// Reasons why records are less exact.
    pub caveats: Vec<String>,
}

impl State {
    /// Commands set a state.
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
    /// Its layout.
    pub layout: vk::PipelineLayout,
    /// Stages of the draw's number.
    pub stages: vk::ShaderStageFlags,
    /// Records, if it does.
    pub recorded: Option<Recorded>,
    /// Why it does not.
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
    /// Layouts that pipelines use: draws need them longer than the program does.
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

    /// A shader module was created.
    pub fn create_module(&mut self, module: vk::ShaderModule, words: &[u32]) {
        self.modules.insert(module.as_raw(), words.into());
    }

    /// A shader module was destroyed.
    pub fn destroy_module(&mut self, module: vk::ShaderModule) {
        self.modules.remove(&module.as_raw());
    }

    /// Words of a module.
    #[must_use]
    pub fn module(&self, module: vk::ShaderModule) -> Option<Arc<[u32]>> {
        self.modules.get(&module.as_raw()).cloned()
    }

    /// A pipeline layout was created.
    pub fn create_layout(&mut self, layout: vk::PipelineLayout, of: Layout) {
        self.layouts.insert(layout.as_raw(), of);
    }

    /// A pipeline layout.
    #[must_use]
    pub fn layout(&self, layout: vk::PipelineLayout) -> Option<Layout> {
        self.layouts.get(&layout.as_raw()).copied()
    }

    /// The program destroyed a layout; returns true if nothing uses it any more.
    pub fn destroy_layout(&mut self, layout: vk::PipelineLayout) -> bool {
        !self.used.contains(&layout.as_raw())
    }

    /// Number for the next recording shader.
    pub fn next_shader(&mut self) -> u32 {
        self.shaders += 1;
        self.shaders - 1
    }

    /// A graphics pipeline was created; it gets its number.
    pub fn create(&mut self, handle: vk::Pipeline, mut pipeline: Pipeline) {
        pipeline.number = self.created;
        self.created += 1;
        if pipeline.recorded.is_some() {
            self.used.insert(pipeline.layout.as_raw());
        }
        self.pipelines.insert(handle.as_raw(), Arc::new(pipeline));
    }

    /// A pipeline was destroyed; returns the recording pipeline that belonged to it.
    pub fn destroy(&mut self, handle: vk::Pipeline) -> Option<vk::Pipeline> {
        let pipeline = self.pipelines.remove(&handle.as_raw())?;
        pipeline.recorded.as_ref().map(|recorded| recorded.handle)
    }

    /// A graphics pipeline.
    #[must_use]
    pub fn get(&self, handle: vk::Pipeline) -> Option<&Arc<Pipeline>> {
        self.pipelines.get(&handle.as_raw())
    }
}
