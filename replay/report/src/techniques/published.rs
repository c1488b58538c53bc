//! Published savings and the measured ones.

use crate::columns::Column;
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
    vec![
        Column::text("technique", "technique", |r: &ClaimRow| {
            r.measured.row.technique.as_str()
        }),
        Column::text("quantity", "saves", |r: &ClaimRow| r.claim.quantity.title()),
        Column::real("published_pct", "published", "%", 0, |r: &ClaimRow| r.claim.text()).published(),
        Column::text("scene", "on", |r: &ClaimRow| r.measured.scene),
        Column::real("ours_pct", "ours", "%", 1, |r: &ClaimRow| r.saved_pct()),
        Column::real("flip_mean", "FLIP", "", 5, |r: &ClaimRow| r.measured.pictures.flip_mean),
        Column::text("source", "source", |r: &ClaimRow| r.claim.source).published(),
    ]
}
