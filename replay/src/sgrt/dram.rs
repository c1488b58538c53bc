//! External memory: one account of what is moved, from which both time and energy follow.

use super::config::SgrtConfig;
use serde::{Deserialize, Serialize};

/// Bytes in and out of external memory by what needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DramBytes {
    /// Nodes and triangles that missed the caches.
    pub hierarchy_bytes: u64,
    /// G-buffer.
    pub gbuffer_bytes: u64,
    /// Attributes and texels.
    pub shading_bytes: u64,
    /// Finished pixels.
    pub frame_buffer_bytes: u64,
}

impl DramBytes {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.hierarchy_bytes + self.gbuffer_bytes + self.shading_bytes + self.frame_buffer_bytes
    }

    /// Adds another batch's.
    pub fn add(&mut self, other: &Self) {
        self.hierarchy_bytes += other.hierarchy_bytes;
        self.gbuffer_bytes += other.gbuffer_bytes;
        self.shading_bytes += other.shading_bytes;
        self.frame_buffer_bytes += other.frame_buffer_bytes;
    }

    /// Time of the transfer at full bandwidth (a GB/s is a byte a nanosecond).
    #[must_use]
    pub fn time_ns(&self, config: &SgrtConfig) -> f64 {
        self.total() as f64 / config.memory.bandwidth_gb_s
    }
}
