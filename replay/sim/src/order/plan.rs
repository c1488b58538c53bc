//! The work of a frame in phases: a frame's shadow maps and pictures for both eyes come first, each alone in
//! the order's single-view curve; then what one eye sees, and layers, in the order of the passes: a left
//! and a right pass that show the same as the order combines them, each other one alone. Every order
//! visits every tile of every pass exactly once.

use super::parts::Direction;
use super::{Order, PlanInputs, View, WorkItem};
use formats::textrace::{Pass, PassKind};
use formats::view::Eye;

/// Work that may run at the same time; the next phase waits for it (a picture needs its shadow
/// map, a frame the one before).
pub type Phase = Vec<WorkItem>;

/// The numbers of all frames, ascending.
pub fn frames(passes: &[Pass]) -> Vec<u32> {
    let mut frames: Vec<u32> = passes.iter().map(|pass| pass.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// The work of one frame, monoscopic passes before the stereo pair. `stream::Walk` plans a whole trace.
pub fn plan_frame(
    order: Order,
    inputs: &PlanInputs<'_>,
    passes: &[Pass],
    frame: u32,
) -> Vec<Phase> {
    let parts = order.parts();
    let mut phases: Vec<Phase> = (views(passes, frame).into_iter())
        .map(|phase| match phase {
            Views::One(view) => parts.mono(view, inputs),
            Views::Pair(left, right) => match order.listed_items(left) {
                Some(items) => items.to_vec(),
                None => parts.stereo(left, right, inputs),
            },
        })
        .collect();
    if parts.direction == Direction::Boustro && !frame.is_multiple_of(2) {
        phases.iter_mut().for_each(|phase| phase.reverse());
    }
    let Some(assignment) = parts.assignment else {
        return phases;
    };
    let columns = |pass: u32| passes.get(pass as usize).map_or(1, |pass| pass.tiles[0]);
    let deal = |phase| assignment.deal(phase, inputs.cores, &columns);
    phases.into_iter().map(deal).collect()
}

/// The views of a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Views {
    /// One view alone.
    One(View),
    /// A left and a right view that show the same.
    Pair(View, View),
}

/// The views of a frame, phase by phase.
pub fn views(passes: &[Pass], frame: u32) -> Vec<Views> {
    let of_frame = passes.iter().enumerate().filter(|(_, p)| p.frame == frame);
    let first = of_frame.clone().next().map_or(0, |(index, _)| index);
    let view = |(index, pass): (usize, &Pass)| View::of(index as u32, (index - first) as u32, pass);
    let (seen, before): (Vec<_>, Vec<_>) =
        of_frame.partition(|(_, p)| p.kind == PassKind::Layer || (p.is_seen() && p.eye.is_some()));
    let mut phases: Vec<Views> = before.into_iter().map(view).map(Views::One).collect();
    let mut open = seen;
    while !open.is_empty() {
        let pass = open.remove(0);
        let Some(partner) = open.iter().position(|other| pair(pass.1, other.1)) else {
            phases.push(Views::One(view(pass)));
            continue;
        };
        let other = open.remove(partner);
        let (left, right) = match pass.1.eye {
            Some(Eye::Left) => (pass, other),
            _ => (other, pass),
        };
        phases.push(Views::Pair(view(left), view(right)));
    }
    phases
}

/// Whether two passes of a frame are a left and a right one that show the same.
fn pair(a: &Pass, b: &Pass) -> bool {
    let eyes = matches!(
        (a.eye, b.eye),
        (Some(Eye::Left), Some(Eye::Right)) | (Some(Eye::Right), Some(Eye::Left))
    );
    eyes && a.kind == b.kind
        && a.layer == b.layer
        && (a.kind == PassKind::Main || a.size_px == b.size_px)
}
