//! Chooses the techniques of every frame of a path under a budget.

use super::search::Infeasible;
use super::{AutoRecord, Budget, Held, Known, Objective, SearchBench, hold, search};

use crate::study::rows::{Part, Row};
use crate::study::timing::{Extent, median_s};
use crate::study::world::World;
use anyhow::bail;
use formats::view::Hmd;
use raster::lavapipe::Lavapipe;
use shell::Progress;
use std::collections::HashMap;
use std::time::Duration;
use techniques::{Planner, SettingsError};
use visibility::Occlusion;

/// Number of frames that the search measures.
const SEARCH_FRAMES: u32 = 3;
/// Repetitions of each frame's timing.
const SEARCH_REPEATS: u32 = 2;

/// The chosen combination, and the techniques of each frame of the path.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The choice and its reasons.
    pub record: AutoRecord,
    /// The combination of each frame.
    pub held: Held,
    /// Results of this search and of earlier ones.
    pub known: Known,
}

impl Choice {
    /// Planners of the combinations; frame `i` uses `[held.of_frame[i]]`.
    ///
    /// # Errors
    /// A combination that the search has not rendered.
    pub fn planners(&self, world: &World) -> Result<Vec<Planner>, SettingsError> {
        let rows = self.held.chain.iter();
        rows.map(|row| world.planner(&row.settings)).collect()
    }
}

/// Searches for the best combination of techniques under a budget on a few frames of the path, then checks it
/// on all frames. A frame that would break an error budget falls back to a safer combination; a path whose
/// median frame breaks a time budget is an error. `runs` are the frames of the search, as runs of consecutive
/// frames; `known` holds the results of earlier searches on them.
///
/// # Errors
/// A budget that no combination keeps, or driver errors.
pub fn choose(
    world: &mut World,
    backend: &mut Lavapipe,
    runs: Vec<Vec<u32>>,
    budget: Budget,
    objective: Objective,
    known: Known,
    progress: &Progress,
) -> anyhow::Result<Choice> {
    let path_frames = world.views.len() as u32;
    let search_frames = runs.concat();
    let options = options(budget, &world.hmd);
    progress.stage(
        "searching",
        options.len() as u64 + 1,
        "techniques alone, and combinations",
    );
    let mut bench = SearchBench {
        is_software: backend.is_software(),
        world,
        backend,
        budget,
        objective,
        baseline: None,
        known,
        extent: Extent {
            runs,
            trace_frames: Vec::new(),
            repeats: SEARCH_REPEATS,
        },
        references: HashMap::new(),
        planners: Vec::new(),
        progress,
    };
    let combinations = Row::combinations();
    let found = match search(&mut bench, &options, &combinations, budget, objective)? {
        Ok(found) => found,
        Err(infeasible) => {
            let Infeasible { closest, baseline } = infeasible;
            bail!(
                "no combination meets --auto {budget}: the fastest one found, {}, takes {:.1} ms per frame on this device, the baseline {:.1} ms",
                closest.row.name,
                closest.per_frame() * 1e3,
                baseline.per_frame() * 1e3
            );
        }
    };
    let chosen = &found.chosen.row;
    progress.stage("holding the budget", path_frames.into(), "frames");
    let held = match budget.error_limit() {
        Some(limit) => {
            let tried = &found.tried;
            // State of the chosen combination; a safer combination that replaces it in a frame starts without
            // state.
            let mut memory = Occlusion::default();
            hold(chosen, tried, path_frames, limit, |row, frame| {
                if row.settings == chosen.settings {
                    progress.advance(1);
                    return bench.error(row, frame, &mut memory);
                }
                bench.error(row, frame, &mut Occlusion::default())
            })?
        }
        None => {
            let planner = bench.world.planner(&chosen.settings)?;
            let mut times: Vec<Duration> = Vec::new();
            let mut memory = Occlusion::default();
            for frame in 0..path_frames {
                let shot = bench
                    .world
                    .shoot(bench.backend, &planner, frame, &mut memory)?;
                times.push(shot.total);
                progress.advance(1);
            }
            check_median(budget, chosen, median_s(&times))?;
            Held::everywhere(chosen.clone(), path_frames as usize)
        }
    };
    Ok(Choice {
        record: AutoRecord::new(budget, objective, &found, &held, search_frames),
        held,
        known: bench.known,
    })
}

fn check_median(budget: Budget, chosen: &Row, median_s: f64) -> anyhow::Result<()> {
    if let Budget::FrameMs(limit_ms) = budget
        && median_s * 1e3 > limit_ms
    {
        bail!(
            "--auto {budget} is not kept on the whole path: {}, which kept it on the frames of the search, takes {:.1} ms in the median",
            chosen.name,
            median_s * 1e3
        );
    }
    Ok(())
}

/// Frames in the middle of equal parts of the path, alternately even and odd, because some techniques treat
/// even and odd frames differently.
pub fn search_frames(path_frames: u32) -> Vec<u32> {
    let count = SEARCH_FRAMES.min(path_frames);
    let middle = |part: u32| {
        let middle = u64::from(path_frames) * (2 * u64::from(part) + 1) / (2 * u64::from(count));
        let even = middle as u32 & !1;
        (even + part % 2).min(path_frames - 1)
    };
    let mut frames: Vec<u32> = (0..count).map(middle).collect();
    // Parts of a short path are no longer than the step to the other parity.
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// The techniques that a budget allows.
fn options(budget: Budget, hmd: &Hmd) -> Vec<Part> {
    let baseline = Row::baseline();
    (Part::options(hmd).into_iter())
        .filter(|part| !baseline.parts.contains(part))
        .filter(|part| match budget {
            Budget::Pixels(_) => part.lossless || part.is_shift(),
            Budget::Flip(limit) => part.lossless || limit > 0.0,
            Budget::FrameMs(_) => true,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_sees_a_few_frames_of_either_parity_and_leaves_the_others() {
        assert_eq!(search_frames(72), [12, 37, 60]);
        assert_eq!(search_frames(1), [0]);
        for path in 1..50 {
            let frames = search_frames(path);
            assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
            assert!(frames.iter().all(|frame| *frame < path), "{frames:?}");
        }
    }

    #[test]
    fn only_shifts_may_be_used_where_shifts_are_bounded() {
        let lossy = |part: &&Part| !part.lossless && !part.is_shift();
        let lossy = |budget: Budget| {
            let options = options(budget, &Hmd::default());
            options.iter().filter(lossy).count()
        };
        assert_eq!(lossy(Budget::Pixels(1.0)), 0);
        assert!(lossy(Budget::Flip(0.01)) > 0);
        // No error is allowed, so no lossy technique is tried.
        let options = options(Budget::Flip(0.0), &Hmd::default());
        assert!(!options.is_empty() && options.iter().all(|part| part.lossless));
    }

    #[test]
    fn a_path_whose_median_frame_is_too_slow_is_an_error() {
        let row = Row::baseline();
        check_median(Budget::FrameMs(11.0), &row, 0.010_9).unwrap();
        let error = check_median(Budget::FrameMs(11.0), &row, 0.012).unwrap_err();
        assert!(error.to_string().contains("12.0 ms"), "{error}");
    }
}
