//! Per-eye frustum culling, the baseline: two frusta, with their lists merged.

use super::{CullInput, Volumes};
use crate::rig::TooWide;
use crate::volume::Volume;

/// The frustum of each eye.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let frusta = frame.rig.eyes().iter();
    Ok(Volumes::Any(
        frusta
            .map(|eye| Volume::new(eye.frustum(frame.extent), None))
            .collect(),
    ))
}
