//! Clocked texture units. The models of what threads do on a miss have one file each (`tmu.model`).
//!
//! Each core's texture unit has its own clock. Shared resources, the L2 and the list of items, are accessed
//! in order of time, by the core with the earliest clock. A core runs ahead on its own until it needs a
//! shared resource while another core is behind.

mod first_miss;
mod items;
mod looping;
mod prefetch_fifo;

use super::counts::CacheCounts;
use super::machine::{FrameWork, Machine};
use super::outcome::MachineOutcome;
use crate::access::FrameClients;
use crate::config::{Allocation, BetweenFrames, ConfigError, RunConfig, TmuModel};
use crate::memory::{Caches, Delay, DelayedFill, MissPath, OtherWork, SecondLevel};
use crate::order::WorkItem;
use crate::stream::{Cores, StreamError, furthest_behind};
use crate::tmu::PipelineStats;
use first_miss::FirstMiss;
use formats::layout::Layout;
use items::Items;
use looping::Looping;
use prefetch_fifo::PrefetchFifo;
use std::sync::Arc;

/// A core's turn to run, until the cycle `until`.
struct CoreRun<'r, 'c, 'i, 'f, D> {
    shared: &'r mut Shared<D>,
    core: usize,
    until: u64,
    work: &'r mut Cores<'c>,
    items: &'r mut Items<'i, 'f>,
}

impl<'i, D: DelayedFill> CoreRun<'_, '_, 'i, '_, D> {
    /// Starts the core's next item, if there is one: performs the other clients' accesses for it and, if the
    /// prefetcher works ahead, prefetches lines of the upcoming item.
    #[inline(always)]
    fn start_item(&mut self, now: u64) -> Result<Option<&'i WorkItem>, StreamError> {
        let Self {
            shared,
            core,
            work,
            items,
            ..
        } = self;
        let (core, l2) = (*core, &mut shared.l2);
        let Some(item) = items.next(core) else {
            return Ok(None);
        };
        work.load(core, item)?;
        items.send_clients(core, item, |access| l2.client_access(core, access, now))?;
        let most = l2.lines_of_next_item();
        if most > 0
            && let Some(item) = items.upcoming(core)
        {
            l2.prefetch_item(core, &work.lines_of(item, most)?, now);
        }
        Ok(Some(item))
    }
}

/// The texture units of all cores.
trait ThreadModel: Send {
    /// The clock and the counters of each core.
    fn units(&self) -> Vec<(u64, PipelineStats)>;

    /// Starts a phase at a cycle.
    fn start_phase(&mut self, cycle: u64);

    /// Runs a core until it needs a shared resource later than its turn lasts. Returns its cycle, or the maximum
    /// if it is done.
    fn run_core<D: DelayedFill>(&mut self, run: CoreRun<D>) -> Result<u64, StreamError>;

    /// Ends the phase and returns the cycle in which the last core finished.
    fn end_phase(&mut self) -> u64 {
        let clocks = self.units().into_iter().map(|(clock, _)| clock);
        clocks.max().unwrap_or(0)
    }

    /// Adds the counts that only this model has.
    fn complete<D: DelayedFill>(&self, _shared: &Shared<D>, _outcome: &mut MachineOutcome) {}
}

/// A machine of clocked texture units.
struct Clocked<M, D> {
    model: M,
    shared: Shared<D>,
    /// Cycles until the last core finished.
    cycles: u64,
}

impl<M: ThreadModel, D: DelayedFill> Machine for Clocked<M, D> {
    /// A phase starts when the last core has finished the previous one.
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError> {
        let FrameWork {
            cores,
            phases,
            assign,
            mut clients,
            ..
        } = frame;
        for phase in phases {
            self.model.start_phase(self.cycles);
            // A finished core has the maximum as its clock.
            let units = self.model.units().into_iter();
            let mut clocks: Vec<u64> = units.map(|(clock, _)| clock).collect();
            let mut items = Items::new(phase, assign, clocks.len(), clients.as_deref_mut());
            while let Some((core, until)) = furthest_behind(&clocks) {
                clocks[core] = self.model.run_core(CoreRun {
                    shared: &mut self.shared,
                    core,
                    until,
                    work: &mut *cores,
                    items: &mut items,
                })?;
            }
            self.cycles = self.model.end_phase();
        }
        self.shared.l2.end_frame(self.cycles);
        Ok(())
    }

    /// Performs the accesses of other clients while no core works, at the maximum rate of memory.
    fn client_accesses(&mut self, clients: &mut FrameClients<'_>) {
        let l2 = &mut self.shared.l2;
        clients.send(|access| l2.idle_client_access(access));
        l2.catch_up(self.cycles);
    }

    /// Caches that are emptied drop their lines in flight.
    fn between_frames(&mut self, index: usize, config: &RunConfig) {
        let Shared { l1, l2, .. } = &mut self.shared;
        match config.between_frames {
            BetweenFrames::Keep => (),
            BetweenFrames::Flush => {
                l1.iter_mut().for_each(D::clear);
                l2.clear(self.cycles);
            }
            BetweenFrames::Lose(percent) => {
                l1.iter_mut().for_each(D::clear);
                l2.lose(OtherWork::after(index, percent, config), self.cycles);
                self.shared.follow_evictions(self.cycles);
            }
        }
    }

    fn outcome(&self, _config: &RunConfig) -> MachineOutcome {
        let counts = self.shared.counts.clone();
        let stats = self.model.units().into_iter().map(|(_, stats)| stats);
        let mut outcome = MachineOutcome {
            memory: self.shared.l2.result(),
            ..MachineOutcome::timed(counts, stats, self.cycles)
        };
        self.model.complete(&self.shared, &mut outcome);
        outcome
    }
}

/// L1 caches with delayed fills above such an L2.
struct Shared<D> {
    l1: Vec<D>,
    l2: SecondLevel<D>,
    /// Cycles in which a line travels from the L2 to an L1.
    l2_cycles: u64,
    counts: CacheCounts,
}

impl<D: DelayedFill> Shared<D> {
    /// Most lines arrive in an L1 within the latencies of a miss of both levels and `later_trips_cycles`.
    fn new<C: Delay<Delayed = D>>(
        caches: Caches<C>,
        config: &RunConfig,
        counts: CacheCounts,
        path: MissPath,
        later_trips_cycles: u64,
    ) -> Self {
        let [l2_cycles, memory_cycles] =
            [config.level.l2.hit_cycles, config.memory_cycles].map(u64::from);
        let usual_cycles = l2_cycles + memory_cycles;
        let Caches { l1, l2 } = caches.delayed(usual_cycles + later_trips_cycles, usual_cycles);
        Self {
            l1,
            l2: SecondLevel::new(l2, path),
            l2_cycles,
            counts,
        }
    }

    /// Invalidates L1 lines that lower levels have evicted.
    #[inline(always)]
    fn follow_evictions(&mut self, now: u64) {
        let l1 = &mut self.l1;
        self.l2.invalidate_l1(|line| {
            let removed = l1.iter_mut().map(|cache| cache.remove(line, now));
            removed.map(u64::from).sum()
        });
    }
}

/// The clocked machine of a configuration.
///
/// # Errors
/// An impossible cache geometry.
pub(super) fn machine(
    config: &RunConfig,
    counts: CacheCounts,
    layout: Option<&Arc<Layout>>,
) -> Result<Box<dyn Machine>, ConfigError> {
    let caches = Caches::build(config)?;
    let allocates_on_miss = config.tmu.allocation == Allocation::OnMiss;
    if allocates_on_miss || config.tmu.model == TmuModel::PrefetchFifo {
        return machine_of(config, caches.allocate_on_miss(), counts, layout);
    }
    match caches.all_four_way() {
        Ok(caches) => machine_of(config, caches, counts, layout),
        Err(caches) => machine_of(config, caches, counts, layout),
    }
}

/// The clocked machine of a configuration with these caches.
///
/// # Errors
/// An impossible level below the L2.
pub(super) fn machine_of<C: Delay>(
    config: &RunConfig,
    caches: Caches<C>,
    counts: CacheCounts,
    layout: Option<&Arc<Layout>>,
) -> Result<Box<dyn Machine>, ConfigError>
where
    C::Delayed: 'static,
{
    let cores = caches.l1.len();
    let path = MissPath::build(config, layout)?;
    // Looping threads with many missing lines request the last ones on later trips.
    let later_trips_cycles = match config.tmu.model {
        TmuModel::Looping => 8 * u64::from(config.tmu.loop_cycles),
        TmuModel::FirstMiss | TmuModel::PrefetchFifo => 0,
    };
    let shared = Shared::new(caches, config, counts, path, later_trips_cycles);
    fn clocked<D: DelayedFill + 'static>(
        model: impl ThreadModel + 'static,
        shared: Shared<D>,
    ) -> Box<dyn Machine> {
        let cycles = 0;
        Box::new(Clocked {
            model,
            shared,
            cycles,
        })
    }
    Ok(match config.tmu.model {
        TmuModel::Looping => clocked(Looping::new(config, cores), shared),
        TmuModel::FirstMiss => clocked(FirstMiss::new(config, cores), shared),
        TmuModel::PrefetchFifo => clocked(PrefetchFifo::new(config, cores), shared),
    })
}
