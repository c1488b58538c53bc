//! The data that a capture keeps for each device.

use super::api::{DeviceLink, take_link};
use super::dispatch_key;
use super::instance::{Instance, draw_number_offset};
use super::next::Next;
use super::pending::{Pending, read_ended};
use super::pictures::Pictures;
use super::queries::Queries;
use crate::capture::{Capture, capture, lock};
use crate::inject::{ReadCounts, Target};
use crate::record_buffer::RecordBuffer;
use crate::track::Tracker;
use ash::vk;
use mesa::SUBGROUP_LANES;
use spool::{Event, ShaderInfo};
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, RwLock};
use std::time::Duration;

/// Size of the part of the file of records that is allocated in advance for each requested frame.
const RESERVED_BYTES_PER_FRAME: u64 = 64 << 20;
/// Maximum size of that part. It occupies the system's file cache, not the program's memory.
const MOST_RESERVED_BYTES: u64 = 512 << 20;

/// A tracked device.
pub(super) struct Device {
    pub handle: vk::Device,
    pub get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    pub next: Next,
    pub capture: &'static Capture,
    /// Buffer that shaders record into; `None` if recording is impossible or was not requested.
    pub recorder: Option<DeviceRecorder>,
    pub queries: Option<Queries>,
    pub pictures: Option<Pictures>,
    tracker: Mutex<Tracker>,
    /// Submissions of requested frames; locked while commands of such frames are submitted.
    pub pending: Mutex<Pending>,
    /// Creation parameters of the program's swapchains.
    pub swapchains: Mutex<HashMap<u64, vk::SwapchainCreateInfoKHR<'static>>>,
}

/// Resources for recording on a device.
pub(super) struct DeviceRecorder {
    pub buffer: RecordBuffer,
    /// Offset of the draw's number in the push constants.
    pub push_constant_bytes: u32,
    pub ballots: bool,
    /// Recording shaders.
    pub shaders: Mutex<HashMap<ShaderKey, Result<RecordingShader, String>>>,
}

/// Words of a module, name of its entry point, whether it renders several views, and whether it is a vertex shader.
pub(super) type ShaderKey = (Arc<[u32]>, String, bool, bool);

/// A recording shader and its module.
#[derive(Clone)]
pub(super) struct RecordingShader {
    pub words: Arc<[u32]>,
    pub info: Arc<ShaderInfo>,
    /// Texture reads of a vertex shader that it does not record.
    pub unrecorded: ReadCounts,
}

impl DeviceRecorder {
    pub fn target(&self, multiview: bool) -> Target {
        Target {
            address: self.buffer.address(),
            push_constant_bytes: self.push_constant_bytes,
            ballots: self.ballots,
            multiview,
        }
    }
}

// SAFETY: the pointers in the swapchains' descriptions are never dereferenced.
unsafe impl Send for Device {}
// SAFETY: as above; all mutable data are behind locks.
unsafe impl Sync for Device {}

/// Number of devices that the process has created.
static NUMBER: AtomicU32 = AtomicU32::new(0);

static DEVICES: LazyLock<RwLock<HashMap<usize, Arc<Device>>>> = LazyLock::new(RwLock::default);

/// Timeout for pending submissions when a device is destroyed, at which all commands must have ended.
const DESTROY_TIMEOUT: Duration = Duration::from_secs(1);

impl Device {
    /// The device of a dispatchable handle.
    ///
    /// # Safety
    /// A valid device, queue or command buffer of a tracked device.
    pub unsafe fn of<H: vk::Handle>(handle: H) -> Arc<Self> {
        // SAFETY: as the caller promises.
        let key = unsafe { dispatch_key(handle) };
        let found = DEVICES.read().ok().and_then(|all| all.get(&key).cloned());
        found.unwrap_or_else(|| {
            // The loader gets hooks only for tracked devices.
            eprintln!("parallax: an unknown Vulkan device");
            std::process::abort()
        })
    }

    /// The device of a handle, if it is tracked.
    ///
    /// # Safety
    /// A valid dispatchable handle.
    pub unsafe fn find<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: as the caller promises.
        let key = unsafe { dispatch_key(handle) };
        DEVICES.read().ok()?.get(&key).cloned()
    }

    /// All tracked devices.
    pub fn all() -> Vec<Arc<Self>> {
        let all = DEVICES.read().ok();
        all.map_or_else(Vec::new, |all| all.values().cloned().collect())
    }

    /// A recording shader by its number.
    pub fn shader(&self, number: u32) -> Option<Arc<ShaderInfo>> {
        let shaders = lock(&self.recorder.as_ref()?.shaders);
        let made = shaders.values().flatten();
        made.map(|shader| &shader.info)
            .find(|info| info.shader == number)
            .cloned()
    }

    pub fn tracker(&self) -> MutexGuard<'_, Tracker> {
        lock(&self.tracker)
    }
}

/// Functions of untracked devices.
static OTHERS: LazyLock<RwLock<HashMap<usize, vk::PFN_vkGetDeviceProcAddr>>> =
    LazyLock::new(RwLock::default);

/// The function that looks up functions of an untracked device.
pub(super) unsafe fn other(handle: vk::Device) -> Option<vk::PFN_vkGetDeviceProcAddr> {
    // SAFETY: a valid device, as the caller promises.
    let key = unsafe { dispatch_key(handle) };
    OTHERS.read().ok()?.get(&key).copied()
}

pub(super) unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateDevice by the loader, whose chain has this layer's link.
    unsafe {
        let (Some(link), Some(instance)) = (
            take_link::<DeviceLink>((*info).p_next),
            Instance::of(physical),
        ) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let (get_instance, get_device) = (link.get_instance_proc_addr, link.get_device_proc_addr);
        let Some(create) = get_instance(instance.handle, c"vkCreateDevice".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create =
            std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateDevice>(create);
        let result = create(physical, info, allocator, device);
        if result != vk::Result::SUCCESS {
            return result;
        }
        let handle = *device;
        let key = dispatch_key(handle);
        match capture() {
            Some(capture) => {
                let next = Next::load(|name: &CStr| get_device(handle, name.as_ptr()));
                let followed = track(capture, &instance, physical, handle, get_device, next);
                if let Ok(mut all) = DEVICES.write() {
                    all.insert(key, Arc::new(followed));
                }
            }
            None => {
                if let Ok(mut all) = OTHERS.write() {
                    all.insert(key, get_device);
                }
            }
        }
        result
    }
}

/// Starts to track a device.
///
/// # Safety
/// The device was just created.
unsafe fn track(
    capture: &'static Capture,
    instance: &Instance,
    physical: vk::PhysicalDevice,
    handle: vk::Device,
    get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    next: Next,
) -> Device {
    // SAFETY: the physical device is the instance's.
    let (properties, (subgroups, driver)) = unsafe {
        (
            instance.real_properties(physical),
            instance.details(physical),
        )
    };
    let name = properties
        .device_name_as_c_str()
        .unwrap_or_default()
        .to_string_lossy();
    let text = |name: Result<&CStr, _>| name.unwrap_or_default().to_string_lossy().into_owned();
    let driver_text = format!(
        "{} {}",
        text(driver.driver_name_as_c_str()),
        text(driver.driver_info_as_c_str())
    );
    let ballots = subgroups.subgroup_size == SUBGROUP_LANES
        && subgroups
            .supported_stages
            .contains(vk::ShaderStageFlags::FRAGMENT)
        && (subgroups.supported_operations).contains(vk::SubgroupFeatureFlags::BALLOT);
    // A record buffer is memory of the process. Only on lavapipe is its address a device address.
    let is_lavapipe = driver.driver_id == vk::DriverId::MESA_LLVMPIPE;
    let mut refused = (!is_lavapipe)
        .then(|| format!("{name} is not lavapipe, on which alone programs are recorded"));
    let mut recorder = None;
    if capture.settings.records && refused.is_none() {
        match RecordBuffer::new(capture.settings.record_bytes) {
            Ok(buffer) => {
                recorder = Some(DeviceRecorder {
                    buffer,
                    push_constant_bytes: draw_number_offset(
                        properties.limits.max_push_constants_size,
                    ),
                    ballots,
                    shaders: Mutex::default(),
                });
            }
            Err(error) => refused = Some(format!("the record buffer: {error}")),
        }
    }
    capture.event(&Event::Device {
        name: name.into_owned(),
        driver: driver_text,
        refused,
        ballots,
        opengl: instance.opengl,
    });
    if recorder.is_some() {
        // Without the space, recording is only slower.
        let [first, end] = capture.settings.frames;
        let frames = u64::from(end.saturating_sub(first));
        let bytes = (frames.saturating_mul(RESERVED_BYTES_PER_FRAME)).min(MOST_RESERVED_BYTES);
        capture.write(|writer| Ok(writer.reserve_records(bytes).is_ok()));
    }
    let queries = (capture.settings.occlusion)
        // SAFETY: the device was just created.
        .then(|| unsafe { Queries::new(handle, &next) })
        .flatten();
    Device {
        handle,
        get_device_proc_addr,
        next,
        capture,
        recorder,
        queries,
        tracker: Mutex::new(Tracker::of_device(NUMBER.fetch_add(1, Ordering::Relaxed))),
        pictures: (capture.settings.pictures && is_lavapipe).then(Pictures::default),
        pending: Mutex::default(),
        swapchains: Mutex::default(),
    }
}

pub(super) unsafe extern "system" fn destroy_device(
    handle: vk::Device,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if handle == vk::Device::null() {
        return;
    }
    // SAFETY: a valid call of vkDestroyDevice.
    unsafe {
        let key = dispatch_key(handle);
        let removed = DEVICES.write().ok().and_then(|mut all| all.remove(&key));
        if let Some(device) = removed {
            if !read_ended(&device, &mut lock(&device.pending), DESTROY_TIMEOUT) {
                let what =
                    "commands of a requested frame had not ended when the device was destroyed";
                device.capture.event(&Event::Trouble {
                    what: what.to_owned(),
                });
            }
            if let Some(queries) = &device.queries {
                queries.destroy(handle, &device.next);
            }
            if let Some(pictures) = &device.pictures {
                pictures.destroy(handle, &device.next);
            }
            device.capture.note_frames();
            device.capture.event(&Event::Closed);
            (device.next.destroy_device)(handle, allocator);
        }
    }
}
