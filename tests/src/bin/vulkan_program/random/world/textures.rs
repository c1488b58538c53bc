//! Textures, their views, and samplers.

use super::{DEPTH, FORMATS, World};
use crate::gpu::{Gpu, Image, ImageKind, Result, all_of, checked};
use crate::random::generator::Generator;
use ash::vk::{self, Handle};

/// A view of one layer of a texture.
#[derive(Clone, Copy)]
pub struct View {
    pub handle: vk::ImageView,
    pub image: vk::Image,
    pub format: usize,
    /// Size of its first level.
    pub size: [u32; 2],
    /// Size of the image, which identifies it.
    pub of: [u32; 2],
    pub levels: u32,
}

pub struct Texture {
    pub image: Image,
    pub format: usize,
    pub size: [u32; 2],
    pub levels: u32,
    pub layers: u32,
    pub views: Vec<View>,
}

impl World {
    /// Creates a texture of a unique size.
    pub fn create_texture(&mut self, random: &mut Generator) -> Result<()> {
        let number = self.created;
        self.created += 1;
        let size = [17 + number % 40, 17 + number / 40 % 40];
        let levels = 1 + random.below(4) as u32;
        let layers = 1 + random.below(3) as u32;
        let format = random.below(FORMATS.len());
        let made = texture(&self.gpu, random, format, size, levels, layers)?;
        self.textures.push(made);
        Ok(())
    }

    /// Number of the next texture.
    pub fn created(&self) -> u32 {
        self.created
    }

    /// Creates a view of a texture.
    pub fn create_view(&mut self, random: &mut Generator) -> Result<()> {
        if self.textures.is_empty() {
            return Ok(());
        }
        let place = random.below(self.textures.len());
        let made = view(&self.gpu, &self.textures[place], random)?;
        self.textures[place].views.push(made);
        Ok(())
    }

    pub fn destroy_view(&mut self, view: View) {
        let gone = self
            .targets
            .iter()
            .filter(|t| t.view.handle == view.handle)
            .count();
        debug_assert!(gone == 0 || view.handle != self.main.views[0].handle);
        while let Some(place) = self
            .targets
            .iter()
            .position(|t| t.view.handle == view.handle)
        {
            let target = self.targets.swap_remove(place);
            self.destroy_target(&target);
        }
        self.forget(view.handle.as_raw());
        self.unwrite(|of, _| of.handle == view.handle);
        // SAFETY: nothing uses the view any more.
        unsafe { self.gpu.device.destroy_image_view(view.handle, None) };
    }

    /// Marks the sets with an object as not written.
    fn unwrite(&mut self, has: impl Fn(&View, vk::Sampler) -> bool) {
        for set in self.pools.iter_mut().flat_map(|pool| &mut pool.sets) {
            set.written = set.written.filter(|(view, sampler)| !has(view, *sampler));
        }
    }

    pub fn destroy_texture(&mut self, place: usize) {
        let texture = self.textures.swap_remove(place);
        self.forget(texture.image.handle.as_raw());
        for view in &texture.views {
            self.destroy_view(*view);
        }
        destroy_image(&self.gpu, texture.image);
    }

    pub fn create_sampler(&mut self, random: &mut Generator) -> Result<()> {
        self.samplers.push(sampler(&self.gpu, random)?);
        Ok(())
    }

    pub fn destroy_sampler(&mut self, place: usize) {
        let sampler = self.samplers.swap_remove(place);
        self.forget(sampler.as_raw());
        self.unwrite(|_, of| of == sampler);
        // SAFETY: nothing uses the sampler any more.
        unsafe { self.gpu.device.destroy_sampler(sampler, None) };
    }
}

pub(super) fn sampler(gpu: &Gpu, random: &mut Generator) -> Result<vk::Sampler> {
    let filters = [vk::Filter::NEAREST, vk::Filter::LINEAR];
    let modes = [
        vk::SamplerAddressMode::REPEAT,
        vk::SamplerAddressMode::CLAMP_TO_EDGE,
        vk::SamplerAddressMode::MIRRORED_REPEAT,
    ];
    let mips = [
        vk::SamplerMipmapMode::NEAREST,
        vk::SamplerMipmapMode::LINEAR,
    ];
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(filters[random.below(2)])
        .min_filter(filters[random.below(2)])
        .mipmap_mode(mips[random.below(2)])
        .address_mode_u(modes[random.below(3)])
        .address_mode_v(modes[random.below(3)])
        .mip_lod_bias(random.unit() - 0.5)
        .max_lod(vk::LOD_CLAMP_NONE);
    // SAFETY: the device is open.
    checked("a sampler", unsafe {
        gpu.device.create_sampler(&info, None)
    })
}

pub(super) fn destroy_image(gpu: &Gpu, image: Image) {
    // SAFETY: nothing uses the image any more.
    unsafe {
        gpu.device.destroy_image_view(image.view, None);
        gpu.device.destroy_image(image.handle, None);
        gpu.device.free_memory(image.memory, None);
    }
}

pub(super) fn to_general(gpu: &Gpu, image: vk::Image, format: vk::Format) -> Result<()> {
    gpu.execute(|device, buffer| {
        let barrier = |old, to| {
            let barrier = vk::ImageMemoryBarrier::default()
                .old_layout(old)
                .new_layout(to)
                .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
                .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .image(image)
                .subresource_range(all_of(format));
            let (all, none) = (
                vk::PipelineStageFlags::ALL_COMMANDS,
                vk::DependencyFlags::empty(),
            );
            // SAFETY: the command buffer is being recorded, and the image is the device's.
            unsafe { device.cmd_pipeline_barrier(buffer, all, all, none, &[], &[], &[barrier]) };
        };
        let general = vk::ImageLayout::GENERAL;
        barrier(vk::ImageLayout::UNDEFINED, general);
        let ranges = [all_of(format)];
        // SAFETY: as above.
        unsafe {
            if format == DEPTH {
                let far = vk::ClearDepthStencilValue {
                    depth: 1.0,
                    stencil: 0,
                };
                device.cmd_clear_depth_stencil_image(buffer, image, general, &far, &ranges);
            } else {
                let color = vk::ClearColorValue {
                    float32: [0.25, 0.5, 0.75, 1.0],
                };
                device.cmd_clear_color_image(buffer, image, general, &color, &ranges);
            }
        }
        barrier(general, general);
    })
}

pub(super) fn texture(
    gpu: &Gpu,
    random: &mut Generator,
    format: usize,
    size: [u32; 2],
    levels: u32,
    layers: u32,
) -> Result<Texture> {
    use vk::ImageUsageFlags as Usage;
    let image = gpu.image(&ImageKind {
        format: FORMATS[format],
        size: [size[0], size[1], 1],
        levels,
        layers,
        view: match layers {
            1 => vk::ImageViewType::TYPE_2D,
            _ => vk::ImageViewType::TYPE_2D_ARRAY,
        },
        usage: Usage::SAMPLED | Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::COLOR_ATTACHMENT,
    })?;
    to_general(gpu, image.handle, FORMATS[format])?;
    // Level 0 of every layer has random texels.
    let texels = size[0] * size[1] * layers;
    let bytes: Vec<u8> = (0..4 * texels).map(|_| random.below(256) as u8).collect();
    let from = gpu.buffer_of(&bytes, vk::BufferUsageFlags::TRANSFER_SRC)?;
    gpu.execute(|device, buffer| {
        let region = vk::BufferImageCopy {
            image_subresource: vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: layers,
            },
            image_extent: vk::Extent3D {
                width: size[0],
                height: size[1],
                depth: 1,
            },
            ..Default::default()
        };
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: the command buffer is being recorded, and the buffer has the texels of all layers.
        unsafe {
            device.cmd_copy_buffer_to_image(buffer, from.handle, image.handle, general, &[region]);
        }
    })?;
    // SAFETY: the copy has ended.
    unsafe {
        gpu.device.destroy_buffer(from.handle, None);
        gpu.device.free_memory(from.memory, None);
    }
    let mut made = Texture {
        image,
        format,
        size,
        levels,
        layers,
        views: Vec::new(),
    };
    let first = view(gpu, &made, random)?;
    made.views.push(first);
    Ok(made)
}

/// Creates a view of a random layer and of one level or all levels.
fn view(gpu: &Gpu, texture: &Texture, random: &mut Generator) -> Result<View> {
    let all = random.once_in(2);
    let level = if all {
        0
    } else {
        random.below(texture.levels as usize) as u32
    };
    let levels = if all { texture.levels } else { 1 };
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: level,
        level_count: if all && random.once_in(2) {
            vk::REMAINING_MIP_LEVELS
        } else {
            levels
        },
        base_array_layer: random.below(texture.layers as usize) as u32,
        layer_count: 1,
    };
    let info = vk::ImageViewCreateInfo::default()
        .image(texture.image.handle)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(FORMATS[texture.format])
        .subresource_range(range);
    // SAFETY: the device is open.
    let made = unsafe { gpu.device.create_image_view(&info, None) };
    Ok(View {
        handle: checked("a view", made)?,
        image: texture.image.handle,
        format: texture.format,
        size: texture.size.map(|side| (side >> level).max(1)),
        of: texture.size,
        levels,
    })
}
