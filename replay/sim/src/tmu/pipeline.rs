//! Timing of one core's texture unit: when threads enter the pipeline, and what they cost.

use super::waiting::{Pending, Waiting, drop_arrived};
use crate::config::TmuConfig;
use std::collections::VecDeque;

/// State of the first stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// A looping thread used the slot, or the pipeline waited for one.
    Looped,
    /// The slot is free for a new thread: call [`Pipeline::start`], or [`Pipeline::drain`].
    Free,
    /// No threads are left.
    Done,
}

/// Counters of a core's texture unit. The total cycles are `useful + wasted + idle`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelineStats {
    /// Footprints filtered, one per cycle.
    pub useful: u64,
    /// Issue slots used by footprints with missing lines.
    pub wasted: u64,
    /// Cycles in which no thread entered.
    pub idle: u64,
    /// Threads started.
    pub threads: u64,
    /// Trips after a thread's first.
    pub loops: u64,
}

impl PipelineStats {
    /// Adds another core's counters.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, useful, wasted, idle, threads, loops);
    }

    /// Useful cycles over all cycles, 0 to 1.
    pub fn utilization(&self) -> f64 {
        let cycles = self.useful + self.wasted + self.idle;
        if cycles == 0 {
            0.0
        } else {
            self.useful as f64 / cycles as f64
        }
    }
}

/// A thread that returns to the first stage.
#[derive(Clone, Copy, Debug)]
struct LoopingThread {
    /// Cycle of its return.
    back: u64,
    /// Earliest arrival that it waits for.
    earliest: u64,
    /// Number of waiting footprints.
    waiting: u32,
    /// Its list in [`Pipeline::pending`].
    list: u32,
}

/// The pipeline of one core.
///
/// A thread is a quad with all its footprints. Footprints with resident lines enter, one per cycle. The
/// others are inactive for the rest of the trip: their tags were checked without success, several per
/// cycle. The thread returns to the first stage `loop_cycles` later, with precedence over new threads, and
/// tries its pending footprints again.
#[derive(Clone, Debug)]
pub struct Pipeline {
    config: TmuConfig,
    /// The current cycle.
    clock: u64,
    /// In order of return, because all loops have the same length.
    looping: VecDeque<LoopingThread>,
    /// Lists of pending footprints.
    pending: Vec<Vec<Pending>>,
    /// Unused lists.
    spare: Vec<u32>,
    /// Pending footprints in a partly filled retry slot, which the next thread's retries share.
    open_slot: u32,
    drained: bool,
    stats: PipelineStats,
}

impl Pipeline {
    /// An empty pipeline at cycle 0.
    pub fn new(config: TmuConfig) -> Self {
        Self {
            config,
            clock: 0,
            looping: VecDeque::with_capacity(config.threads as usize),
            pending: Vec::new(),
            spare: Vec::new(),
            open_slot: 0,
            drained: false,
            stats: PipelineStats::default(),
        }
    }

    /// The current cycle.
    #[inline]
    pub fn clock(&self) -> u64 {
        self.clock
    }

    /// The counters.
    pub fn stats(&self) -> PipelineStats {
        self.stats
    }

    /// Announces that no thread will start until [`Self::resume`].
    pub fn drain(&mut self) {
        self.drained = true;
    }

    /// Allows new threads from `cycle` on. The wait until then does not count as idle.
    pub fn resume(&mut self, cycle: u64) {
        self.drained = false;
        self.clock = self.clock.max(cycle);
    }

    /// Advances time until the first stage has been used or is free for a new thread.
    #[inline]
    pub fn turn(&mut self) -> Turn {
        let full = self.drained || self.looping.len() >= self.config.threads as usize;
        match self.looping.front() {
            Some(thread) if thread.back <= self.clock => {
                self.retry();
                Turn::Looped
            }
            Some(thread) if full => {
                self.stats.idle += thread.back - self.clock;
                self.clock = thread.back;
                Turn::Looped
            }
            None if self.drained => Turn::Done,
            _ => Turn::Free,
        }
    }

    fn retry(&mut self) {
        let Some(mut thread) = self.looping.pop_front() else {
            return;
        };
        self.stats.loops += 1;
        if thread.earliest > self.clock {
            self.trip(0, thread);
            return;
        }
        let list = &mut self.pending[thread.list as usize];
        let waited = thread.waiting;
        (thread.waiting, thread.earliest) = drop_arrived(list, self.clock);
        if thread.waiting == 0 {
            self.spare.push(thread.list);
        }
        self.trip((waited - thread.waiting).into(), thread);
    }

    /// Starts a thread now. `waiting` lists the future arrivals that some of its `footprints` wait for; its
    /// list is exchanged for an unused one.
    #[inline(always)]
    pub fn start(&mut self, footprints: u32, waiting: &mut Waiting) {
        self.stats.threads += 1;
        if waiting.is_empty() {
            self.stats.useful += u64::from(footprints);
            self.clock += u64::from(footprints);
        } else {
            self.start_looping(footprints, waiting);
        }
    }

    #[inline(never)]
    fn start_looping(&mut self, footprints: u32, waiting: &mut Waiting) {
        debug_assert!(waiting.earliest > self.clock);
        let list = self.spare.pop().unwrap_or_else(|| {
            self.pending.push(Vec::new());
            self.pending.len() as u32 - 1
        });
        let thread = LoopingThread {
            back: 0,
            earliest: waiting.earliest,
            waiting: waiting.count(),
            list,
        };
        std::mem::swap(&mut self.pending[list as usize], &mut waiting.list);
        self.trip((footprints - thread.waiting).into(), thread);
    }

    /// One trip: `hits` footprints are filtered, the waiting ones are not.
    #[inline(always)]
    fn trip(&mut self, hits: u64, thread: LoopingThread) {
        let entered = self.clock;
        self.stats.useful += hits;
        self.clock += hits;
        if thread.waiting == 0 {
            return;
        }
        self.open_slot += thread.waiting;
        let slots = u64::from(self.open_slot / self.config.retry_footprints);
        self.open_slot %= self.config.retry_footprints;
        self.stats.wasted += slots;
        self.clock += slots;
        self.looping.push_back(LoopingThread {
            back: entered + u64::from(self.config.loop_cycles),
            ..thread
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Allocation, TmuModel};

    const CONFIG: TmuConfig = TmuConfig {
        model: TmuModel::Looping,
        loop_cycles: 36,
        threads: 4,
        retry_footprints: 4,
        fetches_per_trip: 2,
        allocation: Allocation::OnFill,
        l2_mshrs: 0,
        fifo_footprints: 64,
    };

    /// Runs threads in sequence, each given as hits and latencies of its misses.
    fn run(config: TmuConfig, threads: &[(u32, &[u64])]) -> (u64, PipelineStats) {
        let mut pipeline = Pipeline::new(config);
        let mut threads = threads.iter();
        loop {
            match pipeline.turn() {
                Turn::Looped => {}
                Turn::Done => return (pipeline.clock(), pipeline.stats()),
                Turn::Free => match threads.next() {
                    Some((hits, latencies)) => {
                        let now = pipeline.clock();
                        let pending = (0..).zip(*latencies).map(|(number, latency)| {
                            let (segment, number) =
                                (number / Pending::SEGMENT, number % Pending::SEGMENT);
                            Pending::new(now + latency, 1 << number, segment)
                        });
                        let mut waiting = Waiting::default();
                        pending.for_each(|one| waiting.push(one));
                        pipeline.start(hits + latencies.len() as u32, &mut waiting);
                    }
                    None => pipeline.drain(),
                },
            }
        }
    }

    #[test]
    fn threads_that_hit_take_one_cycle_per_footprint() {
        let (cycles, stats) = run(CONFIG, &[(16, &[]), (24, &[])]);
        assert_eq!(
            (cycles, stats.useful, stats.wasted, stats.idle),
            (40, 40, 0, 0)
        );
    }

    #[test]
    fn an_l1_miss_of_a_quad_costs_one_slot_and_one_loop() {
        let (cycles, stats) = run(CONFIG, &[(12, &[20; 4])]);
        assert_eq!((stats.useful, stats.loops, stats.wasted), (16, 1, 1));
        assert_eq!(cycles, 36 + 4);
    }

    #[test]
    fn an_l2_miss_loops_until_the_line_is_filled() {
        let (cycles, stats) = run(CONFIG, &[(12, &[220; 4])]);
        // The thread returns at cycles 36, 72 ... 252, the first after 220. Each failed trip costs a slot.
        assert_eq!((stats.loops, stats.wasted), (7, 7));
        assert_eq!(cycles, 252 + 4);
    }

    #[test]
    fn footprints_with_filled_lines_are_not_retried() {
        let (cycles, stats) = run(CONFIG, &[(0, &[20, 20, 20, 20, 220, 220, 220, 220])]);
        assert_eq!((stats.loops, stats.wasted), (7, 2 + 6));
        assert_eq!(cycles, 252 + 4);
    }

    #[test]
    fn single_misses_of_several_threads_share_a_retry_slot() {
        let (_, stats) = run(CONFIG, &[(1, &[20]), (1, &[20]), (1, &[20]), (1, &[20])]);
        assert_eq!((stats.loops, stats.wasted), (4, 1));
    }

    #[test]
    fn other_threads_hide_the_latency() {
        let (cycles, stats) = run(CONFIG, &[(12, &[20; 4]), (64, &[])]);
        assert_eq!((cycles, stats.idle), (12 + 1 + 64 + 4, 0));
    }

    #[test]
    fn a_core_has_at_most_the_configured_number_of_threads() {
        let config = TmuConfig {
            threads: 1,
            ..CONFIG
        };
        let (cycles, stats) = run(config, &[(4, &[20; 4]), (8, &[])]);
        assert_eq!(cycles, 36 + 4 + 8);
        assert_eq!(stats.idle, 36 - 4 - 1);
    }

    #[test]
    fn every_cycle_is_useful_wasted_or_idle() {
        let latencies = [[20; 3], [220; 3], [40; 3]];
        let threads: Vec<(u32, &[u64])> = (0..500)
            .map(|i| (i as u32 * 7 % 40, &latencies[i % 3][..i % 4]))
            .collect();
        let (cycles, stats) = run(CONFIG, &threads);
        assert_eq!(cycles, stats.useful + stats.wasted + stats.idle);
        assert_eq!(stats.threads, 500);
    }
}
