//! A path's figures from a sample of its frames (`replay.sample/1`), and how often such samples hold
//! (`replay.sample-trial/1`).

use super::answers::{self, Sampled};
use super::columns::{Columns, columns_of};
use super::document::Document;
use super::table::{Style, Table};
use serde::Serialize;
use sim::figure::Figure;
use studies::sampling::of::Of;
use studies::sampling::trial::Trial;

/// A figure of an order on a machine.
#[derive(Clone, Debug)]
pub struct SampleRow {
    /// L1 and L2, as in `16/256`.
    pub caches: String,
    /// The order.
    pub order: String,
    /// Which figure.
    pub of: Of,
    /// The figure with its interval.
    pub figure: Figure,
    /// Lowest and highest value for whatever the frames before the captured ones left in the caches.
    pub warm_up: Option<Figure>,
    /// Whether the interval is as narrow as promised.
    pub kept: bool,
}

/// How many frames a path has and how many were captured.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct SampleJson {
    /// The promise, as given.
    within: String,
    /// Probability that all intervals hold together, percent.
    confidence_pct: f64,
    /// Seed of the sample.
    seed: u64,
    /// The order that savings are over.
    baseline: String,
    /// Frames of the path.
    frames: usize,
    /// Strata: frames, and those that were captured.
    strata: Vec<[usize; 2]>,
    /// Frames to capture next, as `tracegen raster --frames` takes them; empty if the sample is complete.
    capture: String,
    /// Why the cold start of frames is not bounded, if it is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_bounded: Option<&'static str>,
    /// Figures.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")
    )]
    rows: Table,
}

/// The answer of a sample, or the frames that it lacks.
#[derive(Clone, Debug)]
pub struct SampleReport {
    /// Rows, empty while frames are missing.
    pub rows: Vec<SampleRow>,
    /// The promise, as given.
    pub within: String,
    /// Probability that all intervals hold together.
    pub confidence: f64,
    /// Seed of the sample.
    pub seed: u64,
    /// The order that savings are over.
    pub baseline: String,
    /// Frames of each stratum, and those that were captured.
    pub strata: Vec<[usize; 2]>,
    /// Frames to capture next.
    pub capture: Vec<u32>,
    /// Why the cold start of frames is not bounded, if it is not.
    pub not_bounded: Option<&'static str>,
}

/// Numbers as `tracegen raster --frames` takes them: `3,17,40..43`. A single number is a range, because a number alone
/// is a count.
pub fn frame_list(frames: &[u32]) -> String {
    let mut runs: Vec<[u32; 2]> = Vec::new();
    for &frame in frames {
        match runs.last_mut() {
            Some([_, end]) if *end == frame => *end += 1,
            _ => runs.push([frame, frame + 1]),
        }
    }
    let alone = runs.len() == 1;
    let write = |[first, end]: &[u32; 2]| match end - first {
        1 if !alone => first.to_string(),
        _ => format!("{first}..{end}"),
    };
    runs.iter().map(write).collect::<Vec<_>>().join(",")
}

/// A figure as it is shown: shares in percent, and what is saved instead of what is left.
pub fn shown(of: Of, figure: Figure) -> Figure {
    let figure = figure.times(of.scale());
    match of {
        Of::Saving => Figure {
            value: 100.0 - figure.value,
            low: 100.0 - figure.high,
            high: 100.0 - figure.low,
            ..figure
        },
        _ => figure,
    }
}

fn name_of(of: Of) -> &'static str {
    match of {
        Of::Saving => "saving, %",
        Of::Bytes => "external bytes per frame",
        Of::L1Misses => "L1 footprint misses, %",
        Of::L2Misses => "L2 line misses, %",
        Of::Cycles => "cycles per frame",
    }
}

impl SampleReport {
    fn frames(&self) -> [usize; 2] {
        [0, 1].map(|at| self.strata.iter().map(|stratum| stratum[at]).sum())
    }
}

impl Document for SampleReport {
    const SCHEMA: &'static str = "replay.sample/1";

    fn content(&self) -> impl Serialize {
        SampleJson {
            within: self.within.clone(),
            confidence_pct: 100.0 * self.confidence,
            seed: self.seed,
            baseline: self.baseline.clone(),
            frames: self.frames()[0],
            strata: self.strata.clone(),
            capture: frame_list(&self.capture),
            not_bounded: self.not_bounded,
            rows: self.rows(),
        }
    }

    fn rows(&self) -> Table {
        let columns = columns_of::<SampleRow>()
            .text("caches", "L1/L2", |r| r.caches.clone())
            .text("order", "order", |r| r.order.clone())
            .text("figure", "figure", |r| name_of(r.of))
            .real("value", "value", "", 2, |r| shown(r.of, r.figure.clone()))
            .real("warm_up", "for any caches before", "", 2, |r| {
                r.warm_up.clone().map(|bounds| shown(r.of, bounds))
            })
            .text("kept", "within", |r| r.kept);
        Table::new(&columns, &self.rows)
    }

    fn answer(&self) -> Vec<String> {
        let [of, n] = self.frames();
        if !self.capture.is_empty() {
            return vec![format!(
                "{} of {of} frames are missing: capture them with --frames {}",
                self.capture.len(),
                frame_list(&self.capture)
            )];
        }
        let rows: Vec<Sampled> = (self.rows.iter())
            .map(|row| Sampled {
                order: row.order.clone(),
                caches: row.caches.clone(),
                figure: shown(row.of, row.figure.clone()),
            })
            .collect();
        let figure = self.rows.first().map_or(Of::Saving, |row| row.of);
        let found = answers::sampled(figure, name_of(figure), &self.baseline, &rows);
        let kept = match self.rows.iter().all(|row| row.kept) {
            true => format!("within {}", self.within),
            false => format!(
                "not all within {}: more frames would be needed",
                self.within
            ),
        };
        let cold = self
            .not_bounded
            .map(|why| format!("What earlier frames left in the caches is not bounded ({why})."));
        let promise = format!(
            "{n} of {of} frames in the sample; all intervals hold together with {} % confidence, {kept}.",
            100.0 * self.confidence
        );
        let parts = [found, Some(promise), cold];
        parts.into_iter().flatten().collect()
    }

    fn text(&self, style: Style) -> String {
        match self.rows.is_empty() {
            true => String::new(),
            false => self.rows().styled(style),
        }
    }
}

/// Trials of a figure of an order on a machine.
#[derive(Clone, Debug)]
pub struct TrialRow {
    /// L1 and L2, as in `16/256`.
    pub caches: String,
    /// The order.
    pub order: String,
    /// Which figure.
    pub of: Of,
    /// The trials.
    pub trial: Trial,
}

/// Trials of all figures of a path.
#[derive(Clone, Debug, Default)]
pub struct TrialReport {
    /// Rows.
    pub rows: Vec<TrialRow>,
}

/// The JSON object's members.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TrialJson {
    /// Trials.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")
    )]
    rows: Table,
}

impl Document for TrialReport {
    const SCHEMA: &'static str = "replay.sample-trial/1";

    fn content(&self) -> impl Serialize {
        TrialJson { rows: self.rows() }
    }

    #[rustfmt::skip]
    fn rows(&self) -> Table {
        let scaled = |r: &TrialRow, value: f64| r.of.scale() * value;
        let columns = columns_of::<TrialRow>()
            .text("caches", "L1/L2", |r| r.caches.clone())
            .text("order", "order", |r| r.order.clone())
            .text("figure", "figure", |r| name_of(r.of))
            .real("truth", "all frames", "", 2, |r| shown(r.of, Figure::exact(r.trial.truth)).value)
            .real("holds_pct", "interval holds", "%", 1, |r| r.trial.holds_pct)
            .real("kept_pct", "as narrow as promised", "%", 1, |r| r.trial.kept_pct)
            .real("of_everything", "drew all frames", "samples", 0, |r| r.trial.of_everything as f64)
            .real("mean_frames", "frames", "", 1, |r| r.trial.mean_frames)
            .real("oracle_frames", "frames of the oracle", "", 0, |r| r.trial.oracle_frames as f64)
            .real("frames", "of", "", 0, |r| r.trial.frames as f64)
            .real("mean_half", "half width", "", 3, move |r| scaled(r, r.trial.mean_half))
            .real("known_half", "with known deviation", "", 3, move |r| scaled(r, r.trial.known_half));
        Table::new(&columns, &self.rows)
    }

    fn text(&self, style: Style) -> String {
        self.rows().styled(style)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_listed_as_ranges_without_their_end() {
        assert_eq!(frame_list(&[3, 17, 40, 41, 42]), "3,17,40..43");
        assert_eq!(frame_list(&[5]), "5..6");
        assert_eq!(frame_list(&[5, 7]), "5,7");
    }

    #[test]
    fn a_saving_is_what_the_ratio_leaves() {
        let ratio = Figure::bounded(0.6, [0.5, 0.8], String::new());
        let saving = shown(Of::Saving, ratio);
        assert!((saving.value - 40.0).abs() < 1e-9);
        assert!((saving.low - 20.0).abs() < 1e-9 && (saving.high - 50.0).abs() < 1e-9);
    }
}
