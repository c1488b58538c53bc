//! Recording pipelines of the program's pipelines and pipeline libraries.

use super::api::{find, slice};
use super::device::{Device, DeviceRecorder, RecordingShader};
use super::libraries::{self, LinkedLibrary, Parts};
use super::pipeline_state::{self, Changed};
use super::recording_shaders::{recording_shader, without_module};
use super::stage_reads;
use crate::track::{Library, Pipeline, Recorded, State};
use ash::vk;
use spool::ShaderInfo;
use spool::{DepthTests, What};
use std::sync::Arc;

/// What the tracker keeps of a description.
pub(super) enum Described {
    Pipeline(Pipeline),
    Library(Library),
}

/// Fragment shader of a description: its own, or that of a library.
enum Fragment<'a> {
    None,
    Own(Box<OwnFragment<'a>>),
    Linked(Arc<ShaderInfo>),
    Unrecorded(String),
}

struct OwnFragment<'a> {
    /// Index of the stage.
    place: usize,
    stage: vk::PipelineShaderStageCreateInfo<'a>,
    shader: RecordingShader,
}

impl Fragment<'_> {
    /// Shader, or the reason why it is not recorded; `None` if there is no fragment shader.
    fn shader(&self) -> Option<Result<Arc<ShaderInfo>, String>> {
        match self {
            Self::None => None,
            Self::Own(own) => Some(Ok(Arc::clone(&own.shader.info))),
            Self::Linked(shader) => Some(Ok(Arc::clone(shader))),
            Self::Unrecorded(why) => Some(Err(why.clone())),
        }
    }
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
        let fragment = match &device.recorder {
            Some(recorder) => fragment(device, recorder, info, own, &links),
            None => Fragment::None,
        };
        if libraries::is_library(info) {
            let library = Library {
                parts,
                state,
                layout,
                shader: fragment.shader(),
                ..Library::default()
            };
            return Described::Library(with_variants(device, info, &links, &fragment, library));
        }
        let pipeline = Pipeline {
            number: 0,
            layout,
            stages: number_stages(device, layout),
            recorded: None,
            unrecorded: None,
            bindings: Vec::new(),
            state,
        };
        Described::Pipeline(recorded(device, info, &links, &fragment, pipeline))
    }
}

/// Stages of a layout that see the draw's number.
fn number_stages(device: &Device, layout: vk::PipelineLayout) -> vk::ShaderStageFlags {
    let tracker = device.tracker();
    let layout = tracker.pipelines.layout(layout);
    layout.map(|layout| layout.stages).unwrap_or_default()
}

/// The fragment shader of a description.
///
/// # Safety
/// A valid description with these own parts and libraries.
unsafe fn fragment<'a>(
    device: &Device,
    recorder: &DeviceRecorder,
    info: &vk::GraphicsPipelineCreateInfo<'a>,
    own: Parts,
    links: &[LinkedLibrary],
) -> Fragment<'a> {
    if !own.contains(Parts::FRAGMENT_SHADER) {
        let mut shaders = links.iter().filter_map(|(_, l)| l.as_ref()?.shader.clone());
        return match shaders.next() {
            Some(Ok(shader)) => Fragment::Linked(shader),
            Some(Err(why)) => Fragment::Unrecorded(why),
            None => Fragment::None,
        };
    }
    // SAFETY: as the caller promises.
    unsafe {
        let Some((place, stage)) = fragment_stage(info, own) else {
            return Fragment::None;
        };
        if number_stages(device, info.layout).is_empty() {
            return Fragment::Unrecorded("push constants without room for a number".to_owned());
        }
        let multiview = view_mask(device, info) != 0;
        match recording_shader(device, recorder, &stage, multiview) {
            Ok(shader) => Fragment::Own(Box::new(OwnFragment {
                place,
                stage,
                shader,
            })),
            Err(why) => Fragment::Unrecorded(why),
        }
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
/// A valid description with these libraries and this fragment shader.
unsafe fn recorded(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    fragment: &Fragment<'_>,
    mut pipeline: Pipeline,
) -> Pipeline {
    let shader = match fragment.shader() {
        Some(Ok(shader)) => shader,
        Some(Err(why)) => {
            pipeline.unrecorded = Some(why);
            return pipeline;
        }
        None => return pipeline,
    };
    let twice = is_drawn_twice(&shader, &pipeline.state);
    // SAFETY: as the caller promises.
    match unsafe { variant(device, info, links, fragment, twice) } {
        Ok((handle, fixed)) => {
            pipeline.bindings = bindings(&shader);
            pipeline.recorded = Some(Recorded {
                handle,
                shader,
                twice,
                fixed,
            });
        }
        Err(why) => pipeline.unrecorded = Some(why),
    }
    pipeline
}

/// Creates the variants of a library that recording pipelines are linked from.
///
/// # Safety
/// A valid description of a library with these libraries and this fragment shader.
unsafe fn with_variants(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    fragment: &Fragment<'_>,
    mut library: Library,
) -> Library {
    let tests = match &library.shader {
        Some(Ok(shader)) => Some(shader.tests),
        Some(Err(_)) => return library,
        None => None,
    };
    let outputs = library.parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
    // Alpha-to-coverage is a property of the fragment output, which may be in another library.
    let (once, twice) = match tests {
        Some(DepthTests::Early | DepthTests::Late) => (true, false),
        Some(DepthTests::EarlyLateWrite) => (false, true),
        Some(DepthTests::Either) => (true, true),
        None => (false, outputs && device.recorder.is_some()),
    };
    // SAFETY: as the caller promises.
    let make = |quiet| unsafe { variant(device, info, links, fragment, quiet) };
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

/// Creates a pipeline or library with the recording shader and, if requested, without writes. Also returns the
/// dynamic states that it fixes.
///
/// # Safety
/// A valid description with these libraries and this fragment shader.
unsafe fn variant(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    links: &[LinkedLibrary],
    fragment: &Fragment<'_>,
    quiet: bool,
) -> Result<(vk::Pipeline, Vec<vk::DynamicState>), String> {
    // SAFETY: as the caller promises. Objects derived from the description live until the end of the call.
    unsafe {
        let mut stages = slice(info.p_stages, info.stage_count).to_vec();
        let mut module = vk::ShaderModule::null();
        if let Fragment::Own(own) = fragment {
            module = create_module(device, &own.shader)?;
            stages[own.place].module = module;
            stages[own.place].p_next = without_module(own.stage.p_next);
        }
        let made = linked(device, info, stages, links, quiet);
        (device.next.destroy_shader_module)(device.handle, module, std::ptr::null());
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
