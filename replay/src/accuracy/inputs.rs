//! What is measured.

use super::headline::Replays;
use crate::config::RunConfig;
use crate::experiment::{Subject, frame_count};
use crate::sgrt::frame::RaySource;
use crate::techniques::Folder;
use serde::Deserialize;
use std::time::Duration;

/// A ray trace under its name.
pub struct Rays<'a> {
    /// Short name of the scene.
    pub label: String,
    /// The trace.
    pub source: &'a dyn RaySource,
}

/// One arithmetic at one place, as `tracegen precision` writes it.
#[derive(Clone, Debug, Deserialize)]
pub struct TraversalRow {
    /// What rays and triangles are calculated in.
    pub arithmetic: String,
    /// How far from the origin, metres.
    pub at_m: f64,
    /// Rays whose hit or miss differs from the reference's, percent.
    pub wrong_pct: f64,
    /// Largest error of the distance over the distance, parts per million.
    pub distance_ppm: f64,
    /// Time over that of double precision.
    pub time_ratio: f64,
}

/// Everything that studies may measure; what is empty is not studied.
pub struct Inputs<'a> {
    /// The machine.
    pub config: RunConfig,
    /// Texture traces.
    pub subjects: Vec<Subject<'a>>,
    /// What captures of their views should have been.
    pub truths: Vec<Subject<'a>>,
    /// Further captures of their views, by other drivers.
    pub captures: Vec<Subject<'a>>,
    /// Seconds that it took to make a trace, by label.
    pub seconds: Vec<(String, f64)>,
    /// Ray traces.
    pub rays: Vec<Rays<'a>>,
    /// Folders of `tracegen techniques`.
    pub techniques: &'a [Folder],
    /// Precision of the ray traversal.
    pub traversal: Vec<TraversalRow>,
    /// What was replayed so far.
    pub replays: Replays,
}

impl<'a> Inputs<'a> {
    /// Traces of a single frame: every study but that of frames.
    pub fn stills(&self) -> impl Iterator<Item = &Subject<'a>> {
        let still = |s: &&Subject<'a>| frame_count(s.source.tables()) == 1;
        self.subjects.iter().filter(still)
    }

    /// Traces of several frames.
    pub fn moving(&self) -> impl Iterator<Item = &Subject<'a>> {
        let moves = |s: &&Subject<'a>| frame_count(s.source.tables()) > 1;
        self.subjects.iter().filter(moves)
    }
}

/// A time over another.
pub fn time_ratio(time: Duration, reference: Duration) -> f64 {
    time.as_secs_f64() / reference.as_secs_f64().max(1e-9)
}
