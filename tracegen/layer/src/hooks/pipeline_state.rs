//! State in the description of a pipeline, and changed descriptions.

use super::api::slice;
use crate::spool::DepthInfo;
use crate::track::State;
use ash::vk;

/// The state that a description fixes.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn of(info: &vk::GraphicsPipelineCreateInfo<'_>) -> State {
    // SAFETY: as the caller promises. Structures that the pipeline does not use may be missing.
    unsafe {
        let mut state = State {
            samples: 1,
            ..State::default()
        };
        if let Some(dynamic) = info.p_dynamic_state.as_ref() {
            let states = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count);
            state.dynamic = states.iter().map(|s| s.as_raw()).collect();
        }
        if let Some(viewports) = info.p_viewport_state.as_ref() {
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
        if let Some(assembly) = info.p_input_assembly_state.as_ref() {
            state.topology = assembly.topology;
        }
        if let Some(multisampling) = info.p_multisample_state.as_ref() {
            state.samples = multisampling.rasterization_samples.as_raw();
            if multisampling.sample_shading_enable != 0 {
                state.caveats.push("sample shading".to_owned());
            }
        }
        if alpha_to_coverage(info) {
            state.caveats.push("alpha to coverage".to_owned());
        }
        if let Some(depth) = info.p_depth_stencil_state.as_ref() {
            state.depth = DepthInfo {
                tests: depth.depth_test_enable != 0,
                writes: depth.depth_write_enable != 0,
                compare: depth.depth_compare_op.as_raw(),
                stencil: depth.stencil_test_enable != 0,
            };
        }
        if let Some(blend) = info.p_color_blend_state.as_ref() {
            let attachments = slice(blend.p_attachments, blend.attachment_count);
            let masks = attachments.iter().map(|a| a.color_write_mask.as_raw());
            state.color_masks = masks.collect();
            state.blends = attachments.iter().any(|a| a.blend_enable != 0);
        }
        let stages = slice(info.p_stages, info.stage_count);
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

/// Whether alpha-to-coverage removes samples after shading.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn alpha_to_coverage(info: &vk::GraphicsPipelineCreateInfo<'_>) -> bool {
    // SAFETY: as the caller promises.
    let multisampling = unsafe { info.p_multisample_state.as_ref() };
    multisampling.is_some_and(|state| state.alpha_to_coverage_enable != 0)
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

    /// Disables writes of depth, stencil and colours. Tests are unchanged.
    ///
    /// # Safety
    /// The description that this was made from is still valid.
    pub unsafe fn write_nothing(&mut self) {
        // SAFETY: as the caller promises.
        unsafe {
            if let Some(depth) = self.info.p_depth_stencil_state.as_ref() {
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
            if let Some(blend) = self.info.p_color_blend_state.as_ref() {
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
