//! Studies of estimating external traffic from some sets, tiles or frames, and of the confidence intervals.

use super::clusters::{Counts, Part, cluster_count, counts};
use super::configurations::functional;
use super::inputs::{Inputs, time_ratio};
use super::interval::{Judged, drawn, judged, mean, some};
use super::metric::{Metric, metric};
use super::stopwatch::Stopwatch;
use super::study::{Choice, Study, StudyError};
use crate::experiment::Subject;
use formats::random::Random;
use sim::config::{Order, RunConfig};
use sim::figure::Figure;
use sim::order::frames;
use std::time::Duration;

const FIGURES: [Metric; 4] = [
    metric("error_pct", "error of external bytes (RMS)", "%"),
    metric("bias_pct", "bias", "%"),
    metric("interval_pct", "95 % interval", "\u{b1} %"),
    metric("holds_pct", "interval holds the truth", "%"),
];

const TIME: &str = "functional replay of the sample, over that of the whole trace";

pub const SETS: Study = Study {
    key: "sets",
    title: "Samples of cache sets",
    about: "External bytes of Morton order from some sets of both levels, 400 random draws. Sets are independent of each other, so there is no bias.",
    time: TIME,
    reference: "all sets",
    recommended: "all sets",
    reason: "quads must be expanded to lines before their sets are known, so a sample saves little time",
    figures: &FIGURES,
    measure: |inputs| each(inputs.stills(), inputs, sets),
};

pub const TILES: Study = Study {
    key: "tiles",
    title: "Samples of tiles",
    about: "External bytes of Morton order from every n-th tile, starting at up to 8 different tiles. The tiles in between are not replayed, so caches are colder. The interval does not include that bias.",
    time: TIME,
    reference: "all tiles",
    recommended: "all tiles",
    reason: "its bias, which no interval shows, makes the estimate useless",
    figures: &FIGURES,
    measure: |inputs| each(inputs.stills(), inputs, tiles),
};

pub const FRAMES: Study = Study {
    key: "frames",
    title: "Samples of frames",
    about: "External bytes of all frames along a camera path from some frames, 400 random draws: each frame starts with empty caches, or with caches filled by the frame before.",
    time: TIME,
    reference: "all frames",
    recommended: "1/4 of the frames, warmed",
    reason: "no bias, and an interval close to its nominal level; frames that start with empty caches fetch lines again, and their intervals miss the true value",
    figures: &FIGURES,
    measure: |inputs| each(inputs.moving(), inputs, sampled_frames),
};

/// Computes the choices of a study for one trace.
type Sampler = fn(&Subject<'_>, &RunConfig) -> Result<Vec<Choice>, StudyError>;

fn each<'a, 's: 'a>(
    subjects: impl Iterator<Item = &'a Subject<'s>>,
    inputs: &Inputs<'_>,
    sampler: Sampler,
) -> Result<Vec<Choice>, StudyError> {
    let config = functional(inputs.config);
    let mut choices = Vec::new();
    for subject in subjects {
        choices.extend(sampler(subject, &config)?);
    }
    Ok(choices)
}

fn choice(subject: &Subject<'_>, name: String, time_ratio: f64, judged: Judged) -> Choice {
    let Judged {
        error_pct,
        bias_pct,
        interval_pct,
        holds_pct,
        estimate_pct,
    } = judged;
    Choice {
        name,
        scene: subject.label.clone(),
        contribution: None,
        time_ratio: Some(time_ratio),
        values: [error_pct, bias_pct, interval_pct, holds_pct]
            .map(Some)
            .to_vec(),
        estimate_pct,
    }
}

/// Replays a part and measures its time.
fn replayed(
    subject: &Subject<'_>,
    config: &RunConfig,
    part: &Part<'_>,
) -> Result<(Counts, Duration), StudyError> {
    let start = Stopwatch::start();
    let found = counts(subject.source, config, Order::MORTON, part)?;
    Ok((found, start.elapsed()))
}

/// Draws use one replay with counts by set, because replaying only these sets has the same counts. One draw
/// is replayed alone to measure its time.
fn sets(subject: &Subject<'_>, config: &RunConfig) -> Result<Vec<Choice>, StudyError> {
    let frames = frames(&subject.source.tables().passes);
    let (whole, whole_time) = replayed(subject, config, &Part::frames(&frames))?;
    let values: Vec<f64> = whole
        .by_cluster
        .iter()
        .map(|&misses| misses as f64)
        .collect();
    let truth = values.iter().sum();
    let clusters = cluster_count(config)? as usize;
    let mut choices = Vec::new();
    for one_in in [4, 8, 16] {
        let mut chosen = vec![false; clusters];
        for at in some(
            &mut Random(0),
            (clusters / one_in as usize).max(2),
            clusters,
        ) {
            chosen[at] = true;
        }
        let part = Part {
            clusters: Some(&chosen),
            ..Part::frames(&frames)
        };
        let (_, time) = replayed(subject, config, &part)?;
        choices.push(choice(
            subject,
            format!("1/{one_in} of the sets"),
            time_ratio(time, whole_time),
            drawn(&values, one_in, truth),
        ));
    }
    Ok(choices)
}

/// Estimates by the ratio of misses to footprints, scaled to all footprints.
fn tiles(subject: &Subject<'_>, config: &RunConfig) -> Result<Vec<Choice>, StudyError> {
    /// Largest number of first tiles; each is a replay.
    const STARTS: u64 = 8;
    let frames = frames(&subject.source.tables().passes);
    let (whole, whole_time) = replayed(subject, config, &Part::frames(&frames))?;
    let sums = |tiles: &[(u64, u64)]| tiles.iter().fold((0, 0), |(m, f), t| (m + t.0, f + t.1));
    let (truth, footprints) = sums(&whole.by_tile);
    let busy = whole.by_tile.iter().filter(|tile| tile.1 > 0).count();
    let mut choices = Vec::new();
    for one_in in [4, 8, 16] {
        let mut draws = Vec::new();
        let mut time = Duration::ZERO;
        let starts = one_in.min(STARTS);
        for start in 0..starts {
            let part = Part {
                item: &|item| item as u64 % one_in == start,
                ..Part::frames(&frames)
            };
            let (found, took) = replayed(subject, config, &part)?;
            time += took;
            let tiles: Vec<(f64, f64)> = (found.by_tile.iter())
                .filter(|tile| tile.1 > 0)
                .map(|tile| (tile.0 as f64, tile.1 as f64))
                .collect();
            let (misses, sampled) = sums(&found.by_tile);
            let ratio = misses as f64 / sampled.max(1) as f64;
            // Residuals of the ratio estimator.
            let residuals: Vec<f64> = tiles.iter().map(|t| t.0 - ratio * t.1).collect();
            if residuals.len() < 2 {
                continue;
            }
            let residual = mean(&residuals, busy);
            let per_tile = sampled as f64 / tiles.len() as f64;
            let scale = footprints as f64;
            draws.push(residual.times(scale / per_tile).around(ratio * scale));
        }
        let mut judged = judged(truth as f64, &draws);
        // Every n-th tile is no random sample, and its bias has no probability.
        judged.estimate_pct = draws.first().map(|first| {
            let values = draws.iter().map(|draw| draw.value);
            let over = format!("{} of {one_in} first tiles", draws.len());
            Figure::bounded(first.value, values, over).times(100.0 / truth.max(1) as f64)
        });
        choices.push(choice(
            subject,
            format!("1/{one_in} of the tiles"),
            time_ratio(time / starts as u32, whole_time),
            judged,
        ));
    }
    Ok(choices)
}

/// Replays every frame from empty caches and after the frame before it; draws choose among these results.
fn sampled_frames(subject: &Subject<'_>, config: &RunConfig) -> Result<Vec<Choice>, StudyError> {
    let all = frames(&subject.source.tables().passes);
    let (whole, whole_time) = replayed(subject, config, &Part::frames(&all))?;
    let truth = whole.by_frame.iter().sum::<u64>() as f64;
    let mut choices = Vec::new();
    for (warm, how) in [(0, "cold"), (1, "warmed")] {
        let mut values = Vec::new();
        let mut time = Duration::ZERO;
        for at in 0..all.len() {
            let part = &all[at.saturating_sub(warm)..=at];
            let (found, took) = replayed(subject, config, &Part::frames(part))?;
            values.push(found.by_frame.last().copied().unwrap_or(0) as f64);
            time += took;
        }
        for one_in in [2_u64, 4, 8] {
            if all.len() < 2 * one_in as usize {
                continue;
            }
            let share = time.div_f64(one_in as f64);
            choices.push(choice(
                subject,
                format!("1/{one_in} of the frames, {how}"),
                time_ratio(share, whole_time),
                drawn(&values, one_in, truth),
            ));
        }
    }
    Ok(choices)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace};
    use super::*;
    use sim::stream::MemoryTrace;

    /// The same view repeated `times` times.
    fn repeated(trace: &MemoryTrace, times: u32) -> MemoryTrace {
        let mut out = trace.clone();
        out.tables.passes.clear();
        out.tiles.clear();
        for frame in 0..times {
            for (pass, tiles) in trace.tables.passes.iter().zip(&trace.tiles) {
                let mut pass = *pass;
                pass.frame = frame;
                out.tables.passes.push(pass);
                out.tiles.push(tiles.clone());
            }
        }
        out
    }

    #[test]
    fn set_samples_have_no_bias_and_tile_samples_have_one() {
        let trace = small_trace();
        let inputs = inputs(&trace);
        let bias = |choices: Vec<Choice>| choices[0].values[1].unwrap();
        assert!(bias((SETS.measure)(&inputs).unwrap()).abs() < 3.0);
        assert!(bias((TILES.measure)(&inputs).unwrap()) > 3.0);
    }

    #[test]
    fn warmed_frames_estimate_repeated_frames_and_cold_ones_overestimate_them() {
        let trace = repeated(&small_trace(), 8);
        let mut inputs = inputs(&trace);
        // The whole frame fits in the caches.
        inputs.config.level.l2.size_bytes = 1 << 22;
        let choices = (FRAMES.measure)(&inputs).unwrap();
        assert_eq!(choices.len(), 4);
        let bias = |name: &str| {
            let choice = choices.iter().find(|c| c.name == name).expect(name);
            choice.values[1].unwrap()
        };
        assert!(bias("1/2 of the frames, cold") > 500.0);
        // The first of eight frames has no frame before it.
        assert!(
            bias("1/2 of the frames, warmed").abs() < 20.0,
            "{choices:?}"
        );
    }
}
