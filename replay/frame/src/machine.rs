//! The parameters of the machine beside those of `RunConfig`, and the machine in whole cycles and ticks.

use serde::Serialize;
use sim::config::{ConfigError, LevelConfig, RunConfig, accept};
use sim::memory::dram::DramConfig;
use sim::memory::{TICKS, ticks};

sim::choices! { DramModel = "How DRAM answers.", default Banks:
    Banks = "banks", "Channels, banks and rows with FR-FCFS (docs/models/dram.md).";
    Rate = "rate", "A latency behind a channel of limited bandwidth; reads go first.";
    Fixed = "fixed", "A latency without a limit of bandwidth.";
}

/// Parameters that no preset publishes. docs/models/frame-time.md has their sources and ranges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Settings {
    /// Instructions of each fragment's shader without textures, half of them before its textures.
    pub instructions: f64,
    /// Quads per warp.
    pub warp_quads: u32,
    /// Warps in flight per core.
    pub warps: u32,
    /// Lanes that issue an instruction per cycle and core.
    pub alu_lanes: u32,
    /// Quads that a core's rasteriser emits per cycle.
    pub raster_quads: f64,
    /// Bilinear footprints that a texture unit filters per cycle.
    pub filter_footprints: f64,
    /// Cycles from the filter to the warp.
    pub filter_cycles: u32,
    /// Quads between look-up and filter.
    pub fifo_quads: u32,
    /// Lines that an L1 looks up per cycle.
    pub l1_lookups: u32,
    /// Lines in flight per L1.
    pub l1_mshrs: u32,
    /// Look-ups per line in flight, the first one included.
    pub merges: u32,
    /// Bytes per cycle from the L2 to a core.
    pub port_bytes: f64,
    /// Banks of the L2, one look-up per cycle each.
    pub l2_banks: u32,
    /// Lines that the L2 waits for.
    pub l2_mshrs: u32,
    /// How DRAM answers.
    pub dram: DramModel,
    /// Bytes per nanosecond of DRAM in model `rate`; without it, the peak of the `[dram]` table's device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_gb_s: Option<f64>,
    /// Latency of DRAM in models `rate` and `fixed`.
    pub dram_ns: f64,
    /// Tiles of a core in flight: in work, or being written.
    pub tiles: u32,
    /// True if a core starts a tile only when its last one is shaded.
    pub barrier: bool,
    /// Bytes written per pixel.
    pub colour_bytes: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            instructions: 64.0,
            warp_quads: 8,
            warps: 32,
            alu_lanes: 64,
            raster_quads: 1.0,
            filter_footprints: 4.0,
            filter_cycles: 20,
            fifo_quads: 64,
            l1_lookups: 4,
            l1_mshrs: 32,
            merges: 8,
            port_bytes: 64.0,
            l2_banks: 4,
            l2_mshrs: 128,
            dram: DramModel::Banks,
            bandwidth_gb_s: None,
            dram_ns: 100.0,
            tiles: 2,
            barrier: false,
            colour_bytes: 4,
        }
    }
}

impl Settings {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let rate = |key, value: f64, most: f64| {
            let holds = value.is_finite() && value > 0.0 && value <= most;
            accept(holds, key, "more than 0, and not absurdly many", value)
        };
        rate("instructions", self.instructions, 1e6)?;
        rate("raster_quads", self.raster_quads, 1e3)?;
        rate("filter_footprints", self.filter_footprints, 1e3)?;
        rate("port_bytes", self.port_bytes, 1e6)?;
        rate("dram_ns", self.dram_ns, 1e6)?;
        rate("bandwidth", self.bandwidth_gb_s.unwrap_or(1.0), 1e5)?;
        for (key, value, most) in [
            ("warp_quads", self.warp_quads, 64),
            ("warps", self.warps, 4096),
            ("alu_lanes", self.alu_lanes, 4096),
            ("fifo_quads", self.fifo_quads, 1 << 20),
            ("l1_lookups", self.l1_lookups, 1 << 20),
            ("l1_mshrs", self.l1_mshrs, 1 << 20),
            ("merges", self.merges, 1 << 20),
            ("l2_mshrs", self.l2_mshrs, 1 << 20),
            ("tiles", self.tiles, 64),
        ] {
            let expected = format!("1 to {most}");
            accept((1..=most).contains(&value), key, expected, value)?;
        }
        accept(
            self.l2_banks.is_power_of_two() && self.l2_banks <= 256,
            "l2_banks",
            "a power of two up to 256",
            self.l2_banks,
        )
    }
}

/// The machine in whole cycles and ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Cores.
    pub cores: usize,
    /// Warps in flight per core.
    pub warps: usize,
    /// Quads per warp.
    pub warp_quads: usize,
    /// Instructions of a fragment.
    pub instructions: f64,
    /// Ticks of a quad in the rasteriser.
    pub raster_ticks: u64,
    /// Ticks of a warp's instructions before its textures, and after them.
    pub alu_ticks: [u64; 2],
    /// Ticks of a footprint in the filter.
    pub filter_ticks: u64,
    /// Cycles from the filter to the warp.
    pub filter_cycles: u64,
    /// Quads between look-up and filter.
    pub fifo: usize,
    /// Lines that an L1 looks up per cycle.
    pub lookups: u32,
    /// L1 of a core.
    pub l1: LevelConfig,
    /// Lines in flight per L1.
    pub l1_mshrs: usize,
    /// Look-ups per line in flight.
    pub merges: usize,
    /// Ticks of a line in a core's port.
    pub port_ticks: u64,
    /// Shared cache.
    pub l2: LevelConfig,
    /// Its banks, a power of two.
    pub banks: usize,
    /// Lines that it waits for.
    pub l2_mshrs: usize,
    /// Cycles from its look-up, or from DRAM's answer, to the port.
    pub l2_cycles: u64,
    /// DRAM.
    pub dram: DramMachine,
    /// Tiles of a core in flight.
    pub tiles: usize,
    /// True if a core starts a tile only when its last one is shaded.
    pub barrier: bool,
    /// Bytes of a line.
    pub line_bytes: u32,
    /// Cycles per microsecond.
    pub core_mhz: u32,
}

/// DRAM of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DramMachine {
    /// Channels, banks and rows.
    Banks(DramConfig),
    /// Latency in cycles, and ticks of a line in the channel; 0: no limit.
    Rate {
        /// Cycles from the start of a transfer to the L2.
        latency: u64,
        /// Ticks of a line.
        ticks_per_line: u64,
        /// Lines of writes that wait before they go before reads.
        most_writes: u64,
    },
}

impl Machine {
    /// The machine of a configuration.
    ///
    /// # Errors
    /// A value that is out of range, or a level below the L2, which the model does not have.
    pub fn new(config: &RunConfig, settings: &Settings) -> Result<Self, ConfigError> {
        config.validate()?;
        settings.check()?;
        accept(
            config.level.lower().next().is_none(),
            "level",
            "an L1 and an L2, as the model of frame time has",
            "further levels",
        )?;
        accept(
            config.prefetch.is_none() && !config.level.depend_on_evictions(),
            "prefetch, inclusion",
            "none, as in the model of frame time",
            "a prefetcher or inclusion",
        )?;
        let dram = config.dram.unwrap_or_default();
        let cycles_per_ns = f64::from(dram.core_mhz) * 1e-3;
        let lanes = f64::from(4 * settings.warp_quads);
        let alu = settings.instructions / 2.0 * lanes / f64::from(settings.alu_lanes);
        let gb_s = settings.bandwidth_gb_s.unwrap_or_else(|| peak_gb_s(&dram));
        let line = f64::from(config.line_bytes);
        let rate = |ticks_per_line| DramMachine::Rate {
            latency: ((settings.dram_ns * cycles_per_ns).round() as u64).max(1),
            ticks_per_line,
            most_writes: 64,
        };
        Ok(Self {
            cores: config.cores as usize,
            warps: settings.warps as usize,
            warp_quads: settings.warp_quads as usize,
            instructions: settings.instructions,
            raster_ticks: ticks(1.0 / settings.raster_quads),
            alu_ticks: [ticks(alu); 2],
            filter_ticks: ticks(1.0 / settings.filter_footprints),
            filter_cycles: settings.filter_cycles.into(),
            fifo: settings.fifo_quads as usize,
            lookups: settings.l1_lookups,
            l1: config.level.l1,
            l1_mshrs: settings.l1_mshrs as usize,
            merges: settings.merges as usize,
            port_ticks: ticks(line / settings.port_bytes),
            l2: config.level.l2,
            banks: settings.l2_banks as usize,
            l2_mshrs: settings.l2_mshrs as usize,
            l2_cycles: u64::from(config.level.l2.hit_cycles).max(1),
            dram: match settings.dram {
                DramModel::Banks => DramMachine::Banks(dram),
                DramModel::Rate => rate(ticks(line / gb_s * cycles_per_ns)),
                DramModel::Fixed => rate(0),
            },
            tiles: settings.tiles as usize,
            barrier: settings.barrier,
            line_bytes: config.line_bytes,
            core_mhz: dram.core_mhz,
        })
    }

    /// Bytes that DRAM transfers per cycle at most; infinite without a limit. Refreshes of all banks are left out of the
    /// peak of a device.
    pub fn sustained_bytes_per_cycle(&self) -> f64 {
        match self.dram {
            DramMachine::Banks(dram) => {
                let device = dram.preset.device();
                let awake = 1.0 - f64::from(device.rfc) / f64::from(device.refi);
                peak_gb_s(&dram) * 1e3 / f64::from(self.core_mhz) * awake
            }
            DramMachine::Rate {
                ticks_per_line: 0, ..
            } => f64::INFINITY,
            DramMachine::Rate { ticks_per_line, .. } => {
                f64::from(self.line_bytes) * TICKS as f64 / ticks_per_line as f64
            }
        }
    }
}

/// Peak bandwidth of all channels.
fn peak_gb_s(dram: &DramConfig) -> f64 {
    dram.preset.device().peak_bytes_per_s() * f64::from(dram.channels) * 1e-9
}
