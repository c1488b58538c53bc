//! Checks of a `[dram]` table.

use super::{ConfigError, accept};
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
        self.check_ranges()
    }
}
