//! The Vulkan objects of the random program, and their creation and destruction.
//!
//! All images are in layout `GENERAL`. Nothing is destroyed or changed while commands are being executed.
//! Command buffers that use a destroyed or changed object are freed.

mod descriptors;
mod geometry;
mod pipelines;
mod textures;

use super::generator::Generator;
use super::shaders;
use crate::gpu::{Buffer, Gpu, Image, ImageKind, Result, checked};
use crate::libraries;
use ash::vk::{self, Handle};
use descriptors::{set_layouts, template};
use geometry::geometry;
use std::collections::BTreeSet;
use textures::{destroy_image, sampler, texture, to_general};

pub use descriptors::{pushed, template_data};
pub use geometry::{COUNTS_AT, INDEXED_AT, INDICES_AT, INDIRECT_AT, SHAPES};
pub use textures::{Texture, View};

pub const FORMATS: [vk::Format; 2] = [vk::Format::R8G8B8A8_UNORM, vk::Format::B8G8R8A8_UNORM];
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Size of the target of the frames' pictures. Other images are smaller.
pub const MAIN_PX: [u32; 2] = [160, 120];
/// Queries of a pool.
pub const QUERIES: u32 = 8;

/// Format of the colour target, and whether there is depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Class {
    pub format: usize,
    pub depth: bool,
}

/// Descriptor type of both bindings, and whether they have immutable samplers.
pub type SetKind = [(vk::DescriptorType, bool); 2];
const IMAGE: vk::DescriptorType = vk::DescriptorType::SAMPLED_IMAGE;
const SAMPLER: vk::DescriptorType = vk::DescriptorType::SAMPLER;
const BOTH: vk::DescriptorType = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
/// Kinds of sets. The last one is pushed.
pub const SET_KINDS: [SetKind; 5] = [
    [(IMAGE, false), (SAMPLER, false)],
    [(IMAGE, false), (SAMPLER, true)],
    [(BOTH, false), (BOTH, false)],
    [(BOTH, true), (BOTH, true)],
    [(IMAGE, false), (SAMPLER, false)],
];
pub const PUSHED: usize = 4;

/// A descriptor set and what was written to it.
pub struct Set {
    pub handle: vk::DescriptorSet,
    pub kind: usize,
    pub written: Option<(View, vk::Sampler)>,
}

pub struct Pool {
    pub handle: vk::DescriptorPool,
    pub frees: bool,
    pub sets: Vec<Set>,
}
/// Sets of a pool.
const POOL_SETS: usize = 6;

/// A pipeline layout: the kinds of its sets, and the offset of the fragment shader's constants.
pub struct Layout {
    pub handle: vk::PipelineLayout,
    pub kinds: Vec<usize>,
    pub offset: usize,
    /// Template for a pushed set.
    pub template: Option<vk::DescriptorUpdateTemplate>,
}

pub struct Pipeline {
    pub handle: vk::Pipeline,
    linked: libraries::Linked,
    pub layout: usize,
    pub class: Class,
    /// Whether it is for dynamic rendering.
    pub dynamic: bool,
}

/// A render target, with a render pass and a framebuffer.
pub struct Target {
    pub pass: vk::RenderPass,
    pub framebuffer: vk::Framebuffer,
    pub class: Class,
    pub view: View,
    pub clears: bool,
}

/// A recorded command buffer.
pub struct Recorded {
    pub buffer: vk::CommandBuffer,
    pub pool: vk::CommandPool,
    /// Whether it may be executed several times at once.
    pub simultaneous: bool,
    /// Whether it was submitted since the device was idle.
    pub pending: bool,
    /// Whether it is submitted once.
    pub once: bool,
    /// Whether it ends with the frame's picture.
    pub picture: bool,
    /// Class, kind of rendering and smallest target of a secondary command buffer.
    pub inside: Option<(Class, bool, [u32; 2])>,
    pub contents: Contents,
}

/// What a command buffer uses and draws.
#[derive(Clone, Default)]
pub struct Contents {
    /// Handles of the used objects.
    pub uses: BTreeSet<u64>,
    /// The draws into the main target: sizes of the textures that they read.
    pub draws: Vec<Vec<[u32; 2]>>,
}

pub struct World {
    pub gpu: Gpu,
    pub push: ash::khr::push_descriptor::Device,
    pub multi: ash::ext::multi_draw::Device,
    pub geometry: Buffer,
    pub readback: Buffer,
    pub depth: Image,
    pub set_layouts: Vec<vk::DescriptorSetLayout>,
    pub templates: Vec<vk::DescriptorUpdateTemplate>,
    immutable: [vk::Sampler; 2],
    vertex: vk::ShaderModule,
    pub queries: vk::QueryPool,
    pub statistics: vk::QueryPool,
    pub events: Vec<vk::Event>,
    pub fence: vk::Fence,
    pub semaphores: Vec<vk::Semaphore>,
    /// Whether a semaphore is signalled and not waited for.
    pub signalled: Option<vk::Semaphore>,
    pub timeline: vk::Semaphore,
    pub timeline_value: u64,
    pub commands: vk::CommandPool,
    /// Pools that are destroyed when the device is idle.
    pub retired: Vec<vk::CommandPool>,
    pub main: Texture,
    pub home: Texture,
    pub textures: Vec<Texture>,
    pub samplers: Vec<vk::Sampler>,
    pub pools: Vec<Pool>,
    pub layouts: Vec<Layout>,
    pub pipelines: Vec<Pipeline>,
    pub targets: Vec<Target>,
    pub primaries: Vec<Recorded>,
    pub secondaries: Vec<Recorded>,
    /// Whether it renders the frames' pictures.
    pub shows: bool,
    /// The submitted draws into the frame's picture: sizes of the textures that they read.
    pub log: Vec<Vec<[u32; 2]>>,
    /// Number of created textures, from which their unique sizes follow.
    created: u32,
    is_idle: bool,
}

fn open() -> Result<Gpu> {
    let mut of_12 = vk::PhysicalDeviceVulkan12Features::default()
        .host_query_reset(true)
        .timeline_semaphore(true)
        .draw_indirect_count(true);
    let mut of_13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true);
    let mut multi = vk::PhysicalDeviceMultiDrawFeaturesEXT::default().multi_draw(true);
    let mut of_libraries = libraries::features();
    let features = vk::PhysicalDeviceFeatures::default()
        .multi_draw_indirect(true)
        .draw_indirect_first_instance(true)
        .occlusion_query_precise(true)
        .pipeline_statistics_query(true);
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .features(features)
        .push_next(&mut of_12)
        .push_next(&mut of_13)
        .push_next(&mut multi)
        .push_next(&mut of_libraries);
    let push = ash::khr::push_descriptor::NAME;
    let [library, graphics_library] = libraries::EXTENSIONS;
    let extensions = [push, ash::ext::multi_draw::NAME, library, graphics_library];
    Gpu::open_with(vk::API_VERSION_1_3, &extensions, Some(&mut features))
}

impl World {
    /// Opens a device. `first` is the number of the first texture.
    pub fn new(random: &mut Generator, first: u32) -> Result<Self> {
        let gpu = open()?;
        let device = gpu.device.clone();
        let push = ash::khr::push_descriptor::Device::new(&gpu.instance, &device);
        let multi = ash::ext::multi_draw::Device::new(&gpu.instance, &device);
        let readback = vk::BufferUsageFlags::TRANSFER_DST;
        let readback = gpu.buffer(4 * u64::from(MAIN_PX[0] * MAIN_PX[1]), readback)?;
        let depth = gpu.image(&ImageKind {
            format: DEPTH,
            size: [MAIN_PX[0], MAIN_PX[1], 1],
            levels: 1,
            layers: 1,
            view: vk::ImageViewType::TYPE_2D,
            usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
                | vk::ImageUsageFlags::TRANSFER_DST,
        })?;
        to_general(&gpu, depth.handle, DEPTH)?;
        let words = shaders::vertex()?;
        // SAFETY: the device is open, and the descriptions are valid during their calls.
        unsafe {
            let module = vk::ShaderModuleCreateInfo::default().code(&words);
            let vertex = checked("a module", device.create_shader_module(&module, None))?;
            let immutable = [sampler(&gpu, random)?, sampler(&gpu, random)?];
            let set_layouts = set_layouts(&gpu, immutable)?;
            let queries = |kind, statistics| {
                let info = vk::QueryPoolCreateInfo::default()
                    .query_type(kind)
                    .query_count(QUERIES)
                    .pipeline_statistics(statistics);
                let pool = checked("queries", device.create_query_pool(&info, None))?;
                device.reset_query_pool(pool, 0, QUERIES);
                Ok::<_, String>(pool)
            };
            use vk::QueryPipelineStatisticFlags as Statistics;
            let statistics =
                Statistics::INPUT_ASSEMBLY_PRIMITIVES | Statistics::CLIPPING_PRIMITIVES;
            let info = vk::EventCreateInfo::default();
            let event = || checked("an event", device.create_event(&info, None));
            let events = vec![event()?, event()?];
            let fence = vk::FenceCreateInfo::default();
            let fence = checked("a fence", device.create_fence(&fence, None))?;
            let info = vk::SemaphoreCreateInfo::default();
            let semaphore = || checked("a semaphore", device.create_semaphore(&info, None));
            let semaphores = vec![semaphore()?, semaphore()?];
            let mut kind =
                vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
            let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
            let timeline = checked("a semaphore", device.create_semaphore(&info, None))?;
            let templates: Result<Vec<_>> = (0..PUSHED)
                .map(|kind| template(&gpu, kind, set_layouts[kind], None))
                .collect();
            let main = texture(&gpu, random, 0, MAIN_PX, 1, 1)?;
            let home = texture(&gpu, random, 0, [16, 15], 1, 1)?;
            let mut world = Self {
                geometry: geometry(&gpu)?,
                readback,
                push,
                multi,
                depth,
                templates: templates?,
                set_layouts,
                immutable,
                vertex,
                queries: queries(vk::QueryType::OCCLUSION, Statistics::empty())?,
                statistics: queries(vk::QueryType::PIPELINE_STATISTICS, statistics)?,
                events,
                fence,
                semaphores,
                signalled: None,
                timeline,
                timeline_value: 0,
                commands: command_pool(&gpu)?,
                retired: Vec::new(),
                main,
                home,
                textures: Vec::new(),
                samplers: vec![sampler(&gpu, random)?],
                pools: Vec::new(),
                layouts: Vec::new(),
                pipelines: Vec::new(),
                targets: Vec::new(),
                primaries: Vec::new(),
                secondaries: Vec::new(),
                shows: false,
                log: Vec::new(),
                created: first,
                is_idle: true,
                gpu,
            };
            world.start(random)?;
            Ok(world)
        }
    }

    /// Creates the objects that are never destroyed: two pipelines, a set and two targets for the frames'
    /// pictures.
    fn start(&mut self, random: &mut Generator) -> Result<()> {
        self.layouts.push(self.layout(vec![0], 0)?);
        self.layouts.push(self.layout(vec![PUSHED, 2], 1)?);
        let class = Class {
            format: 0,
            depth: true,
        };
        for dynamic in [false, true] {
            self.pipelines
                .push(self.pipeline(class, dynamic, 0, 0, false, None)?);
        }
        self.create_pool(random)?;
        let set = self.set(&self.pools[0], 0)?;
        self.pools[0].sets.push(set);
        let (view, sampler) = (self.home.views[0], self.samplers[0]);
        self.write(0, 0, view, sampler, random);
        for clears in [true, false] {
            self.targets
                .push(self.target(self.main.views[0], true, clears)?);
        }
        Ok(())
    }

    /// The textures that draws read, with the one that always exists.
    pub fn views(&self) -> Vec<View> {
        let all = self.textures.iter().chain([&self.home]);
        all.flat_map(|texture| &texture.views).copied().collect()
    }

    /// Waits until nothing is being executed.
    pub fn idle(&mut self) -> Result<()> {
        if self.is_idle {
            return Ok(());
        }
        // SAFETY: the device is open, and what is destroyed is not used after the wait.
        unsafe {
            checked("the device", self.gpu.device.device_wait_idle())?;
            let (gone, kept): (Vec<_>, _) = std::mem::take(&mut self.primaries)
                .into_iter()
                .partition(|of| of.once && of.pending);
            self.primaries = kept;
            // The destruction of a pool frees its buffers.
            let retired = std::mem::take(&mut self.retired);
            self.free(
                gone.into_iter()
                    .filter(|of| !retired.contains(&of.pool))
                    .collect(),
            );
            for pool in retired {
                self.gpu.device.destroy_command_pool(pool, None);
            }
        }
        for of in &mut self.primaries {
            of.pending = false;
        }
        self.is_idle = true;
        Ok(())
    }

    /// Notes a submission.
    pub fn note_submission(&mut self) {
        self.is_idle = false;
    }

    fn free(&self, gone: Vec<Recorded>) {
        for of in gone {
            // SAFETY: the command buffer is not being executed.
            unsafe { self.gpu.device.free_command_buffers(of.pool, &[of.buffer]) };
        }
    }

    /// Frees all command buffers. The device is idle.
    pub fn free_all(&mut self) {
        let primaries = std::mem::take(&mut self.primaries);
        self.free(primaries);
        let secondaries = std::mem::take(&mut self.secondaries);
        self.free(secondaries);
    }

    /// Frees the command buffers that use an object. The device is idle.
    pub fn forget(&mut self, handle: u64) {
        let uses = |of: &Recorded| of.contents.uses.contains(&handle);
        let (gone, kept): (Vec<_>, _) = std::mem::take(&mut self.secondaries)
            .into_iter()
            .partition(uses);
        self.secondaries = kept;
        for of in &gone {
            self.forget(of.buffer.as_raw());
        }
        self.free(gone);
        let (gone, kept) = std::mem::take(&mut self.primaries)
            .into_iter()
            .partition(uses);
        self.primaries = kept;
        self.free(gone);
    }

    /// Reads the results of the queries.
    pub fn results(&self) -> Vec<u64> {
        let mut all = Vec::new();
        for (pool, values) in [(self.queries, 1), (self.statistics, 2)] {
            // The values of a query, and whether it has ended.
            let mut found = vec![0_u64; QUERIES as usize * (values + 1)];
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
            let stride = values + 1;
            let rows: &mut [[u64; 2]] =
                bytemuck::cast_slice_mut(&mut found[..2 * QUERIES as usize]);
            // SAFETY: the device is idle, and the slice has room for all values.
            let result = unsafe {
                match values {
                    1 => self.gpu.device.get_query_pool_results(pool, 0, rows, flags),
                    _ => {
                        let rows: &mut [[u64; 3]] = bytemuck::cast_slice_mut(&mut found);
                        self.gpu.device.get_query_pool_results(pool, 0, rows, flags)
                    }
                }
            };
            if result.is_ok() || result == Err(vk::Result::NOT_READY) {
                let ended = found.chunks(stride).filter(|row| row[stride - 1] != 0);
                all.extend(ended.flatten());
            }
        }
        all
    }

    /// Destroys everything and closes the device.
    pub fn close(mut self) -> Result<()> {
        self.idle()?;
        self.free_all();
        while let Some(target) = self.targets.pop() {
            self.destroy_target(&target);
        }
        while !self.pipelines.is_empty() {
            self.destroy_pipeline(0);
        }
        while !self.textures.is_empty() {
            self.destroy_texture(0);
        }
        let device = self.gpu.device.clone();
        // SAFETY: the device is idle, and every handle is destroyed once.
        unsafe {
            for texture in [&self.main, &self.home] {
                for view in &texture.views {
                    device.destroy_image_view(view.handle, None);
                }
                destroy_image(&self.gpu, texture.image);
            }
            destroy_image(&self.gpu, self.depth);
            for buffer in [&self.geometry, &self.readback] {
                device.destroy_buffer(buffer.handle, None);
                device.free_memory(buffer.memory, None);
            }
            for layout in &self.layouts {
                self.destroy_layout(layout);
            }
            for pool in &self.pools {
                device.destroy_descriptor_pool(pool.handle, None);
            }
            for template in &self.templates {
                device.destroy_descriptor_update_template(*template, None);
            }
            for layout in &self.set_layouts {
                device.destroy_descriptor_set_layout(*layout, None);
            }
            for sampler in self.samplers.iter().chain(&self.immutable) {
                device.destroy_sampler(*sampler, None);
            }
            device.destroy_shader_module(self.vertex, None);
            device.destroy_query_pool(self.queries, None);
            device.destroy_query_pool(self.statistics, None);
            for event in &self.events {
                device.destroy_event(*event, None);
            }
            device.destroy_fence(self.fence, None);
            for semaphore in self.semaphores.iter().chain([&self.timeline]) {
                device.destroy_semaphore(*semaphore, None);
            }
            device.destroy_command_pool(self.commands, None);
        }
        self.gpu.close();
        Ok(())
    }
}

/// Formats of the targets of a class.
pub fn rendering(class: Class, formats: &[vk::Format; 1]) -> vk::PipelineRenderingCreateInfo<'_> {
    let info = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(formats);
    info.depth_attachment_format(if class.depth {
        DEPTH
    } else {
        vk::Format::UNDEFINED
    })
}

/// Creates a command pool whose buffers may be reset.
pub fn command_pool(gpu: &Gpu) -> Result<vk::CommandPool> {
    let info = vk::CommandPoolCreateInfo::default()
        .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
        .queue_family_index(gpu.family);
    // SAFETY: the device is open.
    checked("a command pool", unsafe {
        gpu.device.create_command_pool(&info, None)
    })
}
