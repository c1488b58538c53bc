//! The throughput of warps that compute and wait for memory, beside the operational bounds and exact mean value analysis
//! of closed queueing networks (Reiser and Lavenberg, 1980).

use super::*;
use formats::random::Random;

/// Warps that each miss a line of their own, with instructions of `ticks(warp)` before and after.
fn missing(warps: u32, mut ticks: impl FnMut() -> [u64; 2]) -> Part {
    let lines: Vec<[u32; 1]> = (0..warps).map(|line| [line]).collect();
    let requests: Vec<[&[u32]; 1]> = lines.iter().map(|of| [&of[..]]).collect();
    let warps: Vec<_> = requests.iter().map(|of| (&of[..], 1, ticks())).collect();
    part(&warps)
}

fn machine_of(warps: usize) -> Machine {
    Machine {
        warps,
        fifo: 1 << 20,
        filter_ticks: 1,
        dram: fixed(3000),
        ..machine()
    }
}

fn cycles_per_warp(warps: usize, part: &Part) -> f64 {
    let count = part.warps.len() as f64;
    run(&machine_of(warps), List::shared(vec![part.clone()])).0 as f64 / count
}

#[test]
fn throughput_keeps_the_operational_bounds() {
    let part = missing(4000, || [150 * TICKS, 250 * TICKS]);
    let alone = cycles_per_warp(1, &part);
    for warps in 1..=16 {
        let cycles = cycles_per_warp(warps, &part);
        let least = (alone / warps as f64).max(400.0);
        // As if each warp waited for the instructions of all others.
        let most = 400.0 + (alone - 400.0) / warps as f64;
        assert!(
            cycles >= least * 0.999,
            "{warps} warps: {cycles} below {least}"
        );
        assert!(
            cycles <= most * 1.001,
            "{warps} warps: {cycles} above {most}"
        );
    }
    let full = cycles_per_warp(32, &part);
    assert!((full - 400.0).abs() < 2.0, "{full}");
}

/// With exponential instructions and a fixed latency, the network has a product form, so that its throughput is exactly
/// that of mean value analysis. All instructions come before the textures: with two kinds of instructions, of which the
/// older warp's go first, the network would have none.
#[test]
fn throughput_equals_exact_mean_value_analysis() {
    const MEAN: f64 = 1000.0;
    let mut random = Random(7);
    let mut exponential = || {
        let uniform = 1.0 - random.unit_f64();
        (-uniform.ln() * MEAN * TICKS as f64) as u64 + 1
    };
    let part = missing(40_000, || [exponential(), 1]);
    let demand = part.warps.iter().flat_map(|of| of.alu_ticks).sum::<u64>() as f64
        / part.warps.len() as f64
        / TICKS as f64;
    let delay = cycles_per_warp(1, &missing(1000, || [1; 2]));
    let mut queue = 0.0;
    let mut worst = 0.0_f64;
    for warps in 1..=12 {
        let residence = demand * (1.0 + queue);
        let expected = warps as f64 / (residence + delay);
        queue = expected * residence;
        let found = 1.0 / cycles_per_warp(warps, &part);
        worst = worst.max((found / expected - 1.0).abs());
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{warps} warps: {found} for {expected}"
        );
    }
    println!(
        "largest difference from mean value analysis: {:.2} %",
        100.0 * worst
    );
}
