//! Learning from the last frames: which of some orders fetches least is found out while frames are rendered, with counters
//! that a GPU has (lines fetched from memory in a frame).
//!
//! The learner renders a frame with each order in turn, then stays with the one that fetched least, and from time to time
//! renders a frame with another one to see whether that has become better. All orders cross the picture in the same
//! direction in the same frame, so that a change of orders finds in the L2 what a stay would find.

use super::stream::Counting;
use crate::config::{Order, RunConfig};
use crate::engine::{OtherWork, ReplayError};
use crate::order::{self, Counters, Known};
use crate::stream::{
    Cores, Expander, Frame, LineMemory, TileSource, TraceCounts, interleave, rendered,
};
use rayon::prelude::*;

/// Frames between two tries of another order.
const TRY_EVERY: u64 = 8;

/// A learner over some orders: what was fetched with each when it was used last.
#[derive(Clone, Debug)]
pub struct Learner {
    fetched: Vec<Option<u64>>,
    /// Frames so far, and the order that is tried next.
    frames: u64,
    next: usize,
    current: usize,
}

impl Learner {
    /// Registers of it for so many orders: a counter for each, the current one and the next, frames.
    #[must_use]
    pub const fn state_bytes(orders: u32) -> u32 {
        4 * orders + 3
    }

    /// Knows nothing of `orders` orders, of which there is at least one.
    #[must_use]
    pub fn new(orders: usize) -> Self {
        Self {
            fetched: vec![None; orders],
            frames: 0,
            next: 0,
            current: 0,
        }
    }

    /// The order of the next frame.
    pub fn choose(&mut self) -> usize {
        let unknown = self.fetched.iter().position(Option::is_none);
        let tries = self.fetched.len() > 1 && self.frames.is_multiple_of(TRY_EVERY);
        self.current = match unknown {
            Some(order) => order,
            None if tries => {
                if self.next == self.best() {
                    self.next = (self.next + 1) % self.fetched.len();
                }
                let order = self.next;
                self.next = (self.next + 1) % self.fetched.len();
                order
            }
            None => self.best(),
        };
        self.frames += 1;
        self.current
    }

    /// What the frame fetched.
    pub fn observe(&mut self, fetched: u64) {
        if let Some(of_order) = self.fetched.get_mut(self.current) {
            *of_order = Some(fetched);
        }
    }

    /// The order that fetched least when it was used last; the first of equals.
    fn best(&self) -> usize {
        let known = self.fetched.iter().enumerate();
        let best = known.min_by_key(|(order, fetched)| (fetched.unwrap_or(u64::MAX), *order));
        best.map_or(0, |(order, _)| order)
    }
}

/// What came of a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The orders.
    pub orders: Vec<Order>,
    /// Bytes fetched by order and frame, where it is used throughout.
    pub fixed: Vec<Vec<u64>>,
    /// By frame, where the learner chooses.
    pub learned: Vec<u64>,
    /// What it chose.
    pub chosen: Vec<usize>,
}

impl Learned {
    fn total(frames: &[u64]) -> u64 {
        frames.iter().sum()
    }

    /// The order that is best throughout, and its bytes.
    #[must_use]
    pub fn best_fixed(&self) -> Option<(Order, u64)> {
        let totals = self.fixed.iter().map(|frames| Self::total(frames));
        self.orders
            .iter()
            .copied()
            .zip(totals)
            .min_by_key(|(_, total)| *total)
    }

    /// Bytes of the learner over those of the best fixed order, percent more.
    #[must_use]
    pub fn regret_pct(&self) -> Option<f64> {
        let (_, best) = self.best_fixed().filter(|(_, best)| *best > 0)?;
        Some(100.0 * (Self::total(&self.learned) as f64 / best as f64 - 1.0))
    }

    /// Bytes of the frame-wise best of the fixed orders, percent less than the best fixed order's.
    #[must_use]
    pub fn frame_best_pct(&self) -> Option<f64> {
        let (_, best) = self.best_fixed().filter(|(_, best)| *best > 0)?;
        let least = |frame: usize| {
            self.fixed
                .iter()
                .map(|frames| frames[frame])
                .min()
                .unwrap_or(0)
        };
        let sum: u64 = (0..self.learned.len()).map(least).sum();
        Some(100.0 * (1.0 - sum as f64 / best as f64))
    }
}

/// One run over the frames: caches, and what chooses the order.
struct Run {
    caches: Counting,
    learner: Option<Learner>,
    order: usize,
    fetched: Vec<u64>,
    chosen: Vec<usize>,
}

/// Renders all frames of a trace with each order throughout, and with a learner. None unless caches are of four ways and
/// plain LRU.
///
/// # Errors
/// An impossible configuration, a trace that cannot be read.
pub fn learn(
    trace: &dyn TileSource,
    config: &RunConfig,
    orders: &[Order],
    done: &(dyn Fn(u64) + Sync),
) -> Result<Option<Learned>, ReplayError> {
    config.validate()?;
    let rendered = rendered(trace, config)?;
    let tables = TileSource::tables(&rendered);
    let expander = Expander::new(&rendered, config)?;
    if config.between_frames.lost_percent().is_some() {
        OtherWork::check(expander.lines())?;
    }
    // Caches of four ways hold what a footprint asks for, so that repeats find it.
    let l1_sets = config.l1.sets("L1", config.line_bytes)?;
    let expander = expander.without_idle_accesses(l1_sets);
    let mut runs = Vec::new();
    for order in 0..=orders.len() {
        let Some(caches) = Counting::new(config)? else {
            return Ok(None);
        };
        runs.push(Run {
            caches,
            learner: (order == orders.len()).then(|| Learner::new(orders.len())),
            order,
            fetched: Vec::new(),
            chosen: Vec::new(),
        });
    }
    let mut frames: Vec<u32> = tables.passes.iter().map(|pass| pass.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut counts = TraceCounts::new(expander.bins());
    let mut last: Option<Counters> = None;
    let need_counters = orders.iter().any(|order| order.parts().needs_counters());
    for &number in &frames {
        let frame = expander.frame(number, &memory, &mut counts)?;
        let counted = match need_counters {
            true => {
                let known = Known::new(config, &tables.meta);
                Some(frame.counters(&tables.passes, number, &known)?)
            }
            false => None,
        };
        let of_last = last.take().or_else(|| counted.clone());
        let known = Known {
            last: of_last.as_ref(),
            ..Known::new(config, &tables.meta)
        };
        let render = |run: &mut Run| {
            if !run.fetched.is_empty() {
                run.caches.between(config, run.fetched.len());
            }
            run.frame(&frame, orders, &known, &tables.passes, number, config)
        };
        runs.par_iter_mut().try_for_each(render)?;
        last = counted;
        done(1);
    }
    let learner = runs.pop();
    let (learned, chosen) = learner
        .map(|run| (run.fetched, run.chosen))
        .unwrap_or_default();
    Ok(Some(Learned {
        orders: orders.to_vec(),
        fixed: runs.into_iter().map(|run| run.fetched).collect(),
        learned,
        chosen,
    }))
}

impl Run {
    fn frame(
        &mut self,
        frame: &Frame<'_>,
        orders: &[Order],
        known: &Known<'_>,
        passes: &[formats::textrace::Pass],
        number: u32,
        config: &RunConfig,
    ) -> Result<(), ReplayError> {
        let chosen = self.learner.as_mut().map_or(self.order, Learner::choose);
        let order = orders[chosen];
        let phases = order::plan_frame(order, known, passes, number);
        let before = self.caches.fetched;
        let mut cores = Cores::new(frame, config.cores as usize);
        interleave(
            &mut cores,
            &phases,
            order.dispatch(config.assign),
            &mut self.caches,
        )?;
        let fetched = self.caches.fetched - before;
        if let Some(learner) = &mut self.learner {
            learner.observe(fetched);
        }
        self.chosen.push(chosen);
        self.fetched.push(fetched * u64::from(config.line_bytes));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a learner on frames that fetch so much with each order.
    fn run(orders: usize, frames: u64, fetched: impl Fn(u64, usize) -> u64) -> (u64, Vec<usize>) {
        let mut learner = Learner::new(orders);
        let mut total = 0;
        let mut chosen = Vec::new();
        for frame in 0..frames {
            let order = learner.choose();
            let bytes = fetched(frame, order);
            learner.observe(bytes);
            total += bytes;
            chosen.push(order);
        }
        (total, chosen)
    }

    #[test]
    fn each_order_is_tried_and_the_best_one_kept_but_for_a_try_now_and_then() {
        let (_, chosen) = run(3, 33, |_, order| [30, 10, 20][order]);
        assert_eq!(chosen[..8], [0, 1, 2, 1, 1, 1, 1, 1]);
        assert_eq!(
            [chosen[8], chosen[16], chosen[24], chosen[32]],
            [0, 2, 0, 2]
        );
        assert_eq!(chosen.iter().filter(|order| **order == 1).count(), 33 - 6);
    }

    #[test]
    fn an_order_that_becomes_better_is_found() {
        let (_, chosen) = run(
            2,
            120,
            |frame, order| if (frame < 40) == (order == 0) { 10 } else { 30 },
        );
        assert!(chosen[50..].iter().filter(|order| **order == 1).count() > 60);
    }

    #[test]
    fn one_order_is_never_tried_against_another() {
        let (total, _) = run(1, 40, |_, _| 7);
        assert_eq!(total, 280);
        assert_eq!(Learner::state_bytes(4), 19);
    }
}
