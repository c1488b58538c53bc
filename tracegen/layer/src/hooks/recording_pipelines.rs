//! Recording pipelines of the program's pipelines and pipeline libraries.

use super::api::{find, slice};
use super::device::{Device, DeviceRecorder, RecordingShader};
use super::libraries::{self, LinkedLibrary, Parts};
use super::pipeline_state::{self, Changed};
use super::recording_shaders::{recording_shader, without_module};
use super::stage_reads;
use crate::track::{Library, Pipeline, Recorded, RecordedVertex, State, VERTEX};
use ash::vk;
use spool::{DepthTests, ShaderInfo, What};
use std::sync::Arc;

/// What the tracker keeps of a description.
pub(super) enum Described {
    Pipeline(Pipeline),
    Library(Library),
}

/// A stage of a description, and its recording shader.
struct OwnShader<'a> {
    /// Index of the stage.
    place: usize,
    stage: vk::PipelineShaderStageCreateInfo<'a>,
    shader: RecordingShader,
}

/// Describes a pipeline or library of the program and creates its recording pipelines.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn describe(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Described {
    // SAFETY: as the caller promises.
    unsafe {
        let own = libraries::own_parts(info);
        let links = libraries::links(device, info);
        let mut state = pipeline_state::of(info, own);
        state.reads = stage_reads::before_fragments(device, info, own);
        let mut parts = own;
        let mut layout = info.layout;
        for library in links.iter().filter_map(|(_, library)| library.as_ref()) {
            state.add(&library.state, library.parts);
            parts |= library.parts;
            // The layout of a link is optional.
            if layout == vk::PipelineLayout::null() && library.shader.is_some() {
                layout = library.layout;
            }
        }
        let mut shaders = Vec::new();
        let (mut fragment, mut vertex) = (None, None);
        if let Some(recorder) = &device.recorder {
            fragment = self::fragment(device, recorder, info, own, &links, &mut shaders);
            vertex = self::vertex(device, recorder, info, own, &links, &state, &mut shaders);
        }
        if libraries::is_library(info) {
            let library = Library {
                parts,
                state,
                layout,
                shader: fragment,
                vertex,
                ..Library::default()
            };
            return Described::Library(with_variants(device, info, &links, &shaders, library));
        }
        let mut pipeline = Pipeline {
            number: 0,
            layout,
            stages: number_stages(device, layout),
            recorded: None,
            unrecorded: None,
            bindings: Vec::new(),
            state,
        };
        let made = match fragment {
            Some(Ok(shader)) => recorded(
                device,
                info,
                &links,
                &shaders,
                shader,
                vertex,
                &mut pipeline,
            ),
            Some(Err(why)) => Err(why),
            None => Ok(()),
        };
        pipeline.unrecorded = made.err();
        Described::Pipeline(pipeline)
    }
}

/// Stages of a layout that see the draw's number.
fn number_stages(device: &Device, layout: vk::PipelineLayout) -> vk::ShaderStageFlags {
    let tracker = device.tracker();
    let layout = tracker.pipelines.layout(layout);
    layout.map(|layout| layout.stages).unwrap_or_default()
}

/// The recording fragment shader of a description or of its libraries, or the reason why there is none; `None`
/// without a fragment shader. Its own one is added to `shaders`.
///
/// # Safety
/// A valid description with these own parts and libraries.
unsafe fn fragment<'a>(
    device: &Device,
    recorder: &DeviceRecorder,
    info: &vk::GraphicsPipelineCreateInfo<'a>,
    own: Parts,
    links: &[LinkedLibrary],
    shaders: &mut Vec<OwnShader<'a>>,
) -> Option<Result<Arc<ShaderInfo>, String>> {
    if !own.contains(Parts::FRAGMENT_SHADER) {
        return links.iter().find_map(|(_, l)| l.as_ref()?.shader.clone());
    }
    // SAFETY: as the caller promises.
    unsafe {
        let (place, stage) = fragment_stage(info, own)?;
        if number_stages(device, info.layout).is_empty() {
            return Some(Err("push constants without room for a number".to_owned()));
        }
        let multiview = view_mask(device, info) != 0;
        let shader = recording_shader(device, recorder, &stage, multiview);
        Some(shader.map(|shader| {
            let info = Arc::clone(&shader.info);
            shaders.push(OwnShader {
                place,
                stage,
                shader,
            });
            info
        }))
    }
}

/// Index of the fragment stage, and the stage.
///
/// # Safety
/// A valid description with these own parts.
unsafe fn fragment_stage<'a>(
    info: &vk::GraphicsPipelineCreateInfo<'a>,
    own: Parts,
) -> Option<(usize, vk::PipelineShaderStageCreateInfo<'a>)> {
    // SAFETY: as the caller promises. Pointers of parts that are not its own may be invalid.
    unsafe {
        if own.contains(Parts::PRE_RASTERIZATION_SHADERS) {
            let rasterizes = info.p_rasterization_state.as_ref();
            if rasterizes.is_some_and(|state| state.rasterizer_discard_enable != 0) {
                return None;
            }
        }
        let mut stages = slice(info.p_stages, info.stage_count)
            .iter()
            .copied()
            .enumerate();
        stages.find(|(_, stage)| stage.stage == vk::ShaderStageFlags::FRAGMENT)
    }
}

/// The recording vertex shader of a description or of its libraries; `None` if no read can be recorded. Its own one
/// is added to `shaders`.
///
/// # Safety
/// A valid description with these own parts, libraries and state.
unsafe fn vertex<'a>(
    device: &Device,
    recorder: &DeviceRecorder,
    info: &vk::GraphicsPipelineCreateInfo<'a>,
    own: Parts,
    links: &[LinkedLibrary],
    state: &State,
    shaders: &mut Vec<OwnShader<'a>>,
) -> Option<RecordedVertex> {
    if !own.contains(Parts::PRE_RASTERIZATION_SHADERS) {
        return links.iter().find_map(|(_, l)| l.as_ref()?.vertex.clone());
    }
    let wanted = vk::ShaderStageFlags::VERTEX;
    let sees_number = number_stages(device, info.layout).contains(wanted);
    if !sees_number || !state.reads.iter().any(|of| of.stage == VERTEX) {
        return None;
    }
    // SAFETY: as the caller promises.
    let (place, stage, shader) = unsafe {
        let mut stages = slice(info.p_stages, info.stage_count).iter().enumerate();
        let (place, stage) = stages.find(|(_, stage)| stage.stage == wanted)?;
        let multiview = view_mask(device, info) != 0;
        let shader = recording_shader(device, recorder, stage, multiview).ok()?;
        (place, *stage, shader)
    };
    if shader.info.sites.is_empty() {
        return None;
    }
    let unrecorded = shader.unrecorded.iter();
    let recorded = RecordedVertex {
        bindings: bindings(&shader.info),
        shader: Arc::clone(&shader.info),
        unrecorded: unrecorded
            .map(|(what, count)| stage_reads::reads_of(VERTEX, what, *count))
            .collect(),
    };
    shaders.push(OwnShader {
        place,
        stage,
        shader,
    });
    Some(recorded)
}

/// View mask of the draws of a pipeline.
///
/// # Safety
/// A valid description.
unsafe fn view_mask(device: &Device, info: &vk::GraphicsPipelineCreateInfo<'_>) -> u32 {
    if info.render_pass != vk::RenderPass::null() {
        return device
            .tracker()
            .passes
            .view_mask(info.render_pass, info.subpass);
    }
    // SAFETY: as the caller promises.
    let dynamic = unsafe { find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next) };
    dynamic.map_or(0, |rendering| rendering.view_mask)
}

/// Creates the recording pipeline of a complete pipeline.
///
/// # Safety
/// A valid description with these libraries and recording shaders.
unsafe fn recorded(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    shaders: &[OwnShader<'_>],
    shader: Arc<ShaderInfo>,
    vertex: Option<RecordedVertex>,
    pipeline: &mut Pipeline,
) -> Result<(), String> {
    let twice = is_drawn_twice(&shader, &pipeline.state);
    // SAFETY: as the caller promises.
    let (handle, fixed) = unsafe { variant(device, info, links, shaders, twice) }?;
    pipeline.bindings = bindings(&shader);
    pipeline.recorded = Some(Recorded {
        handle,
        shader,
        twice,
        fixed,
        vertex,
    });
    Ok(())
}

/// Creates the variants of a library that recording pipelines are linked from.
///
/// # Safety
/// A valid description of a library with these libraries and recording shaders.
unsafe fn with_variants(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    shaders: &[OwnShader<'_>],
    mut library: Library,
) -> Library {
    let tests = match &library.shader {
        Some(Ok(shader)) => Some(shader.tests),
        Some(Err(_)) => return library,
        None => None,
    };
    let vertex = library.vertex.is_some();
    let outputs = library.parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
    // Alpha-to-coverage is a property of the fragment output, which may be in another library.
    let (once, twice) = match tests {
        Some(DepthTests::Early | DepthTests::Late) => (true, false),
        Some(DepthTests::EarlyLateWrite) => (false, true),
        Some(DepthTests::Either) => (true, true),
        None => (vertex, vertex || outputs && device.recorder.is_some()),
    };
    // SAFETY: as the caller promises.
    let make = |quiet| unsafe { variant(device, info, links, shaders, quiet) };
    if once {
        match make(false) {
            Ok((handle, _)) => library.recording = Some(handle),
            Err(why) => library.shader = Some(Err(why)),
        }
    }
    if twice {
        match make(true) {
            Ok((handle, fixed)) => {
                library.quiet = Some(handle);
                library.fixed = fixed;
            }
            Err(why) => library.shader = Some(Err(why)),
        }
    }
    library
}

/// Whether a pipeline is recorded by an additional draw.
fn is_drawn_twice(shader: &ShaderInfo, state: &State) -> bool {
    match shader.tests {
        DepthTests::EarlyLateWrite => true,
        DepthTests::Either => state.alpha_to_coverage,
        DepthTests::Early | DepthTests::Late => false,
    }
}

/// Set and binding of the textures that a shader may read.
fn bindings(shader: &ShaderInfo) -> Vec<(u32, u32)> {
    let mut bindings: Vec<(u32, u32)> = Vec::new();
    for site in &shader.sites {
        if let What::Texture(texture) = &site.what {
            let both = [Some(texture.image), texture.sampler];
            bindings.extend(both.iter().flatten().map(|b| (b.set, b.binding)));
        }
    }
    bindings.sort_unstable();
    bindings.dedup();
    bindings
}

/// Creates a pipeline or library with its recording shaders and, if requested, without writes. Also returns the
/// dynamic states that it fixes.
///
/// # Safety
/// A valid description with these libraries and recording shaders.
unsafe fn variant(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    shaders: &[OwnShader<'_>],
    quiet: bool,
) -> Result<(vk::Pipeline, Vec<vk::DynamicState>), String> {
    // SAFETY: as the caller promises. Objects derived from the description live until the end of the call.
    unsafe {
        let mut stages = slice(info.p_stages, info.stage_count).to_vec();
        let mut modules = Vec::with_capacity(shaders.len());
        let mut made = Ok(());
        for own in shaders {
            made = made.and_then(|()| {
                let module = create_module(device, &own.shader)?;
                modules.push(module);
                stages[own.place].module = module;
                stages[own.place].p_next = without_module(own.stage.p_next);
                Ok(())
            });
        }
        let made = made.and_then(|()| linked(device, info, stages, links, quiet));
        for module in modules {
            (device.next.destroy_shader_module)(device.handle, module, std::ptr::null());
        }
        made
    }
}

/// Creates a pipeline or library with other stages and with the variants of its libraries.
///
/// # Safety
/// As for [`variant`].
unsafe fn linked(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    stages: Vec<vk::PipelineShaderStageCreateInfo<'_>>,
    links: &[LinkedLibrary],
    quiet: bool,
) -> Result<(vk::Pipeline, Vec<vk::DynamicState>), String> {
    // SAFETY: as the caller promises. The chain lives until the end of the call.
    unsafe {
        let mut changed = Changed::new(info, stages);
        let mut fixed = Vec::new();
        let mut handles = Vec::new();
        for (handle, library) in links {
            let library = library.as_ref();
            let replaced = library.and_then(|l| if quiet { l.quiet } else { l.recording });
            handles.push(replaced.unwrap_or(*handle));
            if quiet && let Some(library) = library {
                fixed.extend(&library.fixed);
            }
        }
        let chain = match handles.is_empty() {
            true => None,
            false => Some(libraries::Chain::new(info.p_next, handles)?),
        };
        if let Some(chain) = &chain {
            changed.replace_chain(chain.first());
        }
        if quiet {
            changed.write_nothing();
        }
        let mut handle = vk::Pipeline::null();
        let result = (device.next.create_graphics_pipelines)(
            device.handle,
            vk::PipelineCache::null(),
            1,
            changed.info(),
            std::ptr::null(),
            &mut handle,
        );
        if result != vk::Result::SUCCESS {
            return Err(format!(
                "the driver refuses the recording pipeline: {result}"
            ));
        }
        fixed.extend(changed.fixed());
        Ok((handle, fixed))
    }
}

/// Creates the module of a recording shader.
///
/// # Safety
/// A live device.
unsafe fn create_module(
    device: &Device,
    shader: &RecordingShader,
) -> Result<vk::ShaderModule, String> {
    let info = vk::ShaderModuleCreateInfo {
        code_size: 4 * shader.words.len(),
        p_code: shader.words.as_ptr(),
        ..Default::default()
    };
    let mut module = vk::ShaderModule::null();
    // SAFETY: the words live until the end of the call.
    let result = unsafe {
        (device.next.create_shader_module)(device.handle, &info, std::ptr::null(), &mut module)
    };
    match result {
        vk::Result::SUCCESS => Ok(module),
        error => Err(format!("the driver refuses the recording shader: {error}")),
    }
}
