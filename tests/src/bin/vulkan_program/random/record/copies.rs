//! Commands outside passes: barriers, events, clears, blits and copies.

use super::{GENERAL, Recorder, layers};
use ash::vk::{self, Handle};

fn corner(size: [u32; 2]) -> vk::Offset3D {
    vk::Offset3D {
        x: size[0] as i32,
        y: size[1] as i32,
        z: 1,
    }
}

impl Recorder<'_> {
    /// Waits for all earlier commands: by a barrier, or by an event.
    pub(super) fn barrier(&mut self) {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let (device, buffer) = (self.device(), self.buffer);
        let none = vk::DependencyFlags::empty();
        // SAFETY: the command buffer is being recorded, outside render passes.
        unsafe {
            device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
            match self.random.below(6) {
                0 => {
                    let event = *self.random.pick(&self.world.events).expect("events");
                    device.cmd_set_event(buffer, event, all);
                    device.cmd_wait_events(buffer, &[event], all, all, &memory, &[], &[]);
                    device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
                    device.cmd_reset_event(buffer, event, all);
                    device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
                }
                1 => {
                    let barrier = [vk::MemoryBarrier2::default()
                        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                        .dst_access_mask(vk::AccessFlags2::MEMORY_READ)];
                    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
                    device.cmd_pipeline_barrier2(buffer, &info);
                }
                _ => {}
            }
        }
    }

    pub(super) fn clear(&mut self) {
        let Some(texture) = self.random.pick(&self.world.textures) else {
            return;
        };
        self.contents.uses.insert(texture.image.handle.as_raw());
        let color = vk::ClearColorValue {
            float32: [self.random.unit(), 0.5, 0.2, 1.0],
        };
        let range = [vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: self.random.below(texture.levels as usize) as u32,
            level_count: 1,
            base_array_layer: self.random.below(texture.layers as usize) as u32,
            layer_count: 1,
        }];
        let image = texture.image.handle;
        // SAFETY: the command buffer is being recorded, and the image exists.
        unsafe {
            self.device()
                .cmd_clear_color_image(self.buffer, image, GENERAL, &color, &range)
        };
    }

    /// Fills a level from another image, or the levels of a layer from its first one.
    pub(super) fn blit(&mut self) {
        let (Some(from), Some(to)) = (
            self.random.pick(&self.world.textures),
            self.random.pick(&self.world.textures),
        ) else {
            return;
        };
        let uses = [from, to].map(|of| of.image.handle.as_raw());
        self.contents.uses.extend(uses);
        let level_size = |size: [u32; 2], level: u32| size.map(|side| (side >> level).max(1));
        let layer = self.random.below(to.layers as usize) as u32;
        let own = from.image.handle == to.image.handle;
        let filter = [vk::Filter::NEAREST, vk::Filter::LINEAR][self.random.below(2)];
        for level in if own { 1..to.levels } else { 0..1 } {
            let (source, of_layer) = if own { (level - 1, layer) } else { (0, 0) };
            let region = [vk::ImageBlit {
                src_subresource: layers(source, of_layer),
                src_offsets: [
                    vk::Offset3D::default(),
                    corner(level_size(from.size, source)),
                ],
                dst_subresource: layers(level, layer),
                dst_offsets: [vk::Offset3D::default(), corner(level_size(to.size, level))],
            }];
            let (from, to) = (from.image.handle, to.image.handle);
            // SAFETY: the command buffer is being recorded, and both images exist.
            unsafe {
                let (device, buffer) = (self.device(), self.buffer);
                device.cmd_blit_image(buffer, from, GENERAL, to, GENERAL, &region, filter);
            }
            self.barrier();
        }
    }

    /// Copies a part of an image, or some texels from a buffer.
    pub(super) fn copy(&mut self) {
        let (Some(from), Some(to)) = (
            self.random.pick(&self.world.textures),
            self.random.pick(&self.world.textures),
        ) else {
            return;
        };
        let extent = vk::Extent3D {
            width: 9,
            height: 7,
            depth: 1,
        };
        let dst_offset = vk::Offset3D {
            x: self.random.below(8) as i32,
            y: 3,
            z: 0,
        };
        let layer = self.random.below(to.layers as usize) as u32;
        self.contents.uses.insert(to.image.handle.as_raw());
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded; both images exist and are larger than the region; the
        // buffer has more texels.
        unsafe {
            if self.random.once_in(2) || from.image.handle == to.image.handle {
                let region = [vk::BufferImageCopy {
                    image_subresource: layers(0, layer),
                    image_offset: dst_offset,
                    image_extent: extent,
                    ..Default::default()
                }];
                let geometry = self.world.geometry.handle;
                device.cmd_copy_buffer_to_image(
                    buffer,
                    geometry,
                    to.image.handle,
                    GENERAL,
                    &region,
                );
            } else {
                self.contents.uses.insert(from.image.handle.as_raw());
                let region = [vk::ImageCopy {
                    src_subresource: layers(0, 0),
                    dst_subresource: layers(0, layer),
                    dst_offset,
                    extent,
                    ..Default::default()
                }];
                let (from, to) = (from.image.handle, to.image.handle);
                device.cmd_copy_image(buffer, from, GENERAL, to, GENERAL, &region);
            }
        }
    }
}
