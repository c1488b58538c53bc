//! The functions that a program calls instead of the driver's.
//!
//! Each hook calls the function of the same name in the next layer or the driver, and reports the call to the
//! tracker.

#[macro_use]
mod macros;

mod api;
mod commands;
mod device;
mod draws;
mod instance;
mod libraries;
mod next;
mod openxr;
mod passes;
mod pending;
mod pictures;
mod pipeline_state;
mod pipelines;
mod queries;
mod recording_pipelines;
mod recording_shaders;
mod resources;
mod sets;
mod stage_reads;
mod submit;
mod waits;

use crate::capture::capture;
use api::NegotiateLayerInterface;
use ash::vk::{self, Handle};
use std::ffi::{CStr, c_char};

/// Pointer that the loader stores in the object of a dispatchable handle.
///
/// # Safety
/// A valid dispatchable handle.
unsafe fn dispatch_key<H: Handle>(handle: H) -> usize {
    // SAFETY: such a handle points to an object that starts with the loader's pointer.
    unsafe { *(handle.as_raw() as *const usize) }
}

/// Version of the interface between loader and layers that this layer supports.
const INTERFACE_VERSION: u32 = 2;

/// Called by the loader to get the layer's entry points.
///
/// # Safety
/// The loader makes the call.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    negotiate: *mut NegotiateLayerInterface,
) -> vk::Result {
    // SAFETY: as the caller promises.
    let Some(negotiate) = (unsafe { negotiate.as_mut() }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if negotiate.version < INTERFACE_VERSION {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    negotiate.version = INTERFACE_VERSION;
    negotiate.get_instance_proc_addr = Some(get_instance_proc_addr);
    negotiate.get_device_proc_addr = Some(get_device_proc_addr);
    negotiate.get_physical_device_proc_addr = None;
    vk::Result::SUCCESS
}

macro_rules! hooks {
    ($name:ident: $($function:literal => $hook:path;)*) => {
        fn $name(function: &CStr) -> vk::PFN_vkVoidFunction {
            let hook: *const () = match function.to_bytes() {
                $($function => $hook as *const (),)*
                _ => return None,
            };
            // SAFETY: the caller casts the function to the type of its name.
            Some(unsafe { std::mem::transmute::<*const (), unsafe extern "system" fn()>(hook) })
        }
    };
}

hooks! { instance_hook:
    b"vkGetInstanceProcAddr" => get_instance_proc_addr;
    b"vkGetDeviceProcAddr" => get_device_proc_addr;
    b"vkCreateInstance" => instance::create_instance;
    b"vkDestroyInstance" => instance::destroy_instance;
    b"vkCreateDevice" => device::create_device;
}

// Properties of devices are changed only during a capture.
hooks! { physical_device_hook:
    b"vkEnumerateDeviceExtensionProperties" => instance::enumerate_device_extension_properties;
    b"vkGetPhysicalDeviceProperties" => instance::get_physical_device_properties;
    b"vkGetPhysicalDeviceProperties2" => instance::get_physical_device_properties2;
    b"vkGetPhysicalDeviceProperties2KHR" => instance::get_physical_device_properties2;
}

fn device_hook(function: &CStr) -> vk::PFN_vkVoidFunction {
    let hook = match function.to_bytes() {
        b"vkGetDeviceProcAddr" => get_device_proc_addr as *const (),
        _ => next::hook(function)?,
    };
    // SAFETY: the caller casts the function to the type of its name.
    Some(unsafe { std::mem::transmute::<*const (), unsafe extern "system" fn()>(hook) })
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: a valid call of vkGetInstanceProcAddr.
    unsafe {
        let function = CStr::from_ptr(name);
        if let Some(hook) = instance_hook(function) {
            return Some(hook);
        }
        if instance == vk::Instance::null() {
            return None;
        }
        let found = instance::Instance::of(instance)?;
        let next = (found.get_instance_proc_addr)(instance, name);
        if capture().is_none() {
            return next;
        }
        // A function that the next layer does not have has no hook.
        let hook = physical_device_hook(function).or_else(|| device_hook(function));
        next.and(hook).or(next)
    }
}

unsafe extern "system" fn get_device_proc_addr(
    handle: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: a valid call of vkGetDeviceProcAddr.
    unsafe {
        if let Some(device) = device::Device::find(handle) {
            let next = (device.get_device_proc_addr)(handle, name);
            return next.and(device_hook(CStr::from_ptr(name))).or(next);
        }
        device::other(handle)?(handle, name)
    }
}
