//! Round-robin culling: one eye's frustum for both eyes, the other eye's in the next frame.
//!
//! What only the eye whose turn it is not sees may be missing, for one frame: the next frame culls
//! with that eye's frustum.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// The frustum of the eye whose turn it is.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let eye = frame.rig.turn(frame.number);
    Ok(Volumes::Any(vec![Volume::new(
        eye.frustum(frame.extent),
        None,
    )]))
}
