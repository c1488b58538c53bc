//! Render targets.

use crate::gpu::{Gpu, Image, ImageKind, Result, checked};
use crate::{Options, Stereo};
use ash::vk;

pub const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// A target and its views.
pub struct Target {
    pub framebuffer: vk::Framebuffer,
    pub color: Image,
    /// Pixels of the target.
    pub size_px: [u32; 2],
    /// Views and their left edges.
    pub views: Vec<(u32, u32)>,
}

/// The render pass of every target.
pub fn render_pass(gpu: &Gpu, stereo: Stereo) -> Result<vk::RenderPass> {
    let attachment = |format, layout| {
        vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .final_layout(layout)
    };
    let attachments = [
        attachment(COLOR, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
        attachment(DEPTH, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL),
    ];
    let colors = [vk::AttachmentReference {
        attachment: 0,
        layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
    }];
    let depth = vk::AttachmentReference {
        attachment: 1,
        layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    };
    let subpasses = [vk::SubpassDescription::default()
        .color_attachments(&colors)
        .depth_stencil_attachment(&depth)];
    let masks = [if stereo == Stereo::Multiview { 3 } else { 0 }];
    let mut multiview = vk::RenderPassMultiviewCreateInfo::default().view_masks(&masks);
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses)
        .push_next(&mut multiview);
    // SAFETY: the device is open.
    checked("a render pass", unsafe {
        gpu.device.create_render_pass(&info, None)
    })
}

/// The targets, in the order in which they are rendered.
pub fn targets(gpu: &Gpu, options: &Options, pass: vk::RenderPass) -> Result<Vec<Target>> {
    let width = options.size_px[0];
    let make = |size_px: [u32; 2], layers: u32, views: Vec<(u32, u32)>| -> Result<Target> {
        let view = match layers {
            1 => vk::ImageViewType::TYPE_2D,
            _ => vk::ImageViewType::TYPE_2D_ARRAY,
        };
        let kind = |format, usage| ImageKind {
            format,
            size: [size_px[0], size_px[1], 1],
            levels: 1,
            layers,
            view,
            usage,
        };
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let color = gpu.image(&kind(COLOR, usage))?;
        let depth = gpu.image(&kind(DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT))?;
        let views_of = [color.view, depth.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views_of)
            .width(size_px[0])
            .height(size_px[1])
            .layers(1);
        // SAFETY: the device is open, and the views are its own.
        let framebuffer = unsafe { gpu.device.create_framebuffer(&info, None) };
        Ok(Target {
            framebuffer: checked("a framebuffer", framebuffer)?,
            color,
            size_px,
            views,
        })
    };
    let of_eye = [width, options.size_px[1]];
    Ok(match options.stereo {
        Stereo::Halves => {
            let both = [2 * width, options.size_px[1]];
            vec![make(both, 1, vec![(0, 0), (1, width)])?]
        }
        Stereo::Targets => {
            let eyes = [0, 1].map(|eye| make(of_eye, 1, vec![(eye, 0)]));
            eyes.into_iter().collect::<Result<_>>()?
        }
        Stereo::Multiview => vec![make(of_eye, 2, vec![(0, 0)])?],
        Stereo::Mono => vec![make(of_eye, 1, vec![(0, 0)])?],
        Stereo::Twice => {
            let first = make(of_eye, 1, vec![(0, 0)])?;
            let second = Target {
                views: vec![(1, 0)],
                ..first
            };
            vec![first, second]
        }
    })
}
