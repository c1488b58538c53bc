mod twin;

use super::machine::{CacheSize, Pipelines};
use super::*;
use crate::config::SgrtConfig;
use formats::raytrace::TraversalKind;
use formats::view::Eye;
use proptest::prelude::*;
use sim::memory::TICKS;
use std::convert::Infallible;
use twin::twin;

/// Batches in memory.
struct List<'a>(std::slice::Iter<'a, Batch>);

impl BatchSource for List<'_> {
    type Error = Infallible;

    fn next(&mut self, batch: &mut Batch) -> Result<bool, Infallible> {
        let next = self.0.next();
        if let Some(next) = next {
            *batch = next.clone();
        }
        Ok(next.is_some())
    }
}

fn run(machine: &Machine, batches: &[Batch]) -> Simulated {
    simulate(machine, &mut List(batches.iter())).expect("rays and requests are conserved")
}

fn machine() -> Machine {
    Machine::new(&SgrtConfig::default(), TraversalKind::Bvh2)
}

fn request(first_line: u32, pipeline: Pipeline) -> Request {
    Request {
        first_line,
        lines: 1,
        pipeline,
    }
}

/// A batch of rays, dealt to the units in turn.
fn batch(units: usize, rays: &[Vec<Request>]) -> Batch {
    let mut out = Batch::default();
    out.clear(units);
    for (turn, ray) in rays.iter().enumerate() {
        let first = out.requests.len() as u32;
        out.requests.extend_from_slice(ray);
        out.items[turn % units].push(Item {
            first,
            end: out.requests.len() as u32,
            rays: 1,
            eye: Eye::Left,
        });
    }
    out
}

#[test]
fn a_lone_ray_takes_the_sum_of_its_latencies() {
    let m = machine();
    let (t, i) = (Pipeline::Traversal, Pipeline::Intersection);
    // Lines 0 and 100 come from DRAM, each once into the node cache and line 100 also from the L2 into the triangle
    // cache; the rest hit.
    let path = [(0, t), (0, t), (100, t), (100, i), (0, t), (100, i)];
    let ray: Vec<Request> = path.iter().map(|&(line, p)| request(line, p)).collect();
    let simulated = run(&m, &[batch(m.units, &[ray])]);
    let [step, test] = [0, 1].map(|kind| m.pipelines[kind].latency);
    let from_l2 = m.l2_latency;
    let from_dram = from_l2 + m.dram_latency;
    let latencies = 4 * step + 2 * test + 2 * from_dram + from_l2;
    // A cycle to enter the unit and one to leave it.
    assert_eq!(simulated.unit_cycles, latencies + 2);
    assert_eq!(simulated.counts.ray_cycles, latencies + 2);
    assert_eq!((step, test, from_l2, m.dram_latency), (24, 40, 20, 60));
    let counts = simulated.counts;
    assert_eq!((counts.steps, counts.tests, counts.dram_lines), (4, 2, 2));
}

/// A chain of dependent nodes that are all fetched ahead with the first one takes one latency of memory.
#[test]
fn a_perfect_prefetch_hides_all_latencies_but_the_first() {
    let m = machine();
    let ray: Vec<Request> = (0..10)
        .map(|k| request(100 * k, Pipeline::Traversal))
        .collect();
    let mut batch = batch(m.units, std::slice::from_ref(&ray));
    let step = m.pipelines[0].latency;
    let from_dram = m.l2_latency + m.dram_latency;
    assert_eq!(
        run(&m, &[batch.clone()]).unit_cycles,
        10 * (step + from_dram) + 2
    );
    batch.prefetches = ray[1..].to_vec();
    batch.ahead.push(0..9);
    let simulated = run(&m, &[batch.clone()]);
    assert_eq!(simulated.unit_cycles, 10 * step + from_dram + 2);
    let p = simulated.counts.prefetch;
    assert_eq!((p.issued, p.useful, p.dram_lines), (9, 9, 9));
    // Each node fetches the next one ahead as it begins: every other node waits for the rest of the latency.
    batch.ahead = (0..9).map(|k| k..k + 1).collect();
    let simulated = run(&m, &[batch.clone()]);
    assert_eq!(simulated.unit_cycles, 6 * step + 5 * from_dram + 2);
    let p = simulated.counts.prefetch;
    assert_eq!((p.useful, p.late), (5, 4));
    // Lines that nobody requests cost bytes alone.
    batch
        .prefetches
        .iter_mut()
        .for_each(|request| request.first_line += 1);
    let simulated = run(&m, &[batch]);
    assert_eq!(simulated.counts.prefetch.useless, 9);
    assert_eq!(simulated.counts.dram_lines, 19);
}

#[test]
fn many_rays_with_perfect_caches_take_the_issue_bound_and_a_pipeline_fill() {
    let mut m = machine();
    m.units = 1;
    m.slots = 1 << 20;
    m.port_interval = 1;
    for (steps, tests) in [(40, 2), (10, 30)] {
        let mut ray = vec![request(0, Pipeline::Traversal); steps];
        ray.extend(vec![request(0, Pipeline::Intersection); tests]);
        let rays = vec![ray; 500];
        let simulated = run(&m, &[batch(1, &rays)]);
        let issue =
            |count: usize, kind: usize| 500 * count as u64 / u64::from(m.pipelines[kind].count);
        let bound = issue(steps, 0).max(issue(tests, 1));
        // The first line from DRAM and the L2, one ray's own latency, and the ports.
        let alone = run(&m, &[batch(1, &rays[..1])]).unit_cycles;
        let cycles = simulated.unit_cycles;
        assert!(cycles >= bound, "{cycles} cycles below the bound {bound}");
        // All rays take their steps before their tests, so the two phases overlap by less than a ray.
        let both = issue(steps, 0).min(issue(tests, 1));
        assert!(
            cycles <= bound + both + alone,
            "{cycles} cycles for a bound of {bound}"
        );
    }
    let rays = vec![vec![request(0, Pipeline::Traversal); 64]; 500];
    let cycles = run(&m, &[batch(1, &rays)]).unit_cycles;
    let bound = 500 * 64 / u64::from(m.pipelines[0].count);
    let fill = m.pipelines[0].latency + m.dram_latency + m.l2_latency + 3;
    assert!(
        (bound..=bound + fill).contains(&cycles),
        "{cycles} for {bound}"
    );
}

#[test]
fn twice_the_bandwidth_halves_a_stream_that_only_dram_limits() {
    let mut m = machine();
    m.units = 1;
    m.slots = 4096;
    (m.l1[0].mshrs, m.l2.mshrs) = (4096, 4096);
    let rays: Vec<Vec<Request>> = (0..4000)
        .map(|line| vec![request(line, Pipeline::Traversal)])
        .collect();
    m.dram_ticks_per_line = 4 * TICKS;
    let slow = run(&m, &[batch(1, &rays)]).unit_cycles;
    m.dram_ticks_per_line = 2 * TICKS;
    let fast = run(&m, &[batch(1, &rays)]).unit_cycles;
    let latency = m.dram_latency + m.l2_latency + m.pipelines[0].latency + 2;
    assert_eq!(slow, 3999 * 4 + latency);
    assert_eq!(fast, 3999 * 2 + latency);
}

#[test]
fn the_cores_transfers_delay_the_units_reads() {
    let mut m = machine();
    m.units = 1;
    m.dram_ticks_per_line = 8 * TICKS;
    let rays: Vec<Vec<Request>> = (0..64)
        .map(|ray| {
            (0..8)
                .map(|k| request(8 * ray + k, Pipeline::Traversal))
                .collect()
        })
        .collect();
    let mut batches = vec![batch(1, &rays), batch(1, &rays)];
    let quiet = run(&m, &batches);
    (batches[0].core_cycles, batches[0].core_lines) = (4000, 400);
    batches[1]
        .requests
        .iter_mut()
        .for_each(|r| r.first_line += 100_000);
    let busy = run(&m, &batches);
    batches[0].core_lines = 0;
    let without_transfers = run(&m, &batches);
    assert!(busy.batches[1].cycles > without_transfers.batches[1].cycles);
    assert!(quiet.unit_cycles < busy.unit_cycles);
    assert_eq!(busy.batches[0], without_transfers.batches[0]);
}

#[test]
fn tile_buffers_stop_the_units_while_the_cores_are_slower() {
    let mut m = machine();
    m.units = 1;
    let mut of_tile = batch(1, &[vec![request(0, Pipeline::Traversal); 4]]);
    of_tile.core_cycles = 1000;
    let tiles = vec![of_tile; 6];
    for buffers in [1, 2, 6] {
        m.tile_buffers = buffers;
        let simulated = run(&m, &tiles);
        let last_open = 1000 * (6 - buffers as u64);
        assert!(simulated.unit_cycles > last_open, "{buffers}");
        assert!(simulated.frame_cycles >= 6000, "{buffers}");
    }
}

#[test]
fn rays_return_in_order_of_dispatch_only_if_the_machine_says_so() {
    let mut m = machine();
    (m.units, m.slots) = (1, 4);
    let long = vec![request(0, Pipeline::Traversal); 50];
    let short = vec![request(0, Pipeline::Traversal); 1];
    let mut rays = vec![short; 40];
    rays[0] = long;
    let any = run(&m, &[batch(1, &rays)]);
    m.in_order_return = true;
    let ordered = run(&m, &[batch(1, &rays)]);
    assert!(ordered.unit_cycles > any.unit_cycles);
    assert!(ordered.counts.ray_cycles > any.counts.ray_cycles);
    (m.in_order_return, m.return_group_rays) = (false, 2);
    let grouped = run(&m, &[batch(1, &rays)]);
    assert!(grouped.unit_cycles > any.unit_cycles);
    assert!(grouped.unit_cycles < ordered.unit_cycles);
}

fn size() -> impl Strategy<Value = CacheSize> {
    (0_u32..3, 1_u32..4, 1_u32..4).prop_map(|(sets, ways, mshrs)| CacheSize {
        sets: 1 << sets,
        ways,
        mshrs,
    })
}

fn pipelines() -> impl Strategy<Value = Pipelines> {
    (1_u32..4, 1_u64..4 * TICKS, 1_u64..12).prop_map(|(count, interval, latency)| Pipelines {
        count,
        interval,
        latency,
    })
}

fn machines() -> impl Strategy<Value = Machine> {
    let caches = (
        [size(), size()],
        size(),
        1_u64..12,
        1_u64..40,
        1_u64..6 * TICKS,
    );
    let shape = (
        1_usize..4,
        1_usize..9,
        1_u64..3 * TICKS,
        prop_oneof![
            Just((true, 1)),
            (1_usize..6).prop_map(|group| (false, group))
        ],
        1_usize..4,
    );
    (shape, [pipelines(), pipelines()], caches).prop_map(|(shape, pipelines, caches)| {
        let (units, slots, port_interval, (in_order_return, group), tile_buffers) = shape;
        let (l1, l2, l2_latency, dram_latency, dram_ticks_per_line) = caches;
        Machine {
            units,
            slots,
            warp_rays: 1,
            port_interval,
            in_order_return,
            return_group_rays: group.min(slots),
            pipelines,
            l1,
            l2,
            l2_latency,
            dram_latency,
            dram_ticks_per_line,
            tile_buffers,
            has_prefetcher: true,
        }
    })
}

/// A unit, rays, a path and the number of its steps that fetch ahead, for each item of a batch.
type Paths = Vec<(usize, u32, Vec<(u32, u32, bool)>, usize)>;

fn paths() -> impl Strategy<Value = Paths> {
    let step = (0_u32..24, 1_u32..4, any::<bool>());
    let path = prop::collection::vec(step, 0..10);
    prop::collection::vec((0_usize..4, 1_u32..4, path, 0_usize..4), 0..14)
}

fn batches() -> impl Strategy<Value = Vec<(Paths, u64, u64)>> {
    prop::collection::vec((paths(), 0_u64..120, 0_u64..20), 0..5)
}

fn to_batch(units: usize, (paths, core_cycles, core_lines): &(Paths, u64, u64)) -> Batch {
    let mut out = Batch::default();
    out.clear(units);
    let pipeline = |node| [Pipeline::Intersection, Pipeline::Traversal][usize::from(node)];
    for (unit, rays, path, ahead) in paths {
        let first = out.requests.len() as u32;
        out.requests
            .extend(path.iter().map(|&(first_line, lines, node)| Request {
                first_line,
                lines,
                pipeline: pipeline(node),
            }));
        out.items[unit % units].push(Item {
            first,
            end: out.requests.len() as u32,
            rays: *rays,
            eye: [Eye::Left, Eye::Right][unit % 2],
        });
        // A path's first steps fetch its last ones ahead, and lines that nobody needs.
        for (number, (line, lines, node)) in path.iter().rev().enumerate().take(*ahead) {
            let at = out.prefetches.len() as u32;
            out.ahead.resize(first as usize + number + 1, at..at);
            out.prefetches.push(Request {
                first_line: line + 7 * (number as u32 % 2),
                lines: *lines,
                pipeline: pipeline(*node),
            });
            out.ahead[first as usize + number].end += 1;
        }
    }
    (out.core_cycles, out.core_lines) = (*core_cycles, *core_lines);
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Small caches, few MSHRs and slots: all queues fill up.
    #[test]
    fn a_loop_over_every_cycle_gives_the_same_cycles_and_counts(
        machine in machines(),
        tiles in batches(),
    ) {
        let batches: Vec<Batch> = tiles.iter().map(|tile| to_batch(machine.units, tile)).collect();
        let simulated = run(&machine, &batches);
        prop_assert_eq!(&simulated, &twin(&machine, &batches));

        // Conservation, from the input.
        let counts = &simulated.counts;
        let rays: u64 = batches.iter().map(Batch::rays).sum();
        let requests: u64 = batches.iter().flat_map(|b| b.items.iter().flatten())
            .map(|item| u64::from(item.end - item.first)).sum();
        prop_assert_eq!((counts.rays_entered, counts.rays_left), (rays, rays));
        prop_assert_eq!((counts.requests, counts.answers), (requests, requests));
        let sum: u64 = simulated.batches.iter().map(|b| b.cycles).sum();
        prop_assert!(sum <= simulated.unit_cycles);
        // Every cycle of every unit has one cause; the last cycle of a frame is not counted.
        let counted = simulated.unit_cycles.saturating_sub(1) * machine.units as u64;
        if simulated.batches.last().is_some_and(|b| b.cycles > 0) {
            prop_assert_eq!(counts.cycles.all(), counted);
        }
    }
}

/// The smallest machine: one slot, caches of one line, one MSHR each.
#[test]
fn the_smallest_caches_and_one_ray_in_flight_do_not_deadlock() {
    let one = CacheSize {
        sets: 1,
        ways: 1,
        mshrs: 1,
    };
    let rays: Vec<Vec<Request>> = (0..30)
        .map(|ray| {
            (0..20)
                .map(|k| Request {
                    first_line: (ray * 7 + k * 3) % 50,
                    lines: 1 + k % 4,
                    pipeline: [Pipeline::Traversal, Pipeline::Intersection][k as usize % 2],
                })
                .collect()
        })
        .collect();
    for (units, slots) in [(1, 1), (4, 1), (4, 200)] {
        let mut m = machine();
        (m.units, m.slots, m.l1, m.l2) = (units, slots, [one; 2], one);
        let tiles = vec![batch(units, &rays); 3];
        let simulated = run(&m, &tiles);
        assert_eq!(simulated.counts.rays_left, 90);
        assert!(simulated.counts.l1_mshr_waits + simulated.counts.l2_mshr_waits > 0);
        assert_eq!(simulated, twin(&m, &tiles));
    }
}
