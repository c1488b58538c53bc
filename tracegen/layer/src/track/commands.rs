//! Command buffers: bound objects, and recorded draws.

use super::descriptors::SetState;
use super::pipelines::{Compute, Pipeline};
use ash::vk;
use spool::{DispatchInfo, DrawInfo, PassInfo, TextureInfo};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Maximum number of bound descriptor sets.
const MOST_SETS: usize = 32;

/// Parameters of a draw command.
#[derive(Clone, Debug, Default)]
pub struct Call {
    /// Number of vertices or indices; 0 for indirect draws.
    pub vertices: u32,
    /// Number of instances; 0 for indirect draws.
    pub instances: u32,
    /// Reasons why its records are less exact.
    pub caveats: Vec<String>,
}

/// A draw of an executed command buffer, and its render pass.
#[derive(Clone, Debug)]
pub struct Executed {
    /// The draw.
    pub draw: Arc<DrawInfo>,
    /// Its render pass; `None` in a secondary command buffer before it is executed.
    pub pass: Option<Arc<PassInfo>>,
}

/// Dynamic state of a command buffer.
#[derive(Clone, Debug, Default)]
pub struct Dynamic {
    /// First viewport.
    pub viewport: Option<vk::Viewport>,
    /// First scissor rectangle.
    pub scissor: Option<vk::Rect2D>,
    /// Topology of primitives.
    pub topology: Option<vk::PrimitiveTopology>,
    /// Whether the depth test is enabled.
    pub depth_test: Option<bool>,
    /// Whether depth writes are enabled.
    pub depth_write: Option<bool>,
    /// Comparison of depths.
    pub depth_compare: Option<vk::CompareOp>,
    /// Whether the stencil test is enabled.
    pub stencil_test: Option<bool>,
    /// Stencil operations in the order of the commands: faces, fail, pass, depth fail, comparison.
    pub stencil_ops: Vec<(
        vk::StencilFaceFlags,
        vk::StencilOp,
        vk::StencilOp,
        vk::StencilOp,
        vk::CompareOp,
    )>,
    /// Stencil write masks in the order of the commands, with their faces.
    pub stencil_write_masks: Vec<(vk::StencilFaceFlags, u32)>,
    /// Written channels, starting at the first set attachment.
    pub color_masks: Option<(u32, Vec<vk::ColorComponentFlags>)>,
    /// Whether writes to each attachment are enabled.
    pub color_enables: Option<Vec<vk::Bool32>>,
}

/// Copies of images in a command buffer, by the numbers of the images.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Copies {
    /// Source and destination of copies, blits and resolves between images.
    pub pairs: Vec<[u32; 2]>,
    /// The same by array layer: image and layer of the source, image and layer of the destination.
    pub layers: Vec<[u32; 4]>,
    /// Images of which one texel alone is copied to a buffer.
    pub probed: Vec<u32>,
}

impl Copies {
    /// Adds a copy between images, once.
    pub fn add(&mut self, from: u32, to: u32) {
        if from != to && !self.pairs.contains(&[from, to]) {
            self.pairs.push([from, to]);
        }
    }

    /// Adds a copy between layers of images, once.
    pub fn add_layers(&mut self, [from, to]: [(u32, u32); 2], count: u32) {
        self.add(from.0, to.0);
        for layer in 0..count {
            let copy = [from.0, from.1 + layer, to.0, to.1 + layer];
            if from.0 != to.0 && !self.layers.contains(&copy) {
                self.layers.push(copy);
            }
        }
    }

    /// Adds the copies of other commands.
    pub fn append(&mut self, other: &Self) {
        for &[from, to] in &other.pairs {
            self.add(from, to);
        }
        let new = (other.layers.iter()).filter(|copy| !self.layers.contains(copy));
        let new: Vec<[u32; 4]> = new.copied().collect();
        self.layers.extend(new);
        self.probed.extend(&other.probed);
    }
}

/// What the commands of a command buffer do besides its draws.
#[derive(Clone, Debug, Default)]
pub struct Effects {
    /// Whether it begins a render pass.
    pub renders: bool,
    /// Whether it copies an image to memory that the host reads.
    pub reads_back: bool,
    /// Images that it copies.
    pub copies: Copies,
    /// Dispatches whose shaders read textures.
    pub dispatches: Vec<DispatchInfo>,
    /// Events that it waits for and does not set before.
    awaited: Vec<vk::Event>,
    /// Events that it sets.
    set: HashSet<vk::Event>,
}

impl Effects {
    /// Notes that the next commands wait for events.
    pub fn await_events(&mut self, events: &[vk::Event]) {
        let others = events.iter().filter(|event| !self.set.contains(event));
        self.awaited.extend(others);
    }

    /// Notes that a command sets an event.
    pub fn set_event(&mut self, event: vk::Event) {
        self.set.insert(event);
    }

    /// Events that something else must set before all commands can end.
    pub fn awaited(&self) -> &[vk::Event] {
        &self.awaited
    }

    /// Appends the effects of commands that are executed later.
    pub fn append(&mut self, later: &Self) {
        self.renders |= later.renders;
        self.reads_back |= later.reads_back;
        self.copies.append(&later.copies);
        self.dispatches.extend_from_slice(&later.dispatches);
        self.await_events(&later.awaited);
        self.set.extend(&later.set);
    }
}

/// State of a command buffer under recording.
#[derive(Debug)]
pub struct CommandState {
    /// Whether it is submitted only once, so that its frame is known when it is recorded.
    one_time: bool,
    handle: vk::Pipeline,
    pipeline: Option<Arc<Pipeline>>,
    sets: [u64; MOST_SETS],
    pushed: HashMap<u32, SetState>,
    /// Dynamic state.
    pub dynamic: Dynamic,
    /// The current render pass.
    pub pass: Option<Arc<PassInfo>>,
    /// The current subpass; `None` with dynamic rendering.
    pub open: Option<OpenPass>,
    /// Number of active queries and transform feedbacks of the program.
    pub active_queries: u32,
    /// What its commands do besides draws.
    pub effects: Effects,
    /// Whether its draws may belong to a requested frame; decided once, at its first pipeline or draw. The
    /// frame may change while it is recorded.
    pub wanted: Option<bool>,
    /// The bound compute pipeline, if its shader reads textures.
    pub compute: Option<Arc<Compute>>,
    items: Vec<Executed>,
}

/// A render pass that has begun and not ended.
#[derive(Clone, Debug)]
pub struct OpenPass {
    /// The render pass.
    pub pass: vk::RenderPass,
    /// Its framebuffer.
    pub framebuffer: vk::Framebuffer,
    /// Views of an imageless framebuffer.
    pub views: Option<Vec<Option<spool::ViewInfo>>>,
    /// Rendered area.
    pub area: vk::Rect2D,
    /// Number of the subpass.
    pub subpass: u32,
}

impl CommandState {
    fn new(one_time: bool) -> Self {
        Self {
            one_time,
            handle: vk::Pipeline::null(),
            pipeline: None,
            sets: [0; MOST_SETS],
            pushed: HashMap::new(),
            dynamic: Dynamic::default(),
            pass: None,
            open: None,
            active_queries: 0,
            effects: Effects::default(),
            wanted: None,
            compute: None,
            items: Vec::new(),
        }
    }

    /// Whether it is submitted only once.
    pub fn one_time(&self) -> bool {
        self.one_time
    }

    /// The bound graphics pipeline.
    pub fn pipeline(&self) -> Option<&Arc<Pipeline>> {
        self.pipeline.as_ref()
    }

    /// Handle of the bound graphics pipeline.
    pub fn pipeline_handle(&self) -> vk::Pipeline {
        self.handle
    }

    /// Binds a graphics pipeline.
    pub fn bind(&mut self, handle: vk::Pipeline, pipeline: Option<Arc<Pipeline>>) {
        self.handle = handle;
        self.pipeline = pipeline;
    }

    /// Binds descriptor sets.
    pub fn bind_sets(&mut self, first: u32, sets: impl IntoIterator<Item = u64>) {
        for (number, set) in (first..).zip(sets) {
            if let Some(slot) = self.sets.get_mut(number as usize) {
                *slot = set;
                self.pushed.remove(&number);
            }
        }
    }

    /// Handle of the descriptor set with this number.
    pub fn set(&self, number: u32) -> Option<u64> {
        self.sets
            .get(number as usize)
            .copied()
            .filter(|set| *set != 0)
    }

    /// Pushed descriptors of a set.
    pub fn pushed(&self, number: u32) -> Option<&SetState> {
        self.pushed.get(&number)
    }

    /// The pushed descriptors of a set; created by `empty` if nothing was pushed before.
    pub fn push(&mut self, number: u32, empty: impl FnOnce() -> SetState) -> &mut SetState {
        self.pushed.entry(number).or_insert_with(empty)
    }

    /// Appends the draws and effects of a secondary command buffer.
    fn execute(&mut self, items: &[Executed], effects: &Effects) {
        self.effects.append(effects);
        for item in items {
            self.items.push(Executed {
                draw: Arc::clone(&item.draw),
                pass: item.pass.clone().or_else(|| self.pass.clone()),
            });
        }
    }

    fn info(
        &self,
        draw: u32,
        call: &Call,
        [textures, vertex_textures]: [Vec<TextureInfo>; 2],
    ) -> Option<DrawInfo> {
        let pipeline = self.pipeline.as_ref()?;
        let vertex = pipeline.recorded.as_ref().and_then(|of| of.vertex.as_ref());
        let (state, set) = (&pipeline.state, &self.dynamic);
        let is = |dynamic| state.is_dynamic(dynamic);
        let with_count = vk::DynamicState::VIEWPORT_WITH_COUNT;
        let viewport = match is(vk::DynamicState::VIEWPORT) || is(with_count) {
            true => set.viewport,
            false => state.viewport,
        };
        let with_count = vk::DynamicState::SCISSOR_WITH_COUNT;
        let scissor = match is(vk::DynamicState::SCISSOR) || is(with_count) {
            true => set.scissor,
            false => state.scissor,
        };
        let mut depth = state.depth;
        let flags = [
            (
                vk::DynamicState::DEPTH_TEST_ENABLE,
                set.depth_test,
                &mut depth.tests,
            ),
            (
                vk::DynamicState::DEPTH_WRITE_ENABLE,
                set.depth_write,
                &mut depth.writes,
            ),
            (
                vk::DynamicState::STENCIL_TEST_ENABLE,
                set.stencil_test,
                &mut depth.stencil,
            ),
        ];
        for (dynamic, value, flag) in flags {
            *flag = value.filter(|_| is(dynamic)).unwrap_or(*flag);
        }
        if let Some(compare) = set
            .depth_compare
            .filter(|_| is(vk::DynamicState::DEPTH_COMPARE_OP))
        {
            depth.compare = compare.as_raw();
        }
        depth.writes &= depth.tests;
        let mut color_masks = state.color_masks.clone();
        if is(vk::DynamicState::COLOR_WRITE_MASK_EXT)
            && let Some((first, masks)) = &set.color_masks
        {
            for (place, mask) in (*first as usize..).zip(masks) {
                if color_masks.len() <= place {
                    color_masks.resize(place + 1, 0);
                }
                color_masks[place] = mask.as_raw();
            }
        }
        if is(vk::DynamicState::COLOR_WRITE_ENABLE_EXT)
            && let Some(enables) = &set.color_enables
        {
            for (mask, enable) in color_masks.iter_mut().zip(enables) {
                *mask = if *enable == 0 { 0 } else { *mask };
            }
        }
        let topology = set
            .topology
            .filter(|_| is(vk::DynamicState::PRIMITIVE_TOPOLOGY));
        let viewport = viewport.unwrap_or_default();
        let scissor = scissor.unwrap_or_default();
        let side = |value: u32| i32::try_from(value).unwrap_or(i32::MAX);
        Some(DrawInfo {
            draw,
            pipeline: pipeline.number,
            shader: pipeline.recorded.as_ref().map(|r| r.shader.shader),
            unrecorded: pipeline.unrecorded.clone(),
            twice: pipeline.recorded.as_ref().is_some_and(|r| r.twice),
            viewport: [viewport.x, viewport.y, viewport.width, viewport.height],
            scissor: [
                scissor.offset.x,
                scissor.offset.y,
                side(scissor.extent.width),
                side(scissor.extent.height),
            ],
            color_masks,
            blends: state.blends,
            depth,
            topology: topology.unwrap_or(state.topology).as_raw(),
            vertices: call.vertices,
            instances: call.instances,
            samples: state.samples,
            caveats: [&state.caveats[..], &call.caveats].concat(),
            textures,
            reads: pipeline.unrecorded_reads(true),
            vertex_shader: vertex.map(|of| of.shader.shader),
            vertex_textures,
        })
    }
}

/// Command buffers by handle, and the numbering of draws.
#[derive(Debug, Default)]
pub struct Commands {
    buffers: HashMap<u64, CommandState>,
    draws: u32,
}

impl Commands {
    pub(super) fn numbered_from(first: u32) -> Self {
        Self {
            draws: first,
            ..Self::default()
        }
    }

    /// Starts the recording of a command buffer.
    pub fn begin(&mut self, buffer: u64, one_time: bool) {
        self.buffers.insert(buffer, CommandState::new(one_time));
    }

    /// Removes a freed command buffer.
    pub fn free(&mut self, buffer: u64) {
        self.buffers.remove(&buffer);
    }

    /// State of a command buffer.
    pub fn get(&self, buffer: u64) -> Option<&CommandState> {
        self.buffers.get(&buffer)
    }

    /// Mutable state of a command buffer.
    pub fn get_mut(&mut self, buffer: u64) -> &mut CommandState {
        self.buffers
            .entry(buffer)
            .or_insert_with(|| CommandState::new(false))
    }

    /// Numbers and describes a draw.
    pub(super) fn draw(
        &mut self,
        buffer: u64,
        call: &Call,
        textures: [Vec<TextureInfo>; 2],
    ) -> Option<DrawInfo> {
        let number = self.draws;
        let state = self.buffers.get_mut(&buffer)?;
        let info = state.info(number, call, textures)?;
        self.draws += 1;
        Some(info)
    }

    /// Adds a draw to a command buffer.
    pub fn add(&mut self, buffer: u64, draw: DrawInfo) {
        let state = self.get_mut(buffer);
        let pass = state.pass.clone();
        state.items.push(Executed {
            draw: Arc::new(draw),
            pass,
        });
    }

    /// Executes a secondary command buffer.
    pub fn execute(&mut self, buffer: u64, secondary: u64) {
        let (items, effects) = match self.buffers.get(&secondary) {
            Some(of) => (of.items.clone(), of.effects.clone()),
            None => return,
        };
        self.get_mut(buffer).execute(&items, &effects);
    }

    /// What command buffers do besides draws, executed one after the other.
    pub fn effects(&self, buffers: impl IntoIterator<Item = u64>) -> Effects {
        let mut all = Effects::default();
        for state in buffers.into_iter().filter_map(|b| self.buffers.get(&b)) {
            all.append(&state.effects);
        }
        all
    }

    /// Draws of a command buffer, in order of execution.
    pub fn items(&self, buffer: u64) -> &[Executed] {
        self.buffers.get(&buffer).map_or(&[], |state| &state.items)
    }
}
