//! The texture unit with a prefetching FIFO.

use super::*;
use crate::config::{TmuConfig, TmuModel};

fn config(fifo_footprints: u32, cores: u32) -> RunConfig {
    RunConfig {
        mode: Mode::Timed,
        cores,
        tmu: TmuConfig {
            model: TmuModel::PrefetchFifo,
            fifo_footprints,
            ..TmuConfig::default()
        },
        ..functional(Order::Z2_STA)
    }
}

/// With a FIFO of one footprint, nothing is in flight at the next look-up, so one core has exactly the
/// misses of functional mode. With a longer FIFO, a line evicted in flight is not requested again.
#[test]
fn one_core_has_the_misses_of_functional_mode() {
    let trace = small();
    let without_latencies = RunConfig {
        mode: Mode::Functional,
        ..config(1, 1)
    };
    let expected = replay(&trace, &without_latencies).unwrap();
    let mut result = replay(&trace, &config(1, 1)).unwrap();
    let (tmu, cycles) = (result.tmu.take().unwrap(), result.cycles.take().unwrap());
    assert!((tmu.utilization - result.footprints as f64 / cycles as f64).abs() < 1e-12);
    assert_eq!(result, expected);
    for fifo in [7, 64, 4096] {
        let result = replay(&trace, &config(fifo, 1)).unwrap();
        assert_eq!(result.access_hash, expected.access_hash);
        let ratio = result.l1.counters.line_misses as f64 / expected.l1.counters.line_misses as f64;
        assert!((0.9..=1.0).contains(&ratio), "{fifo}: {ratio}");
    }
}

/// With a FIFO of one footprint, each waits for the slowest of its lines.
#[test]
fn a_fifo_of_one_footprint_hides_nothing() {
    let trace = small();
    let mut one = config(1, 1);
    one.memory_cycles = 0;
    let result = replay(&trace, &one).unwrap();
    // A miss takes 20 cycles, a hit one. Nothing is in flight at the next look-up.
    let expected = result.footprints + 19 * result.l1.counters.footprint_misses;
    assert_eq!(result.cycles, Some(expected));
    assert_eq!(result.l1.counters.secondary_misses, 0);
}

/// A FIFO longer than the miss latency hides it: the cycles are one per footprint plus at most the last miss.
#[test]
fn a_long_fifo_hides_every_latency() {
    let trace = small();
    for cores in [1, 3] {
        let mut before = u64::MAX;
        for fifo in [1, 8, 64, 512, 4096] {
            let result = replay(&trace, &config(fifo, cores)).unwrap();
            let cycles = result.cycles.unwrap();
            assert!(cycles <= before || cores > 1, "{fifo}");
            before = cycles;
        }
        let result = replay(&trace, &config(4096, cores)).unwrap();
        assert!(result.tmu.unwrap().utilization > 0.98, "{:?}", result.tmu);
        if cores == 1 {
            assert!(before <= result.footprints + 2 * 220, "{before}");
        }
    }
}
