//! State in the description of a pipeline, and changed descriptions.

use super::api::slice;
use super::libraries::{self, Parts};
use crate::track::State;
use ash::vk;
use spool::DepthInfo;

/// The state that the parts of a description fix.
///
/// # Safety
/// A valid description with these own parts.
pub(super) unsafe fn of(info: &vk::GraphicsPipelineCreateInfo<'_>, own: Parts) -> State {
    // SAFETY: as the caller promises. Structures that the pipeline does not use may be missing, and pointers of
    // parts that are not its own may be invalid.
    unsafe {
        let before = own.contains(Parts::PRE_RASTERIZATION_SHADERS);
        let shades = own.contains(Parts::FRAGMENT_SHADER);
        let outputs = own.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
        let mut state = State {
            samples: 1,
            ..State::default()
        };
        if let Some(dynamic) = info.p_dynamic_state.as_ref() {
            let states = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count);
            state.dynamic = states.iter().map(|s| s.as_raw()).collect();
        }
        if let Some(viewports) = part(info.p_viewport_state, before) {
            // The arrays of dynamic states are ignored, so their pointers may be invalid.
            let fixed = |a, b| !state.is_dynamic(a) && !state.is_dynamic(b);
            let viewport = fixed(
                vk::DynamicState::VIEWPORT,
                vk::DynamicState::VIEWPORT_WITH_COUNT,
            );
            let scissor = fixed(
                vk::DynamicState::SCISSOR,
                vk::DynamicState::SCISSOR_WITH_COUNT,
            );
            if viewport {
                let all = slice(viewports.p_viewports, viewports.viewport_count);
                state.viewport = all.first().copied();
            }
            if scissor {
                let all = slice(viewports.p_scissors, viewports.scissor_count);
                state.scissor = all.first().copied();
            }
        }
        let inputs = own.contains(Parts::VERTEX_INPUT_INTERFACE);
        if let Some(assembly) = part(info.p_input_assembly_state, inputs) {
            state.topology = assembly.topology;
        }
        if let Some(multisampling) = part(info.p_multisample_state, outputs) {
            state.samples = multisampling.rasterization_samples.as_raw();
            if multisampling.sample_shading_enable != 0 {
                state.caveats.push("sample shading".to_owned());
            }
            state.alpha_to_coverage = multisampling.alpha_to_coverage_enable != 0;
            if state.alpha_to_coverage {
                state.caveats.push("alpha to coverage".to_owned());
            }
        }
        if let Some(depth) = part(info.p_depth_stencil_state, shades) {
            state.depth = DepthInfo {
                tests: depth.depth_test_enable != 0,
                writes: depth.depth_write_enable != 0,
                compare: depth.depth_compare_op.as_raw(),
                stencil: depth.stencil_test_enable != 0,
            };
        }
        if let Some(blend) = part(info.p_color_blend_state, outputs) {
            let attachments = slice(blend.p_attachments, blend.attachment_count);
            let masks = attachments.iter().map(|a| a.color_write_mask.as_raw());
            state.color_masks = masks.collect();
            state.blends = attachments.iter().any(|a| a.blend_enable != 0);
        }
        let stages = match before {
            true => slice(info.p_stages, info.stage_count),
            false => &[],
        };
        let has = |stage| stages.iter().any(|s| s.stage == stage);
        if has(vk::ShaderStageFlags::GEOMETRY) {
            state
                .caveats
                .push("a geometry shader numbers the primitives".to_owned());
        }
        if has(vk::ShaderStageFlags::TESSELLATION_EVALUATION) {
            state
                .caveats
                .push("the triangles of a patch share a number".to_owned());
        }
        state
    }
}

/// A structure of a part; `None` if it is missing or the part is not the description's own.
///
/// # Safety
/// The pointer is valid or null if the part is the description's own.
unsafe fn part<'a, T>(structure: *const T, is_own: bool) -> Option<&'a T> {
    if !is_own {
        return None;
    }
    // SAFETY: as the caller promises.
    unsafe { structure.as_ref() }
}

/// Dynamic states that enable writes of depth, stencil or colours.
const WRITING: [vk::DynamicState; 5] = [
    vk::DynamicState::DEPTH_WRITE_ENABLE,
    vk::DynamicState::STENCIL_OP,
    vk::DynamicState::STENCIL_WRITE_MASK,
    vk::DynamicState::COLOR_WRITE_MASK_EXT,
    vk::DynamicState::COLOR_WRITE_ENABLE_EXT,
];

/// A description with another fragment shader and without writes.
pub(super) struct Changed<'a> {
    info: vk::GraphicsPipelineCreateInfo<'a>,
    _stages: Vec<vk::PipelineShaderStageCreateInfo<'a>>,
    depth: Box<vk::PipelineDepthStencilStateCreateInfo<'a>>,
    blend: Box<vk::PipelineColorBlendStateCreateInfo<'a>>,
    attachments: Vec<vk::PipelineColorBlendAttachmentState>,
    dynamic: Box<vk::PipelineDynamicStateCreateInfo<'a>>,
    kept: Vec<vk::DynamicState>,
    fixed: Vec<vk::DynamicState>,
}

impl<'a> Changed<'a> {
    /// Copies a description with other stages.
    pub fn new(
        info: &vk::GraphicsPipelineCreateInfo<'a>,
        stages: Vec<vk::PipelineShaderStageCreateInfo<'a>>,
    ) -> Self {
        let mut info = *info;
        info.p_stages = stages.as_ptr();
        // The recording pipeline takes no part in derivation.
        info.flags &= !(vk::PipelineCreateFlags::DERIVATIVE
            | vk::PipelineCreateFlags::ALLOW_DERIVATIVES
            | vk::PipelineCreateFlags::FAIL_ON_PIPELINE_COMPILE_REQUIRED);
        info.base_pipeline_handle = vk::Pipeline::null();
        Self {
            info,
            _stages: stages,
            depth: Box::default(),
            blend: Box::default(),
            attachments: Vec::new(),
            dynamic: Box::default(),
            kept: Vec::new(),
            fixed: Vec::new(),
        }
    }

    /// Replaces the chain. It must live as long as this description is used.
    pub fn replace_chain(&mut self, p_next: *const std::ffi::c_void) {
        self.info.p_next = p_next;
    }

    /// Disables writes of depth, stencil and colours. Tests are unchanged.
    ///
    /// # Safety
    /// The description that this was made from is still valid.
    pub unsafe fn write_nothing(&mut self) {
        // SAFETY: as the caller promises.
        unsafe {
            let own = libraries::own_parts(&self.info);
            let shades = own.contains(Parts::FRAGMENT_SHADER);
            if let Some(depth) = part(self.info.p_depth_stencil_state, shades) {
                *self.depth = *depth;
                self.depth.depth_write_enable = vk::FALSE;
                for face in [&mut self.depth.front, &mut self.depth.back] {
                    face.write_mask = 0;
                    face.pass_op = vk::StencilOp::KEEP;
                    face.fail_op = vk::StencilOp::KEEP;
                    face.depth_fail_op = vk::StencilOp::KEEP;
                }
                self.info.p_depth_stencil_state = &*self.depth;
            }
            let outputs = own.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
            if let Some(blend) = part(self.info.p_color_blend_state, outputs) {
                *self.blend = *blend;
                let count = blend.attachment_count;
                self.attachments = slice(blend.p_attachments, count).to_vec();
                self.attachments.resize(count as usize, Default::default());
                for attachment in &mut self.attachments {
                    attachment.color_write_mask = vk::ColorComponentFlags::empty();
                }
                self.blend.p_attachments = self.attachments.as_ptr();
                self.info.p_color_blend_state = &*self.blend;
            }
            if let Some(dynamic) = self.info.p_dynamic_state.as_ref() {
                let all = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count);
                let writes = |state: &vk::DynamicState| WRITING.contains(state);
                self.fixed = all.iter().copied().filter(writes).collect();
                self.kept = all.iter().copied().filter(|state| !writes(state)).collect();
                *self.dynamic = *dynamic;
                self.dynamic.dynamic_state_count = self.kept.len() as u32;
                self.dynamic.p_dynamic_states = self.kept.as_ptr();
                self.info.p_dynamic_state = &*self.dynamic;
            }
        }
    }

    /// The changed description.
    pub fn info(&self) -> &vk::GraphicsPipelineCreateInfo<'a> {
        &self.info
    }

    /// Dynamic states that the changed description fixes.
    pub fn fixed(&self) -> Vec<vk::DynamicState> {
        self.fixed.clone()
    }
}
