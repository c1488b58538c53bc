//! Draws of a full-screen square with a texture, by dynamic rendering.

use crate::api::Result;
use crate::gpu::{Gpu, Image, ImageKind, all_of, checked};
use crate::wgsl::compile;
use ash::vk;

/// Texels and pixels along the edges of the texture and of the pictures.
pub const EDGE: u32 = 256;
pub const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;

const SHADER: &str = "
@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var nearest: sampler;
struct Corner { @builtin(position) position: vec4<f32>, @location(0) uv: vec2<f32> }
@vertex fn vertex(@builtin(vertex_index) number: u32) -> Corner {
    // Two triangles, because Mesa 22.3 drops those that cross a clip edge in the second view of a multiview pass.
    var corners = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u);
    let at = corners[number];
    let uv = vec2<f32>(f32(at & 1u), f32(at >> 1u));
    return Corner(vec4<f32>(2.0 * uv - 1.0, 0.5, 1.0), uv);
}
@fragment fn fragment(corner: Corner) -> @location(0) vec4<f32> { return textureSample(image, nearest, corner.uv); }
";

/// A kind of picture: samples per pixel, and view mask.
pub type Kind = (u32, u32);

/// Pipelines and descriptor sets.
pub struct Draws {
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    module: vk::ShaderModule,
    sampler: vk::Sampler,
    pool: vk::DescriptorPool,
}

impl Draws {
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let device = &gpu.device;
        let words = compile(SHADER)?;
        // SAFETY: the device is open; handles live as long as it.
        unsafe {
            let binding = |binding, kind| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::FRAGMENT)
            };
            let kinds = [
                vk::DescriptorType::SAMPLED_IMAGE,
                vk::DescriptorType::SAMPLER,
            ];
            let bindings = [binding(0, kinds[0]), binding(1, kinds[1])];
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = checked(
                "a set layout",
                device.create_descriptor_set_layout(&info, None),
            )?;
            let layouts = [set_layout];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
            let layout = checked("a layout", device.create_pipeline_layout(&info, None))?;
            let sizes = kinds.map(|ty| vk::DescriptorPoolSize {
                ty,
                descriptor_count: 8,
            });
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(8)
                .pool_sizes(&sizes);
            let info_of_sampler = vk::SamplerCreateInfo::default()
                .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
                .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
            let module = vk::ShaderModuleCreateInfo::default().code(&words);
            Ok(Self {
                set_layout,
                layout,
                module: checked("a module", device.create_shader_module(&module, None))?,
                sampler: checked("a sampler", device.create_sampler(&info_of_sampler, None))?,
                pool: checked("a pool", device.create_descriptor_pool(&info, None))?,
            })
        }
    }

    /// A set that shows an image.
    pub fn set(&self, gpu: &Gpu, view: vk::ImageView) -> Result<vk::DescriptorSet> {
        let layouts = [self.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        let image = [vk::DescriptorImageInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
        let sampler = [vk::DescriptorImageInfo::default().sampler(self.sampler)];
        // SAFETY: the set is not in use.
        unsafe {
            let set = checked("a set", gpu.device.allocate_descriptor_sets(&info))?[0];
            let write = |binding, kind| {
                vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding)
                    .descriptor_type(kind)
            };
            let writes = [
                write(0, vk::DescriptorType::SAMPLED_IMAGE).image_info(&image),
                write(1, vk::DescriptorType::SAMPLER).image_info(&sampler),
            ];
            gpu.device.update_descriptor_sets(&writes, &[]);
            Ok(set)
        }
    }

    /// A pipeline. Programs often create one for each target.
    pub fn pipeline(&self, gpu: &Gpu, (samples, view_mask): Kind) -> Result<vk::Pipeline> {
        let stage = |stage, name| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage)
                .module(self.module)
                .name(name)
        };
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, c"vertex"),
            stage(vk::ShaderStageFlags::FRAGMENT, c"fragment"),
        ];
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewports = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(samples));
        let attachments = [vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let formats = [FORMAT];
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .view_mask(view_mask);
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewports)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)];
        // SAFETY: the device is open, and everything lives until the end of the call.
        let made = unsafe {
            gpu.device
                .create_graphics_pipelines(vk::PipelineCache::null(), &info, None)
        };
        Ok(made.map_err(|(_, error)| format!("a pipeline: {error}"))?[0])
    }
}

/// A target of a draw.
#[derive(Clone, Copy, Default)]
pub struct To {
    pub view: vk::ImageView,
    /// View into which the samples are resolved.
    pub resolve: vk::ImageView,
    /// Left edge of the picture.
    pub left: u32,
    pub view_mask: u32,
    /// Whether what is there is kept.
    pub keeps: bool,
}

/// Records a draw.
pub fn draw(
    gpu: &Gpu,
    buffer: vk::CommandBuffer,
    draws: &Draws,
    pipeline: vk::Pipeline,
    set: vk::DescriptorSet,
    to: To,
) {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let mut attachment = vk::RenderingAttachmentInfo::default()
        .image_view(to.view)
        .image_layout(layout)
        .load_op(if to.keeps {
            vk::AttachmentLoadOp::LOAD
        } else {
            vk::AttachmentLoadOp::CLEAR
        })
        .store_op(vk::AttachmentStoreOp::STORE);
    if to.resolve != vk::ImageView::null() {
        attachment = attachment
            .resolve_mode(vk::ResolveModeFlags::AVERAGE)
            .resolve_image_view(to.resolve)
            .resolve_image_layout(layout);
    }
    let area = vk::Rect2D {
        offset: vk::Offset2D {
            x: to.left as i32,
            y: 0,
        },
        extent: vk::Extent2D {
            width: EDGE,
            height: EDGE,
        },
    };
    let attachments = [attachment];
    let info = vk::RenderingInfo::default()
        .render_area(area)
        .layer_count(1)
        .view_mask(to.view_mask)
        .color_attachments(&attachments);
    let viewport = vk::Viewport {
        x: to.left as f32,
        y: 0.0,
        width: EDGE as f32,
        height: EDGE as f32,
        min_depth: 0.0,
        max_depth: 1.0,
    };
    let device = &gpu.device;
    let graphics = vk::PipelineBindPoint::GRAPHICS;
    // SAFETY: the command buffer is being recorded, and all objects are the device's.
    unsafe {
        device.cmd_begin_rendering(buffer, &info);
        device.cmd_bind_pipeline(buffer, graphics, pipeline);
        device.cmd_bind_descriptor_sets(buffer, graphics, draws.layout, 0, &[set], &[]);
        device.cmd_set_viewport(buffer, 0, &[viewport]);
        device.cmd_set_scissor(buffer, 0, &[area]);
        device.cmd_draw(buffer, 6, 1, 0, 0);
        device.cmd_end_rendering(buffer);
    }
}

/// Changes the layout of an image.
pub fn change(
    gpu: &Gpu,
    buffer: vk::CommandBuffer,
    image: vk::Image,
    [old, new]: [vk::ImageLayout; 2],
) {
    let barrier = vk::ImageMemoryBarrier::default()
        .old_layout(old)
        .new_layout(new)
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
        .image(image)
        .subresource_range(all_of(FORMAT));
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    let none = vk::DependencyFlags::empty();
    // SAFETY: the command buffer is being recorded, and the image is the device's.
    unsafe {
        gpu.device
            .cmd_pipeline_barrier(buffer, all, all, none, &[], &[], &[barrier])
    };
}

/// A texture whose texels hold their own coordinates.
pub fn texture(gpu: &Gpu) -> Result<Image> {
    let image = gpu.image(&ImageKind {
        format: FORMAT,
        size: [EDGE, EDGE, 1],
        levels: 1,
        layers: 1,
        view: vk::ImageViewType::TYPE_2D,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    })?;
    let texel = |at: u32| [(at % EDGE) as u8, (at / EDGE) as u8, 128, 255];
    let texels: Vec<u8> = (0..EDGE * EDGE).flat_map(texel).collect();
    let from = gpu.buffer_of(&texels, vk::BufferUsageFlags::TRANSFER_SRC)?;
    let filled = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    let region = vk::BufferImageCopy {
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            layer_count: 1,
            ..Default::default()
        },
        image_extent: vk::Extent3D {
            width: EDGE,
            height: EDGE,
            depth: 1,
        },
        ..Default::default()
    };
    gpu.execute(|device, buffer| {
        change(
            gpu,
            buffer,
            image.handle,
            [vk::ImageLayout::UNDEFINED, filled],
        );
        // SAFETY: the buffer holds all texels.
        unsafe {
            device.cmd_copy_buffer_to_image(buffer, from.handle, image.handle, filled, &[region])
        };
        change(
            gpu,
            buffer,
            image.handle,
            [filled, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL],
        );
    })?;
    Ok(image)
}
