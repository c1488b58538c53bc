//! Hooks of functions by which a program waits for the device. After them, the records of submissions that have
//! ended are read.

use super::api::find;
use super::device::Device;
use super::pending::read_ended;
use ash::vk;
use std::sync::TryLockError;
use std::time::Duration;

type Allocator = *const vk::AllocationCallbacks<'static>;

/// Timeout for the fence after commands whose end the program has seen.
const AFTER_WAIT: Duration = Duration::from_millis(100);

pub(super) unsafe extern "system" fn create_semaphore(
    device: vk::Device,
    info: *const vk::SemaphoreCreateInfo<'_>,
    allocator: Allocator,
    semaphore: *mut vk::Semaphore,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateSemaphore.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_semaphore)(device, info, allocator, semaphore);
        let kind = find::<vk::SemaphoreTypeCreateInfo<'_>>((*info).p_next);
        let is_timeline = kind.is_some_and(|k| k.semaphore_type == vk::SemaphoreType::TIMELINE);
        if result == vk::Result::SUCCESS && is_timeline {
            known.tracker().timelines.insert(*semaphore);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_semaphore(
    device: vk::Device,
    semaphore: vk::Semaphore,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroySemaphore.
    unsafe {
        let known = Device::of(device);
        known.tracker().timelines.remove(&semaphore);
        (known.next.destroy_semaphore)(device, semaphore, allocator);
    }
}

/// Reads the records of submissions that have ended. The program has seen that some have.
///
/// # Safety
/// A live device.
unsafe fn after_wait(known: &Device, result: vk::Result, timeout: Duration) {
    if result != vk::Result::SUCCESS {
        return;
    }
    if known.capture.has_pending() {
        // Another thread that holds the lock reads them itself.
        let mut pending = match known.pending.try_lock() {
            Ok(pending) => pending,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        // SAFETY: as the caller promises.
        unsafe { read_ended(known, &mut pending, timeout) };
    }
    known.capture.note_wait();
}

/// Hooks of functions that wait or poll.
macro_rules! waits {
    ($($hook:ident ($of:ident: $handle:ty $(, $argument:ident: $kind:ty)*) $timeout:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook($of: $handle, $($argument: $kind),*) -> vk::Result {
            // SAFETY: a valid call of the function.
            unsafe {
                let known = Device::of($of);
                let result = (known.next.$hook)($of, $($argument),*);
                after_wait(&known, result, $timeout);
                result
            }
        }
    )* };
}

waits! {
    wait_for_fences(device: vk::Device, count: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64) AFTER_WAIT;
    get_fence_status(device: vk::Device, fence: vk::Fence) Duration::ZERO;
    wait_semaphores(device: vk::Device, info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64) AFTER_WAIT;
    get_semaphore_counter_value(device: vk::Device, semaphore: vk::Semaphore, value: *mut u64) Duration::ZERO;
    queue_wait_idle(queue: vk::Queue) AFTER_WAIT;
    device_wait_idle(device: vk::Device) AFTER_WAIT;
}

pub(super) unsafe extern "system" fn copy_image_to_memory(
    device: vk::Device,
    info: *const vk::CopyImageToMemoryInfoEXT<'_>,
) -> vk::Result {
    // SAFETY: a valid call of vkCopyImageToMemoryEXT.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.copy_image_to_memory)(device, info);
        after_wait(&known, result, AFTER_WAIT);
        known.capture.note_readback();
        result
    }
}
