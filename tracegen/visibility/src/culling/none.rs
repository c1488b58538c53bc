//! No culling: every draw, in both eyes.

use super::{CullInput, Volumes};
use crate::rig::TooWide;

/// All of space.
pub(super) fn volumes(_: &CullInput<'_>) -> Result<Volumes, TooWide> {
    Ok(Volumes::Everything)
}
