//! `silhouette`: rejects arrivals at the edge of an object.

use super::{RuleKind, Test};
use crate::frame::Sample;
use crate::place::{EIGHT, RightSample};
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "silhouette",
    title: "a neighbour of another object",
    help: "one of the 8 neighbours is missing or of another object",
    takes_share: false,
    reads: Reads {
        object: Some(Around::Square),
        ..Reads::NOTHING
    },
    test: Some(|_, _, _| Box::new(Silhouette)),
    retests: None,
};

struct Silhouette;

impl Test for Silhouette {
    fn rejects(&self, at: RightSample, _: &Sample) -> bool {
        let other =
            |n: RightSample| n.candidate().is_missing() || n.source().object != at.source().object;
        at.neighbours(&EIGHT).any(other)
    }
}
