//! The ways of rendering a frame with the units simulated cycle by cycle.
//!
//! Cycles, times and cache misses come from the simulation. Work, kernels and bytes are those of the closed form.

use super::cache::Misses;
use super::compose::Reuse;
use super::cycles::{
    Counts, LineCounts, Machine, PrefetchCounts, Simulated, SimulationError, simulate,
};
use super::detect::Decision;
use super::energy;
use super::frame::{FrameError, RaySource};
use super::hardware::{
    Comparison, Kept, TileMisses, TileWork, check_lines, check_sort, misses_in_usual_order,
};
use super::prefetch::Prefetcher;
use super::ray_batches::RayBatches;
use super::timing::{CycleTiming, FrameTiming, IdlePct, PrefetchTiming};
use super::tni::TniCycles;
use super::ways::{Model, Way, WayRun, comparison};
use formats::view::Eye;
use rayon::prelude::*;
use sim::order::rays::{RayPlan, eye_of, tiles_of};

/// The eyes of the simulations without reprojection: a frame, and each eye alone.
const TRACED: [&[Eye]; 3] = [&[Eye::Left, Eye::Right], &[Eye::Left], &[Eye::Right]];

/// The simulations without reprojection. They do not depend on the rule.
pub struct TracedTiming {
    machine: Machine,
    prefetcher: Option<Prefetcher>,
    frame: Simulated,
    left: FrameTiming,
    right: FrameTiming,
}

impl TracedTiming {
    /// Simulates a frame and each eye alone, completely traced.
    ///
    /// # Errors
    /// [`FrameError`] for a trace without visits or for an unreadable tile.
    pub(super) fn new(
        source: &dyn RaySource,
        model: &Model,
        plan: &RayPlan,
        work: &[TileWork],
    ) -> Result<Self, FrameError> {
        let tables = &model.frame.tables;
        if !tables.meta.has_visits {
            return Err(FrameError::NoVisits("--timing cycle"));
        }
        check_lines(&tables.bvh, model.config)?;
        check_sort(source, model.config.tni.ray_sort)?;
        if model.config.tni.ray_sort.row().interrupts_rays() {
            return Err(FrameError::Interrupted(model.config.tni.ray_sort.name()));
        }
        let machine = Machine::new(model.config, tables.bvh.traversal);
        let prefetcher = Prefetcher::new(&model.config.cycles.prefetch, source)?;
        let units = (&machine, prefetcher.as_ref());
        let mut runs: Vec<Simulated> = TRACED
            .par_iter()
            .map(|eyes| {
                let rays = RayBatches::reference(source, model, plan, work, units, eyes);
                run(&machine, rays)
            })
            .collect::<Result<_, _>>()?;
        let each_alone: [&Kept<'_>; 2] = [&|eye, _, _| eye == Eye::Left, &|eye, _, _| {
            eye == Eye::Right
        }];
        let choices = each_alone.map(|kept| (kept, model.config));
        let own_misses = misses_in_usual_order(source, model.frame, &choices)?;
        let alone = |eye: Eye, simulated: &Simulated| {
            let mut simulated_misses = vec![Misses::default(); work.len()];
            // The first tile of a batch stands for all of them.
            let first = |batch| tiles_of(batch).find(|&at| eye_of(at) == eye);
            for (at, of) in plan.batches().filter_map(first).zip(&simulated.batches) {
                simulated_misses[at.tile as usize] = misses(&of.counts);
            }
            let (resources, own) = model.eye(eye, work, &own_misses[eye as usize][eye as usize]);
            let (_, same) = model.eye(eye, work, &simulated_misses);
            timing(&machine, simulated, &resources, [own, same])
        };
        let left = alone(Eye::Left, &runs[1]);
        let right = alone(Eye::Right, &runs[2]);
        Ok(Self {
            frame: runs.swap_remove(0),
            left,
            right,
            machine,
            prefetcher,
        })
    }
}

/// Compares the three ways with the units simulated. `closed_misses` are those of the closed form, with which the
/// result is compared.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn compare(
    source: &dyn RaySource,
    model: &Model,
    plans: [&RayPlan; 2],
    (decisions, reuse): (&[Decision], Reuse),
    work: &[TileWork],
    closed_misses: &[TileMisses],
    traced: &TracedTiming,
) -> Result<(Comparison, CycleTiming), FrameError> {
    let machine = &traced.machine;
    let plan_of = |way: Way| plans[usize::from(way != Way::Reference)];
    let closed = Way::ALL.map(|way| {
        model.run(way, plan_of(way), work, |_, at| {
            closed_misses[at.tile as usize].of(way, at)
        })
    });
    let simulated: Vec<Simulated> = [Way::Reprojected, Way::WholeScreen]
        .par_iter()
        .map(|&way| {
            let units = (machine, traced.prefetcher.as_ref());
            let all = RayBatches::reference(source, model, plans[1], work, units, TRACED[0]);
            run(machine, all.reprojected(way, decisions, reuse))
        })
        .collect::<Result<_, _>>()?;
    let all = [&traced.frame, &simulated[0], &simulated[1]];
    let left_cycles = traced.left.cycles as f64;
    let timed = [0, 1, 2].map(|at| {
        let (way, plan) = (Way::ALL[at], plan_of(Way::ALL[at]));
        let batches: Vec<_> = plan.batches().collect();
        let same_misses = model.run(way, plan, work, |batch, tile| {
            let is_first = tiles_of(batches[batch]).next() == Some(tile);
            let all_of_batch = is_first.then(|| misses(&all[at].batches[batch].counts));
            all_of_batch.unwrap_or_default()
        });
        let by_closed_form = [closed[at].run.tni_cycles, same_misses.run.tni_cycles];
        let timing = timing(machine, all[at], &closed[at].run.tni, by_closed_form);
        (
            with_times(model, machine, all[at], same_misses, left_cycles),
            timing,
        )
    });
    let by_closed_form = comparison(&closed);
    let compared = comparison(&[timed[0].0, timed[1].0, timed[2].0]);
    let [(_, reference), (_, reprojected), _] = timed;
    let timing = CycleTiming {
        reprojected,
        reference,
        left: traced.left.clone(),
        right: traced.right.clone(),
        closed_form_relative_performance: by_closed_form.relative_performance(),
        closed_form_relative_energy: by_closed_form.relative_energy(),
    };
    Ok((compared, timing))
}

fn run(machine: &Machine, mut rays: RayBatches) -> Result<Simulated, FrameError> {
    simulate(machine, &mut rays).map_err(|error| match error {
        SimulationError::Source(error) => error,
        SimulationError::Unbalanced(error) => FrameError::Unbalanced(error),
    })
}

fn misses(counts: &Counts) -> Misses {
    Misses {
        // Every L2 look-up of a ray or a prefetch fetches a line for an L1.
        l1_lines: counts.l2.all() as f64,
        l2_lines: counts.l2.misses as f64,
        l1_visits: counts.l1_fetching_requests as f64,
        l2_visits: counts.l2_fetching_requests as f64,
    }
}

/// Unit cycles in which tiles are traced.
fn traced_cycles(simulated: &Simulated) -> u64 {
    simulated.batches.iter().map(|batch| batch.cycles).sum()
}

/// A way's cost with the times of its simulation. The right eye's cycles are those beyond the left eye alone: rays of
/// both eyes overlap.
fn with_times(
    model: &Model,
    machine: &Machine,
    simulated: &Simulated,
    mut way: WayRun,
    left_cycles: f64,
) -> WayRun {
    let ns_per_cycle = 1e3 / model.config.tni.clock_mhz;
    let run = &mut way.run;
    run.tni_cycles = traced_cycles(simulated) as f64;
    run.time_ns = simulated.frame_cycles as f64 * ns_per_cycle;
    // The units' share is the mean over units of the cycles that idle because of DRAM.
    let idle = simulated.counts.cycles.dram as f64 / machine.units as f64;
    run.memory_bound_ns = (idle + simulated.core_wait_cycles as f64) * ns_per_cycle;
    run.energy = energy::energy(run, &model.frame.tables.bvh, model.config);
    way.right_tni_cycles = (run.tni_cycles - left_cycles).max(0.0);
    way
}

fn pct(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        100.0 * part / whole
    } else {
        0.0
    }
}

/// The figures of a simulation. `closed_form`: unit cycles by the closed form, with its own misses and with the
/// simulation's; `resources`: with its own, by resource.
fn timing(
    machine: &Machine,
    simulated: &Simulated,
    resources: &TniCycles,
    closed_form: [f64; 2],
) -> FrameTiming {
    let counts = &simulated.counts;
    let cycles = traced_cycles(simulated);
    let utilisation = |kind: usize, items: u64| {
        let pipelines = &machine.pipelines[kind];
        let all = cycles as f64 * machine.units as f64 * f64::from(pipelines.count);
        pct(items as f64 * pipelines.interval_cycles(), all)
    };
    let idle = |cycles: u64| pct(cycles as f64, counts.cycles.all() as f64);
    let hit = |line: &LineCounts| pct((line.hits + line.merged) as f64, line.all() as f64);
    let l1_look_ups = counts.node_l1.all() + counts.triangle_l1.all();
    let merged = counts.node_l1.merged + counts.triangle_l1.merged;
    let l1_misses = counts.node_l1.misses + counts.triangle_l1.misses;
    let [own, same] = closed_form;
    FrameTiming {
        cycles,
        closed_form_cycles: own.round() as u64,
        closed_form_cycles_same_misses: same.round() as u64,
        closed_form_error_pct: pct(own - cycles as f64, cycles as f64),
        closed_form_bottleneck: resources.bottleneck().to_owned(),
        unit_cycles: simulated.unit_cycles,
        frame_cycles: simulated.frame_cycles,
        core_wait_cycles: simulated.core_wait_cycles,
        rays_entered: counts.rays_entered,
        rays_left: counts.rays_left,
        requests: counts.requests,
        answers: counts.answers,
        traversal_utilisation_pct: utilisation(0, counts.steps),
        intersection_utilisation_pct: utilisation(1, counts.tests),
        idle: IdlePct {
            no_ray: idle(counts.cycles.no_ray),
            mshr: idle(counts.cycles.mshr),
            dram: idle(counts.cycles.dram),
            l2: idle(counts.cycles.l2),
            latency: idle(counts.cycles.latency),
        },
        mean_ray_cycles: pct(counts.ray_cycles as f64, counts.rays_left as f64) / 100.0,
        node_l1_hit_pct: hit(&counts.node_l1),
        triangle_l1_hit_pct: hit(&counts.triangle_l1),
        l2_hit_pct: hit(&counts.l2),
        l1_merged_pct: pct(merged as f64, l1_look_ups as f64),
        mshr_waits: counts.l1_mshr_waits + counts.l2_mshr_waits,
        l1_misses,
        dram_lines: counts.dram_lines,
        prefetch: (counts.prefetch.requested > 0).then(|| prefetches(&counts.prefetch, l1_misses)),
    }
}

fn prefetches(p: &PrefetchCounts, l1_misses: u64) -> PrefetchTiming {
    let used = p.useful + p.late;
    PrefetchTiming {
        counts: *p,
        accuracy_pct: pct(used as f64, p.issued as f64),
        covered_pct: pct(used as f64, (used + l1_misses) as f64),
    }
}

#[cfg(test)]
mod tests;
