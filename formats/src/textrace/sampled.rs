//! Frames of a path that are planned or captured one by one: what `META` says of them.

use crate::error::{Broken, ensure};
use crate::view::FrameViews;
use serde::{Deserialize, Serialize};

/// What is known of a frame without drawing it. Counts tell frames apart; they are no results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedFrame {
    /// Draws of all views.
    pub draws: u64,
    /// Their triangles.
    pub triangles: u64,
    /// Texels of the mip levels that the frame may sample.
    pub texels: u64,
    /// Texels of the mip levels that the frame before may not sample.
    pub new_texels: u64,
}

/// Checks that a plan has an entry for each frame, and that frames that fill caches are frames of the trace.
pub(super) fn check(
    frames: &[FrameViews],
    plan: Option<&[PlannedFrame]>,
    warm_frames: &[u32],
) -> Result<(), Broken> {
    if let Some(plan) = plan {
        ensure(
            plan.len() == frames.len(),
            "plan",
            format_args!("an entry for each of {} frames", frames.len()),
            plan.len(),
        )?;
    }
    let known = |frame: &u32| {
        frames
            .binary_search_by_key(frame, |views| views.frame)
            .is_ok()
    };
    ensure(
        warm_frames.is_sorted_by(|a, b| a < b) && warm_frames.iter().all(known),
        "warm_frames",
        "numbers of frames, ascending",
        format_args!("{warm_frames:?}"),
    )
}
