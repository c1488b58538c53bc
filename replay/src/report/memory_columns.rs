//! Columns of what is counted beside and below the L2.

use super::columns::Column;
use super::figures::over;
use crate::result::MemoryResult;

/// Every figure of the memory system; those of parts that a configuration does not have are empty.
#[rustfmt::skip]
pub fn columns() -> Vec<Column<'static, MemoryResult>> {
    vec![
        Column::real("prefetched_lines", "prefetched", "", 0, |r: &MemoryResult| Some(r.prefetch?.lines))
            .about("lines that the prefetcher of the L2 fetched"),
        Column::real("prefetch_accuracy_pct", "useful", "% of prefetched", 1, |r: &MemoryResult| { let p = r.prefetch?; Some(100.0 * over(p.useful_lines, p.lines)?) })
            .about("prefetched lines that were requested while they were there or in flight"),
        Column::real("l2_mshrs_peak", "MSHRs", "", 0, |r: &MemoryResult| Some(r.l2_mshrs?.peak))
            .about("MSHRs of the L2 in use at most, where their number is limited"),
        Column::real("l2_stall_cycles", "stalls", "cycles", 0, |r: &MemoryResult| Some(r.l2_mshrs?.stall_cycles))
            .about("cycles that misses of the L2 waited for an MSHR, together"),
        Column::real("invalidated_lines", "invalidated", "lines", 0, |r: &MemoryResult| r.invalidated_lines)
            .about("lines that inclusive levels invalidated in L1 caches and in the L2"),
        Column::real("last_level_miss_pct", "last level", "%", 2, |r: &MemoryResult| Some(100.0 * r.lower_levels.last()?.miss_rate))
            .about("line look-ups of the last level below the L2 that miss"),
        Column::real("dram_row_hit_pct", "row hits", "%", 2, |r: &MemoryResult| Some(100.0 * r.dram.as_ref()?.row_hit_rate))
            .about("reads of DRAM whose row was open"),
        Column::real("dram_activates", "activates", "", 0, |r: &MemoryResult| Some(r.dram.as_ref()?.activates))
            .about("rows of DRAM opened"),
        Column::real("dram_read_bytes", "DRAM reads", "bytes", 0, |r: &MemoryResult| Some(r.dram.as_ref()?.read_bytes))
            .about("whole bursts: more than the lines where these are smaller"),
        Column::real("dram_bandwidth_gb_per_s", "bandwidth", "GB/s", 2, |r: &MemoryResult| Some(r.dram.as_ref()?.bandwidth_gb_per_s))
            .about("bytes read over the time of the replay; functional mode: as fast as the DRAM can"),
        Column::real("dram_peak_gb_per_s", "peak", "GB/s", 1, |r: &MemoryResult| Some(r.dram.as_ref()?.peak_gb_per_s))
            .about("what the data buses carry at most"),
        Column::real("dram_latency_mean_ns", "latency", "ns", 1, |r: &MemoryResult| Some(r.dram.as_ref()?.latency_mean_ns))
            .about("of a read of DRAM, from its arrival to its last data"),
        Column::real("dram_latency_p99_ns", "latency, 99 %", "ns", 1, |r: &MemoryResult| Some(r.dram.as_ref()?.latency_p99_ns))
            .about("99 of 100 reads take no longer"),
        Column::real("dram_energy_mj", "DRAM energy", "mJ", 4, |r: &MemoryResult| Some(r.dram.as_ref()?.energy_mj))
            .about("activates, reads, refreshes and standing by"),
    ]
}
