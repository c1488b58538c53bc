//! `object`: rejects arrivals without a neighbour of the same object.

use super::{RuleKind, Test};
use crate::frame::Sample;
use crate::place::{FOUR, RightSample};
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "object",
    title: "no neighbour of its object",
    help: "nothing of the same object arrived at any of the 4 neighbours",
    takes_share: false,
    reads: Reads {
        object: Some(Around::Cross),
        ..Reads::NOTHING
    },
    test: Some(|_, _, _| Box::new(Object)),
    retests: None,
};

struct Object;

impl Test for Object {
    fn rejects(&self, at: RightSample, _: &Sample) -> bool {
        let same = |n: RightSample| n.source().object == at.source().object;
        !at.arrived_neighbours(&FOUR).any(same)
    }
}
