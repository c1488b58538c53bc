//! Timing of one core's texture unit: which thread enters the pipeline when, and what it costs.

use crate::config::TmuConfig;
use std::collections::VecDeque;

/// What happens at the first stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// A looping thread took the slot, or the pipeline waited for one.
    Looped,
    /// The slot is free for a new thread: call [`Pipeline::start`], or [`Pipeline::drain`].
    Free,
    /// No thread is left.
    Done,
}

/// Counters of a core's texture unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelineStats {
    /// Footprints filtered; one takes one cycle.
    pub useful: u64,
    /// Issue slots taken by trips that failed.
    pub wasted: u64,
    /// Cycles in which no thread could enter.
    pub idle: u64,
    /// Threads finished or in flight.
    pub threads: u64,
    /// Trips after the first.
    pub loops: u64,
}

/// A thread on its way back to the first stage.
#[derive(Clone, Copy, Debug)]
struct Looping {
    /// When it is there.
    back: u64,
    /// When the last of its lines arrives.
    ready: u64,
    footprints: u32,
}

/// The pipeline of one core.
///
/// A thread is a quad with all its footprints. Entering takes one cycle a footprint if every line
/// is there. If any line is missing the thread is inactive for the rest of this trip: it has spent
/// the slots of its tag probe, starts all its fetches at once, and is back at the first stage
/// `loop_cycles` later, where it has precedence over new threads and is tried again.
#[derive(Clone, Debug)]
pub struct Pipeline {
    config: TmuConfig,
    /// The current cycle.
    clock: u64,
    /// In order of return, since every loop is equally long.
    looping: VecDeque<Looping>,
    drained: bool,
    stats: PipelineStats,
}

impl Pipeline {
    /// An empty pipeline at cycle 0.
    #[must_use]
    pub fn new(config: TmuConfig) -> Self {
        Self {
            config,
            clock: 0,
            looping: VecDeque::with_capacity(config.threads as usize),
            drained: false,
            stats: PipelineStats::default(),
        }
    }

    /// The current cycle.
    #[inline]
    #[must_use]
    pub fn clock(&self) -> u64 {
        self.clock
    }

    /// The counters.
    #[must_use]
    pub fn stats(&self) -> PipelineStats {
        self.stats
    }

    /// No further thread will come until [`Self::resume`].
    pub fn drain(&mut self) {
        self.drained = true;
    }

    /// New threads may come, not before `cycle`.
    pub fn resume(&mut self, cycle: u64) {
        self.drained = false;
        self.clock = self.clock.max(cycle);
    }

    /// Lets time pass until the first stage has been used or is free for a new thread.
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
        if let Some(thread) = self.looping.pop_front() {
            self.stats.loops += 1;
            self.enter(thread.footprints, thread.ready);
        }
    }

    /// A new thread enters now; its lines are all there at `ready`.
    #[inline]
    pub fn start(&mut self, footprints: u32, ready: u64) {
        self.stats.threads += 1;
        self.enter(footprints, ready);
    }

    #[inline]
    fn enter(&mut self, footprints: u32, ready: u64) {
        if ready <= self.clock {
            self.stats.useful += u64::from(footprints);
            self.clock += u64::from(footprints);
        } else {
            let slots = u64::from(footprints.div_ceil(self.config.probe_footprints));
            self.looping.push_back(Looping {
                back: self.clock + u64::from(self.config.loop_cycles),
                ready,
                footprints,
            });
            self.stats.wasted += slots;
            self.clock += slots;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: TmuConfig = TmuConfig {
        l1_penalty_cycles: 20,
        l2_penalty_cycles: 200,
        loop_cycles: 36,
        threads: 4,
        probe_footprints: 8,
    };

    /// Runs threads of (footprints, latency) one after another.
    fn run(config: TmuConfig, threads: &[(u32, u64)]) -> (u64, PipelineStats) {
        let mut pipeline = Pipeline::new(config);
        let mut threads = threads.iter();
        loop {
            match pipeline.turn() {
                Turn::Looped => {}
                Turn::Done => return (pipeline.clock(), pipeline.stats()),
                Turn::Free => match threads.next() {
                    Some(&(footprints, latency)) => {
                        pipeline.start(footprints, pipeline.clock() + latency);
                    }
                    None => pipeline.drain(),
                },
            }
        }
    }

    #[test]
    fn threads_that_hit_take_a_cycle_a_footprint() {
        let (cycles, stats) = run(CONFIG, &[(16, 0), (24, 0)]);
        assert_eq!(
            (cycles, stats.useful, stats.wasted, stats.idle),
            (40, 40, 0, 0)
        );
    }

    #[test]
    fn an_l1_miss_costs_one_loop() {
        let (cycles, stats) = run(CONFIG, &[(16, 20)]);
        assert_eq!((stats.loops, stats.wasted), (1, 2));
        assert_eq!(cycles, 36 + 16);
    }

    #[test]
    fn an_l2_miss_loops_until_memory_has_answered() {
        let (cycles, stats) = run(CONFIG, &[(16, 220)]);
        // Back at cycles 36, 72 ... 252, the first after 220; two slots for each failed trip.
        assert_eq!((stats.loops, stats.wasted), (7, 14));
        assert_eq!(cycles, 252 + 16);
    }

    #[test]
    fn other_threads_hide_the_latency() {
        let (cycles, stats) = run(CONFIG, &[(16, 20), (64, 0)]);
        assert_eq!(cycles, 2 + 64 + 16);
        assert_eq!(stats.idle, 0);
    }

    #[test]
    fn a_core_holds_no_more_threads_than_configured() {
        let config = TmuConfig {
            threads: 1,
            ..CONFIG
        };
        let (cycles, stats) = run(config, &[(8, 20), (8, 0)]);
        assert_eq!(cycles, 36 + 8 + 8);
        assert_eq!(stats.idle, 35);
    }

    #[test]
    fn every_cycle_is_useful_wasted_or_idle() {
        let threads: Vec<(u32, u64)> = (0..500)
            .map(|i| (1 + i * 7 % 40, u64::from(i % 3) * 110))
            .collect();
        let (cycles, stats) = run(CONFIG, &threads);
        assert_eq!(cycles, stats.useful + stats.wasted + stats.idle);
        assert_eq!(stats.threads, 500);
    }
}
