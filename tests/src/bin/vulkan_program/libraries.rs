//! Pipelines that are linked from libraries (`VK_EXT_graphics_pipeline_library`).

use crate::gpu::Result;
use ash::vk::{self, GraphicsPipelineLibraryFlagsEXT as Parts};
use std::ffi::CStr;

/// Groups of parts. Each group becomes a library. The description of the link itself has the parts of no group.
pub type Split = &'static [Parts];

const INPUT: Parts = Parts::VERTEX_INPUT_INTERFACE;
const BEFORE: Parts = Parts::PRE_RASTERIZATION_SHADERS;
const SHADER: Parts = Parts::FRAGMENT_SHADER;
const OUTPUT: Parts = Parts::FRAGMENT_OUTPUT_INTERFACE;
const SHADERS: Parts = Parts::from_raw(BEFORE.as_raw() | SHADER.as_raw());
const VERTICES: Parts = Parts::from_raw(INPUT.as_raw() | BEFORE.as_raw());

/// A library per part; shaders together; and a link with its own fragment output.
pub const SPLITS: [Split; 3] = [
    &[INPUT, BEFORE, SHADER, OUTPUT],
    &[INPUT, SHADERS, OUTPUT],
    &[VERTICES, SHADER],
];

/// Features of the extension.
pub fn features() -> vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT<'static> {
    vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT::default().graphics_pipeline_library(true)
}

/// Names of the extension and of the one that it needs.
pub const EXTENSIONS: [&CStr; 2] = [
    ash::khr::pipeline_library::NAME,
    ash::ext::graphics_pipeline_library::NAME,
];

/// A pipeline and the libraries that it is linked from. Lavapipe of Mesa 22.3 still reads the state of libraries
/// when it draws, so they must not be destroyed before the pipeline.
pub struct Linked {
    pub pipeline: vk::Pipeline,
    libraries: Vec<vk::Pipeline>,
}

impl Linked {
    /// Destroys the pipeline and its libraries.
    ///
    /// # Safety
    /// Nothing uses the pipeline any more.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: as the caller promises.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            for library in &self.libraries {
                device.destroy_pipeline(*library, None);
            }
        }
    }
}

/// Creates a pipeline, from libraries if `split` is given.
///
/// # Safety
/// A valid description, on a device with the extension if `split` is given.
pub unsafe fn create(
    device: &ash::Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    split: Option<Split>,
) -> Result<Linked> {
    let mut libraries = Vec::new();
    // SAFETY: as the caller promises.
    unsafe {
        let Some(split) = split else {
            let pipeline = create_one(device, info)?;
            return Ok(Linked {
                pipeline,
                libraries,
            });
        };
        let mut left = SHADERS | INPUT | OUTPUT;
        for parts in split {
            left &= !*parts;
            libraries.push(part(device, info, *parts, &[])?);
        }
        let pipeline = part(device, info, left, &libraries)?;
        Ok(Linked {
            pipeline,
            libraries,
        })
    }
}

/// Creates a library of parts, or links libraries with parts.
///
/// # Safety
/// As for [`create`].
unsafe fn part(
    device: &ash::Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    parts: Parts,
    libraries: &[vk::Pipeline],
) -> Result<vk::Pipeline> {
    let (input, before) = (parts.contains(INPUT), parts.contains(BEFORE));
    let (shades, outputs) = (parts.contains(SHADER), parts.contains(OUTPUT));
    let mut info = *info;
    // The pointers of other parts are ignored, so they need not be valid.
    keep(&mut info.p_vertex_input_state, input);
    keep(&mut info.p_input_assembly_state, input);
    keep(&mut info.p_viewport_state, before);
    keep(&mut info.p_rasterization_state, before);
    keep(&mut info.p_depth_stencil_state, shades);
    keep(&mut info.p_color_blend_state, outputs);
    // A fragment shader with sample shading would need this state, too.
    if !outputs {
        info.p_multisample_state = std::ptr::null();
    }
    // SAFETY: as the caller promises.
    let stages = unsafe { std::slice::from_raw_parts(info.p_stages, info.stage_count as usize) };
    let is_of = |stage: &vk::PipelineShaderStageCreateInfo<'_>| match stage.stage {
        vk::ShaderStageFlags::FRAGMENT => shades,
        _ => before,
    };
    let stages: Vec<_> = stages.iter().copied().filter(is_of).collect();
    info.stage_count = stages.len() as u32;
    info.p_stages = stages.as_ptr();
    let mut own = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(parts);
    let mut links = vk::PipelineLibraryCreateInfoKHR::default().libraries(libraries);
    if libraries.is_empty() {
        info.flags |= vk::PipelineCreateFlags::LIBRARY_KHR;
        info = info.push_next(&mut own);
    } else {
        info = info.push_next(&mut links);
        if !parts.is_empty() {
            info = info.push_next(&mut own);
        }
    }
    // SAFETY: as the caller promises.
    unsafe { create_one(device, &info) }
}

/// Creates what a description describes.
///
/// # Safety
/// A valid description.
unsafe fn create_one(
    device: &ash::Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<vk::Pipeline> {
    let cache = vk::PipelineCache::null();
    // SAFETY: as the caller promises.
    let made = unsafe { device.create_graphics_pipelines(cache, std::slice::from_ref(info), None) };
    made.map(|pipelines| pipelines[0])
        .map_err(|(_, error)| format!("a pipeline: {error}"))
}

/// Makes a pointer invalid unless its part is kept.
fn keep<T>(pointer: &mut *const T, is_kept: bool) {
    if !is_kept {
        *pointer = std::ptr::dangling();
    }
}
