//! Render passes, framebuffers and render targets.

use super::Images;
use ash::vk::{self, Handle};
use spool::{PassInfo, ViewInfo};
use std::collections::HashMap;

/// An attachment that a subpass writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Part of an image.
    pub view: ViewInfo,
    /// Whether the subpass clears it.
    pub clears: bool,
}

/// Targets of a subpass, as indices of attachments.
#[derive(Clone, Debug, Default)]
pub struct Subpass {
    /// Colour attachments; `None` if unused.
    pub colors: Vec<Option<u32>>,
    /// Depth attachment.
    pub depth: Option<u32>,
    /// Attachments that are resolved, and those that they are resolved to.
    pub resolves: Vec<[u32; 2]>,
    /// View mask.
    pub view_mask: u32,
}

/// A render pass.
#[derive(Clone, Debug, Default)]
pub struct RenderPass {
    /// Whether each attachment is cleared.
    pub clears: Vec<bool>,
    /// The subpasses.
    pub subpasses: Vec<Subpass>,
}

/// Render passes and framebuffers by handle, and the number of the last begun pass.
#[derive(Debug, Default)]
pub struct Passes {
    passes: HashMap<u64, RenderPass>,
    framebuffers: HashMap<u64, Vec<Option<ViewInfo>>>,
    begun: u32,
}

impl Passes {
    pub(super) fn numbered_from(first: u32) -> Self {
        Self {
            begun: first,
            ..Self::default()
        }
    }

    /// Adds a render pass.
    pub fn create(&mut self, handle: vk::RenderPass, pass: RenderPass) {
        self.passes.insert(handle.as_raw(), pass);
    }

    /// Removes a render pass.
    pub fn destroy(&mut self, handle: vk::RenderPass) {
        self.passes.remove(&handle.as_raw());
    }

    /// View mask of a subpass.
    pub fn view_mask(&self, handle: vk::RenderPass, subpass: u32) -> u32 {
        let pass = self.passes.get(&handle.as_raw());
        let subpass = pass.and_then(|pass| pass.subpasses.get(subpass as usize));
        subpass.map_or(0, |subpass| subpass.view_mask)
    }

    /// Adds a framebuffer.
    pub fn create_framebuffer(
        &mut self,
        handle: vk::Framebuffer,
        views: &[vk::ImageView],
        images: &Images,
    ) {
        let views = views.iter().map(|view| images.view(*view)).collect();
        self.framebuffers.insert(handle.as_raw(), views);
    }

    /// Removes a framebuffer.
    pub fn destroy_framebuffer(&mut self, handle: vk::Framebuffer) {
        self.framebuffers.remove(&handle.as_raw());
    }

    /// Begins a subpass. `views` are those of an imageless framebuffer.
    pub fn begin(
        &mut self,
        handle: vk::RenderPass,
        framebuffer: vk::Framebuffer,
        views: Option<Vec<Option<ViewInfo>>>,
        area: vk::Rect2D,
        subpass: u32,
    ) -> PassInfo {
        let pass = self
            .passes
            .get(&handle.as_raw())
            .cloned()
            .unwrap_or_default();
        let views = views
            .or_else(|| self.framebuffers.get(&framebuffer.as_raw()).cloned())
            .unwrap_or_default();
        let of = pass
            .subpasses
            .get(subpass as usize)
            .cloned()
            .unwrap_or_default();
        let attachment = |place: u32| {
            let view = views.get(place as usize).copied().flatten()?;
            // Later subpasses keep the content of earlier ones.
            let clears = subpass == 0 && pass.clears.get(place as usize) == Some(&true);
            Some(Attachment { view, clears })
        };
        let colors = of
            .colors
            .iter()
            .filter_map(|color| attachment((*color)?))
            .collect();
        let depth = of.depth.and_then(attachment);
        self.info(colors, depth, area, of.view_mask)
    }

    /// The parts of images that a subpass resolves, and those that they are resolved to.
    pub fn resolves(&self, open: &super::OpenPass) -> Vec<[ViewInfo; 2]> {
        let pass = self.passes.get(&open.pass.as_raw());
        let subpass = pass.and_then(|pass| pass.subpasses.get(open.subpass as usize));
        let known = self.framebuffers.get(&open.framebuffer.as_raw());
        let views = open.views.as_ref().or(known);
        let view = |place: u32| *views?.get(place as usize)?;
        let pairs = subpass.into_iter().flat_map(|subpass| &subpass.resolves);
        pairs
            .filter_map(|[from, to]| Some([view(*from)?, view(*to)?]))
            .collect()
    }

    /// Describes the targets of a render pass, with the next number.
    pub fn info(
        &mut self,
        colors: Vec<Attachment>,
        depth: Option<Attachment>,
        area: vk::Rect2D,
        view_mask: u32,
    ) -> PassInfo {
        let pass = self.begun;
        self.begun += 1;
        let size = [area.extent.width, area.extent.height].map(|s| i32::try_from(s).unwrap_or(0));
        PassInfo {
            pass,
            clears: colors.iter().chain(&depth).any(|a| a.clears),
            colors: colors.into_iter().map(|a| a.view).collect(),
            depth: depth.map(|a| a.view),
            area: [area.offset.x, area.offset.y, size[0], size[1]],
            view_mask,
        }
    }
}
