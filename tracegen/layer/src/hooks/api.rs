//! The interface between a layer and the loader: `vk_layer.h`.

use ash::vk;
use std::ffi::c_void;

/// `VkNegotiateLayerInterface`.
#[repr(C)]
pub struct NegotiateLayerInterface {
    /// Type of this structure, 1.
    pub s_type: i32,
    /// Null.
    pub p_next: *mut c_void,
    /// Version of the interface: requested, then supported.
    pub version: u32,
    /// This layer's function.
    pub get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    /// This layer's function.
    pub get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    /// Null.
    pub get_physical_device_proc_addr: Option<unsafe extern "system" fn()>,
}

/// The next layer's functions for an instance.
#[repr(C)]
pub(super) struct InstanceLink {
    next: *mut InstanceLink,
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    _get_physical_device_proc_addr: Option<unsafe extern "system" fn()>,
}

/// The next layer's functions for a device.
#[repr(C)]
pub(super) struct DeviceLink {
    next: *mut DeviceLink,
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    pub get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

/// `VkLayerInstanceCreateInfo` or `VkLayerDeviceCreateInfo`.
#[repr(C)]
struct LayerCreateInfo<T> {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    /// 0 if a link follows.
    function: i32,
    link: *mut T,
}

/// A link of a chain of creation structures.
pub(super) trait Link {
    /// Type of the structure that contains the link.
    const S_TYPE: vk::StructureType;
    /// The link of the next layer.
    fn next(&self) -> *mut Self;
}

impl Link for InstanceLink {
    const S_TYPE: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;
    fn next(&self) -> *mut Self {
        self.next
    }
}

impl Link for DeviceLink {
    const S_TYPE: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;
    fn next(&self) -> *mut Self {
        self.next
    }
}

/// Removes this layer's link from the chain of a creation call and returns it.
///
/// # Safety
/// `p_next` is the chain that a loader passes to a layer.
pub(super) unsafe fn take_link<'a, T: Link>(p_next: *const c_void) -> Option<&'a T> {
    let mut at = p_next.cast_mut().cast::<LayerCreateInfo<T>>();
    // SAFETY: the loader's chain has its structures, each with type and successor first.
    unsafe {
        loop {
            let info = at.as_mut()?;
            if info.s_type == T::S_TYPE && info.function == 0 {
                let link = info.link.as_ref()?;
                info.link = link.next();
                return Some(link);
            }
            at = info.p_next.cast();
        }
    }
}

/// Finds a structure in a chain by its type.
///
/// # Safety
/// `p_next` is a valid chain.
pub(super) unsafe fn find<'a, T: vk::TaggedStructure>(p_next: *const c_void) -> Option<&'a T> {
    let mut at = p_next.cast::<vk::BaseInStructure<'_>>();
    // SAFETY: the structures of a chain have the same head, whose type identifies the structure.
    unsafe {
        while let Some(base) = at.as_ref() {
            if base.s_type == T::STRUCTURE_TYPE {
                return at.cast::<T>().as_ref();
            }
            at = base.p_next;
        }
    }
    None
}

/// Elements at a pointer from a program; empty if the pointer is null.
///
/// # Safety
/// `first` is null or points to this number of elements.
pub(super) unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
    if first.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(first, count as usize) }
}
