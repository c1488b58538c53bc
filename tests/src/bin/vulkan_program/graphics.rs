//! Descriptions of graphics pipelines, as far as those of the test programs are alike.

use ash::vk;
use std::ffi::CStr;

/// What differs between the pipelines.
pub struct Graphics<'a> {
    /// Module and entry point of the vertex shader and of the fragment shader.
    pub shaders: [(vk::ShaderModule, &'a CStr); 2],
    /// Bytes from one vertex to the next.
    pub stride: u32,
    pub attributes: &'a [vk::VertexInputAttributeDescription],
    /// Comparison of the depth test, which writes; `None` without a test.
    pub depth: Option<vk::CompareOp>,
    pub attachments: &'a [vk::PipelineColorBlendAttachmentState],
    /// Edges of the square viewport; `None` if viewport and scissor are dynamic.
    pub side_px: Option<u32>,
    pub layout: vk::PipelineLayout,
}

/// A colour attachment without blending.
pub fn opaque() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// An attribute of the only vertex buffer.
pub fn attribute(
    location: u32,
    format: vk::Format,
    offset: u32,
) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription {
        location,
        binding: 0,
        format,
        offset,
    }
}

impl Graphics<'_> {
    /// Calls `create` with the description, whose parts live until the end of the call.
    pub fn describe<T>(&self, create: impl FnOnce(vk::GraphicsPipelineCreateInfo<'_>) -> T) -> T {
        let kinds = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let stages = [0, 1].map(|number: usize| {
            let (module, name) = self.shaders[number];
            let stage = vk::PipelineShaderStageCreateInfo::default().stage(kinds[number]);
            stage.module(module).name(name)
        });
        let binding = [vk::VertexInputBindingDescription {
            binding: 0,
            stride: self.stride,
            input_rate: vk::VertexInputRate::VERTEX,
        }];
        let bindings = if self.attributes.is_empty() {
            &[][..]
        } else {
            &binding
        };
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(bindings)
            .vertex_attribute_descriptions(self.attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let side_px = self.side_px.unwrap_or(0);
        let viewport = [vk::Viewport::default()
            .width(side_px as f32)
            .height(side_px as f32)
            .max_depth(1.0)];
        let scissor = [vk::Rect2D::default().extent(vk::Extent2D {
            width: side_px,
            height: side_px,
        })];
        let mut viewports = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let mut dynamic = vk::PipelineDynamicStateCreateInfo::default();
        match self.side_px {
            Some(_) => viewports = viewports.viewports(&viewport).scissors(&scissor),
            None => dynamic = dynamic.dynamic_states(&dynamic_states),
        }
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(self.depth.is_some())
            .depth_write_enable(self.depth.is_some())
            .depth_compare_op(self.depth.unwrap_or_default());
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(self.attachments);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewports)
            .rasterization_state(&rasterization)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout);
        create(info)
    }
}
