//! The function by which the OpenXR runtime of the same process ends frames.

use super::device::Device;
use super::pending::read_ended;
use crate::capture::lock;
use ash::vk::{self, Handle};
use spool::openxr::{EndFrame, ShownView};
use std::time::Duration;

/// Timeout for the commands of a frame whose pictures are shown.
const TIMEOUT: Duration = Duration::from_secs(20);

// The runtime looks the function up by this name and casts it to this type.
const _: EndFrame = parallax_end_openxr_frame;

/// Ends a frame that shows two views.
///
/// # Safety
/// A live `VkDevice` handle, and two views.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn parallax_end_openxr_frame(device: u64, views: *const ShownView) {
    // SAFETY: as the caller promises.
    unsafe {
        let Some(device) = Device::find(vk::Device::from_raw(device)) else {
            return;
        };
        let views = &*views.cast::<[ShownView; 2]>();
        if device.capture.has_pending() {
            read_ended(&device, &mut lock(&device.pending), TIMEOUT);
        }
        let number = |view: &ShownView| {
            let tracker = device.tracker();
            let image = tracker.images.get(vk::Image::from_raw(view.image));
            image.map(|image| image.image)
        };
        if let [Some(left), Some(right)] = [number(&views[0]), number(&views[1])] {
            let eyes = [views[0].of_image(left), views[1].of_image(right)];
            device.capture.note_shown(eyes);
        }
    }
}
