//! Published savings and the measured ones.

use crate::columns::{Column, Columns, columns_of};
use sim::paper::vr::{CLAIMS, Claim, Quantity};
use studies::techniques::{Measured, Measures};

/// A published saving, and the measured one on a scene.
pub(super) struct ClaimRow<'a> {
    claim: &'static Claim,
    measured: &'a Measured<'a>,
}

/// Each claim on each scene that has the technique on its own.
pub fn claims<'a>(scenes: &'a [Measures<'a>]) -> Vec<ClaimRow<'a>> {
    let of = |claim: &'static Claim| {
        let rows = scenes.iter().flat_map(|scene| &scene.rows);
        rows.filter(|m| m.row.parts.len() == 1 && claim.is_about(&m.row.settings))
            .map(move |measured| ClaimRow { claim, measured })
    };
    CLAIMS.iter().flat_map(of).collect()
}

impl ClaimRow<'_> {
    fn saved_pct(&self) -> Option<f64> {
        let m = self.measured;
        let ratio = match self.claim.quantity {
            Quantity::CullTests => m.over_baseline(|f| Some(f.cull_tests)),
            Quantity::Draws => m.over_baseline(|f| Some(f.draws)),
            Quantity::Fragments => m.over_baseline(|f| f.fragments),
            Quantity::FrameTime => Some(m.timing.ratio.median),
        };
        Some(100.0 * (1.0 - ratio?))
    }
}

/// The table of published savings.
#[rustfmt::skip]
pub(super) fn claim_columns<'a>() -> Vec<Column<'static, ClaimRow<'a>>> {
    columns_of::<ClaimRow>()
        .text("technique", "technique", |r| {
            r.measured.row.technique.as_str()
        })
        .text("quantity", "saves", |r| r.claim.quantity.title())
        .real("published_pct", "published", "%", 0, |r| r.claim.text()).published()
        .text("scene", "on", |r| r.measured.scene)
        .real("ours_pct", "ours", "%", 1, |r| r.saved_pct())
        .real("flip_mean", "FLIP", "", 5, |r| r.measured.pictures.flip_mean)
        .text("source", "source", |r| r.claim.source).published()
}
