//! What orders save at a picture size that was not captured, from a capture at a smaller one.
//!
//! Two sizes say how reuse distances grow: the captured one, and half of its width and height ([`Halved`]). How much lines
//! grow on is counted with the levels of the wanted size ([`distinct_lines`]).

use locality::{Reuses, Stream, Streams, analyse, distinct_lines};
use sim::config::{Order, Replacement, RunConfig, SetIndex};
use sim::engine::ReplayError;
use sim::figure::{Because, Figure};
use sim::order::frames;
use sim::stream::{Halved, TileSource};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::ops::RangeInclusive;

/// A prediction is inside a knee if an L2 so many times as large or as small changes it by more than [`KNEE_POINTS`].
pub const KNEE_FACTOR: f64 = 2.0;

/// See [`KNEE_FACTOR`].
pub const KNEE_POINTS: f64 = 10.0;

/// Largest error of a prediction outside the knees, in points, over the scenes of `results/sizes-coverage.csv`,
/// `results/single-frame-summary.csv` and `results/single-frame-machines.csv`.
pub const LARGEST_ERROR_POINTS: f64 = 5.4;

/// Scenes and sources of that error.
pub const MEASURED: [usize; 2] = [12, 11];

/// Pixels of the smallest captured picture with that error.
const LEAST_PX: u64 = 480 * 540;

/// Largest ratio of the wanted sides to the captured ones with that error. Sides are rounded to whole pixels.
const MOST_GROWTH: f64 = 3.03;

/// Sizes of the L1s and of lines with at most that error (`results/single-frame-machines.csv`).
const L1_BYTES: RangeInclusive<u64> = 2 << 10..=32 << 10;
const LINE_BYTES: RangeInclusive<u32> = 16..=128;

/// Sizes of the L2s with that error, in bytes.
const L2_BYTES: RangeInclusive<u64> = 128 << 10..=2 << 20;

/// What an order saves on a pair of caches.
#[derive(Clone, Debug)]
pub struct Predicted {
    /// L1 and L2 in bytes.
    pub caches_bytes: (u64, u64),
    /// The order.
    pub order: Order,
    /// Bytes saved against the baseline, percent.
    pub saving_pct: f64,
    /// The lowest and the highest saving over L2s of about this size ([`KNEE_FACTOR`]).
    pub around_pct: [f64; 2],
    /// Bytes between the L2 and memory per frame.
    pub frame_bytes: f64,
    /// The answer.
    pub answer: Answer,
}

/// Whether a prediction has an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It has.
    Interval,
    /// The L2 is near a size at which savings change: only a capture at full size says how much is saved.
    InsideKnee,
    /// No errors were measured, for this reason.
    Unmeasured(&'static str),
}

impl Predicted {
    /// The saving with its interval, in percent.
    pub fn figure(&self) -> Option<Figure> {
        let [scenes, sources] = MEASURED;
        let because = Because::Residuals { scenes, sources };
        // The true value of a further source is within the largest of n errors with a probability of n / (n + 1).
        let confidence = sources as f64 / (sources + 1) as f64;
        let figure = || Figure::sampled(self.saving_pct, LARGEST_ERROR_POINTS, confidence, because);
        (self.answer == Answer::Interval).then(figure)
    }
}

/// Width and height of a trace's pictures over those of [`Halved`].
const STEP: f64 = 2.0;

/// Predicts the bytes of `orders`, the baseline first, with each pair of L1 and L2 sizes. The sides of the wanted picture
/// are `growth` times as long as those of the trace.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn predict(
    trace: &dyn TileSource,
    growth: f64,
    config: &RunConfig,
    orders: &[Order],
    caches_bytes: &[(u64, u64)],
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Predicted>, ReplayError> {
    let frames = frames(&trace.tables().passes).len().max(1) as f64;
    let halved = Halved::new(trace, config)?;
    let mut power = None;
    let mut analysed: BTreeMap<u64, Vec<Reuses>> = BTreeMap::new();
    let mut predicted = Vec::new();
    for &(l1, l2) in caches_bytes {
        let mut machine = *config;
        (machine.level.l1.size_bytes, machine.level.l2.size_bytes) = (l1, l2);
        machine.validate()?;
        let reuses = match analysed.entry(l1) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let of = |trace| reuses(trace, &machine, orders, done);
                let (small, own) = (of(&halved)?, of(trace)?);
                let power = match power {
                    Some(power) => power,
                    None => {
                        let lines = [&small, &own].map(|of| of.first().map_or(0.0, Reuses::lines));
                        *power.insert(growth_of_lines([&halved, trace], lines, growth, config)?)
                    }
                };
                let pairs = small.iter().zip(&own);
                let stretched = pairs.map(|(small, own)| own.stretched(small, STEP, power));
                new.insert(stretched.collect())
            }
        };
        let level = &machine.level.l2;
        let line_bytes = f64::from(machine.line_bytes);
        let bytes = |of: &Reuses, factor: f64| {
            let sets = l2 as f64 * factor / line_bytes / f64::from(level.ways);
            of.misses(sets, level.ways) * line_bytes / frames
        };
        let unmeasured = unmeasured(&machine, pixels(trace), growth);
        let Some((baseline, others)) = reuses.split_first() else {
            continue;
        };
        for (of, &order) in others.iter().zip(&orders[1..]) {
            let saving = |factor| 100.0 * (1.0 - bytes(of, factor) / bytes(baseline, factor));
            let around = [1.0 / KNEE_FACTOR, 1.0, KNEE_FACTOR].map(saving);
            let [low, high] =
                [f64::min, f64::max].map(|end| around.into_iter().fold(around[1], end));
            predicted.push(Predicted {
                caches_bytes: (l1, l2),
                order,
                saving_pct: around[1],
                around_pct: [low, high],
                frame_bytes: bytes(of, 1.0),
                answer: match (high - low > KNEE_POINTS, unmeasured) {
                    (true, _) => Answer::InsideKnee,
                    (_, Some(why)) => Answer::Unmeasured(why),
                    _ => Answer::Interval,
                },
            });
        }
    }
    Ok(predicted)
}

/// Pixels of the picture of an eye.
fn pixels(trace: &dyn TileSource) -> u64 {
    let [width, height] = trace.tables().meta.hmd.eye_size_px;
    u64::from(width) * u64::from(height)
}

/// Why the errors of a prediction were not measured.
fn unmeasured(config: &RunConfig, pixels: u64, growth: f64) -> Option<&'static str> {
    let level = &config.level.l2;
    let is_even = level.set_index != SetIndex::Modulo || level.ways >= 16;
    let reasons = [
        (!is_even, "fewer than 16 ways without a hash"),
        (growth > MOST_GROWTH, "more than three times the width"),
        (pixels < LEAST_PX, "a capture below 480x540 pixels"),
        (
            !L2_BYTES.contains(&level.size_bytes),
            "an L2 outside 128 KiB to 2 MiB",
        ),
        (
            !L1_BYTES.contains(&config.level.l1.size_bytes),
            "an L1 outside 2 to 32 KiB",
        ),
        (
            !LINE_BYTES.contains(&config.line_bytes),
            "lines outside 16 to 128 bytes",
        ),
    ];
    let found = reasons.into_iter().find(|(holds, _)| *holds);
    found.map(|(_, why)| why)
}

/// The reuses of the L2's stream in each order.
fn reuses(
    trace: &dyn TileSource,
    config: &RunConfig,
    orders: &[Order],
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Reuses>, ReplayError> {
    let figures = analyse(trace, config, orders, Streams::OnlyL2Distances, done)?;
    let streams = figures.iter().flat_map(|order| &order.streams);
    let l2 = streams.filter(|(stream, _)| *stream == Stream::L2);
    Ok(l2.map(|(_, figures)| Reuses::new(figures)).collect())
}

/// The power of the growth of lines from the halved pictures to those of the trace, which have so many `lines`, by which
/// they grow on to the wanted size. It falls where textures reach their finest level.
fn growth_of_lines(
    [small, own]: [&dyn TileSource; 2],
    [of_small, of_own]: [f64; 2],
    growth: f64,
    config: &RunConfig,
) -> Result<f64, ReplayError> {
    let power = growth.ln() / STEP.ln();
    let last = of_own / of_small.max(1.0);
    if last <= 1.0 || growth <= 1.0 {
        return Ok(power);
    }
    let lines = |trace, zoom| {
        let lines = distinct_lines(trace, config, zoom)?;
        Ok::<f64, ReplayError>(lines.max(1) as f64)
    };
    // What the samples of the halved pictures do not read of the lines of the larger ones.
    let missed = of_own / lines(small, STEP)?;
    let next = lines(own, growth)? / of_own * missed.powf(power);
    Ok(next.max(1.0).ln() / last.ln())
}

/// What of a machine the prediction cannot follow: the key, what it expects and what it found.
pub fn not_predicted(config: &RunConfig) -> Option<[String; 3]> {
    let [l1, l2] = [&config.level.l1, &config.level.l2];
    let refused = [
        (
            config.follows_l2_misses() || config.frame.is_some(),
            "machine",
            "an L1 and an L2 only",
            "[prefetch], [[level]], [dram], [frame] or l2.inclusion".to_owned(),
        ),
        (
            l2.replacement != Replacement::LRU,
            "l2.replacement",
            "lru",
            l2.replacement.name().to_owned(),
        ),
        (
            [l1, l2]
                .iter()
                .any(|of| (of.sectors, of.victim_lines) != (1, 0)),
            "caches",
            "whole lines without victim caches",
            "sectors or victim_lines".to_owned(),
        ),
        (
            l1.set_index != SetIndex::Modulo,
            "l1.set_index",
            "modulo",
            "another".to_owned(),
        ),
    ];
    let found = refused.into_iter().find(|(is_refused, ..)| *is_refused);
    found.map(|(_, key, expected, found)| [key.to_owned(), expected.to_owned(), found])
}
