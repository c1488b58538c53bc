//! Small pictures of the targets of render passes, for the list of passes.
//!
//! Only supported on lavapipe, which executes commands one after the other and ignores image layouts.

use super::device::Device;
use super::next::Next;
use crate::capture::lock;
use ash::vk;
use spool::{PassInfo, ViewInfo};
use std::collections::HashSet;
use std::sync::Mutex;

/// Longest side of a picture.
const SIDE_PX: u32 = 256;

/// The pictures of a device.
#[derive(Default)]
pub(super) struct Pictures {
    made: Mutex<Vec<PassReadback>>,
}

/// The image and the buffer for the picture of a render pass.
struct PassReadback {
    pass: u32,
    size: [u32; 2],
    format: vk::Format,
    image: vk::Image,
    buffer: vk::Buffer,
    memory: Vec<vk::DeviceMemory>,
    /// Address of the buffer's mapped memory.
    address: usize,
}

/// Format and aspect of a picture.
#[derive(Clone, Copy)]
struct PictureKind {
    format: vk::Format,
    aspect: vk::ImageAspectFlags,
}

impl PictureKind {
    /// PictureKind of a colour target's picture: sRGB-encoded unless the target already is. `None` for integer
    /// formats.
    fn color(view: &ViewInfo) -> Option<Self> {
        let name = format!("{:?}", vk::Format::from_raw(view.format));
        if name.contains("INT") {
            return None;
        }
        let is_linear = name.contains("SRGB") || name.contains("FLOAT");
        Some(Self {
            format: if is_linear {
                vk::Format::R8G8B8A8_SRGB
            } else {
                vk::Format::R8G8B8A8_UNORM
            },
            aspect: vk::ImageAspectFlags::COLOR,
        })
    }

    fn depth(view: &ViewInfo) -> Self {
        Self {
            format: vk::Format::from_raw(view.format),
            aspect: vk::ImageAspectFlags::DEPTH,
        }
    }
}

/// Depths as grey, from the nearest in black to the farthest in white.
fn grey(depths: &[f32]) -> Vec<u8> {
    let low = depths.iter().copied().fold(f32::INFINITY, f32::min);
    let high = depths.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = if high > low {
        255.0 / (high - low)
    } else {
        0.0
    };
    let texel = |depth: &f32| {
        let grey = ((depth - low) * scale) as u8;
        [grey, grey, grey, 255]
    };
    depths.iter().flat_map(texel).collect()
}

/// Decodes depths as copied to buffers (Vulkan 1.3, "Copying Data Between Buffers and Images").
fn depths(format: vk::Format, bytes: &[u8]) -> Vec<f32> {
    let words = || {
        bytes
            .chunks_exact(4)
            .filter_map(|w| Some(u32::from_ne_bytes(w.try_into().ok()?)))
    };
    match format {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => (bytes.chunks_exact(2))
            .map(|b| f32::from(u16::from_ne_bytes([b[0], b[1]])))
            .collect(),
        vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D24_UNORM_S8_UINT => {
            words().map(|word| (word & 0xff_ffff) as f32).collect()
        }
        _ => words().map(f32::from_bits).collect(),
    }
}

impl Pictures {
    /// Records commands that copy the target of a render pass.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside a render pass.
    pub unsafe fn take(&self, device: &Device, buffer: vk::CommandBuffer, pass: &PassInfo) {
        let (view, kind) = match (pass.colors.first(), &pass.depth) {
            (Some(color), _) => (color, PictureKind::color(color)),
            (None, Some(depth)) => (depth, Some(PictureKind::depth(depth))),
            (None, None) => return,
        };
        let (Some(kind), tracker) = (kind, device.tracker()) else {
            return;
        };
        let image = tracker.images.numbered(view.image).cloned();
        let (Some(info), Some(from)) = (image, tracker.images.handle(view.image)) else {
            return;
        };
        drop(tracker);
        if info.samples > 1 || info.size[2] > 1 {
            return;
        }
        let full = [0, 1].map(|axis| (info.size[axis] >> view.levels[0]).max(1));
        let longest = full[0].max(full[1]);
        let side = |length: u32| match longest > SIDE_PX {
            true => (length * SIDE_PX / longest).max(1),
            false => length,
        };
        let size = full.map(side);
        // SAFETY: as the caller promises.
        unsafe {
            let Some(picture) = PassReadback::new(device, pass.pass, size, kind) else {
                return;
            };
            picture.record(device, buffer, from, view, full, kind.aspect);
            lock(&self.made).push(picture);
        }
    }

    /// Writes the pictures of render passes.
    ///
    /// # Safety
    /// The passes have been executed.
    pub unsafe fn write(&self, device: &Device, passes: &HashSet<u32>) {
        let made = lock(&self.made);
        for picture in made.iter().filter(|picture| passes.contains(&picture.pass)) {
            // SAFETY: the buffer is mapped as long as the picture is kept.
            let bytes = unsafe {
                std::slice::from_raw_parts(picture.address as *const u8, picture.bytes() as usize)
            };
            let is_depth = picture.format != vk::Format::R8G8B8A8_UNORM
                && picture.format != vk::Format::R8G8B8A8_SRGB;
            let texels = match is_depth {
                true => grey(&depths(picture.format, bytes)),
                false => bytes.to_vec(),
            };
            let texels = texels.get(..(4 * picture.size[0] * picture.size[1]) as usize);
            let texels = texels.unwrap_or_default();
            device
                .capture
                .write(|w| w.picture(picture.pass, picture.size, texels));
        }
    }

    /// Destroys the pictures with their device.
    ///
    /// # Safety
    /// No commands are being executed.
    pub unsafe fn destroy(&self, handle: vk::Device, next: &Next) {
        for picture in lock(&self.made).drain(..) {
            // SAFETY: as the caller promises.
            unsafe { picture.destroy(handle, next) };
        }
    }
}

impl PassReadback {
    /// Creates the image and the buffer; `None` if the driver refuses.
    ///
    /// # Safety
    /// The device is open.
    unsafe fn new(device: &Device, pass: u32, size: [u32; 2], kind: PictureKind) -> Option<Self> {
        let (handle, next) = (device.handle, &device.next);
        let mut picture = Self {
            pass,
            size,
            format: kind.format,
            image: vk::Image::null(),
            buffer: vk::Buffer::null(),
            memory: Vec::new(),
            address: 0,
        };
        let [width, height] = size;
        let image = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(kind.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
        let buffer = vk::BufferCreateInfo::default()
            .size(picture.bytes())
            .usage(vk::BufferUsageFlags::TRANSFER_DST);
        // SAFETY: as the caller promises. After an error, the created objects are destroyed.
        unsafe {
            let none = std::ptr::null();
            let success = vk::Result::SUCCESS;
            let made = (next.create_image)(handle, &image, none, &mut picture.image) == success
                && (next.create_buffer)(handle, &buffer, none, &mut picture.buffer) == success
                && picture.bind(device);
            if !made {
                picture.destroy(handle, next);
                return None;
            }
        }
        Some(picture)
    }

    /// Allocates and binds memory of the image and the buffer; returns false if the driver refuses.
    ///
    /// # Safety
    /// Both were just created.
    unsafe fn bind(&mut self, device: &Device) -> bool {
        let (handle, next) = (device.handle, &device.next);
        let success = vk::Result::SUCCESS;
        let mut needs = [vk::MemoryRequirements::default(); 2];
        // SAFETY: as the caller promises.
        unsafe {
            (next.image_requirements)(handle, self.image, &mut needs[0]);
            (next.buffer_requirements)(handle, self.buffer, &mut needs[1]);
            for of in needs {
                // Lavapipe has a single memory type, which is host memory.
                let info = vk::MemoryAllocateInfo::default()
                    .allocation_size(of.size)
                    .memory_type_index(of.memory_type_bits.trailing_zeros());
                let mut memory = vk::DeviceMemory::null();
                let none = std::ptr::null();
                if (next.allocate_memory)(handle, &info, none, &mut memory) != success {
                    return false;
                }
                self.memory.push(memory);
            }
            let mut address = std::ptr::null_mut();
            let (memory, all) = (self.memory[1], vk::WHOLE_SIZE);
            let flags = vk::MemoryMapFlags::empty();
            let bound = (next.bind_image_memory)(handle, self.image, self.memory[0], 0) == success
                && (next.bind_buffer_memory)(handle, self.buffer, memory, 0) == success
                && (next.map_memory)(handle, memory, 0, all, flags, &mut address) == success;
            self.address = address as usize;
            bound
        }
    }

    /// Size of the buffer. A texel of a picture has at most four bytes.
    fn bytes(&self) -> u64 {
        4 * u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Records commands that scale the target down and copy it.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside a render pass.
    unsafe fn record(
        &self,
        device: &Device,
        buffer: vk::CommandBuffer,
        from: vk::Image,
        view: &ViewInfo,
        full: [u32; 2],
        aspect: vk::ImageAspectFlags,
    ) {
        let next = &device.next;
        let corner = |[x, y]: [u32; 2]| vk::Offset3D {
            x: x as i32,
            y: y as i32,
            z: 1,
        };
        let zero = vk::Offset3D::default();
        let layers = |level, layer| vk::ImageSubresourceLayers {
            aspect_mask: aspect,
            mip_level: level,
            base_array_layer: layer,
            layer_count: 1,
        };
        let blit = vk::ImageBlit {
            src_subresource: layers(view.levels[0], view.layers[0]),
            src_offsets: [zero, corner(full)],
            dst_subresource: layers(0, 0),
            dst_offsets: [zero, corner(self.size)],
        };
        let copy = vk::BufferImageCopy {
            image_subresource: layers(0, 0),
            image_extent: vk::Extent3D {
                width: self.size[0],
                height: self.size[1],
                depth: 1,
            },
            ..Default::default()
        };
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: as the caller promises.
        unsafe {
            let nearest = vk::Filter::NEAREST;
            self.wait(buffer, next);
            (next.cmd_blit_image)(
                buffer, from, general, self.image, general, 1, &blit, nearest,
            );
            self.wait(buffer, next);
            let to = self.buffer;
            (next.cmd_copy_image_to_buffer)(buffer, self.image, general, to, 1, &copy);
        }
    }

    /// Records a barrier between all commands before it and all after it.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside a render pass.
    unsafe fn wait(&self, buffer: vk::CommandBuffer, next: &Next) {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let memory = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE);
        let flags = vk::DependencyFlags::empty();
        let (none, no) = (std::ptr::null(), std::ptr::null());
        // SAFETY: as the caller promises.
        unsafe {
            (next.cmd_pipeline_barrier)(buffer, all, all, flags, 1, &memory, 0, none, 0, no);
        }
    }

    /// # Safety
    /// No commands that use the picture are being executed.
    unsafe fn destroy(&self, handle: vk::Device, next: &Next) {
        // SAFETY: as the caller promises; null handles are ignored.
        unsafe {
            (next.destroy_image)(handle, self.image, std::ptr::null());
            (next.destroy_buffer)(handle, self.buffer, std::ptr::null());
            for memory in &self.memory {
                (next.free_memory)(handle, *memory, std::ptr::null());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_become_grey_from_the_nearest_to_the_farthest() {
        let words = [0xff00_0000_u32, 0x0080_0000, 0x00ff_ffff];
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_ne_bytes()).collect();
        let of_24_bits = depths(vk::Format::D24_UNORM_S8_UINT, &bytes);
        assert_eq!(of_24_bits, [0.0, 8_388_608.0, 16_777_215.0]);
        assert_eq!(
            grey(&of_24_bits),
            [0, 0, 0, 255, 127, 127, 127, 255, 255, 255, 255, 255]
        );
        let floats: Vec<u8> = [0.5_f32, 1.0]
            .iter()
            .flat_map(|f| f.to_ne_bytes())
            .collect();
        assert_eq!(depths(vk::Format::D32_SFLOAT, &floats), [0.5, 1.0]);
        assert_eq!(grey(&[1.0, 1.0]), [0, 0, 0, 255, 0, 0, 0, 255]);
    }
}
