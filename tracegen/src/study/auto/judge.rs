//! Measures combinations on a device.

use super::budget::Budget;
use super::objective::Objective;
use super::search::{Cost, Judge, Spread, Verdict};
use crate::study::counted::{Counted, texture_bytes};
use crate::study::rows::Row;
use crate::study::timing::{Extent, in_turns, median_s, time, undisturbed_s};
use crate::study::world::{Shot, World};
use anyhow::Context;
use formats::textrace::{Textrace, TextraceWriter};
use image_error::{Mask, Picture, Reference};
use raster::lavapipe::Lavapipe;
use record::Recorder;
use serde::{Deserialize, Serialize};
use shell::Progress;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;
use techniques::{Planner, Settings};
use visibility::Occlusion;

/// Repetitions per frame in the final comparison: enough that one disturbed repetition hardly matters.
const RUN_OFF_REPEATS: u32 = 6;
/// Number of frames, unused by the search, on which its winner must win as well.
const ELSEWHERE_FRAMES: u32 = 8;

/// Errors and counts of combinations on the frames of a search, which are the same in every search of these
/// frames. The key is the kind of error and the settings as JSON.
pub type Known = BTreeMap<String, Seen>;

/// Results of a combination on the frames of a search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// The worst frame's error.
    pub error: f64,
    /// Counts over all frames; none if the error exceeded the budget.
    pub counted: Option<Counted>,
}

/// Renders combinations, and the baseline alternately.
pub struct SearchBench<'a> {
    /// Scene and path.
    pub world: &'a mut World,
    /// The device.
    pub backend: &'a mut Lavapipe,
    /// Whether the device is the processor.
    pub is_software: bool,
    /// The unit of errors.
    pub budget: Budget,
    /// The quantity to minimise.
    pub objective: Objective,
    /// The baseline's cost per frame, once it is counted.
    pub baseline: Option<f64>,
    /// Errors and counts on the frames of this search and of earlier ones.
    pub known: Known,
    /// Frames and repetitions of the search.
    pub extent: Extent,
    /// The baseline's pictures of the frames of the search that were needed so far.
    pub references: HashMap<u32, Vec<Reference>>,
    /// Planners made so far.
    pub planners: Vec<Arc<Planner>>,
    /// Progress of the search.
    pub progress: &'a Progress,
}

impl SearchBench<'_> {
    /// The error of a combination in a frame, in the budget's unit, rendered after the frame before it.
    ///
    /// # Errors
    /// Driver errors.
    pub fn error(&mut self, row: &Row, frame: u32, memory: &mut Occlusion) -> anyhow::Result<f64> {
        let planner = self.planner(&row.settings)?;
        let shot = self.world.shoot(self.backend, &planner, frame, memory)?;
        self.error_of(&shot, frame)
    }

    /// The error of the frame that was rendered last.
    fn error_of(&mut self, shot: &Shot, frame: u32) -> anyhow::Result<f64> {
        if let Budget::Pixels(_) = self.budget {
            let shift = shot.frame.plan.predicted.disparity_px;
            return Ok(shift.map_or(0.0, f64::from));
        }
        let pictures = self.world.pictures(self.backend, shot)?;
        let references = match self.references.remove(&frame) {
            Some(known) => known,
            None => self.references(frame)?,
        };
        let mut worst = 0.0_f64;
        for (picture, reference) in pictures.iter().zip(&references) {
            let picture = of_rgba(self.world.hmd.eye_size_px, picture);
            let error = reference.error(&picture).context("comparing pictures")?;
            worst = worst.max(error.flip_mean);
        }
        // The pictures of the whole path would take too much memory.
        if self.extent.frames().contains(&frame) {
            self.references.insert(frame, references);
        }
        Ok(worst)
    }

    /// Counts the frame that was rendered last, by a capture of it.
    fn count(&mut self, planner: &Planner, shot: &Shot) -> anyhow::Result<Counted> {
        if shot.reprojection.is_some() {
            return Ok(shot.counted(0));
        }
        let tables = self.world.tables_of([&shot.frame]);
        let job = self.world.job(planner);
        let writer = TextraceWriter::in_memory(&tables)?;
        let mut recorder = Recorder::new(writer, job.draws.replays(job.fragments));
        let captured = job.capture_frame(self.backend, &shot.frame, &mut recorder)?;
        let trace = Textrace::from_bytes(recorder.into_writer()?.into_bytes()?)?;
        Ok(Counted {
            texture_bytes: texture_bytes(&trace)?.iter().sum(),
            ..shot.counted(captured.counts.fragments)
        })
    }

    /// Error and counts on the frames of the search; no counts if the error exceeds the limit.
    fn see(&mut self, row: &Row, limit: f64) -> anyhow::Result<Seen> {
        let planner = self.planner(&row.settings)?;
        let (mut error, mut counted) = (0.0_f64, Counted::default());
        let mut memory = Occlusion::default();
        let extent = self.extent.clone();
        for (frame, measured) in extent.rendered(row.settings.remembers()) {
            // The baseline is rendered first, because it would overwrite the frame that is captured.
            let is_picture = !matches!(self.budget, Budget::Pixels(_));
            if measured && is_picture && !self.references.contains_key(&frame) {
                let references = self.references(frame)?;
                self.references.insert(frame, references);
            }
            let shot = (self.world).shoot(self.backend, &planner, frame, &mut memory)?;
            if !measured {
                continue;
            }
            error = error.max(self.error_of(&shot, frame)?);
            if error <= limit {
                counted += self.count(&planner, &shot)?;
            }
        }
        Ok(Seen {
            error,
            counted: (error <= limit).then_some(counted),
        })
    }

    /// The verdict by counts, from an earlier search if that measured the combination.
    fn judge_by_counts(&mut self, row: &Row) -> anyhow::Result<Verdict> {
        let limit = match (row.lossless, self.budget.error_limit()) {
            (false, Some(limit)) => limit,
            _ => f64::INFINITY,
        };
        let unit = match self.budget {
            Budget::Pixels(_) => "px",
            _ => "flip",
        };
        let key = format!("{unit} {}", serde_json::to_string(&row.settings)?);
        let known = self.known.get(&key).copied();
        let seen = match known.filter(|seen| seen.counted.is_some() || seen.error > limit) {
            Some(seen) => seen,
            None => self.see(row, limit)?,
        };
        self.known.insert(key, seen);
        self.progress.advance(1);
        let frames = self.extent.frames().len() as f64;
        let counted = seen.counted.filter(|_| seen.error <= limit);
        let per_frame = counted.and_then(|counted| self.objective.counted(&counted));
        let cost = per_frame.map(|cost| cost / frames).map(|per_frame| {
            let baseline = *self.baseline.get_or_insert(per_frame);
            let is_none = baseline <= 0.0;
            Cost {
                ratio: if is_none { 1.0 } else { per_frame / baseline },
                per_frame,
                spread: None,
            }
        });
        Ok(Verdict {
            cost,
            error: seen.error,
        })
    }

    /// Renders frames with each of the rows alternately, the baseline first. Returns each row's time relative
    /// to the baseline's, by repetition.
    fn race(&mut self, rows: &[&Row], extent: &Extent) -> anyhow::Result<Vec<Spread>> {
        let planners: Vec<Arc<Planner>> = (rows.iter())
            .map(|row| self.planner(&row.settings))
            .collect::<anyhow::Result<_>>()?;
        let mut times = vec![vec![Vec::new(); extent.frames().len()]; rows.len()];
        // Processor time is used for software drivers, because other programs on the machine do not change
        // it.
        let is_software = self.is_software;
        in_turns(
            self.world,
            self.backend,
            extent,
            rows.len(),
            |contestant, _| &*planners[contestant],
            |contestant, frame, shot, worked| {
                let worked = worked.filter(|_| is_software);
                times[contestant][frame].push(worked.unwrap_or(shot.total));
                if contestant == 0 {
                    self.progress.advance(1);
                }
            },
        )?;
        let total_s = &|contestant: usize, repeat: usize| {
            let frames = times[contestant].iter().map(|times| times[repeat]);
            frames.sum::<Duration>().as_secs_f64()
        };
        let ratios = |contestant| {
            let repeats = 0..extent.repeats as usize;
            repeats.map(move |repeat| total_s(contestant, repeat) / total_s(0, repeat))
        };
        let contestants = 0..rows.len();
        Ok(contestants
            .map(|c| Spread::of(ratios(c).collect()))
            .collect())
    }

    /// The planner of some settings; planners are kept, with the results that they cache.
    fn planner(&mut self, settings: &Settings) -> anyhow::Result<Arc<Planner>> {
        if let Some(known) = self.planners.iter().find(|p| p.settings() == settings) {
            return Ok(Arc::clone(known));
        }
        let planner = Arc::new(self.world.planner(settings)?);
        self.planners.push(Arc::clone(&planner));
        Ok(planner)
    }

    /// The baseline's pictures of a frame, left and right.
    fn references(&mut self, frame: u32) -> anyhow::Result<Vec<Reference>> {
        let baseline = self.planner(&Settings::default())?;
        let world = &mut *self.world;
        let shot = world.shoot(self.backend, &baseline, frame, &mut Occlusion::default())?;
        let pictures = world.pictures(self.backend, &shot)?;
        let size_px = world.hmd.eye_size_px;
        (pictures.iter().zip(world.hmd.fov).zip(world.lens))
            .map(|((picture, fov), lens)| {
                let mask = Mask::of_lens(size_px, &fov, &lens);
                let ppd = image_error::pixels_per_degree(size_px[0], &fov);
                Reference::new(of_rgba(size_px, picture), mask, ppd).context("comparing pictures")
            })
            .collect()
    }
}

impl Judge for SearchBench<'_> {
    type Error = anyhow::Error;

    fn can(&self, row: &Row) -> bool {
        // A reprojected frame needs the frame before it, and frames that are searched alone have none.
        let alone = self.extent.runs.iter().any(|run| run.len() < 2);
        !(row.settings.half_rate.is_some() && alone) && self.world.check(&row.settings).is_ok()
    }

    fn judge(&mut self, row: &Row) -> anyhow::Result<Verdict> {
        if self.objective != Objective::Time {
            return self.judge_by_counts(row);
        }
        let extent = self.extent.clone();
        let planner = self.planner(&row.settings)?;
        // No error is within this limit, so nothing is counted.
        let error = self.see(row, f64::NEG_INFINITY)?.error;
        let times = time(self.world, self.backend, &extent, |_| &*planner, || ())?;
        self.progress.advance(1);
        let own = undisturbed_s(times.iter().map(|times| &*times.frame));
        let beside = undisturbed_s(times.iter().map(|times| &*times.baseline));
        let frames: Vec<Duration> = times.into_iter().flat_map(|times| times.frame).collect();
        let cost = Cost {
            ratio: own / beside,
            per_frame: median_s(&frames),
            spread: None,
        };
        Ok(Verdict {
            cost: Some(cost),
            error,
        })
    }

    fn run_off(&mut self, rows: &[&Row]) -> anyhow::Result<Vec<Spread>> {
        let extent = Extent {
            repeats: RUN_OFF_REPEATS,
            ..self.extent.clone()
        };
        self.progress.stage(
            "deciding",
            u64::from(RUN_OFF_REPEATS) * extent.frames().len() as u64,
            "frames with each of the cheapest, in turns",
        );
        self.race(rows, &extent)
    }

    fn run_off_elsewhere(&mut self, rows: &[&Row]) -> anyhow::Result<Option<Vec<Spread>>> {
        let path_frames = self.world.views.len() as u32;
        let frames = elsewhere(path_frames, &self.extent.frames());
        if frames.is_empty() {
            return Ok(None);
        }
        let extent = Extent {
            runs: frames.iter().map(|frame| vec![*frame]).collect(),
            repeats: RUN_OFF_REPEATS,
            ..self.extent.clone()
        };
        self.progress.stage(
            "confirming",
            u64::from(RUN_OFF_REPEATS) * frames.len() as u64,
            "frames that the search did not see",
        );
        self.race(rows, &extent).map(Some)
    }
}

/// Frames spread over the path, disjoint from those of the search, alternately even and odd.
fn elsewhere(path_frames: u32, searched: &[u32]) -> Vec<u32> {
    let count = ELSEWHERE_FRAMES.min(path_frames);
    let spread = (0..count).map(|i| {
        let even = (u64::from(path_frames) * u64::from(i) / u64::from(count)) as u32 & !1;
        (even + i % 2).min(path_frames - 1)
    });
    let mut frames: Vec<u32> = spread.filter(|frame| !searched.contains(frame)).collect();
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// A picture without alpha.
fn of_rgba(size_px: [u32; 2], rgba: &[u8]) -> Picture {
    Picture {
        size_px,
        pixels: rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_winner_is_confirmed_on_frames_of_either_parity_that_the_search_did_not_see() {
        assert_eq!(elsewhere(72, &[12, 37, 60]), [0, 9, 18, 27, 36, 45, 54, 63]);
        assert_eq!(elsewhere(1, &[0]), [0; 0]);
        for path in 2..40 {
            let frames = elsewhere(path, &[1]);
            assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
            assert!(frames.iter().all(|frame| *frame < path && *frame != 1));
        }
    }
}
