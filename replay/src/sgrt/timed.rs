//! The three ways of rendering a frame with the units simulated cycle by cycle.
//!
//! Cycles, times and cache misses come from the simulation. Work, kernels and bytes are those of the closed form.

use super::cache::Misses;
use super::compose::Reuse;
use super::cycles::{Counts, Machine, Simulated, SimulationError, simulate};
use super::detect::Decision;
use super::energy;
use super::frame::{FrameError, RaySource};
use super::hardware::{Comparison, TileMisses, TileWork, check_lines};
use super::ray_batches::RayBatches;
use super::timing::{CycleTiming, EyeTiming, FrameTiming, IdlePct};
use super::ways::{Model, Way, WayRun, comparison};
use formats::view::Eye;
use rayon::prelude::*;

/// A way, simulated.
struct Timed {
    run: WayRun,
    timing: FrameTiming,
}

/// Compares the three ways with the units simulated. `closed_misses` are those of the closed form, with which the
/// result is compared.
///
/// # Errors
/// [`FrameError`] for a trace without visits or for an unreadable tile.
pub(super) fn compare(
    source: &dyn RaySource,
    model: &Model,
    (decisions, reuse): (&[Decision], Reuse),
    work: &[TileWork],
    closed_misses: &[TileMisses],
) -> Result<(Comparison, CycleTiming), FrameError> {
    let tables = &model.frame.tables;
    if !tables.meta.has_visits {
        return Err(FrameError::NoVisits);
    }
    check_lines(&tables.bvh, model.config)?;
    let machine = Machine::new(model.config, tables.bvh.traversal);
    let closed = Way::ALL.map(|way| {
        model.run(way, work, |tile| match way {
            Way::Reference => [
                closed_misses[tile].left_full,
                closed_misses[tile].right_full,
            ],
            _ => [closed_misses[tile].left, closed_misses[tile].right],
        })
    });
    let simulated: Vec<Simulated> = Way::ALL
        .par_iter()
        .map(|&way| {
            let decided = (decisions, reuse);
            let mut rays = RayBatches::new(source, model, way, decided, work, &machine);
            simulate(&machine, &mut rays).map_err(|error| match error {
                SimulationError::Source(error) => error,
                SimulationError::Unbalanced(error) => FrameError::Unbalanced(error),
            })
        })
        .collect::<Result<_, _>>()?;
    let timed = |at: usize| {
        timed(
            model,
            &machine,
            Way::ALL[at],
            work,
            &simulated[at],
            &closed[at],
        )
    };
    let [reference, reprojected, whole_screen] = [0, 1, 2].map(timed);
    let by_closed_form = comparison(&closed);
    let compared = comparison(&[reference.run, reprojected.run, whole_screen.run]);
    let timing = CycleTiming {
        reprojected: reprojected.timing,
        reference: reference.timing,
        closed_form_relative_performance: by_closed_form.relative_performance(),
        closed_form_relative_energy: by_closed_form.relative_energy(),
    };
    Ok((compared, timing))
}

fn misses(counts: &Counts) -> Misses {
    Misses {
        l1_lines: (counts.node_l1.misses + counts.triangle_l1.misses) as f64,
        l2_lines: counts.l2.misses as f64,
        l1_visits: counts.l1_fetching_requests as f64,
        l2_visits: counts.l2_fetching_requests as f64,
    }
}

/// The cost of a way by its simulation.
fn timed(
    model: &Model,
    machine: &Machine,
    way: Way,
    work: &[TileWork],
    simulated: &Simulated,
    closed: &WayRun,
) -> Timed {
    let of_batch = |at: usize| misses(&simulated.batches[at].counts);
    let same_misses = model.run(way, work, |tile| [2 * tile, 2 * tile + 1].map(of_batch));
    let mut run = same_misses;
    let mut eyes = [(0u64, Counts::default()); 2];
    for (at, batch) in simulated.batches.iter().enumerate() {
        let (cycles, counts) = &mut eyes[at % 2];
        *cycles += batch.cycles;
        counts.add(&batch.counts);
    }
    let ns_per_cycle = 1e3 / model.config.tni.clock_mhz;
    run.tni_cycles = eyes.map(|(cycles, _)| cycles as f64);
    run.run.tni_cycles = run.tni_cycles.iter().sum();
    run.run.time_ns = simulated.frame_cycles as f64 * ns_per_cycle;
    // The units' share is the mean over units of the cycles that idle because of DRAM.
    let idle = simulated.counts.cycles.dram as f64 / machine.units as f64;
    run.run.memory_bound_ns = (idle + simulated.core_wait_cycles as f64) * ns_per_cycle;
    run.run.energy = energy::energy(&run.run, &model.frame.tables.bvh, model.config);
    let eye = |eye: Eye| {
        let at = eye as usize;
        let closed_form = [closed, &same_misses].map(|way| way.tni_cycles[at]);
        EyeTiming {
            closed_form_bottleneck: closed.tni[at].bottleneck().to_owned(),
            ..eye_timing(machine, eyes[at].0, &eyes[at].1, closed_form)
        }
    };
    let counts = &simulated.counts;
    let timing = FrameTiming {
        left: eye(Eye::Left),
        right: eye(Eye::Right),
        unit_cycles: simulated.unit_cycles,
        frame_cycles: simulated.frame_cycles,
        core_wait_cycles: simulated.core_wait_cycles,
        rays_entered: counts.rays_entered,
        rays_left: counts.rays_left,
        requests: counts.requests,
        answers: counts.answers,
    };
    Timed { run, timing }
}

/// The figures of an eye's tiles. `closed_form`: unit cycles by the closed form, with its own misses and with the
/// simulation's.
fn eye_timing(machine: &Machine, cycles: u64, counts: &Counts, closed_form: [f64; 2]) -> EyeTiming {
    let pct = |part: f64, whole: f64| {
        if whole > 0.0 {
            100.0 * part / whole
        } else {
            0.0
        }
    };
    let utilisation = |kind: usize, items: u64| {
        let pipelines = &machine.pipelines[kind];
        let all = cycles as f64 * machine.units as f64 * f64::from(pipelines.count);
        pct(items as f64 * pipelines.interval_cycles(), all)
    };
    let all = counts.cycles.all() as f64;
    let idle = |cycles: u64| pct(cycles as f64, all);
    let hit =
        |line: &super::cycles::LineCounts| pct((line.hits + line.merged) as f64, line.all() as f64);
    let l1_look_ups = counts.node_l1.all() + counts.triangle_l1.all();
    let merged = counts.node_l1.merged + counts.triangle_l1.merged;
    let [own, same] = closed_form;
    EyeTiming {
        rays: counts.rays_left,
        cycles,
        closed_form_cycles: own.round() as u64,
        closed_form_cycles_same_misses: same.round() as u64,
        closed_form_error_pct: pct(own - cycles as f64, cycles as f64),
        closed_form_bottleneck: String::new(),
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
    }
}
