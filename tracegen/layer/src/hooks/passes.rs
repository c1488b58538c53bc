//! Hooks of render passes, framebuffers and dynamic rendering.

use super::api::{find, slice};
use super::device::Device;
use crate::track::{Attachment, CommandState, OpenPass, RenderPass, Subpass};
use ash::vk::{self, Handle};
use spool::{PassInfo, ViewInfo};
use std::sync::Arc;

creates! {
    create_render_pass RenderPassCreateInfo => RenderPass |device, info, pass|
        device.tracker().passes.create(pass, render_pass(info));
    create_render_pass2 RenderPassCreateInfo2 => RenderPass |device, info, pass|
        device.tracker().passes.create(pass, render_pass2(info));
    create_framebuffer FramebufferCreateInfo => Framebuffer |device, info, framebuffer| {
        let views = match info.flags.contains(vk::FramebufferCreateFlags::IMAGELESS) {
            true => &[],
            false => slice(info.p_attachments, info.attachment_count),
        };
        let tracker = &mut *device.tracker();
        tracker.passes.create_framebuffer(framebuffer, views, &tracker.images);
    };
}

destroys! {
    destroy_render_pass RenderPass |device, pass| device.tracker().passes.destroy(pass);
    destroy_framebuffer Framebuffer |device, framebuffer| device.tracker().passes.destroy_framebuffer(framebuffer);
}

before! {
    cmd_begin_render_pass(buffer: vk::CommandBuffer, info: *const vk::RenderPassBeginInfo<'_>, contents: vk::SubpassContents) |device|
        begin(&device, buffer, &*info);
    cmd_begin_render_pass2(buffer: vk::CommandBuffer, info: *const vk::RenderPassBeginInfo<'_>, subpass: *const vk::SubpassBeginInfo<'_>) |device|
        begin(&device, buffer, &*info);
    cmd_begin_rendering(buffer: vk::CommandBuffer, info: *const vk::RenderingInfo<'_>) |device|
        begin_rendering(&device, buffer, &*info);
    cmd_next_subpass(buffer: vk::CommandBuffer, contents: vk::SubpassContents) |device|
        next_subpass(&device, buffer);
    cmd_next_subpass2(buffer: vk::CommandBuffer, begin: *const vk::SubpassBeginInfo<'_>, end: *const vk::SubpassEndInfo<'_>) |device|
        next_subpass(&device, buffer);
}

/// Hooks of commands that end a render pass.
macro_rules! ends {
    ($($hook:ident($($argument:ident: $kind:ty)?);)*) => { $(
        pub(super) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, $($argument: $kind)?) {
            // SAFETY: a valid call of the command.
            unsafe {
                let device = Device::of(buffer);
                let pass = end(&device, buffer);
                (device.next.$hook)(buffer, $($argument)?);
                keep(&device, buffer, pass);
            }
        }
    )* };
}

ends! {
    cmd_end_render_pass();
    cmd_end_render_pass2(info: *const vk::SubpassEndInfo<'_>);
    cmd_end_rendering();
}

const CLEAR: vk::AttachmentLoadOp = vk::AttachmentLoadOp::CLEAR;

fn used(attachment: u32) -> Option<u32> {
    (attachment != vk::ATTACHMENT_UNUSED).then_some(attachment)
}

/// The numbers of a subpass's attachments, some of which are unused.
struct Attachments {
    colors: Vec<u32>,
    /// Destinations of the colours that are resolved.
    colors_to: Vec<u32>,
    depth: Option<u32>,
    depth_to: Option<u32>,
}

impl Attachments {
    fn subpass(self, view_mask: u32) -> Subpass {
        let colors = self.colors.iter().zip(&self.colors_to);
        let pairs = colors.chain(self.depth.iter().zip(&self.depth_to));
        Subpass {
            resolves: pairs
                .filter_map(|(from, to)| Some([used(*from)?, used(*to)?]))
                .collect(),
            colors: self.colors.into_iter().map(used).collect(),
            depth: self.depth.and_then(used),
            view_mask,
        }
    }
}

/// Describes a render pass.
///
/// # Safety
/// A valid description.
unsafe fn render_pass(info: &vk::RenderPassCreateInfo<'_>) -> RenderPass {
    // SAFETY: as the caller promises.
    unsafe {
        let multiview = find::<vk::RenderPassMultiviewCreateInfo<'_>>(info.p_next);
        let masks = multiview.map_or(&[][..], |m| slice(m.p_view_masks, m.subpass_count));
        let place = |of: &vk::AttachmentReference| of.attachment;
        let places = |first, count| slice(first, count).iter().map(place).collect();
        let attachments = slice(info.p_attachments, info.attachment_count).iter();
        let subpasses = slice(info.p_subpasses, info.subpass_count)
            .iter()
            .enumerate();
        RenderPass {
            clears: attachments.map(|of| of.load_op == CLEAR).collect(),
            subpasses: subpasses
                .map(|(number, of)| {
                    let attachments = Attachments {
                        colors: places(of.p_color_attachments, of.color_attachment_count),
                        colors_to: places(of.p_resolve_attachments, of.color_attachment_count),
                        depth: of.p_depth_stencil_attachment.as_ref().map(place),
                        depth_to: None,
                    };
                    attachments.subpass(masks.get(number).copied().unwrap_or(0))
                })
                .collect(),
        }
    }
}

/// Describes a render pass.
///
/// # Safety
/// A valid description.
unsafe fn render_pass2(info: &vk::RenderPassCreateInfo2<'_>) -> RenderPass {
    // SAFETY: as the caller promises.
    unsafe {
        let place = |of: &vk::AttachmentReference2<'_>| of.attachment;
        let places = |first, count| slice(first, count).iter().map(place).collect();
        let attachments = slice(info.p_attachments, info.attachment_count).iter();
        let subpasses = slice(info.p_subpasses, info.subpass_count).iter();
        RenderPass {
            clears: attachments.map(|of| of.load_op == CLEAR).collect(),
            subpasses: subpasses
                .map(|of| {
                    let depth = find::<vk::SubpassDescriptionDepthStencilResolve<'_>>(of.p_next);
                    let depth_to =
                        depth.and_then(|depth| depth.p_depth_stencil_resolve_attachment.as_ref());
                    let attachments = Attachments {
                        colors: places(of.p_color_attachments, of.color_attachment_count),
                        colors_to: places(of.p_resolve_attachments, of.color_attachment_count),
                        depth: of.p_depth_stencil_attachment.as_ref().map(place),
                        depth_to: depth_to.map(place),
                    };
                    attachments.subpass(of.view_mask)
                })
                .collect(),
        }
    }
}

/// Begins to track a render pass.
///
/// # Safety
/// A valid description.
unsafe fn begin(device: &Device, buffer: vk::CommandBuffer, info: &vk::RenderPassBeginInfo<'_>) {
    let tracker = &mut *device.tracker();
    // SAFETY: as the caller promises.
    let attachments = unsafe {
        find::<vk::RenderPassAttachmentBeginInfo<'_>>(info.p_next)
            .map(|given| slice(given.p_attachments, given.attachment_count))
    };
    let views = attachments.filter(|views| !views.is_empty());
    let views: Option<Vec<Option<ViewInfo>>> = views.map(|views| {
        views
            .iter()
            .map(|view| tracker.images.view(*view))
            .collect()
    });
    let open = OpenPass {
        pass: info.render_pass,
        framebuffer: info.framebuffer,
        views,
        area: info.render_area,
        subpass: 0,
    };
    enter(tracker, buffer, open);
}

/// Notes the resolves of a subpass. Those of a multiview pass are of its views.
fn note_resolves(state: &mut CommandState, resolves: &[[ViewInfo; 2]], view_mask: u32) {
    for [from, to] in resolves {
        let first = [(from.image, from.layers[0]), (to.image, to.layers[0])];
        let views = u32::BITS - view_mask.leading_zeros();
        state.effects.copies.add_layers(first, views.max(1));
    }
}

/// Starts to track a subpass.
fn enter(tracker: &mut crate::track::Tracker, buffer: vk::CommandBuffer, open: OpenPass) {
    let pass = tracker.passes.begin(
        open.pass,
        open.framebuffer,
        open.views.clone(),
        open.area,
        open.subpass,
    );
    let resolves = tracker.passes.resolves(&open);
    let state = tracker.commands.get_mut(buffer.as_raw());
    state.effects.renders = true;
    note_resolves(state, &resolves, pass.view_mask);
    state.pass = Some(Arc::new(pass));
    state.open = Some(open);
}

fn next_subpass(device: &Device, buffer: vk::CommandBuffer) {
    let tracker = &mut *device.tracker();
    let open = tracker.commands.get_mut(buffer.as_raw()).open.clone();
    if let Some(mut open) = open {
        open.subpass += 1;
        enter(tracker, buffer, open);
    }
}

/// Ends a render pass and returns its description.
fn end(device: &Device, buffer: vk::CommandBuffer) -> Option<Arc<PassInfo>> {
    let mut tracker = device.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    state.open = None;
    state.pass.take()
}

/// Copies the picture of a render pass, if requested.
///
/// # Safety
/// The render pass has just ended, and the command buffer is being recorded.
unsafe fn keep(device: &Device, buffer: vk::CommandBuffer, pass: Option<Arc<PassInfo>>) {
    if let (Some(pictures), Some(pass)) = (&device.pictures, pass)
        && device.capture.may_want_commands()
    {
        // SAFETY: as the caller promises.
        unsafe { pictures.take(device, buffer, &pass) };
    }
}

/// Begins to track a dynamic render pass.
///
/// # Safety
/// A valid description.
unsafe fn begin_rendering(
    device: &Device,
    buffer: vk::CommandBuffer,
    info: &vk::RenderingInfo<'_>,
) {
    // SAFETY: as the caller promises.
    let (all_colors, depth) = unsafe {
        (
            slice(info.p_color_attachments, info.color_attachment_count),
            info.p_depth_attachment.as_ref(),
        )
    };
    let tracker = &mut *device.tracker();
    let attachment = |of: &vk::RenderingAttachmentInfo<'_>| {
        let view = tracker.images.view(of.image_view)?;
        let clears = of.load_op == CLEAR;
        Some(Attachment { view, clears })
    };
    let resolves: Vec<[ViewInfo; 2]> = (all_colors.iter().chain(depth))
        .filter(|of| of.resolve_mode != vk::ResolveModeFlags::NONE)
        .filter_map(|of| {
            let [from, to] =
                [of.image_view, of.resolve_image_view].map(|view| tracker.images.view(view));
            Some([from?, to?])
        })
        .collect();
    let colors = all_colors.iter().filter_map(attachment).collect();
    let depth = depth.and_then(attachment);
    // A suspended render pass continues.
    let resumes = info.flags.contains(vk::RenderingFlags::RESUMING);
    let state = tracker.commands.get_mut(buffer.as_raw());
    state.effects.renders = true;
    note_resolves(state, &resolves, info.view_mask);
    if !resumes || state.pass.is_none() {
        let (area, views) = (info.render_area, info.view_mask);
        state.pass = Some(Arc::new(tracker.passes.info(colors, depth, area, views)));
    }
}
