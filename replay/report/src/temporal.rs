//! Reuse between the eyes and over time, frame by frame (`replay.temporal/1`).

use super::answers::{self, Scheme};
use super::columns::{Columns, columns_of, name};
use super::document::Document;
use super::lists::{self, geometric_mean};
use super::table::{Style, Table};
use serde::Serialize;
use sgrt::compose::Reuse;
use sgrt::config::SgrtConfig;
use sgrt::temporal::SchemeFigures;
use sim::result::TraceId;

/// The schemes on a frame.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct FrameSchemes {
    /// The frame before it.
    pub previous: TraceId,
    /// The frame.
    pub trace: TraceId,
    /// What each scheme gives.
    pub schemes: Vec<SchemeFigures>,
}

/// The schemes on all frames of a sequence but the first.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TemporalReport {
    rule: String,
    reuse: Reuse,
    config: SgrtConfig,
    frames: Vec<FrameSchemes>,
}

impl TemporalReport {
    /// A report on frames that were run with these settings.
    pub fn new(frames: Vec<FrameSchemes>, rule: String, reuse: Reuse, config: SgrtConfig) -> Self {
        Self {
            rule,
            reuse,
            config,
            frames,
        }
    }
}

impl Document for TemporalReport {
    const SCHEMA: &'static str = "replay.temporal/1";
    const HAS_DETAILS: bool = true;
    const MODEL_VERSION: u32 = sim::model_version::RAY_MODEL_VERSION;

    fn content(&self) -> impl Serialize {
        self
    }

    /// A row per frame and scheme.
    #[rustfmt::skip]
    fn rows(&self) -> Table {
        type SchemeLine<'a> = (&'a FrameSchemes, &'a SchemeFigures);
        let columns = columns_of::<SchemeLine<'_>>()
            .text("frame", "frame", |l| l.0.trace.name.clone())
            .text("scheme", "scheme", |l| l.1.scheme.name())
            .real("left_reused_pct", "left reused", "%", 1, |l| l.1.reused_pct[0])
            .real("right_reused_pct", "right reused", "%", 1, |l| l.1.reused_pct[1])
            .text("rays", "rays", |l| l.1.rays)
            .real("relative_performance", "performance", "ratio", 3, |l| l.1.relative_performance)
            .real("relative_energy", "energy", "ratio", 3, |l| l.1.relative_energy)
            .real("relative_energy_least", "14 nm, least", "ratio", 3, |l| l.1.relative_energy_bounds[0])
            .real("relative_energy_most", "14 nm, most", "ratio", 3, |l| l.1.relative_energy_bounds[1])
            .real("dram_mb", "DRAM", "MB", 2, |l| l.1.dram_bytes as f64 / 1e6)
            .real("gbuffer_dram_mb", "of G-buffers", "MB", 2, |l| l.1.gbuffer_dram_bytes as f64 / 1e6)
            .real("left_flip_mean", "left FLIP", "", 4, |l| l.1.flip_mean[0])
            .real("right_flip_mean", "right FLIP", "", 4, |l| l.1.flip_mean[1]);
        let lines: Vec<SchemeLine<'_>> = (self.frames.iter())
            .flat_map(|frame| frame.schemes.iter().map(move |scheme| (frame, scheme)))
            .collect();
        Table::new(&columns, &lines)
    }

    fn answer(&self) -> Vec<String> {
        let of = |name: &'static str| {
            let frames = self.frames.iter().flat_map(|frame| &frame.schemes);
            let own: Vec<&SchemeFigures> = frames.filter(|s| s.scheme.name() == name).collect();
            let mean = |value: fn(&SchemeFigures) -> f64| {
                geometric_mean(own.iter().map(|s| value(s).max(f64::MIN_POSITIVE))).unwrap_or(1.0)
            };
            let flip = own.iter().flat_map(|s| s.flip_mean);
            Scheme {
                name,
                performance: mean(|s| s.relative_performance),
                energy: mean(|s| s.relative_energy),
                energy_bounds: [
                    mean(|s| s.relative_energy_bounds[0]),
                    mean(|s| s.relative_energy_bounds[1]),
                ],
                flip: lists::mean(flip).unwrap_or(0.0),
            }
        };
        let others = self.frames.first().map_or(&[][..], |frame| &frame.schemes);
        let others = others.iter().map(|s| s.scheme.name());
        let others: Vec<Scheme> = others.filter(|name| *name != "full").map(of).collect();
        let mut out = answers::schemes(self.frames.len(), &others);
        let reuse = name(&self.reuse);
        out.push(format!(
            "Rule {}, reuse of {reuse}. Ratios are over tracing both eyes in full.",
            self.rule
        ));
        out
    }

    /// The main columns, and what the schemes are.
    fn text(&self, style: Style) -> String {
        let schemes = "\
full: both eyes are traced
stereo: the right eye from the left one
temporal: each eye from its previous frame
both: the left eye from its previous frame, the right eye from the left one";
        let keys = [
            "frame",
            "scheme",
            "left_reused_pct",
            "right_reused_pct",
            "relative_performance",
            "relative_energy",
            "relative_energy_least",
            "relative_energy_most",
        ];
        format!("{}\n{schemes}\n", self.rows().picked(keys).styled(style))
    }

    fn details(&self, style: Style) -> String {
        self.rows().styled(style)
    }
}
