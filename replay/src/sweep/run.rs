//! Runs the points of an experiment on every trace.

use super::plan::Point;
use super::store::Store;
use crate::engine::{ReplayError, replay};
use crate::report::z2::experiment::Subject;
use crate::result::RunResult;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A point failed.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The replay failed.
    #[error("{label}, {point}: {source}")]
    Replay {
        /// The trace's label.
        label: String,
        /// The point's settings.
        point: String,
        /// What went wrong.
        source: Box<ReplayError>,
    },
    /// The result could not be kept.
    #[error("{0:#}")]
    Store(anyhow::Error),
}

/// Results by trace and point, and how many of them were computed now.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepOutcome {
    /// `results[trace][point]`.
    pub results: Vec<Vec<RunResult>>,
    /// Points that were not in the store.
    pub computed: usize,
}

/// Runs every point on every trace, in parallel, taking what the store has; `done` is called after
/// each.
///
/// # Errors
/// The first point, in order, that fails; points that were finished are kept.
pub fn run(
    subjects: &[Subject],
    points: &[Point],
    store: &Store,
    done: &(dyn Fn() + Sync),
) -> Result<SweepOutcome, SweepError> {
    let computed = AtomicUsize::new(0);
    let one = |subject: &Subject, point: &Point| {
        let kept = store.load(&subject.id, &point.config);
        let result = kept.map_or_else(
            || {
                let result =
                    replay(subject.source, &point.config).map_err(|error| SweepError::Replay {
                        label: subject.label.clone(),
                        point: point.title(),
                        source: Box::new(error),
                    })?;
                computed.fetch_add(1, Ordering::Relaxed);
                store
                    .save(&subject.id, &point.config, &result)
                    .map_err(SweepError::Store)
            },
            Ok,
        );
        done();
        result
    };
    let jobs: Vec<(&Subject, &Point)> = subjects
        .iter()
        .flat_map(|s| points.iter().map(move |p| (s, p)))
        .collect();
    let mut flat = jobs
        .into_par_iter()
        .map(|(subject, point)| one(subject, point))
        .collect::<Vec<_>>()
        .into_iter();
    let results = subjects
        .iter()
        .map(|_| {
            flat.by_ref()
                .take(points.len())
                .collect::<Result<Vec<_>, _>>()
        })
        .collect::<Result<_, _>>()?;
    Ok(SweepOutcome {
        results,
        computed: computed.into_inner(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::plan::Experiment;
    use super::*;
    use crate::engine::MemoryTrace;
    use crate::result::TraceId;
    use formats::textrace::{Tables, TraceMeta};
    use formats::view::{FovTangents, Hmd};

    /// A trace without passes: its replay is empty, which is enough to count runs.
    fn empty() -> MemoryTrace {
        let fov = FovTangents {
            left: 1.0,
            right: 1.0,
            up: 1.0,
            down: 1.0,
        };
        let meta = TraceMeta {
            tool: String::new(),
            command_line: Vec::new(),
            scene: "empty".to_owned(),
            scene_triangles: 0,
            camera: "default".to_owned(),
            backend: String::new(),
            driver: String::new(),
            seed: 0,
            hmd: Hmd {
                name: "symmetric".to_owned(),
                source: String::new(),
                eye_size_px: [16, 16],
                fov: [fov; 2],
                ipd_m: 0.064,
                cant_deg: 0.0,
            },
            frames: Vec::new(),
        };
        MemoryTrace {
            tables: Tables {
                meta,
                textures: Vec::new(),
                samplers: Vec::new(),
                draws: Vec::new(),
                passes: Vec::new(),
            },
            tiles: Vec::new(),
        }
    }

    #[test]
    fn a_second_run_computes_nothing_and_gives_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let trace = empty();
        let subjects = [Subject {
            source: &trace,
            id: TraceId {
                scene: "empty".into(),
                checksum: "1".into(),
            },
            label: "empty".into(),
            twin: None,
        }];
        let points =
            Experiment::parse("[axes]\norder = [\"morton\", \"z2-sta\"]\nseed = [1, 2, 3]\n")
                .unwrap()
                .points()
                .unwrap();
        let first = run(&subjects, &points, &store, &|| ()).unwrap();
        assert_eq!(first.computed, 6);
        let second = run(&subjects, &points, &store, &|| ()).unwrap();
        assert_eq!(second.computed, 0);
        assert_eq!(first.results, second.results);
    }
}
