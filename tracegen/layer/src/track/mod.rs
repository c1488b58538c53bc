//! Tracks those Vulkan objects of a program that affect the texture samples of draws.
//!
//! This module does not call Vulkan. Hooks report the program's calls. At a draw, they query the textures and
//! targets that it uses.

mod commands;
mod descriptors;
mod images;
mod passes;
mod pipelines;

pub use commands::{Call, CommandState, Commands, Copies, Dynamic, Effects, Executed, OpenPass};
pub use descriptors::{Descriptors, Template, TemplateEntry, Written};
pub use images::Images;
pub use passes::{Attachment, Passes, RenderPass, Subpass};
pub use pipelines::{
    Compute, Layout, Library, Parts, Pipeline, Pipelines, Recorded, RecordedVertex, State, VERTEX,
};

use ash::vk::{self, Handle};
use spool::{DrawInfo, TextureInfo};
use std::collections::HashSet;

/// All tracked objects of a device.
#[derive(Debug, Default)]
pub struct Tracker {
    /// Images, views and samplers.
    pub images: Images,
    /// Descriptor sets.
    pub descriptors: Descriptors,
    /// Shader modules and pipelines.
    pub pipelines: Pipelines,
    /// Render passes and framebuffers.
    pub passes: Passes,
    /// Command buffers.
    pub commands: Commands,
    /// Timeline semaphores.
    pub timelines: HashSet<vk::Semaphore>,
}

impl Tracker {
    /// Tracker of a device. The number of the device is part of the numbers of its objects.
    pub fn of_device(device: u32) -> Self {
        // No program creates more objects of one kind.
        let first = device << 26;
        Self {
            images: Images::numbered_from(first),
            pipelines: Pipelines::numbered_from(first),
            passes: Passes::numbered_from(first),
            commands: Commands::numbered_from(first),
            ..Self::default()
        }
    }

    /// Notes that a command buffer copies layers of an image to those of another one: first layers, and number of
    /// layers, of each region.
    pub fn note_copy(
        &mut self,
        buffer: vk::CommandBuffer,
        from: vk::Image,
        to: vk::Image,
        regions: impl IntoIterator<Item = [vk::ImageSubresourceLayers; 2]>,
    ) {
        let known = |image| self.images.get(image).cloned();
        if let (Some(from), Some(to)) = (known(from), known(to)) {
            let effects = &mut self.commands.get_mut(buffer.as_raw()).effects;
            for [source, target] in regions {
                let first = [
                    (from.image, source.base_array_layer),
                    (to.image, target.base_array_layer),
                ];
                let rest = from.layers.saturating_sub(source.base_array_layer);
                effects
                    .copies
                    .add_layers(first, source.layer_count.min(rest));
            }
        }
        // The host can read the texels of a linear image in memory.
        if self.images.is_linear(to) {
            self.commands.get_mut(buffer.as_raw()).effects.reads_back = true;
        }
    }

    /// Notes that a command buffer copies regions of an image to a buffer.
    pub fn note_read_back(
        &mut self,
        buffer: vk::CommandBuffer,
        image: vk::Image,
        regions: impl IntoIterator<Item = vk::Extent3D>,
    ) {
        let is_texel = |size: vk::Extent3D| [size.width, size.height, size.depth] == [1; 3];
        let is_probe = regions.into_iter().any(is_texel);
        let number = self.images.get(image).map(|image| image.image);
        let effects = &mut self.commands.get_mut(buffer.as_raw()).effects;
        effects.reads_back = true;
        effects.copies.probed.extend(number.filter(|_| is_probe));
    }

    /// Description of a draw in a command buffer, with the next number; `None` if no graphics pipeline is
    /// bound.
    pub fn draw(&mut self, command_buffer: u64, call: &Call) -> Option<DrawInfo> {
        let textures = self.textures(command_buffer)?;
        self.commands.draw(command_buffer, call, textures)
    }

    /// Textures that the bound pipeline's fragment shader, and its recording vertex shader, may read.
    fn textures(&self, command_buffer: u64) -> Option<[Vec<TextureInfo>; 2]> {
        let bound = self.commands.get(command_buffer)?;
        let pipeline = bound.pipeline()?;
        let vertex = pipeline.recorded.as_ref().and_then(|of| of.vertex.as_ref());
        let vertex = vertex.map_or(&[][..], |of| &of.bindings);
        Some([&pipeline.bindings[..], vertex].map(|of| self.textures_of(bound, of)))
    }

    /// Textures of bindings.
    fn textures_of(&self, bound: &CommandState, bindings: &[(u32, u32)]) -> Vec<TextureInfo> {
        let mut textures = Vec::new();
        for &(set, binding) in bindings {
            let slots = match bound.pushed(set) {
                Some(pushed) => pushed.binding(binding),
                None => (bound.set(set)).map_or_else(Vec::new, |set| {
                    self.descriptors
                        .set(set)
                        .map_or_else(Vec::new, |s| s.binding(binding))
                }),
            };
            textures.extend(slots.into_iter().map(|(element, slot)| TextureInfo {
                set,
                binding,
                element,
                view: slot.view,
                sampler: slot.sampler,
            }));
        }
        textures
    }
}

#[cfg(test)]
mod tests;
