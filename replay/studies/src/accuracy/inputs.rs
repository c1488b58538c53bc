//! Inputs of the studies.

use super::headline::Replays;
use crate::experiment::{Subject, frame_count};
use crate::techniques::Folder;
use serde::Deserialize;
use sgrt::frame::RaySource;
use sim::config::RunConfig;
use std::time::Duration;

/// A named ray trace.
pub struct Rays<'a> {
    /// Short name of the scene.
    pub label: String,
    /// The trace.
    pub source: &'a dyn RaySource,
}

/// The precision of one arithmetic at one distance, as `tracegen precision` writes it.
#[derive(Clone, Debug, Deserialize)]
pub struct TraversalRow {
    /// Arithmetic for rays and triangles.
    pub arithmetic: String,
    /// Distance from the origin, metres.
    pub at_m: f64,
    /// Rays whose hit or miss differs from the reference's, percent.
    pub wrong_pct: f64,
    /// Largest error of the distance over the distance, parts per million.
    pub distance_ppm: f64,
    /// Time over that of double precision.
    pub time_ratio: f64,
}

/// Inputs of all studies. A study without input is skipped.
pub struct Inputs<'a> {
    /// The machine.
    pub config: RunConfig,
    /// Texture traces.
    pub subjects: Vec<Subject<'a>>,
    /// References for captures of their views.
    pub truths: Vec<Subject<'a>>,
    /// Captures of their views by other drivers.
    pub captures: Vec<Subject<'a>>,
    /// Capture time of traces in seconds, by label.
    pub seconds: Vec<(String, f64)>,
    /// Ray traces.
    pub rays: Vec<Rays<'a>>,
    /// Folders written by `tracegen techniques`.
    pub techniques: &'a [Folder],
    /// Precision of the ray traversal.
    pub traversal: Vec<TraversalRow>,
    /// Cache of replays.
    pub replays: Replays,
}

impl<'a> Inputs<'a> {
    /// Traces of a single frame, used by every study except that of frames.
    pub(super) fn stills(&self) -> impl Iterator<Item = &Subject<'a>> {
        let still = |s: &&Subject<'a>| frame_count(s.source.tables()) == 1;
        self.subjects.iter().filter(still)
    }

    /// Traces of several frames.
    pub fn moving(&self) -> impl Iterator<Item = &Subject<'a>> {
        let moves = |s: &&Subject<'a>| frame_count(s.source.tables()) > 1;
        self.subjects.iter().filter(moves)
    }
}

/// Ratio of two times.
pub fn time_ratio(time: Duration, reference: Duration) -> f64 {
    time.as_secs_f64() / reference.as_secs_f64().max(1e-9)
}
