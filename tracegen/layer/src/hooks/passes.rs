//! Hooks of render passes, framebuffers and dynamic rendering.

use super::api::{find, slice};
use super::device::Device;
use crate::track::{Attachment, OpenPass, RenderPass, Subpass};
use ash::vk::{self, Handle};
use spool::{PassInfo, ViewInfo};
use std::sync::Arc;

type Allocator = *const vk::AllocationCallbacks<'static>;

const CLEAR: vk::AttachmentLoadOp = vk::AttachmentLoadOp::CLEAR;

fn used(attachment: u32) -> Option<u32> {
    (attachment != vk::ATTACHMENT_UNUSED).then_some(attachment)
}

/// Pairs of attachments of a subpass: those that are resolved, and their destinations.
fn resolved(from: impl Iterator<Item = u32>, to: impl Iterator<Item = u32>) -> Vec<[u32; 2]> {
    from.zip(to)
        .filter_map(|(from, to)| Some([used(from)?, used(to)?]))
        .collect()
}

/// The resolved attachments of a subpass.
///
/// # Safety
/// A valid description.
unsafe fn resolves2(subpass: &vk::SubpassDescription2<'_>) -> Vec<[u32; 2]> {
    // SAFETY: as the caller promises.
    let (colors, to, depth_to) = unsafe {
        let count = subpass.color_attachment_count;
        (
            slice(subpass.p_color_attachments, count),
            slice(subpass.p_resolve_attachments, count),
            find::<vk::SubpassDescriptionDepthStencilResolve<'_>>(subpass.p_next)
                .and_then(|of| of.p_depth_stencil_resolve_attachment.as_ref()),
        )
    };
    // SAFETY: as the caller promises.
    let depth = unsafe { subpass.p_depth_stencil_attachment.as_ref() };
    let place = |of: &vk::AttachmentReference2<'_>| of.attachment;
    let mut pairs = resolved(colors.iter().map(place), to.iter().map(place));
    pairs.extend(resolved(
        depth.into_iter().map(place),
        depth_to.into_iter().map(place),
    ));
    pairs
}

pub(super) unsafe extern "system" fn create_render_pass(
    device: vk::Device,
    info: *const vk::RenderPassCreateInfo<'_>,
    allocator: Allocator,
    pass: *mut vk::RenderPass,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateRenderPass.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_render_pass)(device, info, allocator, pass);
        if result == vk::Result::SUCCESS {
            let info = &*info;
            let multiview = find::<vk::RenderPassMultiviewCreateInfo<'_>>(info.p_next);
            let masks = multiview.map_or(&[][..], |m| slice(m.p_view_masks, m.subpass_count));
            let subpasses = slice(info.p_subpasses, info.subpass_count)
                .iter()
                .enumerate();
            let of = RenderPass {
                clears: (slice(info.p_attachments, info.attachment_count).iter())
                    .map(|attachment| attachment.load_op == CLEAR)
                    .collect(),
                subpasses: subpasses
                    .map(|(number, subpass)| Subpass {
                        colors: (slice(
                            subpass.p_color_attachments,
                            subpass.color_attachment_count,
                        )
                        .iter())
                        .map(|color| used(color.attachment))
                        .collect(),
                        depth: (subpass.p_depth_stencil_attachment.as_ref())
                            .and_then(|depth| used(depth.attachment)),
                        resolves: resolved(
                            slice(subpass.p_color_attachments, subpass.color_attachment_count)
                                .iter()
                                .map(|of| of.attachment),
                            slice(
                                subpass.p_resolve_attachments,
                                subpass.color_attachment_count,
                            )
                            .iter()
                            .map(|of| of.attachment),
                        ),
                        view_mask: masks.get(number).copied().unwrap_or(0),
                    })
                    .collect(),
            };
            known.tracker().passes.create(*pass, of);
        }
        result
    }
}

pub(super) unsafe extern "system" fn create_render_pass2(
    device: vk::Device,
    info: *const vk::RenderPassCreateInfo2<'_>,
    allocator: Allocator,
    pass: *mut vk::RenderPass,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateRenderPass2.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_render_pass2)(device, info, allocator, pass);
        if result == vk::Result::SUCCESS {
            let info = &*info;
            let of = RenderPass {
                clears: (slice(info.p_attachments, info.attachment_count).iter())
                    .map(|attachment| attachment.load_op == CLEAR)
                    .collect(),
                subpasses: (slice(info.p_subpasses, info.subpass_count).iter())
                    .map(|subpass| Subpass {
                        colors: (slice(
                            subpass.p_color_attachments,
                            subpass.color_attachment_count,
                        )
                        .iter())
                        .map(|color| used(color.attachment))
                        .collect(),
                        depth: (subpass.p_depth_stencil_attachment.as_ref())
                            .and_then(|depth| used(depth.attachment)),
                        resolves: resolves2(subpass),
                        view_mask: subpass.view_mask,
                    })
                    .collect(),
            };
            known.tracker().passes.create(*pass, of);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_render_pass(
    device: vk::Device,
    pass: vk::RenderPass,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyRenderPass.
    unsafe {
        let known = Device::of(device);
        known.tracker().passes.destroy(pass);
        (known.next.destroy_render_pass)(device, pass, allocator);
    }
}

pub(super) unsafe extern "system" fn create_framebuffer(
    device: vk::Device,
    info: *const vk::FramebufferCreateInfo<'_>,
    allocator: Allocator,
    framebuffer: *mut vk::Framebuffer,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateFramebuffer.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_framebuffer)(device, info, allocator, framebuffer);
        if result == vk::Result::SUCCESS {
            let imageless = (*info)
                .flags
                .contains(vk::FramebufferCreateFlags::IMAGELESS);
            let views = match imageless {
                true => &[],
                false => slice((*info).p_attachments, (*info).attachment_count),
            };
            let tracker = &mut *known.tracker();
            tracker
                .passes
                .create_framebuffer(*framebuffer, views, &tracker.images);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_framebuffer(
    device: vk::Device,
    framebuffer: vk::Framebuffer,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyFramebuffer.
    unsafe {
        let known = Device::of(device);
        known.tracker().passes.destroy_framebuffer(framebuffer);
        (known.next.destroy_framebuffer)(device, framebuffer, allocator);
    }
}

/// Begins to track a render pass.
///
/// # Safety
/// A valid description.
unsafe fn begin(known: &Device, buffer: vk::CommandBuffer, info: &vk::RenderPassBeginInfo<'_>) {
    let tracker = &mut *known.tracker();
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
    for [from, to] in resolves {
        state.effects.copies.add(from, to);
    }
    state.pass = Some(Arc::new(pass));
    state.open = Some(open);
}

fn next_subpass(known: &Device, buffer: vk::CommandBuffer) {
    let tracker = &mut *known.tracker();
    let open = tracker.commands.get_mut(buffer.as_raw()).open.clone();
    if let Some(mut open) = open {
        open.subpass += 1;
        enter(tracker, buffer, open);
    }
}

/// Ends a render pass and returns its description.
fn end(known: &Device, buffer: vk::CommandBuffer) -> Option<Arc<PassInfo>> {
    let mut tracker = known.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    state.open = None;
    state.pass.take()
}

/// Copies the picture of a render pass, if requested.
///
/// # Safety
/// The render pass has just ended, and the command buffer is being recorded.
unsafe fn keep(known: &Device, buffer: vk::CommandBuffer, pass: Option<Arc<PassInfo>>) {
    if let (Some(pictures), Some(pass)) = (&known.pictures, pass)
        && known.capture.may_want_commands()
    {
        // SAFETY: as the caller promises.
        unsafe { pictures.take(known, buffer, &pass) };
    }
}

pub(super) unsafe extern "system" fn cmd_begin_render_pass(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    // SAFETY: a valid call of vkCmdBeginRenderPass.
    unsafe {
        let known = Device::of(buffer);
        begin(&known, buffer, &*info);
        (known.next.cmd_begin_render_pass)(buffer, info, contents);
    }
}

pub(super) unsafe extern "system" fn cmd_begin_render_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    subpass: *const vk::SubpassBeginInfo<'_>,
) {
    // SAFETY: a valid call of vkCmdBeginRenderPass2.
    unsafe {
        let known = Device::of(buffer);
        begin(&known, buffer, &*info);
        (known.next.cmd_begin_render_pass2)(buffer, info, subpass);
    }
}

pub(super) unsafe extern "system" fn cmd_next_subpass(
    buffer: vk::CommandBuffer,
    contents: vk::SubpassContents,
) {
    // SAFETY: a valid call of vkCmdNextSubpass.
    unsafe {
        let known = Device::of(buffer);
        next_subpass(&known, buffer);
        (known.next.cmd_next_subpass)(buffer, contents);
    }
}

pub(super) unsafe extern "system" fn cmd_next_subpass2(
    buffer: vk::CommandBuffer,
    begin: *const vk::SubpassBeginInfo<'_>,
    end: *const vk::SubpassEndInfo<'_>,
) {
    // SAFETY: a valid call of vkCmdNextSubpass2.
    unsafe {
        let known = Device::of(buffer);
        next_subpass(&known, buffer);
        (known.next.cmd_next_subpass2)(buffer, begin, end);
    }
}

pub(super) unsafe extern "system" fn cmd_end_render_pass(buffer: vk::CommandBuffer) {
    // SAFETY: a valid call of vkCmdEndRenderPass.
    unsafe {
        let known = Device::of(buffer);
        let pass = end(&known, buffer);
        (known.next.cmd_end_render_pass)(buffer);
        keep(&known, buffer, pass);
    }
}

pub(super) unsafe extern "system" fn cmd_end_render_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::SubpassEndInfo<'_>,
) {
    // SAFETY: a valid call of vkCmdEndRenderPass2.
    unsafe {
        let known = Device::of(buffer);
        let pass = end(&known, buffer);
        (known.next.cmd_end_render_pass2)(buffer, info);
        keep(&known, buffer, pass);
    }
}

pub(super) unsafe extern "system" fn cmd_begin_rendering(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderingInfo<'_>,
) {
    // SAFETY: a valid call of vkCmdBeginRendering.
    unsafe {
        let known = Device::of(buffer);
        {
            let info = &*info;
            let tracker = &mut *known.tracker();
            let attachment = |of: &vk::RenderingAttachmentInfo<'_>| {
                let view = tracker.images.view(of.image_view)?;
                let clears = of.load_op == CLEAR;
                Some(Attachment { view, clears })
            };
            let all_colors = slice(info.p_color_attachments, info.color_attachment_count);
            let depth = info.p_depth_attachment.as_ref();
            let resolves: Vec<[u32; 2]> = (all_colors.iter().chain(depth))
                .filter(|of| of.resolve_mode != vk::ResolveModeFlags::NONE)
                .filter_map(|of| {
                    let [from, to] = [of.image_view, of.resolve_image_view]
                        .map(|view| tracker.images.view(view));
                    Some([from?.image, to?.image])
                })
                .collect();
            let colors = all_colors.iter().filter_map(attachment).collect();
            let depth = depth.and_then(attachment);
            // A suspended render pass continues.
            let resumes = info.flags.contains(vk::RenderingFlags::RESUMING);
            let state = tracker.commands.get_mut(buffer.as_raw());
            state.effects.renders = true;
            for [from, to] in resolves {
                state.effects.copies.add(from, to);
            }
            if !resumes || state.pass.is_none() {
                let (area, views) = (info.render_area, info.view_mask);
                state.pass = Some(Arc::new(tracker.passes.info(colors, depth, area, views)));
            }
        }
        (known.next.cmd_begin_rendering)(buffer, info);
    }
}

pub(super) unsafe extern "system" fn cmd_end_rendering(buffer: vk::CommandBuffer) {
    // SAFETY: a valid call of vkCmdEndRendering.
    unsafe {
        let known = Device::of(buffer);
        let pass = end(&known, buffer);
        (known.next.cmd_end_rendering)(buffer);
        keep(&known, buffer, pass);
    }
}
