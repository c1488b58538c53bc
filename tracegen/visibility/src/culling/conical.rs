//! Conical culling: the part of each eye's frustum that is visible through its round lens.
//!
//! The frustum is also tested, because the lens may extend beyond the picture.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// The frustum and lens cone of each eye.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let eyes = frame.rig.eyes().iter();
    Ok(Volumes::Any(
        eyes.map(|eye| Volume::new(eye.frustum(frame.extent), Some(eye.lens_cone())))
            .collect(),
    ))
}
