//! Chooses an order per frame from a counter that a GPU has: the lines fetched from memory in a frame.
//!
//! The learner renders one frame with each order, and then uses the order that fetched least. Every few frames
//! it tries another order again, which may have become better. All orders should traverse the picture in the
//! same direction in the same frame, so that the L2 contents suit each of them.

use super::stream::Counting;
use rayon::prelude::*;
use sim::config::{Order, RunConfig};
use sim::engine::{ReplayError, check_other_work};
use sim::stream::{
    Cores, Expander, Frame, FramePlan, LineMemory, TileSource, Walk, interleave, rendered,
};

/// Number of frames between two trials of other orders.
const TRY_EVERY: u64 = 8;

/// A learner that chooses among several orders.
#[derive(Clone, Debug)]
pub struct Learner {
    /// Lines fetched with each order in its last frame.
    fetched: Vec<Option<u64>>,
    /// Number of frames so far.
    frames: u64,
    /// The order of the next trial.
    next: usize,
    /// The order of the current frame.
    current: usize,
}

impl Learner {
    /// Bytes of registers for this number of orders: a counter per order, the current and the next order, and a
    /// frame counter.
    pub const fn state_bytes(orders: u32) -> u32 {
        4 * orders + 3
    }

    /// A learner for one or more orders, without observations.
    pub fn new(orders: usize) -> Self {
        Self {
            fetched: vec![None; orders],
            frames: 0,
            next: 0,
            current: 0,
        }
    }

    /// The order of the next frame.
    fn choose(&mut self) -> usize {
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

    /// Records the lines that the frame fetched.
    fn observe(&mut self, fetched: u64) {
        if let Some(of_order) = self.fetched.get_mut(self.current) {
            *of_order = Some(fetched);
        }
    }

    /// The order that fetched least in its last frame (the first one if equal).
    fn best(&self) -> usize {
        let known = self.fetched.iter().enumerate();
        let best = known.min_by_key(|(order, fetched)| (fetched.unwrap_or(u64::MAX), *order));
        best.map_or(0, |(order, _)| order)
    }
}

/// The results for a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The orders.
    pub orders: Vec<Order>,
    /// Bytes fetched per order and frame, if each order is used in all frames.
    pub fixed: Vec<Vec<u64>>,
    /// Bytes fetched per frame with the orders that the learner chose.
    pub learned: Vec<u64>,
    /// The chosen order per frame.
    pub chosen: Vec<usize>,
}

impl Learned {
    /// The best fixed order and its bytes over all frames.
    pub fn best_fixed(&self) -> Option<(Order, u64)> {
        let totals = self.fixed.iter().map(|frames| frames.iter().sum());
        self.orders
            .iter()
            .copied()
            .zip(totals)
            .min_by_key(|(_, total)| *total)
    }

    /// Additional bytes over the best fixed order, percent.
    pub fn regret_pct(&self, bytes: u64) -> Option<f64> {
        let (_, best) = self.best_fixed().filter(|(_, best)| *best > 0)?;
        Some(100.0 * (bytes as f64 / best as f64 - 1.0))
    }

    /// Bytes saved by the best order of each frame over the best fixed order, percent.
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

/// One run over the frames, with its own caches.
struct Run {
    caches: Counting,
    learner: Option<Learner>,
    order: usize,
    fetched: Vec<u64>,
    chosen: Vec<usize>,
}

/// Renders all frames of a trace with each fixed order and with a learner. None unless all caches are plain LRU
/// caches of four ways.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn learn(
    trace: &dyn TileSource,
    config: &RunConfig,
    orders: &[Order],
    done: &(dyn Fn(u64) + Sync),
) -> Result<Option<Learned>, ReplayError> {
    config.validate()?;
    let rendered = rendered(trace, config)?;
    let expander = Expander::new(&rendered, config)?;
    if config.between_frames.lost_percent().is_some() {
        check_other_work(expander.lines())?;
    }
    // Caches of four ways hold all lines of a footprint, so repeats hit.
    let l1_sets = config.level.l1.sets("L1", config.line_bytes)?;
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
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, orders.iter().copied());
    for number in walk.frames() {
        let frame = walk.expand(number)?;
        let plan = walk.plan(&frame)?;
        let render = |run: &mut Run| {
            if !run.fetched.is_empty() {
                run.caches.between(config, run.fetched.len());
            }
            run.frame(&frame, orders, &plan, config)
        };
        runs.par_iter_mut().try_for_each(render)?;
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
        plan: &FramePlan<'_>,
        config: &RunConfig,
    ) -> Result<(), ReplayError> {
        let chosen = self.learner.as_mut().map_or(self.order, Learner::choose);
        let order = orders[chosen];
        let phases = plan.phases(&RunConfig { order, ..*config });
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

    /// Runs a learner on frames with these numbers of fetched lines.
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
    fn each_order_is_tried_and_the_best_one_is_used_except_for_occasional_trials() {
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
    fn a_single_order_is_never_replaced() {
        let (total, _) = run(1, 40, |_, _| 7);
        assert_eq!(total, 280);
        assert_eq!(Learner::state_bytes(4), 19);
    }
}
