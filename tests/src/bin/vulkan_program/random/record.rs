//! Records random commands into command buffers. Several threads may record at the same time.

mod copies;
mod draws;

use super::generator::Generator;
use super::world::{Class, Contents, FORMATS, QUERIES, Target, World};
use crate::gpu::{Result, checked};
use ash::vk::{self, Handle};

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;
const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// Records one command buffer.
pub struct Recorder<'w> {
    world: &'w World,
    pub random: Generator,
    buffer: vk::CommandBuffer,
    pub contents: Contents,
}

/// Where draws go.
#[derive(Clone, Copy)]
struct Inside {
    class: Class,
    dynamic: bool,
    /// The target's image, which the draws must not read; null in a secondary command buffer.
    image: vk::Image,
    size: [u32; 2],
    /// Whether the target is the picture of the frame.
    main: bool,
}

fn layers(level: u32, layer: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: level,
        base_array_layer: layer,
        layer_count: 1,
    }
}

fn area(size: [u32; 2]) -> vk::Rect2D {
    let extent = vk::Extent2D {
        width: size[0],
        height: size[1],
    };
    vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent,
    }
}

impl<'w> Recorder<'w> {
    pub fn new(world: &'w World, random: Generator, buffer: vk::CommandBuffer) -> Self {
        Self {
            world,
            random,
            buffer,
            contents: Contents::default(),
        }
    }

    fn device(&self) -> &'w ash::Device {
        &self.world.gpu.device
    }

    /// Begins a primary command buffer.
    pub fn begin(&self, flags: vk::CommandBufferUsageFlags) -> Result<()> {
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: the command buffer is not being executed.
        let begun = unsafe { self.device().begin_command_buffer(self.buffer, &info) };
        checked("a command buffer", begun)
    }

    pub fn end(self) -> Result<Contents> {
        // SAFETY: the command buffer is being recorded.
        let ended = unsafe { self.device().end_command_buffer(self.buffer) };
        checked("a command buffer", ended)?;
        Ok(self.contents)
    }

    /// Records some random commands outside render passes, and passes.
    pub fn commands(&mut self, count: usize) {
        for _ in 0..count {
            self.barrier();
            match self.random.below(8) {
                0 => self.clear(),
                1 => self.blit(),
                2 => self.copy(),
                _ => {
                    // The second target adds to the frame's picture.
                    let first = if self.world.shows { 1 } else { 2 };
                    if let Some(count) = self.world.targets.len().checked_sub(first + 1) {
                        let place = first + self.random.below(count + 1);
                        self.pass(&self.world.targets[place], place == 1);
                    }
                }
            }
        }
    }

    /// Records a pass: a render pass or dynamic rendering, with draws or with secondary command buffers.
    fn pass(&mut self, target: &Target, main: bool) {
        let dynamic = self.random.once_in(2);
        let inside = Inside {
            class: target.class,
            dynamic,
            image: target.view.image,
            size: target.view.size,
            main,
        };
        let all = self.world.secondaries.iter();
        let fitting: Vec<_> = all
            .filter(|of| {
                of.inside.is_some_and(|(class, of_dynamic, size)| {
                    let [width, height] = target.view.size;
                    let fits = size[0] <= width && size[1] <= height;
                    (class, of_dynamic) == (target.class, dynamic) && fits
                })
            })
            .filter(|of| !of.contents.uses.contains(&target.view.image.as_raw()))
            .collect();
        let secondary = (!main || !target.clears)
            .then(|| self.random.pick(&fitting).copied())
            .flatten();
        let query = self.random.below(QUERIES as usize) as u32;
        let kind = self.random.below(6);
        let pools = [self.world.queries, self.world.statistics];
        let pool = pools.get(kind).filter(|_| secondary.is_none());
        let (device, buffer) = (self.device(), self.buffer);
        let uses = [
            target.view.image.as_raw(),
            target.view.handle.as_raw(),
            target.framebuffer.as_raw(),
        ];
        self.contents.uses.extend(uses);
        if secondary.is_none() && self.random.once_in(4) {
            // A pipeline may be bound before the pass begins.
            self.bind_random(inside);
        }
        // SAFETY: the command buffer is being recorded, and all objects exist.
        unsafe {
            if let Some(pool) = pool {
                device.cmd_reset_query_pool(buffer, *pool, query, 1);
                self.barrier();
            }
            self.begin_pass(target, dynamic, secondary.is_some());
            match secondary {
                Some(of) => {
                    for _ in 0..=self.random.below(2) {
                        device.cmd_execute_commands(buffer, &[of.buffer]);
                        if main {
                            self.contents
                                .draws
                                .extend(of.contents.draws.iter().cloned());
                        }
                    }
                    self.contents.uses.extend(&of.contents.uses);
                    self.contents.uses.insert(of.buffer.as_raw());
                }
                None => {
                    self.set_view(inside.size);
                    if main {
                        self.home_draw(inside);
                    }
                    self.draws(inside, 3);
                    if let Some(pool) = pool {
                        device.cmd_begin_query(buffer, *pool, query, self.precise(kind));
                        self.draws(inside, 2);
                        device.cmd_end_query(buffer, *pool, query);
                        self.draws(inside, 2);
                    }
                    if self.random.once_in(3) {
                        self.clear_part(inside);
                        self.draws(inside, 2);
                    }
                }
            }
            match dynamic {
                true => device.cmd_end_rendering(buffer),
                false => device.cmd_end_render_pass(buffer),
            }
        }
    }

    fn precise(&mut self, kind: usize) -> vk::QueryControlFlags {
        match kind {
            0 if self.random.once_in(2) => vk::QueryControlFlags::PRECISE,
            _ => vk::QueryControlFlags::empty(),
        }
    }

    fn begin_pass(&mut self, target: &Target, dynamic: bool, secondary: bool) {
        let color = vk::ClearColorValue {
            float32: [0.1, self.random.unit(), 0.3, 1.0],
        };
        let depth = vk::ClearDepthStencilValue {
            depth: 1.0,
            stencil: 0,
        };
        let clears = [
            vk::ClearValue { color },
            vk::ClearValue {
                depth_stencil: depth,
            },
        ];
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded, and the target exists.
        unsafe {
            if dynamic {
                let load = match target.clears {
                    true => vk::AttachmentLoadOp::CLEAR,
                    false => vk::AttachmentLoadOp::LOAD,
                };
                let attachment = |view, clear| {
                    vk::RenderingAttachmentInfo::default()
                        .image_view(view)
                        .image_layout(GENERAL)
                        .load_op(load)
                        .store_op(vk::AttachmentStoreOp::STORE)
                        .clear_value(clear)
                };
                let colors = [attachment(target.view.handle, clears[0])];
                let depth = attachment(self.world.depth.view, clears[1]);
                let mut info = vk::RenderingInfo::default()
                    .render_area(area(target.view.size))
                    .layer_count(1)
                    .color_attachments(&colors);
                if target.class.depth {
                    info = info.depth_attachment(&depth);
                }
                if secondary {
                    info = info.flags(vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS);
                }
                device.cmd_begin_rendering(buffer, &info);
            } else {
                let contents = match secondary {
                    true => vk::SubpassContents::SECONDARY_COMMAND_BUFFERS,
                    false => vk::SubpassContents::INLINE,
                };
                let info = vk::RenderPassBeginInfo::default()
                    .render_pass(target.pass)
                    .framebuffer(target.framebuffer)
                    .render_area(area(target.view.size))
                    .clear_values(&clears);
                if self.random.once_in(2) {
                    let subpass = vk::SubpassBeginInfo::default().contents(contents);
                    device.cmd_begin_render_pass2(buffer, &info, &subpass);
                } else {
                    device.cmd_begin_render_pass(buffer, &info, contents);
                }
            }
        }
    }

    fn set_view(&self, size: [u32; 2]) {
        let viewport = vk::Viewport {
            width: size[0] as f32,
            height: size[1] as f32,
            max_depth: 1.0,
            ..Default::default()
        };
        // SAFETY: the command buffer is being recorded.
        unsafe {
            self.device().cmd_set_viewport(self.buffer, 0, &[viewport]);
            self.device().cmd_set_scissor(self.buffer, 0, &[area(size)]);
        }
    }

    fn clear_part(&mut self, inside: Inside) {
        let value = vk::ClearColorValue {
            float32: [0.9, self.random.unit(), 0.0, 1.0],
        };
        let attachment = [vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            color_attachment: 0,
            clear_value: vk::ClearValue { color: value },
        }];
        let rect = [vk::ClearRect {
            rect: area(inside.size.map(|side| side.div_ceil(2))),
            base_array_layer: 0,
            layer_count: 1,
        }];
        // SAFETY: the command buffer is being recorded, inside a pass with a colour target.
        unsafe {
            self.device()
                .cmd_clear_attachments(self.buffer, &attachment, &rect)
        };
    }

    /// Records the frame's picture, and its copy to the buffer.
    pub fn picture(&mut self) {
        self.barrier();
        self.pass(&self.world.targets[0], true);
        self.barrier();
        if self.random.once_in(2) {
            self.pass(&self.world.targets[1], true);
            self.barrier();
        }
        let main = &self.world.main;
        let region = [vk::BufferImageCopy {
            image_subresource: layers(0, 0),
            image_extent: vk::Extent3D {
                width: main.size[0],
                height: main.size[1],
                depth: 1,
            },
            ..Default::default()
        }];
        let (device, buffer) = (self.device(), self.buffer);
        let (image, to) = (main.image.handle, self.world.readback.handle);
        // SAFETY: the command buffer is being recorded, and the buffer has room for the picture.
        unsafe {
            if self.random.once_in(2) {
                device.cmd_copy_image_to_buffer(buffer, image, GENERAL, to, &region);
            } else {
                let region = [vk::BufferImageCopy2::default()
                    .image_subresource(region[0].image_subresource)
                    .image_extent(region[0].image_extent)];
                let info = vk::CopyImageToBufferInfo2::default()
                    .src_image(image)
                    .src_image_layout(GENERAL)
                    .dst_buffer(to)
                    .regions(&region);
                device.cmd_copy_image_to_buffer2(buffer, &info);
            }
        }
        self.barrier();
    }

    /// Begins a secondary command buffer for a target and for larger ones, and records draws.
    pub fn secondary(
        &mut self,
        target: &Target,
        dynamic: bool,
        flags: vk::CommandBufferUsageFlags,
    ) -> Result<()> {
        let (class, size) = (target.class, target.view.size);
        let formats = [FORMATS[class.format]];
        let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
            .color_attachment_formats(&formats)
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        if class.depth {
            rendering = rendering.depth_attachment_format(vk::Format::D32_SFLOAT);
        }
        let mut inheritance = vk::CommandBufferInheritanceInfo::default();
        if dynamic {
            inheritance = inheritance.push_next(&mut rendering);
        } else {
            inheritance = inheritance.render_pass(target.pass);
            self.contents.uses.insert(target.framebuffer.as_raw());
        }
        let info = vk::CommandBufferBeginInfo::default()
            .flags(flags | vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(&inheritance);
        // SAFETY: the command buffer is not being executed.
        let begun = unsafe { self.device().begin_command_buffer(self.buffer, &info) };
        checked("a secondary command buffer", begun)?;
        let image = vk::Image::null();
        self.set_view(size);
        self.draws(
            Inside {
                class,
                dynamic,
                image,
                size,
                main: false,
            },
            4,
        );
        Ok(())
    }
}
