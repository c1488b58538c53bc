//! Pipelines, one per object.

use crate::gpu::{Gpu, Result, checked};
use crate::graphics::{Graphics, attribute, opaque};
use crate::libraries::{self, Split};
use crate::scene::Vertex;
use ash::vk;

/// A pipeline of a module with entry points `vertex` and `fragment`, linked from libraries if `split` is given.
pub fn pipeline(
    gpu: &Gpu,
    pass: vk::RenderPass,
    layout: vk::PipelineLayout,
    words: &[u32],
    split: Option<Split>,
) -> Result<vk::Pipeline> {
    let device = &gpu.device;
    let info = vk::ShaderModuleCreateInfo::default().code(words);
    // SAFETY: the device is open, and the module exists until the pipeline is created.
    unsafe {
        let module = checked("a shader module", device.create_shader_module(&info, None))?;
        let made = Graphics {
            shaders: [(module, c"vertex"), (module, c"fragment")],
            stride: size_of::<Vertex>() as u32,
            attributes: &[
                attribute(0, vk::Format::R32G32B32_SFLOAT, 0),
                attribute(1, vk::Format::R32G32_SFLOAT, 12),
                attribute(2, vk::Format::R32G32B32_SFLOAT, 20),
            ],
            depth: Some(vk::CompareOp::LESS),
            attachments: &[opaque()],
            side_px: None,
            layout,
        }
        .describe(|info| libraries::create(device, &info.render_pass(pass), split));
        device.destroy_shader_module(module, None);
        Ok(made?.pipeline)
    }
}
