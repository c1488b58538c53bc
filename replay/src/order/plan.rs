//! All work of a trace in phases: a frame's monoscopic passes (shadow maps) come first, each alone
//! in the order's single-view curve; then the two main passes, as the order combines them. Every
//! order visits every tile of every pass exactly once.

use super::{TileOrder, View, WorkItem};
use formats::textrace::{Pass, PassKind};
use formats::view::Eye;

/// Work that may run at the same time; the next phase waits for it (a picture needs its shadow
/// map, a frame the one before).
pub type Phase = Vec<WorkItem>;

/// All work of a trace: frame after frame, monoscopic passes before the stereo pair.
#[must_use]
pub fn plan(order: &dyn TileOrder, passes: &[Pass]) -> Vec<Phase> {
    let mut frames: Vec<u32> = passes.iter().map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    let plan = |frame| plan_frame(order, passes, frame);
    frames.into_iter().flat_map(plan).collect()
}

/// The work of one frame.
#[must_use]
pub fn plan_frame(order: &dyn TileOrder, passes: &[Pass], frame: u32) -> Vec<Phase> {
    let views = |eye: Option<Eye>| {
        let of_frame = passes
            .iter()
            .enumerate()
            .filter(move |(_, p)| p.frame == frame);
        of_frame.filter(move |(_, p)| eye == p.eye.filter(|_| p.kind == PassKind::Main))
    };
    let view = |(index, pass): (usize, &Pass)| View {
        pass: index as u32,
        tiles: pass.tiles,
    };
    let mut phases: Vec<Phase> = views(None).map(|mono| order.mono(view(mono))).collect();
    let mut lefts = views(Some(Eye::Left)).map(view);
    let mut rights = views(Some(Eye::Right)).map(view);
    loop {
        match (lefts.next(), rights.next()) {
            (Some(left), Some(right)) => phases.push(order.stereo(left, right)),
            (Some(alone), None) | (None, Some(alone)) => phases.push(order.mono(alone)),
            (None, None) => break,
        }
    }
    phases
}
