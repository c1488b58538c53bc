//! Runs the experiment: every trace, cache configuration and order, points in parallel.

use super::model::{PaperReport, Run, TraceInfo};
use super::plots::MAPPED_ORDERS;
use crate::config::{Mode, Order, RunConfig};
use crate::engine::{ReplayError, TileSource, replay};
use crate::paper::z2_twin;
use crate::result::TraceId;
use formats::textrace::{PassKind, Tables};
use formats::texture::TexelFormat;
use rayon::prelude::*;

/// A trace to run, and how to name it.
pub struct Subject<'a> {
    /// The trace.
    pub source: &'a dyn TileSource,
    /// Scene name and checksum.
    pub id: TraceId,
    /// Short name in tables, unique in the experiment.
    pub label: String,
    /// Scene of the paper that it stands for.
    pub twin: Option<String>,
}

/// What is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Everything that is not varied.
    pub base: RunConfig,
    /// L1 and L2 size in bytes.
    pub caches_bytes: Vec<(u64, u64)>,
    /// Orders; Morton first, since the others are held against it.
    pub orders: Vec<Order>,
    /// Also run every point in functional mode.
    pub functional: bool,
    /// Keep per-tile maps of the first cache configuration for the orders that are drawn.
    pub tile_maps: bool,
}

/// A point failed.
#[derive(Debug, thiserror::Error)]
#[error("{label}, {order}: {source}")]
pub struct ExperimentError {
    /// The trace's label.
    pub label: String,
    /// The order.
    pub order: &'static str,
    /// What went wrong.
    pub source: Box<ReplayError>,
}

impl Plan {
    /// Number of replays that [`Plan::run`] makes for this many traces.
    #[must_use]
    pub fn replays(&self, traces: usize) -> usize {
        traces * self.caches_bytes.len() * self.orders.len() * (1 + usize::from(self.functional))
    }

    /// Runs every point; `done` is called after each replay.
    ///
    /// # Errors
    /// The first point, in the plan's order, that cannot be replayed.
    pub fn run(
        &self,
        subjects: &[Subject],
        done: &(dyn Fn() + Sync),
    ) -> Result<PaperReport, ExperimentError> {
        let timed = self.points(subjects.len(), self.base.mode, self.tile_maps);
        let functional = if self.functional && self.base.mode == Mode::Timed {
            self.points(subjects.len(), Mode::Functional, false)
        } else {
            Vec::new()
        };
        let split = timed.len();
        let points: Vec<(usize, RunConfig)> = timed.into_iter().chain(functional).collect();
        let mut runs: Vec<Run> = points
            .into_par_iter()
            .map(|(trace, config)| {
                let result = replay(subjects[trace].source, &config);
                done();
                result
                    .map(|result| Run {
                        trace,
                        config,
                        result,
                    })
                    .map_err(|error| ExperimentError {
                        source: Box::new(error),
                        label: subjects[trace].label.clone(),
                        order: config.order.name(),
                    })
            })
            .collect::<Vec<_>>()
            .into_iter()
            .collect::<Result<_, _>>()?;
        let functional = runs.split_off(split);
        let traces = subjects
            .iter()
            .enumerate()
            .map(|(index, subject)| info(subject, runs.iter().find(|r| r.trace == index)))
            .collect();
        Ok(PaperReport::new(traces, self.base, &runs, &functional))
    }

    fn points(&self, traces: usize, mode: Mode, tile_maps: bool) -> Vec<(usize, RunConfig)> {
        let mut points = Vec::new();
        for trace in 0..traces {
            for (index, &(l1, l2)) in self.caches_bytes.iter().enumerate() {
                for &order in &self.orders {
                    let mut config = RunConfig {
                        mode,
                        order,
                        ..self.base
                    };
                    config.l1.size_bytes = l1;
                    config.l2.size_bytes = l2;
                    config.tile_maps = tile_maps && index == 0 && MAPPED_ORDERS.contains(&order);
                    points.push((trace, config));
                }
            }
        }
        points
    }
}

fn info(subject: &Subject, run: Option<&Run>) -> TraceInfo {
    let tables = subject.source.tables();
    let first_frame = tables.passes.iter().map(|p| p.frame).min().unwrap_or(0);
    let main = || {
        tables
            .passes
            .iter()
            .enumerate()
            .filter(|(_, p)| p.kind == PassKind::Main)
    };
    let result = run.map(|r| &r.result);
    TraceInfo {
        label: subject.label.clone(),
        trace: subject.id.clone(),
        twin: subject.twin.clone(),
        frames: frames_of(tables),
        quads: result.map_or(0, |r| r.quads),
        lanes: result.map_or(0, |r| r.lanes),
        footprints: result.map_or(0, |r| r.footprints),
        textures: tables.textures.len(),
        tiles: main().next().map_or([0, 0], |(_, p)| p.tiles),
        eye_passes: main()
            .filter(|(_, p)| p.frame == first_frame)
            .map(|(i, _)| i as u32)
            .collect(),
        meta: tables.meta.clone(),
    }
}

/// Frames that a trace renders.
#[must_use]
pub fn frames_of(tables: &Tables) -> u32 {
    let main = tables.passes.iter().filter(|p| p.kind == PassKind::Main);
    let mut frames: Vec<u32> = main.map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    frames.len() as u32
}

/// Whether the trace samples a shadow map.
#[must_use]
pub fn has_shadow_maps(tables: &Tables) -> bool {
    tables
        .textures
        .iter()
        .any(|t| t.format == TexelFormat::R32f)
}

/// The scene of the paper that a trace stands for.
#[must_use]
pub fn twin_of(tables: &Tables) -> Option<String> {
    z2_twin(&tables.meta.scene, has_shadow_maps(tables)).map(str::to_owned)
}

/// Short, unique names: the scene's, or its folder's for a file, with `+shadows` where a scene
/// that is usually without them has shadow maps, and the checksum where that is not enough.
#[must_use]
pub fn labels(traces: &[(&Tables, &TraceId)]) -> Vec<String> {
    let plain: Vec<String> = traces
        .iter()
        .map(|(tables, _)| {
            let name = scene_name(&tables.meta.scene);
            let usual = name.contains("shadow") || name.contains("jungle");
            if has_shadow_maps(tables) && !usual {
                format!("{name}+shadows")
            } else {
                name
            }
        })
        .collect();
    plain
        .iter()
        .zip(traces)
        .map(|(label, (_, id))| {
            let same = plain.iter().filter(|other| *other == label).count();
            if same > 1 {
                format!("{label} {}", id.checksum)
            } else {
                label.clone()
            }
        })
        .collect()
}

fn scene_name(scene: &str) -> String {
    let mut parts = scene.trim_end_matches(['/', '\\']).rsplit(['/', '\\']);
    let file = parts.next().unwrap_or(scene);
    let folder = parts
        .next()
        .filter(|f| !f.is_empty() && *f != "." && *f != "..");
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    folder.unwrap_or(stem).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_by_its_folder_and_a_built_in_scene_by_itself() {
        assert_eq!(
            scene_name("../shared/scenes/crytek-sponza/sponza.gltf"),
            "crytek-sponza"
        );
        assert_eq!(scene_name("sponza.gltf"), "sponza");
        assert_eq!(scene_name("../sponza.gltf"), "sponza");
        assert_eq!(scene_name("atrium-plain"), "atrium-plain");
    }
}
