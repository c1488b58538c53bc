//! Hooks of functions by which a program waits for the device. After them, the records of submissions that have
//! ended are read.

use super::api::find;
use super::device::Device;
use super::pending::read_ended;
use ash::vk;
use std::sync::TryLockError;
use std::time::Duration;

creates! {
    create_semaphore SemaphoreCreateInfo => Semaphore |device, info, semaphore| {
        let kind = find::<vk::SemaphoreTypeCreateInfo<'_>>(info.p_next);
        if kind.is_some_and(|kind| kind.semaphore_type == vk::SemaphoreType::TIMELINE) {
            device.tracker().timelines.insert(semaphore);
        }
    };
}

destroys! {
    destroy_semaphore Semaphore |device, semaphore| device.tracker().timelines.remove(&semaphore);
}

/// Timeout for the fence after commands whose end the program has seen.
const AFTER_WAIT: Duration = Duration::from_millis(100);

/// Reads the records of submissions that have ended. The program has seen that some have.
///
/// # Safety
/// A live device.
unsafe fn after_wait(device: &Device, result: vk::Result, timeout: Duration) {
    if result != vk::Result::SUCCESS {
        return;
    }
    if device.capture.has_pending() {
        // Another thread that holds the lock reads them itself.
        let mut pending = match device.pending.try_lock() {
            Ok(pending) => pending,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        // SAFETY: as the caller promises.
        unsafe { read_ended(device, &mut pending, timeout) };
    }
    device.capture.note_wait();
}

after! {
    wait_for_fences(handle: vk::Device, count: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64) |device, result|
        after_wait(&device, result, AFTER_WAIT);
    get_fence_status(handle: vk::Device, fence: vk::Fence) |device, result| after_wait(&device, result, Duration::ZERO);
    wait_semaphores(handle: vk::Device, info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64) |device, result|
        after_wait(&device, result, AFTER_WAIT);
    get_semaphore_counter_value(handle: vk::Device, semaphore: vk::Semaphore, value: *mut u64) |device, result|
        after_wait(&device, result, Duration::ZERO);
    queue_wait_idle(queue: vk::Queue) |device, result| after_wait(&device, result, AFTER_WAIT);
    device_wait_idle(handle: vk::Device) |device, result| after_wait(&device, result, AFTER_WAIT);
    copy_image_to_memory(handle: vk::Device, info: *const vk::CopyImageToMemoryInfoEXT<'_>) |device, result| {
        after_wait(&device, result, AFTER_WAIT);
        device.capture.note_readback();
    };
}
