//! Pipelines that fit a fragment shader, and the time until their first draw is done.

use crate::descriptors::Sets;
use crate::gpu::{Gpu, Image, ImageKind, Result, checked};
use crate::graphics::{Graphics, opaque};
use crate::reflect::{Fragment, Numbers};
use crate::vertex;
use ash::vk;
use rspirv::binary::Assemble;
use rspirv::dr::Builder;
use rspirv::spirv::{
    AddressingModel, Capability, ExecutionMode, ExecutionModel, FunctionControl, MemoryModel,
};
use std::ffi::CString;

const SIZE_PX: u32 = 64;
/// Bytes of push constants that lavapipe has. The last ones are the number of the draw.
const PUSH_CONSTANT_BYTES: u32 = 256;

/// Opens the device with what recording shaders need.
pub fn open() -> Result<Gpu> {
    let mut of_1_2 = vk::PhysicalDeviceVulkan12Features::default().buffer_device_address(true);
    let mut of_1_3 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .shader_demote_to_helper_invocation(true);
    let of_1_0 = vk::PhysicalDeviceFeatures::default()
        .shader_int64(true)
        .geometry_shader(true)
        .fragment_stores_and_atomics(true);
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .features(of_1_0)
        .push_next(&mut of_1_2)
        .push_next(&mut of_1_3);
    Gpu::open_with(vk::API_VERSION_1_3, &[], Some(&mut features))
}

/// A fragment shader that does nothing.
pub fn plain_module() -> Vec<u32> {
    let mut b = Builder::new();
    b.set_version(1, 3);
    b.capability(Capability::Shader);
    b.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
    let void = b.type_void();
    let function = b.type_function(void, []);
    // The builder refuses only instructions outside a block.
    let main = b
        .begin_function(void, None, FunctionControl::NONE, function)
        .unwrap_or(0);
    let _ = b
        .begin_block(None)
        .and_then(|_| b.ret())
        .and_then(|()| b.end_function());
    b.entry_point(ExecutionModel::Fragment, main, "main", []);
    b.execution_mode(main, ExecutionMode::OriginUpperLeft, []);
    b.module().assemble()
}

/// All of a pipeline but its fragment shader.
pub struct Fitting<'a> {
    gpu: &'a Gpu,
    entry: CString,
    vertices: Vec<u32>,
    sets: Sets,
    layout: vk::PipelineLayout,
    formats: Vec<vk::Format>,
    targets: Vec<Option<Image>>,
}

impl<'a> Fitting<'a> {
    pub fn new(gpu: &'a Gpu, of: &Fragment) -> Result<Self> {
        let sets = Sets::new(gpu, of)?;
        let constants = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::FRAGMENT,
            offset: 0,
            size: PUSH_CONSTANT_BYTES,
        }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets.layouts)
            .push_constant_ranges(&constants);
        // SAFETY: the device is open.
        let layout = checked("a layout", unsafe {
            gpu.device.create_pipeline_layout(&info, None)
        })?;
        let format = |numbers: Option<Numbers>| match numbers {
            None => vk::Format::UNDEFINED,
            Some(Numbers::Float) => vk::Format::R8G8B8A8_UNORM,
            Some(Numbers::Signed) => vk::Format::R32G32B32A32_SINT,
            Some(Numbers::Unsigned) => vk::Format::R32G32B32A32_UINT,
        };
        let formats: Vec<_> = of.outputs()?.into_iter().map(format).collect();
        let target = |format: &vk::Format| {
            let kind = ImageKind {
                format: *format,
                size: [SIZE_PX, SIZE_PX, 1],
                levels: 1,
                layers: 1,
                view: vk::ImageViewType::TYPE_2D,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
            };
            (*format != vk::Format::UNDEFINED)
                .then(|| gpu.image(&kind))
                .transpose()
        };
        Ok(Self {
            gpu,
            entry: CString::new(of.name.as_str()).map_err(|e| e.to_string())?,
            vertices: vertex::words(of)?,
            sets,
            layout,
            targets: formats.iter().map(target).collect::<Result<_>>()?,
            formats,
        })
    }

    /// Milliseconds of processor time to make a pipeline of a fragment shader and to draw with it.
    pub fn compile(&self, words: &[u32]) -> Result<f64> {
        let device = &self.gpu.device;
        let before = processor_ms();
        // SAFETY: the device is open, and what is destroyed is no longer used.
        unsafe {
            let module = |words: &[u32]| {
                let info = vk::ShaderModuleCreateInfo::default().code(words);
                checked("a module", device.create_shader_module(&info, None))
            };
            let modules = [module(&self.vertices)?, module(words)?];
            let pipeline = self.pipeline(modules)?;
            self.gpu.execute(|_, buffer| self.draw(buffer, pipeline))?;
            let spent = processor_ms() - before;
            device.destroy_pipeline(pipeline, None);
            for module in modules {
                device.destroy_shader_module(module, None);
            }
            Ok(spent)
        }
    }

    fn pipeline(&self, [vertex, fragment]: [vk::ShaderModule; 2]) -> Result<vk::Pipeline> {
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&self.formats);
        let device = &self.gpu.device;
        let graphics = Graphics {
            shaders: [(vertex, c"main"), (fragment, &self.entry)],
            stride: 0,
            attributes: &[],
            depth: None,
            attachments: &vec![opaque(); self.formats.len()],
            side_px: Some(SIZE_PX),
            layout: self.layout,
        };
        let made = graphics.describe(|info| {
            let info = [info.push_next(&mut rendering)];
            // SAFETY: the description is valid, and its parts live until the end of the call.
            unsafe { device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None) }
        });
        Ok(checked("a pipeline", made.map_err(|(_, error)| error))?[0])
    }

    fn area(&self) -> vk::Rect2D {
        let extent = vk::Extent2D {
            width: SIZE_PX,
            height: SIZE_PX,
        };
        vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent,
        }
    }

    fn draw(&self, buffer: vk::CommandBuffer, pipeline: vk::Pipeline) {
        let device = &self.gpu.device;
        let targets: Vec<_> = (self.targets.iter())
            .map(|target| {
                vk::RenderingAttachmentInfo::default()
                    .image_view(target.map_or(vk::ImageView::null(), |target| target.view))
                    .image_layout(vk::ImageLayout::GENERAL)
                    .load_op(vk::AttachmentLoadOp::CLEAR)
                    .store_op(vk::AttachmentStoreOp::STORE)
            })
            .collect();
        let rendering = vk::RenderingInfo::default()
            .render_area(self.area())
            .layer_count(1)
            .color_attachments(&targets);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the command buffer is being recorded, and all handles are the device's.
        unsafe {
            device.cmd_begin_rendering(buffer, &rendering);
            device.cmd_bind_pipeline(buffer, graphics, pipeline);
            if !self.sets.sets.is_empty() {
                device.cmd_bind_descriptor_sets(
                    buffer,
                    graphics,
                    self.layout,
                    0,
                    &self.sets.sets,
                    &[],
                );
            }
            let zeros = [0; PUSH_CONSTANT_BYTES as usize];
            device.cmd_push_constants(
                buffer,
                self.layout,
                vk::ShaderStageFlags::FRAGMENT,
                0,
                &zeros,
            );
            device.cmd_draw(buffer, 3, 1, 0, 0);
            device.cmd_end_rendering(buffer);
        }
    }
}

#[repr(C)]
struct Time {
    seconds: i64,
    nanoseconds: i64,
}

unsafe extern "C" {
    fn clock_gettime(clock: i32, time: *mut Time) -> i32;
}

/// `CLOCK_PROCESS_CPUTIME_ID` of Linux.
const PROCESSOR_TIME: i32 = 2;

/// Processor time of all threads of this process.
fn processor_ms() -> f64 {
    let mut time = Time {
        seconds: 0,
        nanoseconds: 0,
    };
    // SAFETY: the pointer is valid, and the type is that of 64-bit Linux.
    unsafe { clock_gettime(PROCESSOR_TIME, &raw mut time) };
    time.seconds as f64 * 1e3 + time.nanoseconds as f64 / 1e6
}
