//! Renders the frames.

use crate::also::Extras;
use crate::gpu::{Buffer, Gpu, Result};
use crate::pipeline::pipeline;
use crate::sets::Sets;
use crate::targets::{Target, render_pass, targets};
use crate::{Options, Stereo, libraries, scene, shaders};
use ash::{Device, vk};

/// Pipeline and vertices of an object.
struct Draw {
    pipeline: vk::Pipeline,
    vertices: Buffer,
    count: u32,
}

/// Renders the requested frames.
pub fn run(options: &Options) -> Result<()> {
    if options.end.as_deref() == Some("hang") {
        // A program that never renders.
        std::thread::sleep(std::time::Duration::from_secs(600));
    }
    if options.end.as_deref() == Some("before") {
        eprintln!("vulkan_program: no display");
        std::process::abort();
    }
    let gpu = match options.libraries {
        Some(_) => {
            let mut of_libraries = libraries::features();
            let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut of_libraries);
            let extensions = &libraries::EXTENSIONS;
            Gpu::open_with(vk::API_VERSION_1_2, extensions, Some(&mut features))?
        }
        None => Gpu::open()?,
    };
    let [width, height] = options.size_px;
    let pass = render_pass(&gpu, options.stereo)?;
    let targets = targets(&gpu, options, pass)?;
    let eyes = gpu.buffer(128, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
    let sets = Sets::new(&gpu, &eyes)?;
    let extras = Extras::new(&gpu, options.also, sets.layout)?;
    let mut draws = Vec::new();
    for (position, object) in options.objects.iter().enumerate() {
        let words = shaders::words(object, options.stereo, options.also.vertex)?;
        let vertices = scene::triangles(position, options.objects.len());
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
        draws.push(Draw {
            pipeline: pipeline(&gpu, pass, sets.layout, &words, options.libraries)?,
            count: vertices.len() as u32,
            vertices: gpu.buffer_of(bytemuck::cast_slice(&vertices), usage)?,
        });
    }
    let picture_bytes = 4 * u64::from(width) * u64::from(height);
    let readback = gpu.buffer(2 * picture_bytes, vk::BufferUsageFlags::TRANSFER_DST)?;
    for frame in 0..options.frames {
        let aspect = width as f32 / height as f32;
        gpu.write(&eyes, bytemuck::cast_slice(&scene::eyes(frame, aspect)))?;
        let record = |device: &Device, buffer| {
            extras.record(device, buffer, &sets);
            for (number, target) in targets.iter().enumerate() {
                draw_target(device, options, pass, target, &draws, &sets, buffer);
                if !options.also.unread {
                    copy(device, options, target, number, &readback, buffer);
                }
            }
        };
        gpu.execute_by(record, |buffer| extras.submit(&gpu, buffer, frame))?;
        if let Some(end) = options.end.as_deref().filter(|_| frame == 1) {
            end_abnormally(end);
        }
    }
    if let Some(path) = &options.picture {
        let picture = gpu.mapped(&readback, |bytes| bytes.to_vec())?;
        std::fs::write(path, picture).map_err(|e| format!("{path}: {e}"))?;
    }
    gpu.close();
    Ok(())
}

/// Ends the program in one of several wrong ways.
fn end_abnormally(how: &str) {
    match how {
        "crash" => std::process::abort(),
        "early" => std::process::exit(3),
        "fork" => fork_once(),
        _ => {}
    }
}

unsafe extern "C" {
    fn fork() -> i32;
    fn _exit(status: i32) -> !;
}

/// Starts a copy of this process that ends at once. Some programs start copies to look for other programs.
fn fork_once() {
    // SAFETY: the copy calls nothing but `_exit`, which is allowed after a fork of a process with threads.
    unsafe {
        if fork() == 0 {
            _exit(0);
        }
    }
}

fn draw_target(
    device: &Device,
    options: &Options,
    pass: vk::RenderPass,
    target: &Target,
    draws: &[Draw],
    sets: &Sets,
    buffer: vk::CommandBuffer,
) {
    let [width, height] = options.size_px;
    let clears = [
        vk::ClearValue {
            color: vk::ClearColorValue { float32: [0.0; 4] },
        },
        vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue {
                depth: 1.0,
                stencil: 0,
            },
        },
    ];
    let begin = vk::RenderPassBeginInfo::default()
        .render_pass(pass)
        .framebuffer(target.framebuffer)
        .render_area(vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D {
                width: target.size_px[0],
                height: target.size_px[1],
            },
        })
        .clear_values(&clears);
    let graphics = vk::PipelineBindPoint::GRAPHICS;
    // SAFETY: the command buffer is being recorded, and all handles are the device's.
    unsafe {
        device.cmd_begin_render_pass(buffer, &begin, vk::SubpassContents::INLINE);
        device.cmd_bind_descriptor_sets(buffer, graphics, sets.layout, 0, &sets.sets, &[]);
        for &(eye, left) in &target.views {
            let viewport = vk::Viewport {
                x: left as f32,
                y: 0.0,
                width: width as f32,
                height: height as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            };
            let scissor = vk::Rect2D {
                offset: vk::Offset2D {
                    x: left as i32,
                    y: 0,
                },
                extent: vk::Extent2D { width, height },
            };
            device.cmd_set_viewport(buffer, 0, &[viewport]);
            device.cmd_set_scissor(buffer, 0, &[scissor]);
            let constants = [eye, 1.0_f32.to_bits()];
            let bytes = bytemuck::cast_slice(&constants);
            let stages = vk::ShaderStageFlags::VERTEX;
            device.cmd_push_constants(buffer, sets.layout, stages, 0, bytes);
            for draw in draws {
                device.cmd_bind_pipeline(buffer, graphics, draw.pipeline);
                device.cmd_bind_vertex_buffers(buffer, 0, &[draw.vertices.handle], &[0]);
                for first in 0..options.draws {
                    device.cmd_draw(buffer, draw.count, options.instances, 0, first);
                }
            }
        }
        device.cmd_end_render_pass(buffer);
    }
}

/// Copies a target into the buffer of pictures, row by row, with the left picture first.
pub fn copy(
    device: &Device,
    options: &Options,
    target: &Target,
    number: usize,
    to: &Buffer,
    buffer: vk::CommandBuffer,
) {
    let [width, height] = options.size_px;
    let picture_bytes = 4 * u64::from(width) * u64::from(height);
    let region = |place: u64, left: u32, layer: u32| vk::BufferImageCopy {
        buffer_offset: place * picture_bytes,
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer: layer,
            layer_count: 1,
        },
        image_offset: vk::Offset3D {
            x: left as i32,
            y: 0,
            z: 0,
        },
        image_extent: vk::Extent3D {
            width,
            height,
            depth: 1,
        },
        ..Default::default()
    };
    let regions = match options.stereo {
        Stereo::Halves => vec![region(0, 0, 0), region(1, width, 0)],
        Stereo::Multiview => vec![region(0, 0, 0), region(1, 0, 1)],
        Stereo::Targets | Stereo::Twice => vec![region(number as u64, 0, 0)],
        Stereo::Mono => vec![region(0, 0, 0)],
    };
    let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    // The next render pass may render into the same image.
    let barrier = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_READ)
        .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
    // SAFETY: the command buffer is being recorded; the buffer holds two pictures.
    unsafe {
        let image = target.color.handle;
        device.cmd_copy_image_to_buffer(buffer, image, layout, to.handle, &regions);
        device.cmd_pipeline_barrier(
            buffer,
            vk::PipelineStageFlags::TRANSFER,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::DependencyFlags::empty(),
            &[barrier],
            &[],
            &[],
        );
    }
}
