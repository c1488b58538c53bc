//! `row`: rejects arrivals behind a surface of their row.

use super::{RuleKind, Test};
use crate::frame::{Frame, Sample};
use crate::place::RightSample;
use crate::reads::{Around, Reads};
use crate::reproject::Reprojection;

pub static RULE: RuleKind = RuleKind {
    name: "row",
    title: "behind a surface of its row",
    help: "behind a surface that two adjacent left pixels of one object span across it in the row, \
           by more than SHARE of the surface's depth",
    takes_share: true,
    reads: Reads {
        position: Some(Around::Next),
        object: Some(Around::Next),
        ..Reads::NOTHING
    },
    test: Some(|frame, arrived, share| {
        let nearest = spans(frame, arrived);
        Box::new(Row { nearest, share })
    }),
    retests: None,
};

struct Row {
    /// Depth of the nearest surface, by right sample.
    nearest: Vec<f32>,
    share: f32,
}

impl Test for Row {
    fn rejects(&self, at: RightSample, _: &Sample) -> bool {
        at.candidate().depth > self.nearest[at.index] * (1.0 + self.share)
    }
}

/// Adjacent left pixels belong to one surface if their depths differ by less than this share.
const SAME_SURFACE_SHARE: f32 = 0.05;

/// The nearest depth, at each right sample, of the segments between adjacent left pixels of one object in
/// its row; infinite without a segment.
///
/// A near surface that appears stretched to the right eye leaves gaps between its arrivals. The segments close them.
fn spans(frame: &Frame, arrived: &Reprojection) -> Vec<f32> {
    let width = frame.size_px[0] as usize;
    let mut nearest = vec![f32::INFINITY; frame.sample_count()];
    let samples = &frame.left().samples;
    for (index, a) in arrived.projected.iter().enumerate() {
        let next = index + 1;
        let is_last = index % width == width - 1;
        if is_last || samples[index].is_sky() || samples[index].object != samples[next].object {
            continue;
        }
        let b = &arrived.projected[next];
        let (near, far) = (a.depth.min(b.depth), a.depth.max(b.depth));
        let row = a.at_px[1];
        if far > near * (1.0 + SAME_SURFACE_SHARE) || row.is_nan() || row < 0.0 {
            continue;
        }
        let row = row as usize;
        if row >= frame.size_px[1] as usize {
            continue;
        }
        let (x0, x1) = (a.at_px[0], b.at_px[0]);
        let first = (x0.min(x1) - 0.5).ceil().max(0.0);
        let last = (x0.max(x1) - 0.5).floor().min(width as f32 - 1.0);
        let mut x = first;
        while x <= last {
            let share = if x1 == x0 {
                0.0
            } else {
                (x + 0.5 - x0) / (x1 - x0)
            };
            let depth = a.depth + (b.depth - a.depth) * share;
            let slot = &mut nearest[row * width + x as usize];
            *slot = slot.min(depth);
            x += 1.0;
        }
    }
    nearest
}
