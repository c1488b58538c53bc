//! Tracks those Vulkan objects of a program that affect the texture samples of draws.
//!
//! This module does not call Vulkan. Hooks report the program's calls. At a draw, they query the textures and
//! targets that it uses.

mod commands;
mod descriptors;
mod images;
mod passes;
mod pipelines;

pub use commands::{Call, CommandState, Commands, Dynamic, Effects, Executed, OpenPass};
pub use descriptors::{Descriptors, Template, TemplateEntry, Written};
pub use images::Images;
pub use passes::{Attachment, Passes, RenderPass, Subpass};
pub use pipelines::{Compute, Layout, Library, Pipeline, Pipelines, Recorded, State};

use crate::spool::{DrawInfo, TextureInfo, ViewInfo};
use ash::vk;
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
    /// Images into which draws that test depth have rendered colours.
    scene_images: HashSet<u32>,
}

impl Tracker {
    /// Tracker of a device. The number of the device is part of the numbers of its objects.
    #[must_use]
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

    /// Notes the targets of a draw that tests depth. Such a draw is part of a 3D scene.
    pub fn note_scene(&mut self, command_buffer: u64) {
        let Some(state) = self.commands.get(command_buffer) else {
            return;
        };
        if let Some(pass) = state.pass.as_ref().filter(|pass| pass.depth.is_some())
            && state.tests_depth()
        {
            self.scene_images
                .extend(pass.colors.iter().map(|view| view.image));
        }
    }

    /// Whether a draw tests no depth and its targets are no pictures of a scene, while the program has rendered
    /// scenes into other images. Browsers and desktops compose their windows by such draws.
    #[must_use]
    pub fn is_outside_scenes(&self, command_buffer: u64) -> bool {
        let state = self.commands.get(command_buffer);
        let Some((state, pass)) = state.and_then(|state| Some((state, state.pass.as_ref()?)))
        else {
            return false;
        };
        if self.scene_images.is_empty() || pass.colors.is_empty() {
            return false;
        }
        let tests_depth = pass.depth.is_some() && state.tests_depth();
        let is_scene = |view: &ViewInfo| self.scene_images.contains(&view.image);
        !tests_depth && !pass.colors.iter().any(is_scene)
    }

    /// Description of a draw in a command buffer, with the next number; `None` if no graphics pipeline is
    /// bound.
    pub fn draw(&mut self, command_buffer: u64, call: &Call) -> Option<DrawInfo> {
        let textures = self.textures(command_buffer)?;
        self.commands.draw(command_buffer, call, textures)
    }

    /// Textures that the bound pipeline's shader may read.
    fn textures(&self, command_buffer: u64) -> Option<Vec<TextureInfo>> {
        let bound = self.commands.get(command_buffer)?;
        let pipeline = bound.pipeline()?;
        let mut textures = Vec::new();
        for &(set, binding) in &pipeline.bindings {
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
        Some(textures)
    }
}

#[cfg(test)]
mod tests;
