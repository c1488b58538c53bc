//! `triangle`: rejects pixels whose ray misses the triangle to be reused.

use super::RuleKind;
use crate::reads::{Around, Reads};

pub static RULE: RuleKind = RuleKind {
    name: "triangle",
    title: "the right-eye ray misses its triangle",
    help: "the right-eye ray misses the triangle that the left one hit; where it hits, the right \
           hit is exact",
    takes_share: false,
    reads: Reads {
        triangle: Some(Around::Own),
        ..Reads::NOTHING
    },
    test: None,
    retests: Some(&[]),
};
