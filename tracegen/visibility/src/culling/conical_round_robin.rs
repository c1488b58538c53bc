//! Conical round-robin culling: uses the lens of one eye, and that of the other eye in the next frame.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// Frustum and lens cone of the frame's eye.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let eye = frame.rig.frame_eye(frame.number);
    Ok(Volumes::Any(vec![Volume::new(
        eye.frustum(frame.extent),
        Some(eye.lens_cone()),
    )]))
}
