//! Round-robin culling: uses one eye's frustum for both eyes, and the other eye's in the next frame.
//!
//! Draws that only the other eye sees may be missing for one frame.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// Frustum of the frame's eye.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let eye = frame.rig.frame_eye(frame.number);
    Ok(Volumes::Any(vec![Volume::new(
        eye.frustum(frame.extent),
        None,
    )]))
}
