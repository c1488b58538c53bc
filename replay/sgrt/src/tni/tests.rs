use super::*;
use crate::work::RayWork;

fn cycles(work: &BatchWork, misses: &Misses, config: &SgrtConfig) -> TniCycles {
    super::cycles(work, misses, TraversalKind::Bvh2, config)
}

fn batch(rays: u64, steps: u64, tests: u64) -> BatchWork {
    let mut work = BatchWork::default();
    work.by_class[0] = RayWork {
        rays,
        steps,
        triangle_tests: tests,
        alpha_tests: 0,
    };
    work
}

#[test]
fn a_traversal_bound_batch_takes_steps_over_pipelines() {
    let config = SgrtConfig::default();
    let c = cycles(&batch(100, 64_000, 100), &Misses::default(), &config);
    let pipelines = f64::from(config.tni.units * config.tni.trv_pipelines);
    assert_eq!(c.total(), 64_000.0 / pipelines);
    assert_eq!(c.bottleneck(), "traversal");
}

#[test]
fn twice_the_units_halve_everything() {
    let mut config = SgrtConfig::default();
    let misses = Misses {
        l1_visits: 50.0,
        l2_visits: 20.0,
        ..Misses::default()
    };
    let one = cycles(&batch(10, 900, 300), &misses, &config);
    config.tni.units *= 2;
    let two = cycles(&batch(10, 900, 300), &misses, &config);
    assert_eq!(two.traversal * 2.0, one.traversal);
    assert_eq!(two.intersection * 2.0, one.intersection);
    assert_eq!(two.latency * 2.0, one.latency);
}

#[test]
fn a_wide_step_takes_its_configured_cycles() {
    let config = SgrtConfig::default();
    let of = |tree| super::cycles(&batch(10, 64_000, 0), &Misses::default(), tree, &config);
    let (narrow, wide) = (of(TraversalKind::Bvh2), of(TraversalKind::Bvh8));
    let ratio = config.tni.trv_cycles_per_wide_step / config.tni.trv_cycles_per_step;
    assert_eq!(wide.traversal, ratio * narrow.traversal);
    assert!(wide.latency > narrow.latency);
}

/// A ray of the cycle-by-cycle twin: steps, with a triangle test after every `steps_per_test`.
#[derive(Clone, Copy)]
struct TwinRay {
    steps: u32,
    steps_per_test: u32,
    miss_every: u32,
}

/// One unit, cycle by cycle. Rays form a ring, each ready at some cycle; each pipeline takes the first
/// ready ray that needs it.
fn twin(rays: &[TwinRay], config: &SgrtConfig) -> (u64, BatchWork, Misses) {
    #[derive(Clone, Copy)]
    struct Slot {
        ray: TwinRay,
        done: u32,
        test_next: bool,
        ready: u64,
    }
    let tni = &config.tni;
    let l2 = u64::from(config.cache.l2_latency_cycles);
    let mut work = batch(rays.len() as u64, 0, 0);
    let mut misses = Misses::default();
    let mut waiting = rays.iter().copied();
    let mut slots: Vec<Slot> = Vec::new();
    let mut cycle = 0u64;
    loop {
        if slots.len() < tni.rays_in_flight as usize {
            slots.extend(waiting.next().map(|ray| Slot {
                ray,
                done: 0,
                test_next: false,
                ready: cycle,
            }));
        }
        if slots.is_empty() {
            return (cycle, work, misses);
        }
        let (mut trv, mut ist) = (tni.trv_pipelines, tni.ist_pipelines);
        for slot in &mut slots {
            if slot.ready > cycle {
                continue;
            }
            if slot.test_next && ist > 0 {
                ist -= 1;
                slot.test_next = false;
                slot.ready = cycle + u64::from(tni.ist_depth_cycles);
                work.by_class[0].triangle_tests += 1;
            } else if !slot.test_next && slot.done < slot.ray.steps && trv > 0 {
                trv -= 1;
                slot.done += 1;
                slot.test_next = slot.done.is_multiple_of(slot.ray.steps_per_test);
                slot.ready = cycle + u64::from(tni.trv_depth_cycles);
                work.by_class[0].steps += 1;
                if slot.done.is_multiple_of(slot.ray.miss_every) {
                    slot.ready += l2;
                    misses.l1_visits += 1.0;
                }
            }
        }
        cycle += 1;
        slots.retain(|s| s.done < s.ray.steps || s.test_next || s.ready > cycle);
    }
}

#[test]
fn the_throughput_model_stays_close_to_a_cycle_by_cycle_unit() {
    let mut config = SgrtConfig::default();
    config.tni.units = 1;
    config.tni.trv_pipelines = 4;
    let rays = |n: u32, steps_per_test, miss_every| -> Vec<TwinRay> {
        let ray = |i: u32| TwinRay {
            steps: 12 + i * 7 % 33,
            steps_per_test,
            miss_every,
        };
        (0..n).map(ray).collect()
    };
    // One case each for traversal, intersection and latency as the bottleneck.
    for (name, in_flight, steps_per_test, miss_every) in [
        ("traversal", 256, 16, 1000),
        ("intersection", 256, 2, 1000),
        ("latency", 32, 16, 1000),
        ("latency", 64, 8, 2),
    ] {
        config.tni.rays_in_flight = in_flight;
        let (simulated, work, misses) = twin(&rays(6000, steps_per_test, miss_every), &config);
        let model = cycles(&work, &misses, &config);
        let off = model.total() / simulated as f64 - 1.0;
        assert_eq!(model.bottleneck(), name);
        assert!(
            off.abs() < 0.06,
            "{name}: model off by {:.1} %",
            off * 100.0
        );
    }
}

#[test]
fn a_visit_waits_once_for_all_its_lines_and_energy_pays_for_each() {
    let config = SgrtConfig::default();
    let narrow = Misses {
        l1_visits: 10.0,
        l1_lines: 10.0,
        ..Misses::default()
    };
    let wide = Misses {
        l1_lines: 40.0,
        ..narrow
    };
    let work = batch(1, 10, 0);
    let [a, b] = [narrow, wide].map(|misses| cycles(&work, &misses, &config).latency);
    assert_eq!(a, b);
    let energy = |misses| {
        let run = crate::run::Run {
            work,
            misses,
            ..Default::default()
        };
        crate::energy::energy(&run, &crate::testing::bvh(), &config).caches_pj
    };
    let line_pj = config.cache.line_bytes as f64 * config.energy.l2_pj_per_byte;
    assert!((energy(wide) - energy(narrow) - 30.0 * line_pj).abs() < 1e-6);
}
