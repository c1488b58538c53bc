//! The headline figures, and the error of one replay's figures against another's.

use super::metric::{Metric, metric};
use super::stopwatch::Stopwatch;
use crate::experiment::Subject;
use sim::config::{Order, RunConfig};
use sim::engine::{ReplayError, replay};
use sim::result::RunResult;
use sim::stream::TileSource;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Headline figures of texture traces.
pub(super) const TEXTURE_FIGURES: [Metric; 6] = [
    metric("external_bytes", "external bytes", "%"),
    metric("l1_footprint_miss_pct", "L1 miss rate", "points"),
    metric("l2_line_miss_pct", "L2 miss rate", "points"),
    metric("reduction_pct", "saved against Morton", "points"),
    metric("tmu_util_pct", "TMU utilisation", "points"),
    metric("tmu_ratio", "TMU utilisation over Morton's", "%"),
];

/// The headline figure of ray traces.
pub const REUSE: Metric = metric("reuse_pct", "right pixels reused", "points");

/// All figures in the table of errors.
pub fn headline_figures() -> impl Iterator<Item = Metric> {
    TEXTURE_FIGURES.into_iter().chain([REUSE])
}

/// Caches replays, so that studies with the same configuration share the result and its time.
#[derive(Default)]
pub struct Replays(Mutex<Vec<(String, RunConfig, Arc<Replayed>)>>);

impl Replays {
    /// A trace replayed with a configuration in both orders; the second call returns the first one's
    /// result.
    ///
    /// # Errors
    /// See [`replay`].
    pub fn of(
        &self,
        subject: &Subject<'_>,
        config: RunConfig,
    ) -> Result<Arc<Replayed>, ReplayError> {
        let mut made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |(label, of, _): &&(String, RunConfig, Arc<Replayed>)| {
            *label == subject.label && *of == config
        };
        if let Some((.., replayed)) = made.iter().find(same) {
            return Ok(Arc::clone(replayed));
        }
        let replayed = Arc::new(Replayed::new(subject.source, config)?);
        made.push((subject.label.clone(), config, Arc::clone(&replayed)));
        Ok(replayed)
    }
}

/// A trace in Morton order and in Z2 STA.
pub struct Replayed {
    /// Both results.
    pub results: [RunResult; 2],
    /// Time of both replays.
    pub time: Duration,
}

impl Replayed {
    /// Replays a trace in both orders.
    ///
    /// # Errors
    /// See [`replay`].
    pub fn new(trace: &dyn TileSource, config: RunConfig) -> Result<Self, ReplayError> {
        let start = Stopwatch::start();
        let of = |order| replay(trace, &RunConfig { order, ..config });
        let results = [of(Order::MORTON)?, of(Order::Z2_STA)?];
        Ok(Self {
            results,
            time: start.elapsed(),
        })
    }

    /// The figures in both orders.
    fn figures(&self) -> [[Option<f64>; 2]; 6] {
        let [morton, sta] = &self.results;
        let both = |of: fn(&RunResult) -> f64| [Some(of(morton)), Some(of(sta))];
        let tmu = |result: &RunResult| Some(100.0 * result.tmu.as_ref()?.utilization);
        let saved = 1.0 - sta.external_bytes as f64 / (morton.external_bytes.max(1)) as f64;
        let ratio = tmu(sta).zip(tmu(morton)).map(|(sta, morton)| sta / morton);
        [
            both(|r| r.external_bytes as f64),
            both(|r| 100.0 * r.l1.footprint_miss_rate),
            both(|r| 100.0 * r.l2.line_miss_rate),
            [None, Some(100.0 * saved)],
            [tmu(morton), tmu(sta)],
            [None, ratio],
        ]
    }

    /// Errors against another replay, in the order of [`TEXTURE_FIGURES`]; the larger of both orders.
    pub fn errors(&self, reference: &Self) -> Vec<Option<f64>> {
        let (ours, theirs) = (self.figures(), reference.figures());
        let pairs = ours.iter().zip(&theirs).zip(TEXTURE_FIGURES);
        pairs
            .map(|((ours, theirs), figure)| {
                let both = ours.iter().zip(theirs);
                let found = both.filter_map(|(a, b)| error(figure.unit, (*a)?, (*b)?));
                found.max_by(|a, b| a.abs().total_cmp(&b.abs()))
            })
            .collect()
    }
}

/// The error of a figure; relative if its unit is percent.
fn error(unit: &str, variant: f64, reference: f64) -> Option<f64> {
    match unit {
        "%" => (reference > 0.0).then(|| 100.0 * (variant / reference - 1.0)),
        _ => Some(variant - reference),
    }
}
