//! Hooks of queues. Records are read when the commands that wrote them have ended.

use super::api::slice;
use super::device::Device;
use super::draws::buffers_of;
use crate::capture::lock;
use crate::spool::{Event, Span};
use crate::track::Executed;
use ash::vk::{self, Handle};
use std::collections::HashSet;

pub(super) unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: a valid call of vkQueueSubmit.
    unsafe {
        let known = Device::of(queue);
        let buffers = buffers_of(slice(submits, count));
        let submit = || (known.next.queue_submit)(queue, count, submits, fence);
        submit_and_read(&known, queue, &buffers, submit)
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
        let known = Device::of(queue);
        let infos = slice(submits, count).iter();
        let buffers = infos
            .flat_map(|submit| {
                slice(
                    submit.p_command_buffer_infos,
                    submit.command_buffer_info_count,
                )
            })
            .map(|info| info.command_buffer);
        let buffers: Vec<vk::CommandBuffer> = buffers.collect();
        let submit = || (known.next.queue_submit2)(queue, count, submits, fence);
        submit_and_read(&known, queue, &buffers, submit)
    }
}

/// Submits commands. In a requested frame, waits for them and reads their records.
///
/// # Safety
/// A valid submission.
unsafe fn submit_and_read(
    known: &Device,
    queue: vk::Queue,
    buffers: &[vk::CommandBuffer],
    submit: impl FnOnce() -> vk::Result,
) -> vk::Result {
    // SAFETY: as the caller promises.
    let result = unsafe { submit_frame(known, queue, buffers, submit) };
    if result == vk::Result::SUCCESS {
        let tracker = known.tracker();
        let reads = |buffer: &vk::CommandBuffer| tracker.commands.reads_back(buffer.as_raw());
        let reads_back = buffers.iter().any(reads);
        drop(tracker);
        if reads_back {
            known.capture.note_readback();
        }
    }
    result
}

/// Submits commands of the current frame.
///
/// # Safety
/// A valid submission.
unsafe fn submit_frame(
    known: &Device,
    queue: vk::Queue,
    buffers: &[vk::CommandBuffer],
    submit: impl FnOnce() -> vk::Result,
) -> vk::Result {
    let capture = known.capture;
    capture.note_frames();
    let frame = capture.frame();
    if !capture.wants(frame) {
        // Reusable command buffers must not record outside requested frames.
        if let Some(recorder) = known.recorder.as_ref().filter(|r| r.buffer.is_open()) {
            // Another thread may have started a requested frame in the meantime, and its commands may still
            // be executing.
            let _alone = lock(&known.submitting);
            if !capture.wants(capture.frame()) {
                recorder.buffer.open(false);
            }
        }
        return submit();
    }
    let items: Vec<Executed> = {
        let tracker = known.tracker();
        let items = buffers
            .iter()
            .flat_map(|b| tracker.commands.items(b.as_raw()));
        items.cloned().collect()
    };
    if items.is_empty() {
        return submit();
    }
    let _alone = lock(&known.submitting);
    let numbers: Vec<u32> = items.iter().map(|item| item.draw.draw).collect();
    // SAFETY: a queue of the device. The draws are not being executed before they are submitted.
    unsafe {
        if let Some(recorder) = known.recorder.as_ref().filter(|r| !r.buffer.is_open()) {
            // Commands in flight belong to earlier frames.
            let _ = (known.next.queue_wait_idle)(queue);
            recorder.buffer.open(true);
        }
        if let Some(queries) = &known.queries {
            queries.reset(known.handle, &numbers, &known.next);
        }
        let result = submit();
        if result != vk::Result::SUCCESS {
            return result;
        }
        if wait(known, queue) {
            write_records(known, frame, &items, &numbers);
        } else {
            if let Some(recorder) = &known.recorder {
                recorder.buffer.open(false);
            }
            capture.event(&Event::Trouble {
                what: format!(
                    "commands of frame {frame} did not end within {WAIT_TIMEOUT_S} seconds"
                ),
            });
        }
        result
    }
}

/// Timeout in seconds for the commands of a frame. Some commands wait for others that the program has not
/// submitted yet.
const WAIT_TIMEOUT_S: u64 = 60;

/// Waits until all submitted commands of a queue have ended; returns false after the timeout.
///
/// # Safety
/// A queue of the device.
unsafe fn wait(known: &Device, queue: vk::Queue) -> bool {
    let next = &known.next;
    let mut fence = vk::Fence::null();
    // SAFETY: as the caller promises. A fence that may still be signalled is not used again.
    unsafe {
        let info = vk::FenceCreateInfo::default();
        let made = (next.create_fence)(known.handle, &info, std::ptr::null(), &mut fence);
        if made != vk::Result::SUCCESS {
            return (next.queue_wait_idle)(queue) == vk::Result::SUCCESS;
        }
        let submitted = (next.queue_submit)(queue, 0, std::ptr::null(), fence);
        let done = submitted == vk::Result::SUCCESS
            && (next.wait_for_fences)(
                known.handle,
                1,
                &fence,
                vk::TRUE,
                WAIT_TIMEOUT_S * 1_000_000_000,
            ) == vk::Result::SUCCESS;
        if done {
            (next.destroy_fence)(known.handle, fence, std::ptr::null());
        }
        done
    }
}

/// Writes the records of executed draws.
///
/// # Safety
/// The draws have been executed.
unsafe fn write_records(known: &Device, frame: u32, items: &[Executed], numbers: &[u32]) {
    let capture = known.capture;
    describe(known, items);
    // SAFETY: as the caller promises.
    let occlusion = known
        .queries
        .as_ref()
        .map_or_else(Vec::new, |queries| unsafe {
            queries.results(known.handle, numbers, &known.next)
        });
    let (records, lost_bytes) = match &known.recorder {
        Some(recorder) => recorder.buffer.take(|records, lost| {
            let span = capture.write(|writer| writer.records(records));
            (span.unwrap_or_default(), lost)
        }),
        None => (Span::default(), 0),
    };
    let draw = |item: &Executed| {
        let pass = item.pass.as_ref().map_or(u32::MAX, |pass| pass.pass);
        [item.draw.draw, pass]
    };
    if let Some(pictures) = &known.pictures {
        let passes: HashSet<u32> = items
            .iter()
            .filter_map(|i| Some(i.pass.as_ref()?.pass))
            .collect();
        // SAFETY: as the caller promises.
        unsafe { pictures.write(known, &passes) };
    }
    capture.event(&Event::Submit {
        frame,
        draws: items.iter().map(draw).collect(),
        records,
        lost_bytes,
        occlusion,
    });
}

/// Describes draws, their render passes, shaders and images, each once.
fn describe(known: &Device, items: &[Executed]) {
    let capture = known.capture;
    for item in items {
        let draw = &item.draw;
        let mut images: Vec<u32> = Vec::new();
        if let Some(pass) = &item.pass {
            images.extend(pass.colors.iter().chain(&pass.depth).map(|view| view.image));
            capture.write(|w| w.describe("pass", pass.pass, || Event::Pass((**pass).clone())));
        }
        let views = draw.textures.iter().filter_map(|texture| texture.view);
        images.extend(views.map(|view| view.image));
        for image in images {
            let info = known.tracker().images.numbered(image).cloned();
            if let Some(info) = info {
                capture.write(|w| w.describe("image", image, || Event::Image((*info).clone())));
            }
        }
        if let Some(shader) = draw.shader {
            let info = known.shader(shader);
            if let Some(info) = info {
                capture.write(|w| w.describe("shader", shader, || Event::Shader((*info).clone())));
            }
        }
        capture.write(|w| w.describe("draw", draw.draw, || Event::Draw((**draw).clone())));
    }
}

pub(super) unsafe extern "system" fn queue_present(
    queue: vk::Queue,
    info: *const vk::PresentInfoKHR<'_>,
) -> vk::Result {
    // SAFETY: a valid call of vkQueuePresentKHR.
    unsafe {
        let known = Device::of(queue);
        let result = (known.next.queue_present)(queue, info);
        known.capture.note_present();
        result
    }
}
