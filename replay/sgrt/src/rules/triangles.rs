//! `triangles`: rejects pixels whose ray misses all triangles that arrived around it.

use super::RuleKind;
use crate::place::EIGHT;
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "triangles",
    title: "the right-eye ray misses all triangles around it",
    help: "the right-eye ray misses the triangles of the pixel and of its 8 neighbours; else the \
           nearest hit is reused, and it is exact",
    takes_share: false,
    reads: Reads {
        triangle: Some(Around::Square),
        ..Reads::NOTHING
    },
    test: None,
    retests: Some(&EIGHT),
};
