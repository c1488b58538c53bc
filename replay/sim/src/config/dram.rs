//! Checks of a `[dram]` table.

use super::{ConfigError, accept, in_range};
use crate::memory::dram::DramConfig;

impl DramConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        accept(
            self.channels.is_power_of_two() && self.channels <= 64,
            "dram.channels",
            "a power of two up to 64",
            self.channels,
        )?;
        in_range("dram.queue", self.queue, 1..=1024)?;
        in_range("dram.core_mhz", self.core_mhz, 1..=100_000)
    }
}
