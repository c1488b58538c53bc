//! Vulkan: instances and devices that the runtime makes for programs, and the images of swapchains.

use crate::chain::{input, output, text};
use crate::state::{Answer, Code, DONE, INVALID, State};
use crate::system::check_system;
use ash::vk::{self, Handle};
use libloading::os::unix::Library;
use openxr_sys as xr;
use std::ffi::c_char;
use std::sync::Arc;
use xr::{StructureType, SwapchainUsageFlags};

type Get = vk::PFN_vkGetInstanceProcAddr;

/// What an instance of OpenXR knows of Vulkan.
#[derive(Default)]
pub(crate) struct Vulkan {
    /// Whether the program has asked for the versions that the runtime supports.
    asked: bool,
    /// Function of the program, or of the Vulkan loader.
    get: Option<Get>,
    /// The program's instance of Vulkan, and the device that it has to use.
    instance: vk::Instance,
    physical: vk::PhysicalDevice,
}

/// The Vulkan loader, which stays open.
fn loader() -> Result<Get, Code> {
    // SAFETY: the name determines the function's type.
    unsafe {
        let library = Library::new("libvulkan.so.1").map_err(|_| Code::ERROR_RUNTIME_FAILURE)?;
        let get = library.get::<Get>(b"vkGetInstanceProcAddr\0");
        let get = *get.map_err(|_| Code::ERROR_RUNTIME_FAILURE)?;
        std::mem::forget(library);
        Ok(get)
    }
}

/// The program's function of Vulkan, in the type of ash.
fn get_of(function: Option<xr::platform::VkGetInstanceProcAddr>) -> Result<Get, Code> {
    let function = function.ok_or(INVALID)?;
    // SAFETY: both types are that of vkGetInstanceProcAddr.
    Ok(unsafe { std::mem::transmute::<xr::platform::VkGetInstanceProcAddr, Get>(function) })
}

/// Functions of an instance of Vulkan.
///
/// # Safety
/// A live instance.
unsafe fn functions(get: Get, instance: vk::Instance) -> ash::Instance {
    let entry = ash::StaticFn {
        get_instance_proc_addr: get,
    };
    // SAFETY: as the caller promises.
    unsafe { ash::Instance::load(&entry, instance) }
}

/// The first device, which programs have to use.
///
/// # Safety
/// A live instance.
unsafe fn first_device(get: Get, instance: vk::Instance) -> Result<vk::PhysicalDevice, Code> {
    // SAFETY: as the caller promises.
    let found = unsafe { functions(get, instance).enumerate_physical_devices() };
    let first = found.ok().and_then(|all| all.first().copied());
    first.ok_or(Code::ERROR_RUNTIME_FAILURE)
}

fn instance_of(raw: xr::platform::VkInstance) -> Result<vk::Instance, Code> {
    match raw.is_null() {
        true => Err(INVALID),
        false => Ok(vk::Instance::from_raw(raw as u64)),
    }
}

impl State {
    /// Notes the device that the program has to use, and answers it.
    ///
    /// # Safety
    /// A live instance.
    unsafe fn choose(
        &mut self,
        handle: xr::Instance,
        instance: xr::platform::VkInstance,
        device: *mut xr::platform::VkPhysicalDevice,
    ) -> Answer {
        let vulkan = &mut self.instance(handle)?.vulkan;
        // SAFETY: as the caller promises.
        unsafe {
            let device = device.as_mut().ok_or(INVALID)?;
            let get = match vulkan.get {
                Some(get) => get,
                None => *vulkan.get.insert(loader()?),
            };
            let instance = instance_of(instance)?;
            vulkan.physical = first_device(get, instance)?;
            vulkan.instance = instance;
            *device = vulkan.physical.as_raw() as xr::platform::VkPhysicalDevice;
        }
        DONE
    }
}

api! {
    fn get_requirements(instance: xr::Instance, system: xr::SystemId, of: *mut xr::GraphicsRequirementsVulkanKHR) |state| {
        let instance = state.instance(instance)?;
        check_system(system)?;
        let of = output(of, StructureType::GRAPHICS_REQUIREMENTS_VULKAN_KHR)?;
        of.min_api_version_supported = xr::Version::new(1, 0, 0);
        of.max_api_version_supported = xr::Version::new(1, 3, 0xfff);
        instance.vulkan.asked = true;
        DONE
    }

    fn create_vulkan_instance(
        instance: xr::Instance, info: *const xr::VulkanInstanceCreateInfoKHR, made: *mut xr::platform::VkInstance,
        result: *mut xr::platform::VkResult,
    ) |state| {
        let instance = state.instance(instance)?;
        let info = input(info, StructureType::VULKAN_INSTANCE_CREATE_INFO_KHR)?;
        check_system(info.system_id)?;
        let get = get_of(info.pfn_get_instance_proc_addr)?;
        if info.vulkan_create_info.is_null() || made.is_null() || result.is_null() {
            return Err(INVALID);
        }
        if !instance.vulkan.asked {
            return Err(Code::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
        }
        let create = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()).ok_or(Code::ERROR_RUNTIME_FAILURE)?;
        let create = std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create);
        let mut created = vk::Instance::null();
        *result = create(info.vulkan_create_info.cast(), info.vulkan_allocator.cast(), &mut created).as_raw();
        instance.vulkan.get = Some(get);
        *made = created.as_raw() as xr::platform::VkInstance;
        DONE
    }

    fn get_graphics_device2(
        instance: xr::Instance, info: *const xr::VulkanGraphicsDeviceGetInfoKHR, device: *mut xr::platform::VkPhysicalDevice,
    ) |state| {
        state.instance(instance)?;
        let info = input(info, StructureType::VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR)?;
        check_system(info.system_id)?;
        state.choose(instance, info.vulkan_instance, device)
    }

    fn create_vulkan_device(
        instance: xr::Instance, info: *const xr::VulkanDeviceCreateInfoKHR, made: *mut xr::platform::VkDevice,
        result: *mut xr::platform::VkResult,
    ) |state| {
        let instance = state.instance(instance)?;
        let info = input(info, StructureType::VULKAN_DEVICE_CREATE_INFO_KHR)?;
        check_system(info.system_id)?;
        let get = get_of(info.pfn_get_instance_proc_addr)?;
        let physical = vk::PhysicalDevice::from_raw(info.vulkan_physical_device as u64);
        if info.vulkan_create_info.is_null() || made.is_null() || result.is_null() || physical == vk::PhysicalDevice::null() {
            return Err(INVALID);
        }
        if physical != instance.vulkan.physical {
            return Err(Code::ERROR_HANDLE_INVALID);
        }
        let create = get(instance.vulkan.instance, c"vkCreateDevice".as_ptr()).ok_or(Code::ERROR_RUNTIME_FAILURE)?;
        let create = std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateDevice>(create);
        let mut created = vk::Device::null();
        let code = create(physical, info.vulkan_create_info.cast(), info.vulkan_allocator.cast(), &mut created);
        *result = code.as_raw();
        *made = created.as_raw() as xr::platform::VkDevice;
        DONE
    }

    fn get_graphics_device(
        instance: xr::Instance, system: xr::SystemId, of: xr::platform::VkInstance, device: *mut xr::platform::VkPhysicalDevice,
    ) |state| {
        state.instance(instance)?;
        check_system(system)?;
        state.choose(instance, of, device)
    }

    fn get_instance_extensions(instance: xr::Instance, system: xr::SystemId, capacity: u32, count: *mut u32, buffer: *mut c_char) |state| {
        state.instance(instance)?;
        check_system(system)?;
        text("", capacity, count, buffer)
    }

    fn get_device_extensions(instance: xr::Instance, system: xr::SystemId, capacity: u32, count: *mut u32, buffer: *mut c_char) |state| {
        state.instance(instance)?;
        check_system(system)?;
        text("", capacity, count, buffer)
    }
}

/// Formats of swapchains, the preferred ones first.
const FORMATS: [vk::Format; 9] = [
    vk::Format::R8G8B8A8_SRGB,
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::B8G8R8A8_UNORM,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::D32_SFLOAT,
    vk::Format::D32_SFLOAT_S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D16_UNORM,
];

fn is_depth(format: vk::Format) -> bool {
    FORMATS[5..].contains(&format)
}

/// The program's device.
#[derive(Clone)]
pub(crate) struct Device(Arc<Opened>);

struct Opened {
    device: ash::Device,
    queue: vk::Queue,
    family: u32,
    memory: vk::PhysicalDeviceMemoryProperties,
    formats: Vec<i64>,
}

/// An image of a swapchain.
pub(crate) struct Image {
    device: Device,
    handle: vk::Image,
    memory: vk::DeviceMemory,
}

impl Image {
    /// `VkImage` handle.
    pub fn raw(&self) -> u64 {
        self.handle.as_raw()
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let device = &self.device.0.device;
        // SAFETY: a program keeps its device until it has destroyed its session, and does not use images of a
        // destroyed swapchain. Errors of a lost device have no effect.
        unsafe {
            let _lost = device.queue_wait_idle(self.device.0.queue);
            device.destroy_image(self.handle, None);
            device.free_memory(self.memory, None);
        }
    }
}

impl Device {
    /// The device of a session, after a check.
    ///
    /// # Safety
    /// A binding with live handles.
    pub unsafe fn of_binding(
        vulkan: &Vulkan,
        binding: &xr::GraphicsBindingVulkanKHR,
    ) -> Result<Self, Code> {
        if !vulkan.asked {
            return Err(Code::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
        }
        let wrong = Code::ERROR_GRAPHICS_DEVICE_INVALID;
        let handles = [binding.instance, binding.physical_device, binding.device];
        let physical = vk::PhysicalDevice::from_raw(binding.physical_device as u64);
        if handles.iter().any(|handle| handle.is_null()) || physical != vulkan.physical {
            return Err(wrong);
        }
        let get = vulkan.get.ok_or(wrong)?;
        // SAFETY: as the caller promises.
        unsafe {
            let instance = functions(get, vk::Instance::from_raw(binding.instance as u64));
            let families = instance.get_physical_device_queue_family_properties(physical);
            let family = families
                .get(binding.queue_family_index as usize)
                .ok_or(wrong)?;
            if binding.queue_index >= family.queue_count {
                return Err(wrong);
            }
            let device = vk::Device::from_raw(binding.device as u64);
            let device = ash::Device::load(instance.fp_v1_0(), device);
            let renders = |format: &vk::Format| {
                let of = instance.get_physical_device_format_properties(physical, *format);
                let needed = match is_depth(*format) {
                    true => vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT,
                    false => vk::FormatFeatureFlags::COLOR_ATTACHMENT,
                };
                of.optimal_tiling_features.contains(needed)
            };
            let formats = FORMATS.iter().filter(|format| renders(format));
            Ok(Self(Arc::new(Opened {
                queue: device.get_device_queue(binding.queue_family_index, binding.queue_index),
                family: binding.queue_family_index,
                memory: instance.get_physical_device_memory_properties(physical),
                formats: formats.map(|format| i64::from(format.as_raw())).collect(),
                device,
            })))
        }
    }

    /// `VkDevice` handle.
    pub fn raw(&self) -> u64 {
        self.0.device.handle().as_raw()
    }

    /// Formats of swapchains.
    pub fn formats(&self) -> Vec<i64> {
        self.0.formats.clone()
    }

    /// Creates an image of a swapchain, in the layout in which programs get it.
    pub fn image(&self, info: &xr::SwapchainCreateInfo) -> Result<Image, Code> {
        self.create(info).map_err(|error| match error {
            vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                Code::ERROR_OUT_OF_MEMORY
            }
            _ => Code::ERROR_RUNTIME_FAILURE,
        })
    }

    fn create(&self, info: &xr::SwapchainCreateInfo) -> Result<Image, vk::Result> {
        let format = vk::Format::from_raw(info.format as i32);
        let mut flags = vk::ImageCreateFlags::empty();
        if info.face_count == 6 {
            flags |= vk::ImageCreateFlags::CUBE_COMPATIBLE;
        }
        if (info.usage_flags).contains(SwapchainUsageFlags::MUTABLE_FORMAT) {
            flags |= vk::ImageCreateFlags::MUTABLE_FORMAT;
        }
        let create = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width: info.width,
                height: info.height,
                depth: 1,
            })
            .mip_levels(info.mip_count)
            .array_layers(info.array_size * info.face_count)
            .samples(vk::SampleCountFlags::from_raw(info.sample_count))
            .usage(usage(info.usage_flags, is_depth(format)));
        let Opened { device, .. } = &*self.0;
        // SAFETY: the session's device is open, and the memory is the image's alone.
        unsafe {
            let handle = device.create_image(&create, None)?;
            let needs = device.get_image_memory_requirements(handle);
            let allocate = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(self.memory_type(needs));
            let memory = device.allocate_memory(&allocate, None)?;
            let image = Image {
                device: self.clone(),
                handle,
                memory,
            };
            device.bind_image_memory(handle, memory, 0)?;
            self.to_attachment(handle, is_depth(format))?;
            Ok(image)
        }
    }

    /// The first allowed memory type on the device.
    fn memory_type(&self, needs: vk::MemoryRequirements) -> u32 {
        let kinds = &self.0.memory.memory_types[..self.0.memory.memory_type_count as usize];
        let allowed = |place: &usize| needs.memory_type_bits >> place & 1 == 1;
        let local = |place: &usize| {
            kinds[*place]
                .property_flags
                .contains(vk::MemoryPropertyFlags::DEVICE_LOCAL)
        };
        let mut places = (0..kinds.len()).filter(allowed);
        let first = places.clone().next().unwrap_or(0);
        places.find(local).unwrap_or(first) as u32
    }

    /// Moves a new image into the layout in which programs get images and give them back.
    ///
    /// # Safety
    /// An image of the device that nothing uses.
    unsafe fn to_attachment(&self, image: vk::Image, depth: bool) -> Result<(), vk::Result> {
        let Opened {
            device,
            queue,
            family,
            ..
        } = &*self.0;
        let (layout, aspect_mask) = match depth {
            true => (
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
                vk::ImageAspectFlags::DEPTH,
            ),
            false => (
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                vk::ImageAspectFlags::COLOR,
            ),
        };
        let barrier = vk::ImageMemoryBarrier::default()
            .new_layout(layout)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask,
                base_mip_level: 0,
                level_count: vk::REMAINING_MIP_LEVELS,
                base_array_layer: 0,
                layer_count: vk::REMAINING_ARRAY_LAYERS,
            });
        let (start, end) = (
            vk::PipelineStageFlags::TOP_OF_PIPE,
            vk::PipelineStageFlags::ALL_COMMANDS,
        );
        let none = vk::DependencyFlags::empty();
        // SAFETY: the pool is used here alone, and destroyed after its commands have ended.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(*family);
            let pool = device.create_command_pool(&info, None)?;
            let submit = || {
                let info = vk::CommandBufferAllocateInfo::default()
                    .command_pool(pool)
                    .command_buffer_count(1);
                let buffers = device.allocate_command_buffers(&info)?;
                let once = vk::CommandBufferBeginInfo::default()
                    .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
                device.begin_command_buffer(buffers[0], &once)?;
                device.cmd_pipeline_barrier(buffers[0], start, end, none, &[], &[], &[barrier]);
                device.end_command_buffer(buffers[0])?;
                let infos = [vk::SubmitInfo::default().command_buffers(&buffers)];
                device.queue_submit(*queue, &infos, vk::Fence::null())?;
                device.queue_wait_idle(*queue)
            };
            let submitted = submit();
            device.destroy_command_pool(pool, None);
            submitted
        }
    }
}

/// What an image may be used for. Copies of images, and reads by shaders, are always allowed.
fn usage(flags: SwapchainUsageFlags, depth: bool) -> vk::ImageUsageFlags {
    let mut usage = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::SAMPLED;
    usage |= match depth {
        true => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        false => vk::ImageUsageFlags::COLOR_ATTACHMENT,
    };
    for (asked, of) in [
        (
            SwapchainUsageFlags::UNORDERED_ACCESS,
            vk::ImageUsageFlags::STORAGE,
        ),
        (
            SwapchainUsageFlags::TRANSFER_DST,
            vk::ImageUsageFlags::TRANSFER_DST,
        ),
        (
            SwapchainUsageFlags::INPUT_ATTACHMENT,
            vk::ImageUsageFlags::INPUT_ATTACHMENT,
        ),
    ] {
        if flags.contains(asked) {
            usage |= of;
        }
    }
    usage
}
