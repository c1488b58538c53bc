//! No culling: every draw, in both eyes.

use super::{Frame, Volumes};
use crate::rig::TooWide;

/// All of space.
pub(super) fn volumes(_: &Frame<'_>) -> Result<Volumes, TooWide> {
    Ok(Volumes::Everything)
}
