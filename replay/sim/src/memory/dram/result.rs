//! The result of the DRAM model, in physical units.

use super::DramConfig;
use super::channel::Channel;
use super::presets::Device;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The `dram` object of a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct DramResult {
    /// Device.
    pub device: String,
    /// Requests in lines, reads and writes together. The other counts are in bursts.
    pub requests: u64,
    /// Bytes of a line; zero in results without the key.
    #[serde(default)]
    pub line_bytes: u32,
    /// Bytes of a burst; zero in results without the key.
    #[serde(default)]
    pub burst_bytes: u32,
    /// Bursts read. A line smaller than a burst reads a whole burst; a longer one reads several.
    pub reads: u64,
    /// Bytes transferred to the chip.
    pub read_bytes: u64,
    /// Bursts written.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub writes: u64,
    /// Bytes transferred from the chip.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub write_bytes: u64,
    /// Bursts written whose row was open.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub write_row_hits: u64,
    /// Bursts read whose row was open.
    pub row_hits: u64,
    /// Bursts read that opened a row in a bank without an open row.
    pub row_empty: u64,
    /// Bursts read that first had to close another row.
    pub row_conflicts: u64,
    /// `row_hits` over `reads`.
    pub row_hit_rate: f64,
    /// Rows opened.
    pub activates: u64,
    /// Refreshes of all banks, over all channels.
    pub refreshes: u64,
    /// From the first clock to the last data.
    pub time_us: f64,
    /// Bytes transferred over time.
    pub bandwidth_gb_per_s: f64,
    /// Peak bandwidth of the data buses.
    pub peak_gb_per_s: f64,
    /// Mean latency of a read burst from arrival to last data. Requests without a time arrive when they enter the queue.
    pub latency_mean_ns: f64,
    /// Median latency.
    pub latency_p50_ns: f64,
    /// 99th percentile of the latency.
    pub latency_p99_ns: f64,
    /// Energy of activates, reads, writes, refreshes and standby.
    pub energy_mj: f64,
}

fn is_zero(value: &u64) -> bool {
    *value == 0
}

impl DramResult {
    /// Sums over all channels, whose queues are empty.
    pub(super) fn of(
        config: &DramConfig,
        device: &Device,
        channels: &[Channel],
        requests: u64,
        line_bytes: u32,
    ) -> Self {
        let sum = |of: fn(&Channel) -> u64| channels.iter().map(of).sum::<u64>();
        let reads = sum(|c| c.counts.reads);
        let (activates, refreshes) = (sum(|c| c.counts.activates), sum(|c| c.counts.refreshes));
        let end = channels.iter().map(|c| c.counts.end).max().unwrap_or(0);
        let clock_ns = f64::from(device.clock_ps) * 1e-3;
        let time_s = end as f64 * clock_ns * 1e-9;
        let writes = sum(|c| c.counts.writes);
        let [read_bytes, write_bytes] =
            [reads, writes].map(|bursts| bursts * u64::from(device.burst_bytes));
        let mut latencies: Vec<u64> = Vec::new();
        for channel in channels {
            let of = &channel.counts.latencies;
            latencies.resize(latencies.len().max(of.len()), 0);
            (latencies.iter_mut().zip(of)).for_each(|(all, own)| *all += own);
        }
        let total: u64 = (0..)
            .zip(&latencies)
            .map(|(clocks, n): (u64, _)| clocks * n)
            .sum();
        let quantile = |share: f64| {
            let (wanted, mut seen) = ((share * reads as f64).ceil().max(1.0) as u64, 0);
            let at = latencies.iter().position(|n| {
                seen += n;
                seen >= wanted
            });
            at.unwrap_or(0) as f64 * clock_ns
        };
        let over_reads = |value: f64| {
            if reads == 0 {
                0.0
            } else {
                value / reads as f64
            }
        };
        let row_hits = sum(|c| c.counts.row_hits);
        let nj = activates as f64 * device.activate_nj
            + reads as f64 * device.read_nj
            + writes as f64 * device.write_nj
            + refreshes as f64 * device.refresh_nj;
        let background_mj = device.background_mw * time_s * f64::from(config.channels);
        Self {
            device: device.name.to_owned(),
            requests,
            line_bytes,
            burst_bytes: device.burst_bytes,
            reads,
            read_bytes,
            writes,
            write_bytes,
            write_row_hits: sum(|c| c.counts.write_row_hits),
            row_hits,
            row_empty: sum(|c| c.counts.row_empty),
            row_conflicts: sum(|c| c.counts.row_conflicts),
            row_hit_rate: over_reads(row_hits as f64),
            activates,
            refreshes,
            time_us: time_s * 1e6,
            bandwidth_gb_per_s: if end == 0 {
                0.0
            } else {
                (read_bytes + write_bytes) as f64 / time_s * 1e-9
            },
            peak_gb_per_s: f64::from(config.channels) * device.peak_bytes_per_s() * 1e-9,
            latency_mean_ns: over_reads(total as f64 * clock_ns),
            latency_p50_ns: quantile(0.5),
            latency_p99_ns: quantile(0.99),
            energy_mj: nj * 1e-6 + background_mj,
        }
    }
}

impl fmt::Display for DramResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} lines of {} B requested; {} bursts of {} B read, {:.2} MB; row hits {:.2} %, {} rows opened, {} closed for another",
            self.device,
            self.requests,
            self.line_bytes,
            self.reads,
            self.burst_bytes,
            self.read_bytes as f64 * 1e-6,
            100.0 * self.row_hit_rate,
            self.activates,
            self.row_conflicts
        )?;
        if self.writes > 0 {
            writeln!(
                f,
                "{} bursts written, {:.2} MB; row hits {:.2} %",
                self.writes,
                self.write_bytes as f64 * 1e-6,
                100.0 * self.write_row_hits as f64 / self.writes as f64
            )?;
        }
        writeln!(
            f,
            "{:.2} of {:.2} GB/s; latency mean {:.1}, median {:.1}, 99 % {:.1} ns; {:.4} mJ",
            self.bandwidth_gb_per_s,
            self.peak_gb_per_s,
            self.latency_mean_ns,
            self.latency_p50_ns,
            self.latency_p99_ns,
            self.energy_mj
        )
    }
}
