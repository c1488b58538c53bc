//! Conical round-robin culling: by one eye's lens, and by the other eye's in the next frame.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// The frustum and lens cone of the eye whose turn it is.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let eye = frame.rig.turn(frame.number);
    Ok(Volumes::Any(vec![Volume::new(
        eye.frustum(frame.extent),
        Some(eye.lens_cone()),
    )]))
}
