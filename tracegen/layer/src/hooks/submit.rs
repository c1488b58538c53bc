//! Hooks of queues.

use super::api::{find, slice};
use super::device::Device;
use super::draws::buffers_of;
use super::pending::{Pending, Submission, fence_after, read_ended, wait_for};
use crate::capture::lock;
use crate::track::{Copies, Effects, Executed};
use ash::vk::{self, Handle};
use spool::Event;
use std::collections::HashMap;
use std::time::Duration;

/// Command buffers of a call, and the semaphores that something outside the call must signal.
struct Submitted {
    buffers: Vec<vk::CommandBuffer>,
    waits: Vec<(vk::Semaphore, u64)>,
}

/// Semaphores that a sequence of submissions waits for and does not signal itself, with their values.
#[derive(Default)]
struct SemaphoreWaits {
    signalled: HashMap<vk::Semaphore, u64>,
    open: Vec<(vk::Semaphore, u64)>,
}

impl SemaphoreWaits {
    fn wait(&mut self, semaphore: vk::Semaphore, value: u64) {
        let signalled = self.signalled.get(&semaphore);
        if signalled.is_none_or(|signalled| *signalled < value) {
            self.open.push((semaphore, value));
        }
    }

    fn signal(&mut self, semaphore: vk::Semaphore, value: u64) {
        let signalled = self.signalled.entry(semaphore).or_default();
        *signalled = value.max(*signalled);
    }
}

/// Values of the semaphores of a submission; none for binary semaphores.
fn pairs<'a>(
    semaphores: &'a [vk::Semaphore],
    values: &'a [u64],
) -> impl Iterator<Item = (vk::Semaphore, u64)> + 'a {
    semaphores.iter().copied().zip(values.iter().copied())
}

pub(super) unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: a valid call of vkQueueSubmit.
    unsafe {
        let device = Device::of(queue);
        let mut waits = SemaphoreWaits::default();
        for info in slice(submits, count) {
            let Some(values) = find::<vk::TimelineSemaphoreSubmitInfo<'_>>(info.p_next) else {
                continue;
            };
            let waited = slice(info.p_wait_semaphores, info.wait_semaphore_count);
            let of = slice(
                values.p_wait_semaphore_values,
                values.wait_semaphore_value_count,
            );
            pairs(waited, of).for_each(|(semaphore, value)| waits.wait(semaphore, value));
            let signalled = slice(info.p_signal_semaphores, info.signal_semaphore_count);
            let of = slice(
                values.p_signal_semaphore_values,
                values.signal_semaphore_value_count,
            );
            pairs(signalled, of).for_each(|(semaphore, value)| waits.signal(semaphore, value));
        }
        let submitted = Submitted {
            buffers: buffers_of(slice(submits, count)),
            waits: waits.open,
        };
        let submit = || (device.next.queue_submit)(queue, count, submits, fence);
        submit_and_read(&device, queue, &submitted, submit)
    }
}

pub(super) unsafe extern "system" fn queue_submit2(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: a valid call of vkQueueSubmit2.
    unsafe {
        let device = Device::of(queue);
        let (mut waits, mut buffers) = (SemaphoreWaits::default(), Vec::new());
        for info in slice(submits, count) {
            for of in slice(info.p_wait_semaphore_infos, info.wait_semaphore_info_count) {
                waits.wait(of.semaphore, of.value);
            }
            for of in slice(
                info.p_signal_semaphore_infos,
                info.signal_semaphore_info_count,
            ) {
                waits.signal(of.semaphore, of.value);
            }
            let of = slice(info.p_command_buffer_infos, info.command_buffer_info_count);
            buffers.extend(of.iter().map(|info| info.command_buffer));
        }
        let submitted = Submitted {
            buffers,
            waits: waits.open,
        };
        let submit = || (device.next.queue_submit2)(queue, count, submits, fence);
        submit_and_read(&device, queue, &submitted, submit)
    }
}

/// Submits commands. In a requested frame, reads their records.
///
/// # Safety
/// A valid submission.
unsafe fn submit_and_read(
    device: &Device,
    queue: vk::Queue,
    submitted: &Submitted,
    submit: impl FnOnce() -> vk::Result,
) -> vk::Result {
    let buffers = submitted.buffers.iter().map(|buffer| buffer.as_raw());
    let effects = device.tracker().commands.effects(buffers);
    let (renders, reads_back) = (effects.renders, effects.reads_back);
    // SAFETY: as the caller promises.
    let result = unsafe { submit_frame(device, queue, submitted, effects, submit) };
    if result == vk::Result::SUCCESS {
        if renders {
            device.capture.note_rendering();
        }
        if reads_back {
            device.capture.note_readback();
        }
    }
    result
}

/// Timeout for the commands of earlier frames when recording starts.
const SETTLE_TIMEOUT: Duration = Duration::from_secs(2);

/// Timeout for the commands of a submission of which the layer does not know that they wait for the host.
const END_TIMEOUT: Duration = Duration::from_secs(20);

/// Submits commands of the current frame.
///
/// # Safety
/// A valid submission.
unsafe fn submit_frame(
    device: &Device,
    queue: vk::Queue,
    submitted: &Submitted,
    effects: Effects,
    submit: impl FnOnce() -> vk::Result,
) -> vk::Result {
    let capture = device.capture;
    let mut pending = lock(&device.pending);
    // SAFETY: a queue of the device. The draws are not being executed before they are submitted.
    unsafe {
        read_ended(device, &mut pending, Duration::ZERO);
        capture.note_frames();
        let place = capture.place();
        if !capture.wants(place) {
            close(device, &pending);
            let waits = !capture.is_over() && waits_for_host(device, submitted, &effects);
            let result = submit();
            if waits && result == vk::Result::SUCCESS {
                // Fences of earlier submissions that have ended are not needed.
                pending.is_blocked(device);
                pending.block(device, queue);
            }
            return result;
        }
        if effects.copies != Copies::default() {
            capture.event(&Event::Copies {
                frame: place.frame,
                pairs: effects.copies.pairs.clone(),
                layers: effects.copies.layers.clone(),
                probed: effects.copies.probed.clone(),
            });
        }
        let blocked = pending.is_blocked(device);
        let draws = draws_of(device, submitted);
        if draws.is_empty() && effects.dispatches.is_empty() {
            drop(pending);
            return submit();
        }
        if let Some(recorder) = device.recorder.as_ref().filter(|r| !r.buffer.is_open()) {
            // Commands in flight belong to earlier frames. Those of command buffers that are submitted once
            // do not record.
            if !blocked {
                let mut fences: Vec<vk::Fence> = fence_after(device, queue).into_iter().collect();
                wait_for(device, &mut fences, SETTLE_TIMEOUT);
            }
            recorder.buffer.open(true);
        }
        if let Some(queries) = &device.queries {
            let numbers: Vec<u32> = draws.iter().map(|item| item.draw.draw).collect();
            queries.reset(device.handle, &numbers, &device.next);
        }
        let timeout = match blocked || waits_for_host(device, submitted, &effects) {
            true => Duration::ZERO,
            false => END_TIMEOUT,
        };
        let result = submit();
        if result == vk::Result::SUCCESS {
            let submission = Submission {
                place,
                draws,
                dispatches: effects.dispatches,
            };
            pending.add(device, queue, submission);
            read_ended(device, &mut pending, timeout);
        }
        result
    }
}

/// Disables recording outside requested frames, because reusable command buffers must not record there. Pending
/// submissions must still record.
fn close(device: &Device, pending: &Pending) {
    let recorder = device.recorder.as_ref().filter(|r| r.buffer.is_open());
    if let Some(recorder) = recorder.filter(|_| pending.is_empty()) {
        recorder.buffer.open(false);
    }
}

/// Draws of a submission in order of execution.
fn draws_of(device: &Device, submitted: &Submitted) -> Vec<Executed> {
    let tracker = device.tracker();
    let buffers = submitted.buffers.iter();
    let draws = buffers.flat_map(|buffer| tracker.commands.items(buffer.as_raw()));
    draws.cloned().collect()
}

/// Whether commands cannot end before the host, or a later submission, signals a semaphore or sets an event.
///
/// # Safety
/// A valid submission that has not been made.
unsafe fn waits_for_host(device: &Device, submitted: &Submitted, effects: &Effects) -> bool {
    let next = &device.next;
    let is_open = |(semaphore, value): &(vk::Semaphore, u64)| {
        let mut now = u64::MAX;
        device.tracker().timelines.contains(semaphore)
            // SAFETY: a live timeline semaphore.
            && unsafe { (next.get_semaphore_counter_value)(device.handle, *semaphore, &mut now) }
                == vk::Result::SUCCESS
            && now < *value
    };
    // SAFETY: a live event.
    let is_reset = |event: &vk::Event| unsafe {
        (next.get_event_status)(device.handle, *event) == vk::Result::EVENT_RESET
    };
    submitted.waits.iter().any(is_open) || effects.awaited().iter().any(is_reset)
}

after! {
    queue_present(queue: vk::Queue, info: *const vk::PresentInfoKHR<'_>) |device, result| device.capture.note_present();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_semaphores_that_the_call_does_not_signal_before_are_open() {
        let [own, other] = [1, 2].map(vk::Semaphore::from_raw);
        let mut waits = SemaphoreWaits::default();
        waits.wait(other, 5);
        waits.signal(own, 7);
        waits.signal(own, 3);
        waits.wait(own, 7);
        waits.wait(own, 8);
        assert_eq!(waits.open, [(other, 5), (own, 8)]);
    }
}
