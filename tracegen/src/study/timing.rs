//! Times frames of several settings alternately.

use super::processor;
use super::world::{Shot, World};
use raster::lavapipe::Lavapipe;
use std::collections::BTreeMap;
use std::time::Duration;
use techniques::{Planner, Settings};
use visibility::Occlusion;

/// Frames and repetitions that are measured of every row.
#[derive(Clone, Debug)]
pub struct Extent {
    /// The measured frames, as runs of consecutive frames.
    pub runs: Vec<Vec<u32>>,
    /// The measured frames that are written to the trace, ascending.
    pub trace_frames: Vec<u32>,
    /// Repetitions of each frame's timing.
    pub repeats: u32,
}

impl Extent {
    /// The measured frames, ascending.
    pub fn frames(&self) -> Vec<u32> {
        self.runs.concat()
    }

    /// Steps of progress of one row.
    pub fn steps(&self) -> u64 {
        self.frames().len() as u64 * (1 + u64::from(self.repeats))
    }

    /// Every rendered frame, and whether it is measured. For techniques with state, the frame before a run is
    /// rendered as well.
    pub fn rendered(&self, remembers: bool) -> impl Iterator<Item = (u32, bool)> + '_ {
        self.runs.iter().flat_map(move |run| {
            let before = run[0]
                .checked_sub(1)
                .filter(|_| remembers)
                .map(|frame| (frame, false));
            before
                .into_iter()
                .chain(run.iter().map(|frame| (*frame, true)))
        })
    }
}

/// Times of one frame, by repetition.
#[derive(Debug, Default)]
pub struct Times {
    /// With the measured settings.
    pub frame: Vec<Duration>,
    /// The baseline's, each measured next to the other's.
    pub baseline: Vec<Duration>,
    /// Processor time of the frame, if the system reports it.
    pub processor: Vec<Duration>,
    /// Processor time of the baseline.
    pub baseline_processor: Vec<Duration>,
    /// By stage, with the measured settings.
    pub stages: BTreeMap<&'static str, Vec<Duration>>,
}

/// Times frames alternately with a row's planners and with the baseline's, repeatedly: one entry per measured
/// frame.
///
/// # Errors
/// Driver errors.
pub fn time<'s>(
    world: &mut World,
    backend: &mut Lavapipe,
    extent: &Extent,
    planner: impl Fn(u32) -> &'s Planner,
    mut advance: impl FnMut(),
) -> anyhow::Result<Vec<Times>> {
    let baseline = world.planner(&Settings::default())?;
    let mut times: Vec<Times> = extent.frames().iter().map(|_| Times::default()).collect();
    in_turns(
        world,
        backend,
        extent,
        2,
        |contestant, frame| match contestant {
            0 => planner(frame),
            _ => &baseline,
        },
        |contestant, frame, shot, worked| {
            if contestant == 0 {
                times[frame].add(shot);
                times[frame].processor.extend(worked);
                advance();
            } else {
                times[frame].baseline.push(shot.total);
                times[frame].baseline_processor.extend(worked);
            }
        },
    )?;
    Ok(times)
}

/// Renders each measured frame with every contestant, one after the other, as often as `extent` says;
/// `planner` returns a contestant's planner for a frame. `took` receives the contestant's number, the
/// position of the frame among the measured ones, what was rendered, and the processor time, if the system
/// reports it.
///
/// # Errors
/// Driver errors.
pub fn in_turns<'s>(
    world: &mut World,
    backend: &mut Lavapipe,
    extent: &Extent,
    contestants: usize,
    planner: impl Fn(usize, u32) -> &'s Planner,
    mut took: impl FnMut(usize, usize, &Shot, Option<Duration>),
) -> anyhow::Result<()> {
    let frames = extent.frames();
    let remembers = (frames.iter())
        .flat_map(|frame| (0..contestants).map(|c| planner(c, *frame).settings()))
        .any(Settings::remembers);
    for repeat in 0..extent.repeats as usize {
        let mut memories: Vec<Occlusion> = (0..contestants).map(|_| Occlusion::default()).collect();
        let mut measured = 0;
        for (number, is_measured) in extent.rendered(remembers) {
            for place in 0..contestants {
                // Later contestants find warmer caches, so the order rotates.
                let contestant = (place + repeat + 1) % contestants;
                let memory = &mut memories[contestant];
                let before = processor::time();
                let shot = world.shoot(backend, planner(contestant, number), number, memory)?;
                if is_measured {
                    let now = processor::time();
                    let worked = now
                        .zip(before)
                        .map(|(now, before)| now.saturating_sub(before));
                    took(contestant, measured, &shot, worked);
                }
            }
            measured += usize::from(is_measured);
        }
    }
    Ok(())
}

/// The time of all frames together without disturbances: the sum of the shortest repetitions.
pub fn undisturbed_s<'a>(frames: impl IntoIterator<Item = &'a [Duration]>) -> f64 {
    let shortest = |times: &[Duration]| times.iter().min().copied().unwrap_or_default();
    frames
        .into_iter()
        .map(shortest)
        .sum::<Duration>()
        .as_secs_f64()
}

pub(super) const CULL: &str = "cull";

impl Times {
    fn add(&mut self, row: &Shot) {
        self.frame.push(row.total);
        for (stage, time) in [
            (CULL, row.frame.cull_time),
            ("submit", row.work.submitting),
            ("render", row.work.waiting),
            ("compose", row.compose),
        ] {
            self.stages.entry(stage).or_default().push(time);
        }
    }
}

/// The median in seconds; the lower one of an even number of times.
pub fn median_s(times: &[Duration]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort();
    let middle = sorted.get(sorted.len().saturating_sub(1) / 2);
    middle.copied().unwrap_or_default().as_secs_f64()
}
