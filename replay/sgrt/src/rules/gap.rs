//! `gap`: rejects the last arrival before a gap of its row.

use super::{RuleKind, Test};
use crate::frame::Sample;
use crate::place::{RIGHT, RightSample};
use crate::reads::Reads;

/// Only whether something arrived is needed, which reprojection knows itself.
pub static RULE: RuleKind = RuleKind {
    name: "gap",
    title: "nothing arrived at the next pixel of its row",
    help: "nothing arrived at the next pixel of its row, so the edge of a surface may be in this one",
    takes_share: false,
    reads: Reads::NOTHING,
    test: Some(|_, _, _| Box::new(Gap)),
    retests: None,
};

struct Gap;

impl Test for Gap {
    fn rejects(&self, at: RightSample, _: &Sample) -> bool {
        at.neighbours(&RIGHT)
            .any(|next| next.candidate().is_missing())
    }
}
