//! DRAM devices and their timings.
//!
//! Timings are in clocks of the command bus and follow the speed bins of the standards. Energies
//! are typical data-sheet values to one digit: suitable for comparison, not as absolute values.

crate::choices! { #[non_exhaustive] DramPreset = "A named device.", default Lpddr4:
    Lpddr4 = "lpddr4", "LPDDR4-3200, 16-bit channels (JESD209-4).";
    Lpddr5 = "lpddr5", "LPDDR5-6400, 16-bit channels, bank groups (JESD209-5).";
    Ddr4 = "ddr4", "DDR4-2400R (16-16-16), 64-bit channels of 4 Gb x8 devices (JESD79-4).";
    Gddr6 = "gddr6", "GDDR6 at 14 Gb/s per pin, 16-bit channels (JESD250).";
}

/// Organisation, timings and energies of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Device {
    /// Name of the standard and speed.
    pub name: &'static str,
    /// Bytes per burst.
    pub burst_bytes: u32,
    /// Bytes per row of the channel.
    pub row_bytes: u32,
    /// Bank groups, a power of two; 1 for devices without groups.
    pub groups: u32,
    /// Banks per group, a power of two.
    pub banks_of_group: u32,
    /// Clock period in picoseconds.
    pub clock_ps: u32,
    /// Clocks of data per burst.
    pub burst: u32,
    /// Read to first data.
    pub cl: u32,
    /// Activate to read.
    pub rcd: u32,
    /// Precharge to activate.
    pub rp: u32,
    /// Activate to precharge.
    pub ras: u32,
    /// Read to precharge.
    pub rtp: u32,
    /// Write to first data.
    pub cwl: u32,
    /// Last data of a write to precharge.
    pub wr: u32,
    /// Last data of a write to a read of another group.
    pub wtr_s: u32,
    /// Last data of a write to a read of the same group.
    pub wtr_l: u32,
    /// Read to read of another group.
    pub ccd_s: u32,
    /// Read to read of the same group.
    pub ccd_l: u32,
    /// Activate to activate in another group.
    pub rrd_s: u32,
    /// Activate to activate in the same group.
    pub rrd_l: u32,
    /// Window in which at most four activates are allowed.
    pub faw: u32,
    /// Duration of a refresh of all banks.
    pub rfc: u32,
    /// Interval between refreshes.
    pub refi: u32,
    /// Energy of activating and precharging a row, in nanojoules.
    pub activate_nj: f64,
    /// Energy of reading and driving a burst, in nanojoules.
    pub read_nj: f64,
    /// Energy of driving and writing a burst, in nanojoules.
    pub write_nj: f64,
    /// Energy of refreshing all banks, in nanojoules.
    pub refresh_nj: f64,
    /// Standby power with open rows, in milliwatts.
    pub background_mw: f64,
}

impl Device {
    /// Energy per byte read or written if every second burst opens a row. Excludes standby and refresh.
    pub fn pj_per_byte(&self) -> f64 {
        1000.0 * (self.read_nj + 0.5 * self.activate_nj) / f64::from(self.burst_bytes)
    }
}

const LPDDR4: Device = Device {
    name: "LPDDR4-3200",
    burst_bytes: 32,
    row_bytes: 2048,
    groups: 1,
    banks_of_group: 8,
    clock_ps: 625,
    burst: 8,
    cl: 28,
    rcd: 29,
    rp: 29,
    ras: 68,
    rtp: 12,
    cwl: 14,
    wr: 29,
    wtr_s: 16,
    wtr_l: 16,
    ccd_s: 8,
    ccd_l: 8,
    rrd_s: 16,
    rrd_l: 16,
    faw: 64,
    rfc: 448,
    refi: 6246,
    activate_nj: 1.5,
    read_nj: 1.3,
    write_nj: 1.3,
    refresh_nj: 30.0,
    background_mw: 15.0,
};

const LPDDR5: Device = Device {
    name: "LPDDR5-6400",
    burst_bytes: 32,
    row_bytes: 2048,
    groups: 4,
    banks_of_group: 4,
    clock_ps: 1250,
    burst: 2,
    cl: 20,
    rcd: 15,
    rp: 15,
    ras: 34,
    rtp: 6,
    cwl: 11,
    wr: 28,
    wtr_s: 5,
    wtr_l: 10,
    ccd_s: 2,
    ccd_l: 4,
    rrd_s: 4,
    rrd_l: 4,
    faw: 16,
    rfc: 168,
    refi: 3123,
    activate_nj: 1.5,
    read_nj: 1.0,
    write_nj: 1.0,
    refresh_nj: 30.0,
    background_mw: 15.0,
};

const DDR4: Device = Device {
    name: "DDR4-2400R",
    burst_bytes: 64,
    row_bytes: 8192,
    groups: 4,
    banks_of_group: 4,
    clock_ps: 833,
    burst: 4,
    cl: 16,
    rcd: 16,
    rp: 16,
    ras: 39,
    rtp: 9,
    cwl: 12,
    wr: 18,
    wtr_s: 3,
    wtr_l: 9,
    ccd_s: 4,
    ccd_l: 6,
    rrd_s: 4,
    rrd_l: 6,
    faw: 26,
    rfc: 312,
    refi: 9360,
    activate_nj: 10.0,
    read_nj: 8.0,
    write_nj: 8.0,
    refresh_nj: 700.0,
    background_mw: 400.0,
};

const GDDR6: Device = Device {
    name: "GDDR6-14000",
    burst_bytes: 32,
    row_bytes: 2048,
    groups: 4,
    banks_of_group: 4,
    clock_ps: 571,
    burst: 2,
    cl: 24,
    rcd: 26,
    rp: 26,
    ras: 53,
    rtp: 4,
    cwl: 6,
    wr: 26,
    wtr_s: 9,
    wtr_l: 11,
    ccd_s: 2,
    ccd_l: 3,
    rrd_s: 7,
    rrd_l: 7,
    faw: 28,
    rfc: 210,
    refi: 3333,
    activate_nj: 2.0,
    read_nj: 1.9,
    write_nj: 1.9,
    refresh_nj: 50.0,
    background_mw: 150.0,
};

impl DramPreset {
    /// The device.
    pub const fn device(self) -> Device {
        match self {
            Self::Lpddr4 => LPDDR4,
            Self::Lpddr5 => LPDDR5,
            Self::Ddr4 => DDR4,
            Self::Gddr6 => GDDR6,
        }
    }
}

impl Device {
    /// Banks per channel.
    pub const fn banks(&self) -> u32 {
        self.groups * self.banks_of_group
    }

    /// The clock of a cycle at `core_mhz`.
    pub fn clock(&self, cycle: u64, core_mhz: u32) -> u64 {
        let ps = u128::from(cycle) * 1_000_000 / u128::from(core_mhz);
        (ps / u128::from(self.clock_ps)) as u64
    }

    /// Peak bandwidth of a channel's data bus in bytes per second.
    pub fn peak_bytes_per_s(&self) -> f64 {
        f64::from(self.burst_bytes) / (f64::from(self.burst) * f64::from(self.clock_ps) * 1e-12)
    }
}
