//! Hooks of instances and physical devices.

use super::api::{InstanceLink, take_link};
use super::dispatch_key;
use crate::capture::{capture, lock};
use ash::vk;
use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::sync::{Arc, LazyLock, Mutex};

/// The next layer's functions for an instance. They are looked up when the instance is created, because the
/// loader returns this layer's own functions later.
pub(super) struct Instance {
    pub handle: vk::Instance,
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    destroy: vk::PFN_vkDestroyInstance,
    extensions: vk::PFN_vkEnumerateDeviceExtensionProperties,
    properties: vk::PFN_vkGetPhysicalDeviceProperties,
    properties2: Option<vk::PFN_vkGetPhysicalDeviceProperties2>,
    /// Whether the caller implements OpenGL on Vulkan.
    pub opengl: bool,
}

/// Engine names of the implementations of OpenGL on Vulkan.
const OPENGL_ENGINES: [&CStr; 2] = [c"mesa zink", c"ANGLE"];

static INSTANCES: LazyLock<Mutex<HashMap<usize, Arc<Instance>>>> = LazyLock::new(Mutex::default);

/// Extensions with objects that the layer does not track. They are hidden from programs.
const HIDDEN: [&CStr; 9] = [
    c"VK_EXT_shader_object",
    c"VK_EXT_descriptor_buffer",
    c"VK_EXT_mutable_descriptor_type",
    c"VK_VALVE_mutable_descriptor_type",
    c"VK_EXT_mesh_shader",
    c"VK_KHR_maintenance6",
    c"VK_NV_device_generated_commands",
    c"VK_EXT_device_generated_commands",
    c"VK_EXT_attachment_feedback_loop_dynamic_state",
];

/// Newest Vulkan version whose functions are tracked.
const NEWEST: u32 = vk::API_VERSION_1_3;

/// Oldest Vulkan version with the functions that the capture calls.
const NEEDED: u32 = vk::API_VERSION_1_2;

/// Size of push constants that Vulkan guarantees, in bytes.
const LEAST_PUSH_CONSTANTS: u32 = 128;
/// Size of push constants that lavapipe stores, whatever limit it reports, in bytes.
const STORED_PUSH_CONSTANTS: u32 = 512;

impl Instance {
    /// The instance of a handle, which is an instance or one of its physical devices.
    ///
    /// # Safety
    /// A valid dispatchable handle.
    pub unsafe fn of<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: as the caller promises.
        let key = unsafe { dispatch_key(handle) };
        lock(&INSTANCES).get(&key).cloned()
    }

    /// Unchanged properties of a device.
    ///
    /// # Safety
    /// A device of this instance.
    pub unsafe fn real_properties(
        &self,
        device: vk::PhysicalDevice,
    ) -> vk::PhysicalDeviceProperties {
        let mut properties = vk::PhysicalDeviceProperties::default();
        // SAFETY: as the caller promises.
        unsafe { (self.properties)(device, &mut properties) };
        properties
    }

    /// Properties of subgroups and of the driver.
    ///
    /// # Safety
    /// A device of this instance.
    pub unsafe fn details(
        &self,
        device: vk::PhysicalDevice,
    ) -> (
        vk::PhysicalDeviceSubgroupProperties<'static>,
        vk::PhysicalDeviceDriverProperties<'static>,
    ) {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut subgroups = vk::PhysicalDeviceSubgroupProperties {
            p_next: (&raw mut driver).cast(),
            ..Default::default()
        };
        let mut all = vk::PhysicalDeviceProperties2 {
            p_next: (&raw mut subgroups).cast(),
            ..Default::default()
        };
        if let Some(properties2) = self.properties2 {
            // SAFETY: as the caller promises; the chain lives until the end of the call.
            unsafe { properties2(device, &mut all) };
        }
        subgroups.p_next = std::ptr::null_mut();
        (subgroups, driver)
    }
}

/// Offset of the draw's number in the push constants of a device.
///
/// It is never within the size that Vulkan guarantees, because some programs use all of it. Lavapipe before
/// Mesa 23 reports only that size, but all versions store [`STORED_PUSH_CONSTANTS`] bytes.
pub(super) fn draw_number_offset(real_limit: u32) -> u32 {
    real_limit.clamp(2 * LEAST_PUSH_CONSTANTS, STORED_PUSH_CONSTANTS) - 4
}

/// Limit of push constants that is reported to programs.
fn visible_limit(real_limit: u32) -> u32 {
    draw_number_offset(real_limit).min(real_limit)
}

pub(super) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateInstance by the loader, whose chain has this layer's link.
    unsafe {
        let Some(link) = take_link::<InstanceLink>((*info).p_next) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let get = link.get_instance_proc_addr;
        let Some(create) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create =
            std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create);
        // If the program requests an early version, functions that the capture calls would be unavailable.
        let mut application = (*info)
            .p_application_info
            .as_ref()
            .copied()
            .unwrap_or_default();
        let engine = application.engine_name_as_c_str();
        let opengl = engine.is_some_and(|name| OPENGL_ENGINES.contains(&name));
        application.api_version = application.api_version.max(NEEDED);
        let mut asked = *info;
        if capture().is_some() {
            asked.p_application_info = &application;
        }
        let result = create(&asked, allocator, instance);
        if let Some(capture) = capture() {
            capture.note_use();
        }
        if result == vk::Result::SUCCESS {
            let handle = *instance;
            let named = |name: &CStr| get(handle, name.as_ptr());
            macro_rules! function {
                ($name:literal, $kind:ident) => {
                    named($name).map(|found| {
                        std::mem::transmute::<unsafe extern "system" fn(), vk::$kind>(found)
                    })
                };
            }
            let (Some(destroy), Some(extensions), Some(properties)) = (
                function!(c"vkDestroyInstance", PFN_vkDestroyInstance),
                function!(
                    c"vkEnumerateDeviceExtensionProperties",
                    PFN_vkEnumerateDeviceExtensionProperties
                ),
                function!(
                    c"vkGetPhysicalDeviceProperties",
                    PFN_vkGetPhysicalDeviceProperties
                ),
            ) else {
                return vk::Result::ERROR_INITIALIZATION_FAILED;
            };
            let new = Instance {
                handle,
                get_instance_proc_addr: get,
                destroy,
                extensions,
                properties,
                properties2: function!(
                    c"vkGetPhysicalDeviceProperties2",
                    PFN_vkGetPhysicalDeviceProperties2
                ),
                opengl,
            };
            lock(&INSTANCES).insert(dispatch_key(handle), Arc::new(new));
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_instance(
    instance: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if instance == vk::Instance::null() {
        return;
    }
    // SAFETY: a valid call of vkDestroyInstance.
    unsafe {
        let removed = lock(&INSTANCES).remove(&dispatch_key(instance));
        if let Some(known) = removed {
            (known.destroy)(instance, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn enumerate_device_extension_properties(
    device: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    properties: *mut vk::ExtensionProperties,
) -> vk::Result {
    // SAFETY: a valid call of vkEnumerateDeviceExtensionProperties.
    unsafe {
        let Some(instance) = Instance::of(device) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let next = instance.extensions;
        if !layer.is_null() {
            return next(device, layer, count, properties);
        }
        let mut there = 0;
        let result = next(device, layer, &mut there, std::ptr::null_mut());
        if result != vk::Result::SUCCESS {
            return result;
        }
        let mut all = vec![vk::ExtensionProperties::default(); there as usize];
        let result = next(device, layer, &mut there, all.as_mut_ptr());
        if result != vk::Result::SUCCESS && result != vk::Result::INCOMPLETE {
            return result;
        }
        all.truncate(there as usize);
        all.retain(|extension| {
            let name = extension.extension_name_as_c_str().unwrap_or_default();
            !HIDDEN.contains(&name)
        });
        if properties.is_null() {
            *count = all.len() as u32;
            return vk::Result::SUCCESS;
        }
        let fitting = all.len().min(*count as usize);
        std::ptr::copy_nonoverlapping(all.as_ptr(), properties, fitting);
        *count = fitting as u32;
        if fitting < all.len() {
            vk::Result::INCOMPLETE
        } else {
            vk::Result::SUCCESS
        }
    }
}

fn hide(properties: &mut vk::PhysicalDeviceProperties) {
    properties.api_version = properties.api_version.min(NEWEST | 0xfff);
    let limit = &mut properties.limits.max_push_constants_size;
    *limit = visible_limit(*limit);
}

pub(super) unsafe extern "system" fn get_physical_device_properties(
    device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceProperties,
) {
    // SAFETY: a valid call of vkGetPhysicalDeviceProperties.
    unsafe {
        if let Some(instance) = Instance::of(device) {
            (instance.properties)(device, properties);
            hide(&mut *properties);
        }
    }
}

pub(super) unsafe extern "system" fn get_physical_device_properties2(
    device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceProperties2<'_>,
) {
    // SAFETY: a valid call of vkGetPhysicalDeviceProperties2.
    unsafe {
        let instance = Instance::of(device);
        if let Some(next) = instance.and_then(|instance| instance.properties2) {
            next(device, properties);
            hide(&mut (*properties).properties);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_draws_number_is_after_the_reported_push_constants() {
        assert_eq!((draw_number_offset(256), visible_limit(256)), (252, 252));
        assert_eq!((draw_number_offset(128), visible_limit(128)), (252, 128));
    }
}
