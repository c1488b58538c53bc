//! Texture reads of shaders that are not recorded: those before the fragment shader, and compute shaders.

use super::api::slice;
use super::device::Device;
use super::draws::is_wanted;
use super::libraries::Parts;
use super::recording_shaders::module_of;
use crate::inject::{InjectError, texel_reads, workgroup_size};
use crate::track::{Compute, VERTEX};
use ash::vk::{self, Handle};
use rspirv::spirv::ExecutionModel;
use spool::{DispatchInfo, StageReads};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Stages whose reads are counted, with their names.
const STAGES: [(vk::ShaderStageFlags, ExecutionModel, &str); 5] = {
    use {ExecutionModel as Model, vk::ShaderStageFlags as Stage};
    let (control, evaluation) = (Model::TessellationControl, Model::TessellationEvaluation);
    [
        (Stage::VERTEX, Model::Vertex, VERTEX),
        (Stage::TESSELLATION_CONTROL, control, "tessellation control"),
        (
            Stage::TESSELLATION_EVALUATION,
            evaluation,
            "tessellation evaluation",
        ),
        (Stage::GEOMETRY, Model::Geometry, "geometry"),
        (Stage::COMPUTE, Model::GLCompute, "compute"),
    ]
};

/// Result for a module that cannot be analysed. It must not end the program.
fn without_panic<T>(analyse: impl FnOnce() -> Result<T, InjectError>) -> Result<T, InjectError> {
    catch_unwind(AssertUnwindSafe(analyse)).unwrap_or(Err(InjectError::Malformed("a panic")))
}

/// Texture reads of a stage.
///
/// # Safety
/// A valid stage.
unsafe fn of_stage(
    device: &Device,
    stage: &vk::PipelineShaderStageCreateInfo<'_>,
) -> Vec<StageReads> {
    let Some((_, model, name)) = STAGES.iter().find(|(flag, ..)| *flag == stage.stage) else {
        return Vec::new();
    };
    // SAFETY: as the caller promises.
    let module = unsafe { module_of(device, stage) };
    let counts = module.ok().and_then(|(words, entry)| {
        without_panic(|| texel_reads(&words, Some(&entry), *model)).ok()
    });
    let unknown = || BTreeMap::from([("shaders that cannot be analysed".to_owned(), 0)]);
    let counts = counts.unwrap_or_else(unknown).into_iter();
    counts
        .map(|(what, instructions)| reads_of(name, &what, instructions))
        .collect()
}

/// Image instructions of a stage for a kind of texture.
pub(super) fn reads_of(stage: &str, what: &str, instructions: u32) -> StageReads {
    StageReads {
        stage: stage.to_owned(),
        what: what.to_owned(),
        instructions,
    }
}

/// Texture reads of the own stages of a graphics pipeline before its fragment shader.
///
/// # Safety
/// A valid description with these own parts.
pub(super) unsafe fn before_fragments(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    own: Parts,
) -> Vec<StageReads> {
    if !own.contains(Parts::PRE_RASTERIZATION_SHADERS) {
        return Vec::new();
    }
    // SAFETY: as the caller promises.
    unsafe {
        let stages = slice(info.p_stages, info.stage_count).iter();
        stages.flat_map(|stage| of_stage(device, stage)).collect()
    }
}

/// Value of a specialisation constant.
///
/// # Safety
/// A valid description or null.
unsafe fn specialized(info: *const vk::SpecializationInfo<'_>, constant: u32) -> Option<u32> {
    // SAFETY: as the caller promises; the data have the offsets of the entries.
    unsafe {
        let info = info.as_ref()?;
        let entries = slice(info.p_map_entries, info.map_entry_count);
        let entry = entries.iter().find(|entry| entry.constant_id == constant)?;
        let at = info.p_data.cast::<u8>().add(entry.offset as usize);
        match entry.size {
            1 => Some(at.read().into()),
            2 => Some(at.cast::<u16>().read_unaligned().into()),
            4 => Some(at.cast::<u32>().read_unaligned()),
            _ => None,
        }
    }
}

after! {
    create_compute_pipelines(handle: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::ComputePipelineCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipelines: *mut vk::Pipeline) |device, result|
        for (info, handle) in slice(infos, count).iter().zip(slice(pipelines, count)) {
            let reads = of_stage(&device, &info.stage);
            if *handle == vk::Pipeline::null() || reads.is_empty() {
                continue;
            }
            let workgroup = module_of(&device, &info.stage).ok().and_then(|(words, entry)| {
                let constant = |number| specialized(info.stage.p_specialization_info, number);
                without_panic(|| workgroup_size(&words, Some(&entry), constant)).ok()
            });
            let compute = Compute {
                workgroup: workgroup.unwrap_or_default(),
                reads,
            };
            device.tracker().pipelines.create_compute(*handle, compute);
        };
}

/// Tracks a dispatch whose shader reads textures.
///
/// # Safety
/// The command buffer is being recorded.
unsafe fn track(device: &Device, buffer: vk::CommandBuffer, groups: Option<[u32; 3]>) {
    let mut tracker = device.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    let Some(compute) = state.compute.clone() else {
        return;
    };
    if device.capture.is_over() || !is_wanted(device, state) {
        return;
    }
    state.effects.dispatches.push(DispatchInfo {
        groups,
        workgroup: compute.workgroup,
        reads: compute.reads.clone(),
    });
}

before! {
    cmd_dispatch(buffer: vk::CommandBuffer, x: u32, y: u32, z: u32) |device| track(&device, buffer, Some([x, y, z]));
    cmd_dispatch_base(buffer: vk::CommandBuffer, first_x: u32, first_y: u32, first_z: u32, x: u32, y: u32, z: u32) |device|
        track(&device, buffer, Some([x, y, z]));
    cmd_dispatch_indirect(buffer: vk::CommandBuffer, from: vk::Buffer, at: vk::DeviceSize) |device| track(&device, buffer, None);
}
