//! The functions by which the OpenXR runtime of the same process ends frames and finds images.

use super::device::Device;
use super::pending::read_ended;
use crate::capture::lock;
use ash::vk::{self, Handle};
use spool::openxr::{EndFrame, FindNewestImage, NewestImage, ShownView};
use std::collections::HashSet;
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

/// Timeout for the commands of a frame whose pictures are shown.
const TIMEOUT: Duration = Duration::from_secs(20);

// The runtime looks the function up by this name and casts it to this type.
const _: EndFrame = parallax_end_openxr_frame;
const _: FindNewestImage = parallax_newest_openxr_image;

/// Numbers of the images that [`parallax_newest_openxr_image`] has found.
static FOUND: LazyLock<Mutex<HashSet<u32>>> = LazyLock::new(Mutex::default);

/// Finds the image of a texture that the program's OpenGL has just created.
///
/// # Safety
/// Valid pointers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn parallax_newest_openxr_image(
    size: *const [u32; 4],
    found: *mut NewestImage,
) -> bool {
    // SAFETY: as the caller promises.
    let (size, found) = unsafe { (*size, &mut *found) };
    let mut known = lock(&FOUND);
    let newest = Device::all().into_iter().filter_map(|device| {
        let (number, image) = device.tracker().images.newest(size)?;
        Some((number, device.handle, image))
    });
    let newest = newest.max_by_key(|(number, ..)| *number);
    let Some((_, device, image)) = newest.filter(|(number, ..)| known.insert(*number)) else {
        return false;
    };
    *found = NewestImage {
        device: device.as_raw(),
        image: image.as_raw(),
    };
    true
}

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
