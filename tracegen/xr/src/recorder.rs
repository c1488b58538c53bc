//! Tells the recording layer in the same process that a frame has ended.

use libloading::os::unix::{Library, RTLD_NOW};
use spool::openxr::{END_FRAME, EndFrame, ShownView};
use spool::{FOLDER_VARIABLE, LAYER_LINK};
use std::path::Path;
use std::sync::OnceLock;

/// Value of `RTLD_NOLOAD`: the Vulkan loader has opened the layer, and only that copy counts the frames.
const LOADED_ONLY: i32 = libc::RTLD_NOLOAD;

/// The layer's function, once the layer is there.
fn function() -> Option<EndFrame> {
    static FUNCTION: OnceLock<EndFrame> = OnceLock::new();
    if let Some(known) = FUNCTION.get() {
        return Some(*known);
    }
    let folder = std::env::var_os(FOLDER_VARIABLE)?;
    let file = Path::new(&folder).join(LAYER_LINK);
    // SAFETY: the library is open already, so nothing is initialised; it is never unloaded; the name determines the
    // function's type.
    let found = unsafe {
        let library = Library::open(Some(file), RTLD_NOW | LOADED_ONLY).ok()?;
        let found = *library
            .get::<EndFrame>(END_FRAME.to_bytes_with_nul())
            .ok()?;
        std::mem::forget(library);
        found
    };
    Some(*FUNCTION.get_or_init(|| found))
}

/// Ends a frame that shows these views.
pub(crate) fn end_frame(device: u64, views: &[ShownView; 2]) {
    if let Some(function) = function() {
        // SAFETY: a live device, and two views.
        unsafe { function(device, views.as_ptr()) };
    }
}
