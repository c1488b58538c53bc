//! Submissions of requested frames whose records are not read yet.
//!
//! Records are read as soon as the commands have ended: usually in the hook of the submission, which waits. A
//! submission that waits for the host ends later, so its hook must not wait. Its records are read in a later call.

use super::device::Device;
use crate::capture::FrameNumbers;
use crate::track::Executed;
use ash::vk;
use spool::{DispatchInfo, Event, Span};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::time::Duration;

/// The submissions of a device.
#[derive(Default)]
pub(super) struct Pending {
    submissions: Vec<Submission>,
    /// Fences that are signalled when they have ended.
    fences: Vec<vk::Fence>,
    /// Fences after submissions of other frames that wait for the host.
    blocked: Vec<vk::Fence>,
}

/// A submission of a requested frame.
pub(super) struct Submission {
    pub place: FrameNumbers,
    pub draws: Vec<Executed>,
    pub dispatches: Vec<DispatchInfo>,
}

impl Pending {
    /// Whether no submission is pending.
    pub fn is_empty(&self) -> bool {
        self.submissions.is_empty()
    }

    /// Whether an earlier submission still waits for the host, and with it all later ones.
    ///
    /// # Safety
    /// A live device.
    pub unsafe fn is_blocked(&mut self, device: &Device) -> bool {
        // SAFETY: as the caller promises.
        !self.is_empty() || unsafe { !wait_for(device, &mut self.blocked, Duration::ZERO) }
    }

    /// Notes that a submission of another frame was just made, which waits for the host.
    ///
    /// # Safety
    /// A queue of the device, which the program is not using in another thread.
    pub unsafe fn block(&mut self, device: &Device, queue: vk::Queue) {
        // SAFETY: as the caller promises.
        self.blocked.extend(unsafe { fence_after(device, queue) });
    }

    /// Adds a submission that was just made.
    ///
    /// # Safety
    /// A queue of the device, which the program is not using in another thread.
    pub unsafe fn add(&mut self, device: &Device, queue: vk::Queue, submission: Submission) {
        // SAFETY: as the caller promises.
        match unsafe { fence_after(device, queue) } {
            Some(fence) => self.fences.push(fence),
            // SAFETY: as above.
            None => drop(unsafe { (device.next.queue_wait_idle)(queue) }),
        }
        self.submissions.push(submission);
        device.capture.note_submission();
    }
}

/// A fence that is signalled when all submitted commands of a queue have ended; `None` if the driver refuses.
///
/// # Safety
/// A queue of the device, which the program is not using in another thread.
pub(super) unsafe fn fence_after(device: &Device, queue: vk::Queue) -> Option<vk::Fence> {
    let (next, success) = (&device.next, vk::Result::SUCCESS);
    let mut fence = vk::Fence::null();
    // SAFETY: as the caller promises.
    unsafe {
        let info = vk::FenceCreateInfo::default();
        if (next.create_fence)(device.handle, &info, std::ptr::null(), &mut fence) != success {
            return None;
        }
        if (next.queue_submit)(queue, 0, std::ptr::null(), fence) != success {
            (next.destroy_fence)(device.handle, fence, std::ptr::null());
            return None;
        }
    }
    Some(fence)
}

/// Waits for fences of the layer and destroys them; returns false after the timeout.
///
/// # Safety
/// Fences of the device.
pub(super) unsafe fn wait_for(
    device: &Device,
    fences: &mut Vec<vk::Fence>,
    timeout: Duration,
) -> bool {
    let (next, handle) = (&device.next, device.handle);
    let timeout_ns = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
    // SAFETY: as the caller promises. Signalled fences are not in use.
    unsafe {
        let (count, first) = (fences.len() as u32, fences.as_ptr());
        let ended = fences.is_empty()
            || (next.wait_for_fences)(handle, count, first, vk::TRUE, timeout_ns)
                == vk::Result::SUCCESS;
        if ended {
            for fence in fences.drain(..) {
                (next.destroy_fence)(handle, fence, std::ptr::null());
            }
        }
        ended
    }
}

/// Waits for the pending submissions and writes their records; returns false after the timeout.
///
/// # Safety
/// A live device.
pub(super) unsafe fn read_ended(device: &Device, pending: &mut Pending, timeout: Duration) -> bool {
    if pending.is_empty() {
        return true;
    }
    // SAFETY: as the caller promises; the submissions have ended when their records are read.
    unsafe {
        if !wait_for(device, &mut pending.fences, timeout) {
            return false;
        }
        let submissions = std::mem::take(&mut pending.submissions);
        let count = submissions.len() as u32;
        write_records(device, submissions);
        device.capture.note_read(count);
    }
    true
}

/// Writes the records of submissions. Those of a frame are written as one submission, because their records are
/// in one buffer.
///
/// # Safety
/// The submissions have ended.
unsafe fn write_records(device: &Device, submissions: Vec<Submission>) {
    let capture = device.capture;
    let mut frames: BTreeMap<FrameNumbers, (Vec<Executed>, Vec<DispatchInfo>)> = BTreeMap::new();
    for submission in submissions {
        let (draws, dispatches) = frames.entry(submission.place).or_default();
        draws.extend(submission.draws);
        dispatches.extend(submission.dispatches);
    }
    for (draws, _) in frames.values() {
        describe(device, draws);
    }
    note_mixed(device, &frames);
    let all = frames.values().flat_map(|(draws, _)| draws);
    let numbers: Vec<u32> = all.clone().map(|item| item.draw.draw).collect();
    // SAFETY: as the caller promises.
    let occlusion: HashMap<u32, u64> = device
        .queries
        .as_ref()
        .map_or_else(Vec::new, |queries| unsafe {
            queries.results(device.handle, &numbers, &device.next)
        })
        .into_iter()
        .collect();
    let (records, lost_bytes) = match &device.recorder {
        Some(recorder) => recorder.buffer.take(|records, lost| {
            let span = capture.write(|writer| writer.records(records));
            (span.unwrap_or_default(), lost)
        }),
        None => (Span::default(), 0),
    };
    if let Some(pictures) = &device.pictures {
        let passes: HashSet<u32> = all.filter_map(|i| Some(i.pass.as_ref()?.pass)).collect();
        // SAFETY: as the caller promises.
        unsafe { pictures.write(device, &passes) };
    }
    for (place, (draws, dispatches)) in frames {
        let numbers = draws.iter().map(|item| item.draw.draw);
        capture.event(&Event::Submit {
            frame: place.frame,
            frame_by_waits: place.by_waits,
            records,
            lost_bytes,
            occlusion: numbers
                .filter_map(|draw| Some((draw, *occlusion.get(&draw)?)))
                .collect(),
            draws: draws.iter().map(number_and_pass).collect(),
            dispatches,
        });
    }
}

fn number_and_pass(item: &Executed) -> [u32; 2] {
    let pass = item.pass.as_ref().map_or(u32::MAX, |pass| pass.pass);
    [item.draw.draw, pass]
}

/// Reports draws of several frames whose records cannot be told apart, because the frames ended together.
fn note_mixed(
    device: &Device,
    frames: &BTreeMap<FrameNumbers, (Vec<Executed>, Vec<DispatchInfo>)>,
) {
    let mut seen: HashMap<u32, FrameNumbers> = HashMap::new();
    let mut mixed = 0_u64;
    for (place, (draws, _)) in frames {
        for item in draws {
            let first = *seen.entry(item.draw.draw).or_insert(*place);
            mixed += u64::from(first != *place);
        }
    }
    if mixed > 0 {
        device.capture.event(&Event::Trouble {
            what: format!(
                "{mixed} draws were under way in two frames at once: both frames have the records of both executions"
            ),
        });
    }
}

/// Describes draws, their render passes, shaders and images, each once.
fn describe(device: &Device, items: &[Executed]) {
    let capture = device.capture;
    for item in items {
        let draw = &item.draw;
        let mut images: Vec<u32> = Vec::new();
        if let Some(pass) = &item.pass {
            images.extend(pass.colors.iter().chain(&pass.depth).map(|view| view.image));
            capture.write(|w| w.describe("pass", pass.pass, || Event::Pass((**pass).clone())));
        }
        let views = draw.textures.iter().chain(&draw.vertex_textures);
        let views = views.filter_map(|texture| texture.view);
        images.extend(views.map(|view| view.image));
        for image in images {
            let info = device.tracker().images.numbered(image).cloned();
            if let Some(info) = info {
                capture.write(|w| w.describe("image", image, || Event::Image((*info).clone())));
            }
        }
        for shader in [draw.shader, draw.vertex_shader].into_iter().flatten() {
            let info = device.shader(shader);
            if let Some(info) = info {
                capture.write(|w| w.describe("shader", shader, || Event::Shader((*info).clone())));
            }
        }
        capture.write(|w| w.describe("draw", draw.draw, || Event::Draw((**draw).clone())));
    }
}
