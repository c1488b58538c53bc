//! Descriptor sets, and the textures in them.

use crate::gpu::{Buffer, Gpu, Image, ImageKind, Result, all_of, checked};
use crate::targets::COLOR;
use crate::textures::{EDGE, LAYERS, LEVELS, texels};
use ash::vk;

/// Size of the push constants: the eye's number and a scale.
pub const CONSTANT_BYTES: u32 = 8;

/// Descriptor sets and the layout of all pipelines.
pub struct Sets {
    pub layout: vk::PipelineLayout,
    pub sets: [vk::DescriptorSet; 2],
}

const IMAGE: vk::DescriptorType = vk::DescriptorType::SAMPLED_IMAGE;
const SAMPLER: vk::DescriptorType = vk::DescriptorType::SAMPLER;
const UNIFORM: vk::DescriptorType = vk::DescriptorType::UNIFORM_BUFFER;

/// Bindings of the second set; see `shaders`.
const TEXTURES: [vk::DescriptorType; 8] =
    [IMAGE, SAMPLER, IMAGE, IMAGE, IMAGE, IMAGE, SAMPLER, SAMPLER];

impl Sets {
    pub fn new(gpu: &Gpu, eyes: &Buffer) -> Result<Self> {
        let device = &gpu.device;
        // SAFETY: the device is open; handles live as long as it.
        unsafe {
            let layouts = set_layouts(gpu)?;
            let range = [vk::PushConstantRange {
                stage_flags: vk::ShaderStageFlags::VERTEX,
                offset: 0,
                size: CONSTANT_BYTES,
            }];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&layouts)
                .push_constant_ranges(&range);
            let layout = checked(
                "a pipeline layout",
                device.create_pipeline_layout(&info, None),
            )?;
            let size = |ty, descriptor_count| vk::DescriptorPoolSize {
                ty,
                descriptor_count,
            };
            let sizes = [size(UNIFORM, 1), size(IMAGE, 8), size(SAMPLER, 8)];
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(2)
                .pool_sizes(&sizes);
            let pool = checked(
                "a descriptor pool",
                device.create_descriptor_pool(&info, None),
            )?;
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            let sets = checked("descriptor sets", device.allocate_descriptor_sets(&info))?;
            let sets = [sets[0], sets[1]];
            write(gpu, sets, eyes)?;
            Ok(Self { layout, sets })
        }
    }
}

fn set_layouts(gpu: &Gpu) -> Result<[vk::DescriptorSetLayout; 2]> {
    let binding = |binding, kind, stage| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(binding)
            .descriptor_type(kind)
            .descriptor_count(1)
            .stage_flags(stage)
    };
    let uniform = vec![binding(0, UNIFORM, vk::ShaderStageFlags::VERTEX)];
    let all = vk::ShaderStageFlags::ALL;
    let textures: Vec<_> = (0..)
        .zip(TEXTURES)
        .map(|(b, kind)| binding(b, kind, all))
        .collect();
    let make = |bindings: &[vk::DescriptorSetLayoutBinding<'_>]| {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
        // SAFETY: the device is open.
        let made = unsafe { gpu.device.create_descriptor_set_layout(&info, None) };
        checked("a set layout", made)
    };
    Ok([make(&uniform)?, make(&textures)?])
}

fn write(gpu: &Gpu, sets: [vk::DescriptorSet; 2], eyes: &Buffer) -> Result<()> {
    let device = &gpu.device;
    let buffer = [vk::DescriptorBufferInfo {
        buffer: eyes.handle,
        offset: 0,
        range: vk::WHOLE_SIZE,
    }];
    let [flat, other, layered, sky, volume] = images(gpu)?.map(|image| {
        vk::DescriptorImageInfo::default()
            .image_view(image.view)
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
    });
    let sampler = |mode, filter| {
        let info = vk::SamplerCreateInfo::default()
            .address_mode_u(mode)
            .address_mode_v(mode)
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(vk::SamplerMipmapMode::NEAREST)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the device is open.
        let sampler = checked("a sampler", unsafe { device.create_sampler(&info, None) })?;
        Ok::<_, String>(vk::DescriptorImageInfo::default().sampler(sampler))
    };
    use vk::{Filter, SamplerAddressMode as Mode};
    let nearest = sampler(Mode::REPEAT, Filter::NEAREST)?;
    let bordered = sampler(Mode::CLAMP_TO_BORDER, Filter::NEAREST)?;
    let linear = sampler(Mode::REPEAT, Filter::LINEAR)?;
    let infos = [flat, nearest, other, layered, sky, volume, bordered, linear];
    let mut writes = vec![
        vk::WriteDescriptorSet::default()
            .dst_set(sets[0])
            .descriptor_type(UNIFORM)
            .buffer_info(&buffer),
    ];
    for ((binding, kind), info) in (0..).zip(TEXTURES).zip(infos.chunks(1)) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(sets[1])
            .dst_binding(binding)
            .descriptor_type(kind)
            .image_info(info);
        writes.push(write);
    }
    // SAFETY: the sets are not in use.
    unsafe { device.update_descriptor_sets(&writes, &[]) };
    Ok(())
}

/// Creates the textures: two flat ones, an array, a cube and a volume.
fn images(gpu: &Gpu) -> Result<[Image; 5]> {
    let kind = |view, layers, depth, levels| ImageKind {
        format: COLOR,
        size: [EDGE, EDGE, depth],
        levels,
        layers,
        view,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    };
    use vk::ImageViewType as View;
    let flat = kind(View::TYPE_2D, 1, 1, LEVELS);
    let layered = kind(View::TYPE_2D_ARRAY, LAYERS, 1, LEVELS);
    let sky = kind(View::CUBE, 6, 1, LEVELS);
    let volume = kind(View::TYPE_3D, 1, 4, 1);
    let made = [&flat, &flat, &layered, &sky, &volume].map(|kind| upload(gpu, kind));
    let made: Vec<Image> = made.into_iter().collect::<Result<_>>()?;
    made.try_into().map_err(|_| "five images".to_owned())
}

/// Creates a texture with texels that hold their own coordinates.
pub fn upload(gpu: &Gpu, kind: &ImageKind) -> Result<Image> {
    let image = gpu.image(kind)?;
    let mut bytes = Vec::new();
    let mut regions = Vec::new();
    for layer in 0..kind.layers {
        for level in 0..kind.levels {
            let edge = (EDGE >> level).max(1);
            regions.push(vk::BufferImageCopy {
                buffer_offset: bytes.len() as u64,
                image_subresource: vk::ImageSubresourceLayers {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    mip_level: level,
                    base_array_layer: layer,
                    layer_count: 1,
                },
                image_extent: vk::Extent3D {
                    width: edge,
                    height: edge,
                    depth: kind.size[2],
                },
                ..Default::default()
            });
            for slice in 0..kind.size[2] {
                bytes.extend(texels(level, layer + slice));
            }
        }
    }
    let from = gpu.buffer_of(&bytes, vk::BufferUsageFlags::TRANSFER_SRC)?;
    gpu.execute(|device, buffer| {
        let barrier = |old, new, before, after| {
            let barrier = vk::ImageMemoryBarrier::default()
                .old_layout(old)
                .new_layout(new)
                .src_access_mask(before)
                .dst_access_mask(after)
                .image(image.handle)
                .subresource_range(all_of(kind.format));
            let all = vk::PipelineStageFlags::ALL_COMMANDS;
            let none = vk::DependencyFlags::empty();
            // SAFETY: the command buffer is being recorded, and the image is the device's.
            unsafe { device.cmd_pipeline_barrier(buffer, all, all, none, &[], &[], &[barrier]) };
        };
        let (none, write) = (vk::AccessFlags::empty(), vk::AccessFlags::TRANSFER_WRITE);
        let filled = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        barrier(vk::ImageLayout::UNDEFINED, filled, none, write);
        // SAFETY: as above, and the buffer holds the data of all regions.
        unsafe {
            device.cmd_copy_buffer_to_image(buffer, from.handle, image.handle, filled, &regions);
        }
        let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        barrier(filled, read, write, vk::AccessFlags::SHADER_READ);
    })?;
    Ok(image)
}
