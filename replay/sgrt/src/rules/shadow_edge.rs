//! `shadow-edge`: traces shadow rays again at the edges of shadows.

use super::{RuleKind, Test};
use crate::frame::{Frame, Sample};
use crate::place::{EIGHT, RightSample};
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "shadow-edge",
    title: "rejects nothing; its shadow rays are traced again at the edge of a shadow",
    help: "nothing, but where one of the 8 neighbours has other shadow outcomes than the reused left pixel, \
           the shadow rays are traced again; matters with reuse of shadow outcomes",
    takes_share: false,
    reads: Reads {
        shadow: Some(Around::Square),
        ..Reads::NOTHING
    },
    test: Some(|frame, _, _| Box::new(ShadowEdge { frame })),
    retests: None,
};

struct ShadowEdge<'a> {
    frame: &'a Frame,
}

impl ShadowEdge<'_> {
    /// Shadow outcomes of a left pixel, and how many there are: none on a surface that faces away from all lights.
    fn outcomes(&self, source: u32) -> (u64, u32) {
        self.frame.left().work[source as usize].shadow_outcomes()
    }
}

impl Test for ShadowEdge<'_> {
    fn rejects(&self, _: RightSample, _: &Sample) -> bool {
        false
    }

    fn retraces_shadows(&self, at: RightSample, source: u32) -> bool {
        let own = self.outcomes(source);
        let other = |n: RightSample| self.outcomes(n.candidate().source) != own;
        at.arrived_neighbours(&EIGHT).any(other)
    }
}
