//! `depth`: rejects arrivals behind a neighbour.

use super::{RuleKind, Test};
use crate::frame::Sample;
use crate::place::{FOUR, RightSample};
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "depth",
    title: "behind a neighbour",
    help: "farther than what arrived at one of the 4 neighbours by more than SHARE of its depth",
    takes_share: true,
    reads: Reads {
        position: Some(Around::Cross),
        ..Reads::NOTHING
    },
    test: Some(|_, _, share| Box::new(Depth { share })),
    retests: None,
};

struct Depth {
    share: f32,
}

impl Test for Depth {
    fn rejects(&self, at: RightSample, _: &Sample) -> bool {
        let behind =
            |n: RightSample| at.candidate().depth > n.candidate().depth * (1.0 + self.share);
        at.arrived_neighbours(&FOUR).any(behind)
    }
}
