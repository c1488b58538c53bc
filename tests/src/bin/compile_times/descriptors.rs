//! Descriptor sets that fit a fragment shader.

use crate::gpu::{self, Gpu, Result, checked};
use crate::reflect::{Descriptor, Fragment, ImageKind, Kind, Numbers};
use ash::vk;
use rspirv::spirv::Dim;

const BUFFER_BYTES: u64 = 1 << 16;

/// Layouts and sets.
pub struct Sets {
    pub layouts: Vec<vk::DescriptorSetLayout>,
    pub sets: Vec<vk::DescriptorSet>,
}

impl Sets {
    /// Makes sets whose descriptors refer to images and buffers of the right kind.
    pub fn new(gpu: &Gpu, of: &Fragment) -> Result<Self> {
        let all = of.descriptors()?;
        let count = all.iter().map(|d| d.set + 1).max().unwrap_or(0);
        let device = &gpu.device;
        // SAFETY: the device is open; what is created lives until the program ends.
        unsafe {
            let mut layouts = Vec::new();
            for set in 0..count {
                let of_set = all.iter().filter(|d| d.set == set);
                let bindings: Vec<_> = of_set
                    .map(|d| {
                        vk::DescriptorSetLayoutBinding::default()
                            .binding(d.binding)
                            .descriptor_type(kind(d))
                            .descriptor_count(d.count)
                            .stage_flags(vk::ShaderStageFlags::FRAGMENT)
                    })
                    .collect();
                let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
                layouts.push(checked(
                    "a layout",
                    device.create_descriptor_set_layout(&info, None),
                )?);
            }
            if layouts.is_empty() {
                return Ok(Self {
                    layouts,
                    sets: Vec::new(),
                });
            }
            let sizes: Vec<_> = all
                .iter()
                .map(|d| vk::DescriptorPoolSize {
                    ty: kind(d),
                    descriptor_count: d.count,
                })
                .collect();
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(count)
                .pool_sizes(&sizes);
            let pool = checked("a pool", device.create_descriptor_pool(&info, None))?;
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            let sets = checked("sets", device.allocate_descriptor_sets(&info))?;
            for descriptor in &all {
                write(gpu, sets[descriptor.set as usize], descriptor)?;
            }
            Ok(Self { layouts, sets })
        }
    }
}

fn kind(of: &Descriptor) -> vk::DescriptorType {
    use vk::DescriptorType as T;
    match &of.kind {
        Kind::Image(image) => match (image.dim, image.with_sampler, image.sampled) {
            (Dim::DimBuffer, _, true) => T::UNIFORM_TEXEL_BUFFER,
            (Dim::DimBuffer, _, false) => T::STORAGE_TEXEL_BUFFER,
            (Dim::DimSubpassData, ..) => T::INPUT_ATTACHMENT,
            (_, true, _) => T::COMBINED_IMAGE_SAMPLER,
            (_, _, true) => T::SAMPLED_IMAGE,
            _ => T::STORAGE_IMAGE,
        },
        Kind::Sampler => T::SAMPLER,
        Kind::Uniform => T::UNIFORM_BUFFER,
        Kind::Storage => T::STORAGE_BUFFER,
    }
}

fn write(gpu: &Gpu, set: vk::DescriptorSet, descriptor: &Descriptor) -> Result<()> {
    let device = &gpu.device;
    let count = descriptor.count as usize;
    let to = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .dst_binding(descriptor.binding)
        .descriptor_type(kind(descriptor));
    // SAFETY: the device is open; what is created lives until the program ends.
    unsafe {
        match &descriptor.kind {
            Kind::Image(image) if image.dim == Dim::DimBuffer => {
                let info = vk::BufferViewCreateInfo::default()
                    .buffer(buffer(gpu)?)
                    .format(format(image))
                    .range(vk::WHOLE_SIZE);
                let view = checked("a view", device.create_buffer_view(&info, None))?;
                device.update_descriptor_sets(&[to.texel_buffer_view(&vec![view; count])], &[]);
            }
            Kind::Image(image) => {
                let info = vk::DescriptorImageInfo::default()
                    .sampler(sampler(gpu, image.depth)?)
                    .image_view(view(gpu, image)?)
                    .image_layout(vk::ImageLayout::GENERAL);
                device.update_descriptor_sets(&[to.image_info(&vec![info; count])], &[]);
            }
            Kind::Sampler => {
                let info = vk::DescriptorImageInfo::default().sampler(sampler(gpu, false)?);
                device.update_descriptor_sets(&[to.image_info(&vec![info; count])], &[]);
            }
            Kind::Uniform | Kind::Storage => {
                let info = vk::DescriptorBufferInfo::default()
                    .buffer(buffer(gpu)?)
                    .range(vk::WHOLE_SIZE);
                device.update_descriptor_sets(&[to.buffer_info(&vec![info; count])], &[]);
            }
        }
    }
    Ok(())
}

fn buffer(gpu: &Gpu) -> Result<vk::Buffer> {
    use vk::BufferUsageFlags as Usage;
    let texels = Usage::UNIFORM_TEXEL_BUFFER | Usage::STORAGE_TEXEL_BUFFER;
    let usage = Usage::UNIFORM_BUFFER | Usage::STORAGE_BUFFER | texels;
    Ok(gpu.buffer(BUFFER_BYTES, usage)?.handle)
}

/// A trilinear sampler, which compares if `compares`.
fn sampler(gpu: &Gpu, compares: bool) -> Result<vk::Sampler> {
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
        .max_lod(vk::LOD_CLAMP_NONE)
        .compare_enable(compares)
        .compare_op(vk::CompareOp::LESS);
    // SAFETY: the device is open.
    checked("a sampler", unsafe {
        gpu.device.create_sampler(&info, None)
    })
}

fn format(of: &ImageKind) -> vk::Format {
    match (of.depth, of.sampled, of.numbers) {
        (true, ..) => vk::Format::D32_SFLOAT,
        (_, _, Numbers::Float) => vk::Format::R8G8B8A8_UNORM,
        (_, true, Numbers::Signed) => vk::Format::R8G8B8A8_SINT,
        (_, true, Numbers::Unsigned) => vk::Format::R8G8B8A8_UINT,
        (_, false, Numbers::Signed) => vk::Format::R32_SINT,
        (_, false, Numbers::Unsigned) => vk::Format::R32_UINT,
    }
}

fn view(gpu: &Gpu, of: &ImageKind) -> Result<vk::ImageView> {
    use vk::ImageViewType as View;
    if of.multisampled {
        return Err("a multisampled image".to_owned());
    }
    let (view, layers) = match (of.dim, of.arrayed) {
        (Dim::Dim2D | Dim::DimRect | Dim::DimSubpassData, false) => (View::TYPE_2D, 1),
        (Dim::Dim2D, true) => (View::TYPE_2D_ARRAY, 4),
        (Dim::DimCube, false) => (View::CUBE, 6),
        (Dim::Dim3D, _) => (View::TYPE_3D, 1),
        (other, _) => return Err(format!("an image of {other:?}")),
    };
    let usage = match (of.dim, of.sampled) {
        (Dim::DimSubpassData, _) => {
            vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::COLOR_ATTACHMENT
        }
        (_, true) => vk::ImageUsageFlags::SAMPLED,
        _ => vk::ImageUsageFlags::STORAGE,
    };
    let made = gpu.image(&gpu::ImageKind {
        format: format(of),
        size: [32, 32, if view == View::TYPE_3D { 32 } else { 1 }],
        levels: 4,
        layers,
        view,
        usage,
    });
    Ok(made?.view)
}
