//! Hooks of shader modules, pipeline layouts and graphics pipelines.

use super::api::slice;
use super::device::Device;
use super::recording_pipelines::{Described, describe};
use crate::track::Layout;
use ash::vk::{self, Handle};

type Allocator = *const vk::AllocationCallbacks<'static>;

creates! {
    create_shader_module ShaderModuleCreateInfo => ShaderModule |device, info, module| {
        let words = slice(info.p_code, (info.code_size / 4) as u32);
        device.tracker().pipelines.create_module(module, words);
    };
}

destroys! {
    destroy_shader_module ShaderModule |device, module| device.tracker().pipelines.destroy_module(module);
    // The recording pipelines belong to this layer.
    destroy_pipeline Pipeline |device, pipeline| {
        let recording_pipelines = device.tracker().pipelines.destroy(pipeline);
        for recording_pipeline in recording_pipelines {
            (device.next.destroy_pipeline)(device.handle, recording_pipeline, std::ptr::null());
        }
    };
}

after! {
    create_graphics_pipelines(handle: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::GraphicsPipelineCreateInfo<'_>, allocator: Allocator, pipelines: *mut vk::Pipeline) |device, result|
        for (info, handle) in slice(infos, count).iter().zip(slice(pipelines, count)) {
            if *handle != vk::Pipeline::null() {
                let described = describe(&device, info);
                let pipelines = &mut device.tracker().pipelines;
                match described {
                    Described::Pipeline(pipeline) => pipelines.create(*handle, pipeline),
                    Described::Library(library) => pipelines.create_library(*handle, library),
                }
            }
        };
}

pub(super) unsafe extern "system" fn create_pipeline_layout(
    handle: vk::Device,
    info: *const vk::PipelineLayoutCreateInfo<'_>,
    allocator: Allocator,
    layout: *mut vk::PipelineLayout,
) -> vk::Result {
    // SAFETY: a valid call of vkCreatePipelineLayout.
    unsafe {
        let device = Device::of(handle);
        let ranges = slice(
            (*info).p_push_constant_ranges,
            (*info).push_constant_range_count,
        );
        let room = device
            .recorder
            .as_ref()
            .and_then(|r| extended_ranges(ranges, r.push_constant_bytes));
        let create = |stages| {
            let tracker = &mut *device.tracker();
            let sets = slice((*info).p_set_layouts, (*info).set_layout_count).iter();
            let sets = sets.map(|set| tracker.descriptors.empty_set(set.as_raw()));
            let sets = sets.collect();
            tracker
                .pipelines
                .create_layout(*layout, Layout { stages, sets });
        };
        let Some((ranges, stages)) = room else {
            let result = (device.next.create_pipeline_layout)(handle, info, allocator, layout);
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
        let result = (device.next.create_pipeline_layout)(handle, &wider, allocator, layout);
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
    for stage in [vk::ShaderStageFlags::FRAGMENT, vk::ShaderStageFlags::VERTEX] {
        match ranges
            .iter_mut()
            .find(|range| range.stage_flags.contains(stage))
        {
            Some(range) => range.size = offset + BYTES - range.offset,
            None => ranges.push(vk::PushConstantRange {
                stage_flags: stage,
                offset,
                size: BYTES,
            }),
        }
    }
    let stages = ranges.iter().filter(|range| end(range) > offset);
    let stages = stages.fold(vk::ShaderStageFlags::empty(), |all, range| {
        all | range.stage_flags
    });
    Some((ranges, stages))
}

pub(super) unsafe extern "system" fn destroy_pipeline_layout(
    handle: vk::Device,
    layout: vk::PipelineLayout,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyPipelineLayout. A layout that draws still need is not destroyed.
    unsafe {
        let device = Device::of(handle);
        let unused = device.tracker().pipelines.destroy_layout(layout);
        if unused {
            (device.next.destroy_pipeline_layout)(handle, layout, allocator);
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
            (2, 252, 4)
        );
        assert_eq!(stages, Stages::FRAGMENT | Stages::VERTEX);
        let vertex = range(Stages::VERTEX, 0, 64);
        let both = range(Stages::GEOMETRY | Stages::FRAGMENT, 64, 16);
        let (ranges, stages) = extended_ranges(&[vertex, both], 252).unwrap();
        assert_eq!(
            (ranges.len(), ranges[1].offset, ranges[1].size),
            (2, 64, 192)
        );
        assert_eq!((ranges[0].offset, ranges[0].size), (0, 256));
        assert_eq!(stages, Stages::GEOMETRY | Stages::FRAGMENT | Stages::VERTEX);
        assert!(extended_ranges(&[range(Stages::VERTEX, 250, 4)], 252).is_none());
    }
}
