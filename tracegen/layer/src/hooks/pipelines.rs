//! Hooks of shader modules, pipeline layouts and graphics pipelines.

use super::api::slice;
use super::device::Device;
use super::recording_pipelines::{Described, describe};
use crate::track::Layout;
use ash::vk::{self, Handle};

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
        let create = |stages| {
            let tracker = &mut *known.tracker();
            let sets = slice((*info).p_set_layouts, (*info).set_layout_count).iter();
            let sets = sets.map(|set| tracker.descriptors.empty_set(set.as_raw()));
            let sets = sets.collect();
            tracker
                .pipelines
                .create_layout(*layout, Layout { stages, sets });
        };
        let Some((ranges, stages)) = room else {
            let result = (known.next.create_pipeline_layout)(device, info, allocator, layout);
            if result == vk::Result::SUCCESS {
                create(vk::ShaderStageFlags::empty());
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
            create(stages);
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
    // SAFETY: a valid call of vkDestroyPipeline. The recording pipelines belong to this layer.
    unsafe {
        let known = Device::of(device);
        let recording_pipelines = known.tracker().pipelines.destroy(pipeline);
        for recording_pipeline in recording_pipelines {
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
                let described = describe(&known, info);
                let pipelines = &mut known.tracker().pipelines;
                match described {
                    Described::Pipeline(pipeline) => pipelines.create(*handle, pipeline),
                    Described::Library(library) => pipelines.create_library(*handle, library),
                }
            }
        }
        result
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
