//! Pipeline layouts, pipelines, render passes and targets.

use super::*;
use crate::graphics::{Graphics, attribute, opaque};
use crate::libraries::{self, Split};

impl World {
    /// Creates a pipeline layout.
    pub fn layout(&self, kinds: Vec<usize>, offset: usize) -> Result<Layout> {
        let sets: Vec<_> = kinds.iter().map(|kind| self.set_layouts[*kind]).collect();
        let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
        let range = |stage_flags, offset, size| vk::PushConstantRange {
            stage_flags,
            offset,
            size,
        };
        let ranges = [
            range(vertex, 0, 16),
            range(fragment, shaders::OFFSETS[offset], 16),
        ];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(&ranges);
        // SAFETY: the device is open.
        let made = unsafe { self.gpu.device.create_pipeline_layout(&info, None) };
        let handle = checked("a pipeline layout", made)?;
        let template = match kinds[0] {
            PUSHED => Some(template(
                &self.gpu,
                PUSHED,
                self.set_layouts[PUSHED],
                Some(handle),
            )?),
            _ => None,
        };
        Ok(Layout {
            handle,
            kinds,
            offset,
            template,
        })
    }

    pub fn destroy_layout(&self, layout: &Layout) {
        // SAFETY: no command buffer that uses the layout is being recorded.
        unsafe {
            if let Some(template) = layout.template {
                self.gpu
                    .device
                    .destroy_descriptor_update_template(template, None);
            }
            self.gpu.device.destroy_pipeline_layout(layout.handle, None);
        }
    }

    /// Creates a pipeline.
    pub fn pipeline(
        &self,
        class: Class,
        dynamic: bool,
        layout: usize,
        body: usize,
        blends: bool,
        split: Option<Split>,
    ) -> Result<Pipeline> {
        let device = &self.gpu.device;
        let words = shaders::fragment(body, self.layouts[layout].offset)?;
        // SAFETY: the device is open; the module and the render pass exist until the pipeline is created.
        unsafe {
            let module = vk::ShaderModuleCreateInfo::default().code(&words);
            let module = checked("a module", device.create_shader_module(&module, None))?;
            let attribute =
                |location, offset| attribute(location, vk::Format::R32G32_SFLOAT, offset);
            let mut attachment = opaque();
            if blends {
                attachment = attachment
                    .blend_enable(true)
                    .src_color_blend_factor(vk::BlendFactor::ONE)
                    .dst_color_blend_factor(vk::BlendFactor::SRC_COLOR);
            }
            let graphics = Graphics {
                shaders: [(self.vertex, c"vertex"), (module, c"fragment")],
                stride: 16,
                attributes: &[attribute(0, 0), attribute(1, 8)],
                depth: class.depth.then_some(vk::CompareOp::LESS_OR_EQUAL),
                attachments: &[attachment],
                side_px: None,
                layout: self.layouts[layout].handle,
            };
            let formats = [FORMATS[class.format]];
            let mut rendering = rendering(class, &formats);
            let pass = match dynamic {
                true => vk::RenderPass::null(),
                false => self.render_pass(class, true)?,
            };
            let made = graphics.describe(|info| {
                let info = match dynamic {
                    true => info.push_next(&mut rendering),
                    false => info.render_pass(pass),
                };
                libraries::create(device, &info, split)
            });
            device.destroy_shader_module(module, None);
            device.destroy_render_pass(pass, None);
            let linked = made?;
            Ok(Pipeline {
                handle: linked.pipeline,
                linked,
                layout,
                class,
                dynamic,
            })
        }
    }

    pub fn destroy_pipeline(&mut self, place: usize) {
        let pipeline = self.pipelines.swap_remove(place);
        self.forget(pipeline.handle.as_raw());
        // SAFETY: nothing uses the pipeline any more.
        unsafe { pipeline.linked.destroy(&self.gpu.device) };
    }

    pub(super) fn render_pass(&self, class: Class, clears: bool) -> Result<vk::RenderPass> {
        let load = if clears {
            vk::AttachmentLoadOp::CLEAR
        } else {
            vk::AttachmentLoadOp::LOAD
        };
        let general = vk::ImageLayout::GENERAL;
        let attachment = |format| {
            vk::AttachmentDescription::default()
                .format(format)
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(general)
                .final_layout(general)
        };
        let mut attachments = vec![attachment(FORMATS[class.format])];
        let reference = |attachment| vk::AttachmentReference {
            attachment,
            layout: general,
        };
        let (colors, depth) = ([reference(0)], reference(1));
        let mut subpass = vk::SubpassDescription::default().color_attachments(&colors);
        if class.depth {
            attachments.push(attachment(DEPTH));
            subpass = subpass.depth_stencil_attachment(&depth);
        }
        let subpasses = [subpass];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses);
        // SAFETY: the device is open.
        let made = unsafe { self.gpu.device.create_render_pass(&info, None) };
        checked("a render pass", made)
    }

    /// Creates a target for a view of one level.
    pub fn target(&self, view: View, depth: bool, clears: bool) -> Result<Target> {
        let class = Class {
            format: view.format,
            depth,
        };
        let pass = self.render_pass(class, clears)?;
        let views = [view.handle, self.depth.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views[..if depth { 2 } else { 1 }])
            .width(view.size[0])
            .height(view.size[1])
            .layers(1);
        // SAFETY: the device is open.
        let made = unsafe { self.gpu.device.create_framebuffer(&info, None) };
        let framebuffer = checked("a framebuffer", made)?;
        Ok(Target {
            pass,
            framebuffer,
            class,
            view,
            clears,
        })
    }

    pub fn destroy_target(&mut self, target: &Target) {
        self.forget(target.framebuffer.as_raw());
        // SAFETY: nothing uses the framebuffer any more, and the render pass is used with it alone.
        unsafe {
            self.gpu
                .device
                .destroy_framebuffer(target.framebuffer, None);
            self.gpu.device.destroy_render_pass(target.pass, None);
        }
    }
}
