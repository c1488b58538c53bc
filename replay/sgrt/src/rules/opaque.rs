//! `opaque`: rejects arrivals on a material through which rays may pass.

use super::{RuleKind, Test};
use crate::frame::{Frame, Sample};
use crate::place::RightSample;
use crate::reads::{Around, Reads};

/// An object has one material, so reading its number suffices.
pub static RULE: RuleKind = RuleKind {
    name: "opaque",
    title: "its material has holes",
    help: "the material has texels that let rays pass (an alpha mask, or a blended texture), so a \
           ray beside the left one may go on",
    takes_share: false,
    reads: Reads {
        object: Some(Around::Own),
        ..Reads::NOTHING
    },
    test: Some(|frame, _, _| Box::new(Opaque { frame })),
    retests: None,
};

struct Opaque<'a> {
    frame: &'a Frame,
}

impl Test for Opaque<'_> {
    fn rejects(&self, _: RightSample, hit: &Sample) -> bool {
        let material = self.frame.tables.materials.get(hit.material as usize);
        !hit.is_sky() && material.is_some_and(|m| m.alpha_masked)
    }
}
