//! A sample of a path's frames: which frames it needs next, and what it says.

use super::estimate::{Estimate, Pair, Stratum, estimate, figure};
use super::of::Of;
use super::stages::{self, Demand};
use super::strata::{Block, Planned, strata};
use super::values::Series;
use sim::figure::Figure;

/// Width of an interval that is asked for: plus or minus this much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Within {
    /// Percentage points of a share.
    Points(f64),
    /// Percent of the figure.
    Percent(f64),
}

impl Within {
    /// Largest half width of the interval of a ratio.
    fn half(self, ratio: f64) -> f64 {
        match self {
            Self::Points(points) => points / 100.0,
            Self::Percent(percent) => percent / 100.0 * ratio.abs(),
        }
    }
}

/// What is asked of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Promise {
    /// Width of each interval.
    pub within: Within,
    /// Probability that all intervals hold together.
    pub confidence: f64,
}

impl Promise {
    /// Largest half width of the interval of a ratio.
    pub fn half(&self, ratio: f64) -> f64 {
        self.within.half(ratio)
    }

    /// The confidence of each of `count` intervals that hold together (Bonferroni).
    fn of_each(&self, count: usize) -> f64 {
        1.0 - (1.0 - self.confidence) / count.max(1) as f64
    }
}

/// A figure of a configuration.
#[derive(Clone, Copy, Debug)]
pub struct Aim<'a> {
    /// The figure.
    pub of: Of,
    /// Counts by frame.
    pub values: &'a Series,
    /// Those of the baseline order.
    pub baseline: &'a Series,
}

impl Aim<'_> {
    /// Numerator and denominator of a frame, if it was replayed.
    pub fn pair(&self, frame: u32) -> Option<Pair> {
        let (counts, baseline) = (self.values.get(&frame)?, self.baseline.get(&frame)?);
        Some(self.of.pair(counts, baseline))
    }
}

/// What is to be done.
#[derive(Clone, Debug)]
pub enum Step {
    /// These frames are missing.
    Capture(Vec<u32>),
    /// The figures, in the order of the aims, and the frames of each stratum that they are from.
    Done(Vec<Figure>, Vec<usize>),
}

/// The sample of a plan and a seed.
#[derive(Clone, Debug)]
pub struct Sample<'p> {
    plan: &'p [Planned],
    /// Strata of the path.
    pub strata: Vec<Block>,
    drawn: Vec<Vec<usize>>,
}

impl<'p> Sample<'p> {
    /// Divides a path and draws the sequence of its frames.
    pub fn new(plan: &'p [Planned], seed: u64) -> Self {
        let strata = strata(plan);
        let drawn = stages::draw(&strata, seed);
        Self {
            plan,
            strata,
            drawn,
        }
    }

    /// The frames of a sample with these sizes of its strata.
    pub fn frames(&self, sizes: &[usize]) -> Vec<u32> {
        let chosen = self
            .drawn
            .iter()
            .zip(sizes)
            .flat_map(|(drawn, &size)| &drawn[..size]);
        let mut frames: Vec<u32> = chosen.map(|&at| self.plan[at].number).collect();
        frames.sort_unstable();
        frames
    }

    /// The values of the sampled frames by stratum.
    fn values(&self, aim: &Aim<'_>, sizes: &[usize]) -> Vec<Stratum> {
        let of = |(drawn, &size): (&Vec<usize>, &usize)| Stratum {
            of: drawn.len(),
            sample: drawn[..size]
                .iter()
                .filter_map(|&at| aim.pair(self.plan[at].number))
                .collect(),
        };
        self.drawn.iter().zip(sizes).map(of).collect()
    }

    /// An estimate from a sample with these sizes.
    pub fn estimate(&self, aim: &Aim<'_>, sizes: &[usize]) -> Estimate {
        estimate(&self.values(aim, sizes))
    }

    /// The next step to keep a promise for all aims, from the frames that were replayed.
    pub fn step(&self, aims: &[Aim<'_>], promise: &Promise) -> Step {
        let missing = |sizes: &[usize]| {
            let mut frames = self.frames(sizes);
            frames.retain(|frame| aims.iter().any(|aim| aim.pair(*frame).is_none()));
            (!frames.is_empty()).then_some(Step::Capture(frames))
        };
        let confidence = promise.of_each(aims.len());
        let pilot = stages::pilot(&self.strata);
        if let Some(step) = missing(&pilot) {
            return step;
        }
        let demand = |aim: &Aim<'_>| {
            let estimate = self.estimate(aim, &pilot);
            let half = promise.within.half(estimate.ratio);
            Demand {
                estimate,
                half,
                confidence,
            }
        };
        let demands: Vec<Demand> = aims.iter().map(demand).collect();
        let sizes = stages::last(&self.strata, &pilot, &demands);
        if let Some(step) = missing(&sizes) {
            return step;
        }
        let figures = aims
            .iter()
            .map(|aim| figure(&self.values(aim, &sizes), confidence));
        Step::Done(figures.collect(), sizes)
    }
}
