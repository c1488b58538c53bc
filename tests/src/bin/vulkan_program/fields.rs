//! Full-screen draws that differ in one field of a sampler or of an image view each: one frame per draw.
//!
//! The texture has 64x64 texels, seven levels and six layers, and the picture has 64x64 pixels. So the texels that
//! a draw reads follow from arithmetic.

mod bindings;
mod list;

use crate::gpu::{Gpu, ImageKind, Result};
use crate::render::copy;
use crate::sets::upload;
use crate::targets::{COLOR, Target, render_pass, targets};
use crate::textures::{EDGE, LEVELS};
use crate::{Options, wgsl};
use ash::{Device, vk};
use bindings::{Bindings, PUSH};
pub use list::{FIELDS, Field};

/// The layers of the texture.
const LAYERS: u32 = 6;

/// Renders a frame for each field.
pub fn run(options: &Options) -> Result<()> {
    let mut seams =
        vk::PhysicalDeviceNonSeamlessCubeMapFeaturesEXT::default().non_seamless_cube_map(true);
    let mut of_12 =
        vk::PhysicalDeviceVulkan12Features::default().sampler_mirror_clamp_to_edge(true);
    let features = vk::PhysicalDeviceFeatures::default().sampler_anisotropy(true);
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .features(features)
        .push_next(&mut of_12)
        .push_next(&mut seams);
    let extensions = [PUSH, ash::ext::non_seamless_cube_map::NAME];
    let gpu = Gpu::open_with(vk::API_VERSION_1_2, &extensions, Some(&mut features))?;
    let pass = render_pass(&gpu, options.stereo)?;
    let targets = targets(&gpu, options, pass)?;
    let texture = upload(
        &gpu,
        &ImageKind {
            format: COLOR,
            size: [EDGE, EDGE, 1],
            levels: LEVELS,
            layers: LAYERS,
            view: vk::ImageViewType::CUBE,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        },
    )?;
    let picture_bytes = 4 * u64::from(options.size_px[0]) * u64::from(options.size_px[1]);
    let readback = gpu.buffer(2 * picture_bytes, vk::BufferUsageFlags::TRANSFER_DST)?;
    for field in &options.fields {
        let words = wgsl::compile(&field.text())?;
        let bindings = Bindings::new(&gpu, texture.handle, field)?;
        let pipeline =
            crate::pipeline::pipeline(&gpu, pass, bindings.layout, &words, options.libraries)?;
        gpu.execute(|device, buffer| {
            draw(
                device,
                options,
                pass,
                &targets[0],
                pipeline,
                &bindings,
                buffer,
            );
            copy(device, options, &targets[0], 0, &readback, buffer);
        })?;
    }
    gpu.close();
    Ok(())
}

fn draw(
    device: &Device,
    options: &Options,
    pass: vk::RenderPass,
    target: &Target,
    pipeline: vk::Pipeline,
    bindings: &Bindings,
    buffer: vk::CommandBuffer,
) {
    let [width, height] = options.size_px;
    let depth = vk::ClearDepthStencilValue {
        depth: 1.0,
        stencil: 0,
    };
    let clears = [
        vk::ClearValue::default(),
        vk::ClearValue {
            depth_stencil: depth,
        },
    ];
    let area = vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent: vk::Extent2D { width, height },
    };
    let begin = vk::RenderPassBeginInfo::default()
        .render_pass(pass)
        .framebuffer(target.framebuffer)
        .render_area(area)
        .clear_values(&clears);
    let viewport = vk::Viewport {
        width: width as f32,
        height: height as f32,
        max_depth: 1.0,
        ..Default::default()
    };
    // SAFETY: the command buffer is being recorded, and all handles are the device's.
    unsafe {
        device.cmd_begin_render_pass(buffer, &begin, vk::SubpassContents::INLINE);
        device.cmd_bind_pipeline(buffer, vk::PipelineBindPoint::GRAPHICS, pipeline);
        device.cmd_set_viewport(buffer, 0, &[viewport]);
        device.cmd_set_scissor(buffer, 0, &[area]);
        bindings.bind(buffer);
        device.cmd_draw(buffer, 3, 1, 0, 0);
        device.cmd_end_render_pass(buffer);
    }
}
