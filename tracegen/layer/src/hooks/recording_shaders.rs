//! Recording shaders of the program's fragment shaders.

use super::api::{find, slice};
use super::device::{Device, DeviceRecorder, RecordingShader};
use crate::capture::{capture, lock};
use crate::inject::instrument;
use ash::vk;
use rspirv::spirv::ExecutionModel;
use spool::ShaderInfo;
use std::ffi::CStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Words of a stage's module, and the name of its entry point.
///
/// # Safety
/// A valid stage.
pub(super) unsafe fn module_of(
    device: &Device,
    stage: &vk::PipelineShaderStageCreateInfo<'_>,
) -> Result<(Arc<[u32]>, String), String> {
    // SAFETY: as the caller promises.
    unsafe {
        let words = match device.tracker().pipelines.module(stage.module) {
            Some(words) => words,
            // The stage may contain its module.
            None => match find::<vk::ShaderModuleCreateInfo<'_>>(stage.p_next) {
                Some(inline) => slice(inline.p_code, (inline.code_size / 4) as u32).into(),
                None => return Err("a shader whose module is not known".to_owned()),
            },
        };
        let entry = CStr::from_ptr(stage.p_name);
        Ok((words, entry.to_string_lossy().into_owned()))
    }
}

/// The recording shader of a fragment stage or a vertex stage.
///
/// # Safety
/// A valid stage.
pub(super) unsafe fn recording_shader(
    device: &Device,
    recorder: &DeviceRecorder,
    stage: &vk::PipelineShaderStageCreateInfo<'_>,
    multiview: bool,
) -> Result<RecordingShader, String> {
    // SAFETY: as the caller promises.
    let (words, entry) = unsafe { module_of(device, stage) }?;
    let is_vertex = stage.stage == vk::ShaderStageFlags::VERTEX;
    let key = (words, entry, multiview, is_vertex);
    if let Some(made) = lock(&recorder.shaders).get(&key) {
        return made.clone();
    }
    let target = recorder.target(multiview);
    // A module that cannot be rewritten must not end the program.
    let made = catch_unwind(AssertUnwindSafe(|| {
        let model = match is_vertex {
            true => ExecutionModel::Vertex,
            false => ExecutionModel::Fragment,
        };
        instrument(&key.0, Some(&key.1), model, &target)
    }))
    .unwrap_or(Err(crate::inject::InjectError::Malformed("a panic")))
    .map_err(|error| error.to_string())
    .map(|recording| {
        let shader = device.tracker().pipelines.next_shader();
        keep_module(shader, "program", &key.0);
        keep_module(shader, "recording", &recording.words);
        RecordingShader {
            words: recording.words.into(),
            info: Arc::new(ShaderInfo {
                shader,
                tests: recording.tests,
                sites: recording.sites,
            }),
            unrecorded: recording.unrecorded,
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

/// The chain of a stage, without a module in it. Such a module would take precedence over the stage's new
/// module.
///
/// # Safety
/// A valid chain.
pub(super) unsafe fn without_module(p_next: *const std::ffi::c_void) -> *const std::ffi::c_void {
    // SAFETY: as the caller promises.
    match unsafe { find::<vk::ShaderModuleCreateInfo<'_>>(p_next) } {
        // Recording does not need the other structures of the chain.
        Some(_) => std::ptr::null(),
        None => p_next,
    }
}
