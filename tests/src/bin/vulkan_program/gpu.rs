//! A Vulkan device with the functions that the program needs for buffers and images.

use ash::{Device, Entry, Instance, vk};
use std::ffi::CStr;

/// Result with the error as text.
pub type Result<T> = std::result::Result<T, String>;

/// Converts the driver's error to text.
pub fn checked<T>(what: &str, result: ash::prelude::VkResult<T>) -> Result<T> {
    result.map_err(|error| format!("{what}: {error}"))
}

/// An opened device.
pub struct Gpu {
    _entry: Entry,
    pub instance: Instance,
    pub device: Device,
    pub queue: vk::Queue,
    /// Family of the queue.
    pub family: u32,
    memory: vk::PhysicalDeviceMemoryProperties,
}

/// A buffer that the CPU writes and reads.
pub struct Buffer {
    pub handle: vk::Buffer,
    pub memory: vk::DeviceMemory,
    pub bytes: u64,
}

/// An image and a view of the whole image.
#[derive(Clone, Copy)]
pub struct Image {
    pub handle: vk::Image,
    pub view: vk::ImageView,
    pub memory: vk::DeviceMemory,
}

/// Properties of an image.
pub struct ImageKind {
    pub format: vk::Format,
    pub size: [u32; 3],
    pub levels: u32,
    pub layers: u32,
    pub view: vk::ImageViewType,
    pub usage: vk::ImageUsageFlags,
}

impl Gpu {
    /// Opens the first device.
    pub fn open() -> Result<Self> {
        Self::open_with(vk::API_VERSION_1_2, &[], None)
    }

    /// Opens the first device with extensions and features.
    pub fn open_with(
        version: u32,
        extensions: &[&CStr],
        features: Option<&mut vk::PhysicalDeviceFeatures2<'_>>,
    ) -> Result<Self> {
        // SAFETY: the loader is a Vulkan loader; what is created lives until the program ends.
        unsafe {
            let entry = Entry::load().map_err(|e| format!("no Vulkan loader: {e}"))?;
            let application = vk::ApplicationInfo::default().api_version(version);
            // A layer that the program asks for.
            let layer = std::env::var("PROGRAM_LAYER").map(|name| format!("{name}\0"));
            let layers: Vec<_> = layer.iter().map(|name| name.as_ptr().cast()).collect();
            let info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_layer_names(&layers);
            let instance = checked("an instance", entry.create_instance(&info, None))?;
            let devices = checked("devices", instance.enumerate_physical_devices())?;
            let physical = *devices.first().ok_or("no Vulkan device")?;
            let queues = instance.get_physical_device_queue_family_properties(physical);
            let is_graphics =
                |q: &vk::QueueFamilyProperties| q.queue_flags.contains(vk::QueueFlags::GRAPHICS);
            let family = queues
                .iter()
                .position(is_graphics)
                .ok_or("no queue for graphics")?;
            let priorities = [1.0];
            let queue = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(family as u32)
                .queue_priorities(&priorities)];
            let mut multiview = vk::PhysicalDeviceVulkan11Features::default().multiview(true);
            let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
            let mut info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue)
                .enabled_extension_names(&names)
                .push_next(&mut multiview);
            if let Some(features) = features {
                info = info.push_next(features);
            }
            let device = checked("a device", instance.create_device(physical, &info, None))?;
            let queue = device.get_device_queue(family as u32, 0);
            let memory = instance.get_physical_device_memory_properties(physical);
            Ok(Self {
                _entry: entry,
                instance,
                device,
                queue,
                family: family as u32,
                memory,
            })
        }
    }

    /// A device that something else has opened, with one queue of the first family.
    ///
    /// # Safety
    /// A device of the instance.
    #[allow(
        dead_code,
        reason = "only one of the programs that share this file needs it"
    )]
    pub unsafe fn of_device(
        entry: Entry,
        instance: Instance,
        physical: vk::PhysicalDevice,
        device: Device,
    ) -> Self {
        // SAFETY: as the caller promises.
        let (queue, memory) = unsafe {
            let memory = instance.get_physical_device_memory_properties(physical);
            (device.get_device_queue(0, 0), memory)
        };
        Self {
            _entry: entry,
            instance,
            device,
            queue,
            family: 0,
            memory,
        }
    }

    fn allocate(
        &self,
        needs: vk::MemoryRequirements,
        flags: vk::MemoryPropertyFlags,
    ) -> Result<vk::DeviceMemory> {
        let kinds = &self.memory.memory_types[..self.memory.memory_type_count as usize];
        let fits = |(place, kind): &(usize, &vk::MemoryType)| {
            needs.memory_type_bits >> place & 1 == 1 && kind.property_flags.contains(flags)
        };
        let kind = kinds
            .iter()
            .enumerate()
            .find(fits)
            .ok_or("no such memory")?
            .0;
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(kind as u32);
        // SAFETY: the device is open.
        checked("memory", unsafe {
            self.device.allocate_memory(&info, None)
        })
    }

    /// Creates a buffer.
    pub fn buffer(&self, bytes: u64, usage: vk::BufferUsageFlags) -> Result<Buffer> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device is open, and the memory is the buffer's alone.
        unsafe {
            let handle = checked("a buffer", self.device.create_buffer(&info, None))?;
            let flags =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let memory =
                self.allocate(self.device.get_buffer_memory_requirements(handle), flags)?;
            checked(
                "a buffer",
                self.device.bind_buffer_memory(handle, memory, 0),
            )?;
            Ok(Buffer {
                handle,
                memory,
                bytes,
            })
        }
    }

    /// Creates a buffer with this content.
    pub fn buffer_of(&self, content: &[u8], usage: vk::BufferUsageFlags) -> Result<Buffer> {
        let buffer = self.buffer(content.len() as u64, usage)?;
        self.write(&buffer, content)?;
        Ok(buffer)
    }

    /// Writes a buffer from its start.
    pub fn write(&self, buffer: &Buffer, content: &[u8]) -> Result<()> {
        self.mapped(buffer, |bytes| {
            bytes[..content.len()].copy_from_slice(content)
        })
    }

    /// Reads or writes a buffer.
    pub fn mapped<T>(&self, buffer: &Buffer, f: impl FnOnce(&mut [u8]) -> T) -> Result<T> {
        let whole = vk::MemoryMapFlags::empty();
        // SAFETY: the memory is the buffer's, as long as it says, and nothing is being executed.
        unsafe {
            let mapped = self
                .device
                .map_memory(buffer.memory, 0, buffer.bytes, whole);
            let first: *mut u8 = checked("mapped memory", mapped)?.cast();
            let value = f(std::slice::from_raw_parts_mut(first, buffer.bytes as usize));
            self.device.unmap_memory(buffer.memory);
            Ok(value)
        }
    }

    /// Creates an image.
    pub fn image(&self, kind: &ImageKind) -> Result<Image> {
        let [width, height, depth] = kind.size;
        let cube = kind.view == vk::ImageViewType::CUBE;
        let info = vk::ImageCreateInfo::default()
            .flags(match cube {
                true => {
                    vk::ImageCreateFlags::CUBE_COMPATIBLE | vk::ImageCreateFlags::MUTABLE_FORMAT
                }
                false => vk::ImageCreateFlags::empty(),
            })
            .image_type(match kind.view {
                vk::ImageViewType::TYPE_3D => vk::ImageType::TYPE_3D,
                _ => vk::ImageType::TYPE_2D,
            })
            .format(kind.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth,
            })
            .mip_levels(kind.levels)
            .array_layers(kind.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(kind.usage);
        // SAFETY: the device is open, and the memory is the image's alone.
        unsafe {
            let handle = checked("an image", self.device.create_image(&info, None))?;
            let needs = self.device.get_image_memory_requirements(handle);
            let memory = self.allocate(needs, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            checked("an image", self.device.bind_image_memory(handle, memory, 0))?;
            let view = vk::ImageViewCreateInfo::default()
                .image(handle)
                .view_type(kind.view)
                .format(kind.format)
                .subresource_range(all_of(kind.format));
            let view = checked("a view", self.device.create_image_view(&view, None))?;
            Ok(Image {
                handle,
                view,
                memory,
            })
        }
    }

    /// Records commands, executes them and waits.
    pub fn execute(&self, record: impl FnOnce(&Device, vk::CommandBuffer)) -> Result<()> {
        let device = &self.device;
        self.execute_by(record, |buffer| {
            let buffers = [buffer];
            let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
            // SAFETY: the commands are complete.
            unsafe {
                let submitted = device.queue_submit(self.queue, &submit, vk::Fence::null());
                checked("a submission", submitted)?;
                checked("the queue", device.queue_wait_idle(self.queue))
            }
        })
    }

    /// Records commands and executes them by `submit`, which waits for them.
    pub fn execute_by(
        &self,
        record: impl FnOnce(&Device, vk::CommandBuffer),
        submit: impl FnOnce(vk::CommandBuffer) -> Result<()>,
    ) -> Result<()> {
        let device = &self.device;
        // SAFETY: the pool and its buffer are used here alone, and nothing is destroyed before it is done.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default();
            let pool = checked("a command pool", device.create_command_pool(&info, None))?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let buffers = checked("a command buffer", device.allocate_command_buffers(&info))?;
            let begin = vk::CommandBufferBeginInfo::default()
                .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            checked("commands", device.begin_command_buffer(buffers[0], &begin))?;
            record(device, buffers[0]);
            checked("commands", device.end_command_buffer(buffers[0]))?;
            submit(buffers[0])?;
            device.destroy_command_pool(pool, None);
        }
        Ok(())
    }

    /// Ends the use of the device.
    pub fn close(self) {
        // SAFETY: nothing is being executed, and nothing is used afterwards.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// The subresource range of all levels and layers of an image.
pub fn all_of(format: vk::Format) -> vk::ImageSubresourceRange {
    let aspect_mask = match format {
        vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    };
    vk::ImageSubresourceRange {
        aspect_mask,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}
