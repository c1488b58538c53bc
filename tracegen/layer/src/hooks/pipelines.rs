//! Hooks of shader modules, pipeline layouts and graphics pipelines.

use super::api::{find, slice};
use super::device::{Device, DeviceRecorder, RecordingShader};
use super::pipeline_state;
use crate::capture::{capture, lock};
use crate::inject::{DepthTests, What, instrument};
use crate::spool::ShaderInfo;
use crate::track::{Layout, Pipeline, Recorded};
use ash::vk;
use std::ffi::CStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

type Allocator = *const vk::AllocationCallbacks<'static>;

pub(super) unsafe extern "system" fn create_shader_module(
    device: vk::Device,
    info: *const vk::ShaderModuleCreateInfo<'_>,
    allocator: Allocator,
    module: *mut vk::ShaderModule,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateShaderModule.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_shader_module)(device, info, allocator, module);
        if result == vk::Result::SUCCESS {
            let words = slice((*info).p_code, ((*info).code_size / 4) as u32);
            known.tracker().pipelines.create_module(*module, words);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_shader_module(
    device: vk::Device,
    module: vk::ShaderModule,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyShaderModule.
    unsafe {
        let known = Device::of(device);
        known.tracker().pipelines.destroy_module(module);
        (known.next.destroy_shader_module)(device, module, allocator);
    }
}

pub(super) unsafe extern "system" fn create_pipeline_layout(
    device: vk::Device,
    info: *const vk::PipelineLayoutCreateInfo<'_>,
    allocator: Allocator,
    layout: *mut vk::PipelineLayout,
) -> vk::Result {
    // SAFETY: a valid call of vkCreatePipelineLayout.
    unsafe {
        let known = Device::of(device);
        let ranges = slice(
            (*info).p_push_constant_ranges,
            (*info).push_constant_range_count,
        );
        let room = known
            .recorder
            .as_ref()
            .and_then(|r| extended_ranges(ranges, r.push_constant_bytes));
        let Some((ranges, stages)) = room else {
            let result = (known.next.create_pipeline_layout)(device, info, allocator, layout);
            if result == vk::Result::SUCCESS {
                known
                    .tracker()
                    .pipelines
                    .create_layout(*layout, Layout::default());
            }
            return result;
        };
        let wider = vk::PipelineLayoutCreateInfo {
            push_constant_range_count: ranges.len() as u32,
            p_push_constant_ranges: ranges.as_ptr(),
            ..*info
        };
        let result = (known.next.create_pipeline_layout)(device, &wider, allocator, layout);
        if result == vk::Result::SUCCESS {
            known
                .tracker()
                .pipelines
                .create_layout(*layout, Layout { stages });
        }
        result
    }
}

/// Push constant ranges extended by the draw's number at an offset, and the stages that see it; `None` if the
/// program uses these bytes itself.
fn extended_ranges(
    ranges: &[vk::PushConstantRange],
    offset: u32,
) -> Option<(Vec<vk::PushConstantRange>, vk::ShaderStageFlags)> {
    const BYTES: u32 = 4;
    let end = |range: &vk::PushConstantRange| range.offset.saturating_add(range.size);
    if ranges.iter().any(|range| end(range) > offset) {
        return None;
    }
    let mut ranges = ranges.to_vec();
    // A stage must not be in two ranges.
    let fragment = vk::ShaderStageFlags::FRAGMENT;
    match ranges
        .iter_mut()
        .find(|range| range.stage_flags.contains(fragment))
    {
        Some(range) => range.size = offset + BYTES - range.offset,
        None => ranges.push(vk::PushConstantRange {
            stage_flags: fragment,
            offset,
            size: BYTES,
        }),
    }
    let stages = ranges.iter().filter(|range| end(range) > offset);
    let stages = stages.fold(vk::ShaderStageFlags::empty(), |all, range| {
        all | range.stage_flags
    });
    Some((ranges, stages))
}

pub(super) unsafe extern "system" fn destroy_pipeline_layout(
    device: vk::Device,
    layout: vk::PipelineLayout,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyPipelineLayout. A layout that draws still need is not destroyed.
    unsafe {
        let known = Device::of(device);
        let unused = known.tracker().pipelines.destroy_layout(layout);
        if unused {
            (known.next.destroy_pipeline_layout)(device, layout, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn destroy_pipeline(
    device: vk::Device,
    pipeline: vk::Pipeline,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyPipeline. The recording pipeline belongs to this layer.
    unsafe {
        let known = Device::of(device);
        let recording_pipeline = known.tracker().pipelines.destroy(pipeline);
        if let Some(recording_pipeline) = recording_pipeline {
            (known.next.destroy_pipeline)(device, recording_pipeline, std::ptr::null());
        }
        (known.next.destroy_pipeline)(device, pipeline, allocator);
    }
}

pub(super) unsafe extern "system" fn create_graphics_pipelines(
    device: vk::Device,
    cache: vk::PipelineCache,
    count: u32,
    infos: *const vk::GraphicsPipelineCreateInfo<'_>,
    allocator: Allocator,
    pipelines: *mut vk::Pipeline,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateGraphicsPipelines.
    unsafe {
        let known = Device::of(device);
        let create = known.next.create_graphics_pipelines;
        let result = create(device, cache, count, infos, allocator, pipelines);
        for (info, handle) in slice(infos, count).iter().zip(slice(pipelines, count)) {
            if *handle != vk::Pipeline::null() {
                let pipeline = describe(&known, info);
                known.tracker().pipelines.create(*handle, pipeline);
            }
        }
        result
    }
}

/// Describes a pipeline of the program and creates its recording pipeline.
///
/// # Safety
/// A valid description.
unsafe fn describe(known: &Device, info: &vk::GraphicsPipelineCreateInfo<'_>) -> Pipeline {
    // SAFETY: as the caller promises.
    let (state, stage) = unsafe { (pipeline_state::of(info), fragment_stage(info)) };
    let stages = known
        .tracker()
        .pipelines
        .layout(info.layout)
        .unwrap_or_default()
        .stages;
    let mut pipeline = Pipeline {
        number: 0,
        layout: info.layout,
        stages,
        recorded: None,
        unrecorded: None,
        bindings: Vec::new(),
        state,
    };
    let Some(recorder) = &known.recorder else {
        return pipeline;
    };
    let Some((place, stage)) = stage else {
        return pipeline;
    };
    if stages.is_empty() {
        pipeline.unrecorded = Some("push constants without room for a number".to_owned());
        return pipeline;
    }
    // SAFETY: as the caller promises.
    let recording_pipeline = unsafe { recording_pipeline(known, recorder, info, place, &stage) };
    match recording_pipeline {
        Ok(recorded) => {
            let mut bindings: Vec<(u32, u32)> = Vec::new();
            for site in &recorded.shader.sites {
                if let What::Texture(texture) = &site.what {
                    let both = [Some(texture.image), texture.sampler];
                    bindings.extend(both.iter().flatten().map(|b| (b.set, b.binding)));
                }
            }
            bindings.sort_unstable();
            bindings.dedup();
            pipeline.bindings = bindings;
            pipeline.recorded = Some(recorded);
        }
        Err(why) => pipeline.unrecorded = Some(why),
    }
    pipeline
}

/// Index of the fragment stage, and the stage.
///
/// # Safety
/// A valid description.
unsafe fn fragment_stage<'a>(
    info: &vk::GraphicsPipelineCreateInfo<'a>,
) -> Option<(usize, vk::PipelineShaderStageCreateInfo<'a>)> {
    // SAFETY: as the caller promises.
    unsafe {
        let rasterizes = info.p_rasterization_state.as_ref();
        if rasterizes.is_some_and(|state| state.rasterizer_discard_enable != 0) {
            return None;
        }
        let mut stages = slice(info.p_stages, info.stage_count)
            .iter()
            .copied()
            .enumerate();
        stages.find(|(_, stage)| stage.stage == vk::ShaderStageFlags::FRAGMENT)
    }
}

/// Creates the recording pipeline for a pipeline.
///
/// # Safety
/// A valid description with its fragment stage at index `place`.
unsafe fn recording_pipeline(
    known: &Device,
    recorder: &DeviceRecorder,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    place: usize,
    stage: &vk::PipelineShaderStageCreateInfo<'_>,
) -> Result<Recorded, String> {
    // SAFETY: as the caller promises. Objects derived from the description live until the end of the call.
    unsafe {
        let words = match known.tracker().pipelines.module(stage.module) {
            Some(words) => words,
            // The stage may contain its module.
            None => match find::<vk::ShaderModuleCreateInfo<'_>>(stage.p_next) {
                Some(inline) => slice(inline.p_code, (inline.code_size / 4) as u32).into(),
                None => return Err("a shader whose module is not known".to_owned()),
            },
        };
        let entry = CStr::from_ptr(stage.p_name).to_string_lossy().into_owned();
        let multiview = view_mask(known, info) != 0;
        let shader = recording_shader(known, recorder, words, entry, multiview)?;
        let module_info = vk::ShaderModuleCreateInfo {
            code_size: 4 * shader.words.len(),
            p_code: shader.words.as_ptr(),
            ..Default::default()
        };
        let mut module = vk::ShaderModule::null();
        let made = (known.next.create_shader_module)(
            known.handle,
            &module_info,
            std::ptr::null(),
            &mut module,
        );
        if made != vk::Result::SUCCESS {
            return Err(format!("the driver refuses the recording shader: {made}"));
        }
        let mut stages = slice(info.p_stages, info.stage_count).to_vec();
        stages[place].module = module;
        stages[place].p_next = without_module(stage.p_next);
        let late_alpha = pipeline_state::alpha_to_coverage(info);
        let twice = match shader.info.tests {
            DepthTests::EarlyLateWrite => true,
            DepthTests::Either => late_alpha,
            DepthTests::Early | DepthTests::Late => false,
        };
        let mut changed = pipeline_state::Changed::new(info, stages);
        if twice {
            changed.write_nothing();
        }
        let mut handle = vk::Pipeline::null();
        let result = (known.next.create_graphics_pipelines)(
            known.handle,
            vk::PipelineCache::null(),
            1,
            changed.info(),
            std::ptr::null(),
            &mut handle,
        );
        (known.next.destroy_shader_module)(known.handle, module, std::ptr::null());
        if result != vk::Result::SUCCESS {
            return Err(format!(
                "the driver refuses the recording pipeline: {result}"
            ));
        }
        Ok(Recorded {
            handle,
            shader: shader.info,
            twice,
            fixed: changed.fixed(),
        })
    }
}

/// The chain of a stage, without a module in it. Such a module would take precedence over the stage's new
/// module.
///
/// # Safety
/// A valid chain.
unsafe fn without_module(p_next: *const std::ffi::c_void) -> *const std::ffi::c_void {
    // SAFETY: as the caller promises.
    match unsafe { find::<vk::ShaderModuleCreateInfo<'_>>(p_next) } {
        // Recording does not need the other structures of the chain.
        Some(_) => std::ptr::null(),
        None => p_next,
    }
}

/// View mask of the draws of a pipeline.
///
/// # Safety
/// A valid description.
unsafe fn view_mask(known: &Device, info: &vk::GraphicsPipelineCreateInfo<'_>) -> u32 {
    if info.render_pass != vk::RenderPass::null() {
        return known
            .tracker()
            .passes
            .view_mask(info.render_pass, info.subpass);
    }
    // SAFETY: as the caller promises.
    let dynamic = unsafe { find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next) };
    dynamic.map_or(0, |rendering| rendering.view_mask)
}

/// The recording shader of an entry point, created once.
fn recording_shader(
    known: &Device,
    recorder: &DeviceRecorder,
    words: Arc<[u32]>,
    entry: String,
    multiview: bool,
) -> Result<RecordingShader, String> {
    let key = (words, entry, multiview);
    if let Some(made) = lock(&recorder.shaders).get(&key) {
        return made.clone();
    }
    let target = recorder.target(multiview);
    // A module that cannot be rewritten must not end the program.
    let made = catch_unwind(AssertUnwindSafe(|| {
        instrument(&key.0, Some(&key.1), &target)
    }))
    .unwrap_or(Err(crate::inject::InjectError::Malformed("a panic")))
    .map_err(|error| error.to_string())
    .map(|recording| {
        let shader = known.tracker().pipelines.next_shader();
        keep_module(shader, "program", &key.0);
        keep_module(shader, "recording", &recording.words);
        RecordingShader {
            words: recording.words.into(),
            info: Arc::new(ShaderInfo {
                shader,
                tests: recording.tests,
                sites: recording.sites,
            }),
        }
    });
    lock(&recorder.shaders).insert(key, made.clone());
    made
}

/// Writes a module to the folder for modules, if the launcher set one.
fn keep_module(shader: u32, of: &str, words: &[u32]) {
    let folder = capture().and_then(|capture| capture.settings.modules.as_ref());
    if let Some(folder) = folder {
        let name = format!("{}-{shader}-{of}.spv", std::process::id());
        if let Err(error) =
            std::fs::write(folder.join(name), bytemuck::cast_slice::<u32, u8>(words))
        {
            eprintln!("parallax: {}: {error}", folder.display());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::ShaderStageFlags as Stages;

    fn range(stage_flags: Stages, offset: u32, size: u32) -> vk::PushConstantRange {
        vk::PushConstantRange {
            stage_flags,
            offset,
            size,
        }
    }

    #[test]
    fn ranges_are_extended_by_a_number_and_have_each_stage_once() {
        let (ranges, stages) = extended_ranges(&[], 252).unwrap();
        assert_eq!(
            (ranges.len(), ranges[0].offset, ranges[0].size),
            (1, 252, 4)
        );
        assert_eq!(stages, Stages::FRAGMENT);
        let vertex = range(Stages::VERTEX, 0, 64);
        let both = range(Stages::GEOMETRY | Stages::FRAGMENT, 64, 16);
        let (ranges, stages) = extended_ranges(&[vertex, both], 252).unwrap();
        assert_eq!(
            (ranges.len(), ranges[1].offset, ranges[1].size),
            (2, 64, 192)
        );
        assert_eq!(stages, Stages::GEOMETRY | Stages::FRAGMENT);
        assert!(extended_ranges(&[range(Stages::VERTEX, 250, 4)], 252).is_none());
    }
}
