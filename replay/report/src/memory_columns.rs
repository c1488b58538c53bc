//! Columns of the prefetcher, the MSHRs, the levels below the L2 and DRAM.

use super::columns::{Column, Columns, columns_of, over};
use sim::memory::dram::DramResult;
use sim::result::MemoryResult;

/// A figure of the DRAM, if there is one.
fn dram<V>(of: fn(&DramResult) -> V) -> impl Fn(&MemoryResult) -> Option<V> {
    move |result| result.dram.as_ref().map(of)
}

/// Every figure of the memory system. Figures of parts that a configuration lacks are empty.
#[rustfmt::skip]
pub fn columns() -> Vec<Column<'static, MemoryResult>> {
    columns_of::<MemoryResult>()
        .real("prefetched_lines", "prefetched", "", 0, |r| Some(r.prefetch?.lines))
            .about("lines that the L2's prefetcher fetched")
        .real("prefetch_accuracy_pct", "useful", "% of prefetched", 1, |r| { let p = r.prefetch?; Some(100.0 * over(p.useful_lines, p.lines)?) })
            .about("prefetched lines that were requested while in the cache or in flight")
        .real("l2_mshrs_peak", "MSHRs", "", 0, |r| Some(r.l2_mshrs?.peak))
            .about("largest number of L2 MSHRs in use, if their number is limited")
        .real("l2_stall_cycles", "stalls", "cycles", 0, |r| Some(r.l2_mshrs?.stall_cycles))
            .about("total cycles that L2 misses waited for an MSHR")
        .real("invalidated_lines", "invalidated", "lines", 0, |r| r.invalidated_lines)
            .about("lines that inclusive levels invalidated in L1 caches and in the L2")
        .real("last_level_line_miss_pct", "last level", "%", 2, |r| Some(100.0 * r.lower_levels.last()?.line_miss_rate))
            .about("line look-ups of the last level below the L2 that miss")
        .real("dram_row_hit_pct", "row hits", "%", 2, |r| Some(100.0 * r.dram.as_ref()?.row_hit_rate))
            .about("DRAM reads whose row was open")
        .real("dram_activates", "activates", "", 0, dram(|d| d.activates))
            .about("DRAM rows opened")
        .real("dram_read_bytes", "DRAM reads", "bytes", 0, dram(|d| d.read_bytes))
            .about("bytes of whole bursts; more than the lines if these are smaller than a burst")
        .real("dram_bandwidth_gb_per_s", "bandwidth", "GB/s", 2, dram(|d| d.bandwidth_gb_per_s))
            .about("DRAM read rate; in functional mode, that of a DRAM that is always busy")
        .real("dram_peak_gb_per_s", "peak", "GB/s", 1, dram(|d| d.peak_gb_per_s))
            .about("peak bandwidth of the data buses")
        .real("dram_latency_mean_ns", "latency", "ns", 1, dram(|d| d.latency_mean_ns))
            .about("time of a DRAM read from its arrival to its last data, mean")
        .real("dram_latency_p99_ns", "latency, 99 %", "ns", 1, dram(|d| d.latency_p99_ns))
            .about("99th percentile of the time of a DRAM read")
        .real("dram_energy_mj", "DRAM energy", "mJ", 4, dram(|d| d.energy_mj))
            .about("energy of activates, reads, writes, refreshes and standby")
}
