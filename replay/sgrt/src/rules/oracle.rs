//! `oracle`: rejects exactly what would be seen to be wrong. It bounds what any detection can reach.

use super::{RuleKind, Test};
use crate::frame::{Frame, Sample};
use crate::place::RightSample;
use crate::reads::Reads;

pub static RULE: RuleKind = RuleKind {
    name: "oracle",
    title: "it is wrong by more than a share of the brightest colour (a bound: no device knows this)",
    help: "the traced hit is another triangle, and its colour differs by more than a share of the \
           brightest one; where shadow outcomes are wrong by as much, the shadow rays are traced again. \
           No device knows this, and nothing is charged for it: a bound for all rules",
    takes_share: true,
    reads: Reads::NOTHING,
    test: Some(|frame, _, share| Box::new(Oracle { frame, share })),
    retests: None,
};

struct Oracle<'a> {
    frame: &'a Frame,
    share: f32,
}

/// Encoding of displays, close to sRGB.
fn encoded(linear: [f32; 3]) -> [f32; 3] {
    linear.map(|v| v.clamp(0.0, 1.0).powf(1.0 / 2.2))
}

impl Oracle<'_> {
    /// Whether the colours of a left and a right sample differ by more than the share.
    fn differs(&self, left: &Sample, right: &Sample) -> bool {
        let (a, b) = (encoded(left.color()), encoded(right.color()));
        (0..3).any(|c| (a[c] - b[c]).abs() > self.share)
    }
}

impl Test for Oracle<'_> {
    fn rejects(&self, at: RightSample, hit: &Sample) -> bool {
        let truth = &self.frame.right().samples[at.index];
        truth.primitive != hit.primitive && self.differs(hit, truth)
    }

    fn retraces_shadows(&self, at: RightSample, source: u32) -> bool {
        let (left, right) = (self.frame.left(), self.frame.right());
        let outcomes = |of: &crate::frame::EyeFrame, index: usize| of.work[index].shadow_outcomes();
        let source = source as usize;
        outcomes(left, source) != outcomes(right, at.index)
            && self.differs(&left.samples[source], &right.samples[at.index])
    }
}
