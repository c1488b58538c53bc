//! Functions of the recording layer in the same process.

use libloading::os::unix::{Library, RTLD_NOW};
use spool::openxr::{END_FRAME, EndFrame, FindNewestImage, NEWEST_IMAGE, NewestImage, ShownView};
use spool::{FOLDER_VARIABLE, LAYER_LINK};
use std::path::Path;
use std::sync::OnceLock;

/// Value of `RTLD_NOLOAD`: the Vulkan loader has opened the layer, and only that copy counts the frames.
const LOADED_ONLY: i32 = libc::RTLD_NOLOAD;

/// The layer's functions.
struct Layer {
    end_frame: EndFrame,
    newest_image: FindNewestImage,
}

/// The layer, once it is there.
fn layer() -> Option<&'static Layer> {
    static LAYER: OnceLock<Layer> = OnceLock::new();
    if let Some(known) = LAYER.get() {
        return Some(known);
    }
    let folder = std::env::var_os(FOLDER_VARIABLE)?;
    let file = Path::new(&folder).join(LAYER_LINK);
    // SAFETY: the library is open already, so nothing is initialised; it is never unloaded; the names determine the
    // functions' types.
    let found = unsafe {
        let library = Library::open(Some(file), RTLD_NOW | LOADED_ONLY).ok()?;
        let found = Layer {
            end_frame: *library.get(END_FRAME.to_bytes_with_nul()).ok()?,
            newest_image: *library.get(NEWEST_IMAGE.to_bytes_with_nul()).ok()?,
        };
        std::mem::forget(library);
        found
    };
    Some(LAYER.get_or_init(|| found))
}

/// Ends a frame that shows these views.
pub(crate) fn end_frame(device: u64, views: &[ShownView; 2]) {
    if let Some(layer) = layer() {
        // SAFETY: a live device, and two views.
        unsafe { (layer.end_frame)(device, views.as_ptr()) };
    }
}

/// The newest image with this width, height, number of layers and of samples that was not found before.
pub(crate) fn newest_image(size: [u32; 4]) -> Option<NewestImage> {
    let mut found = NewestImage::default();
    // SAFETY: valid pointers.
    let is_found = unsafe { (layer()?.newest_image)(&raw const size, &raw mut found) };
    is_found.then_some(found)
}
