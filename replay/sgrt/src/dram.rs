//! External memory traffic, from which both time and energy are computed.

use super::config::SgrtConfig;
use serde::{Deserialize, Serialize};

/// Bytes read from and written to external memory, by use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct DramBytes {
    /// Nodes and triangles that missed in the caches.
    pub hierarchy_bytes: u64,
    /// G-buffer.
    pub gbuffer_bytes: u64,
    /// Attributes and texels.
    pub shading_bytes: u64,
    /// Finished pixels.
    pub frame_buffer_bytes: u64,
}

impl DramBytes {
    /// Total bytes.
    pub fn total(&self) -> u64 {
        self.hierarchy_bytes + self.gbuffer_bytes + self.shading_bytes + self.frame_buffer_bytes
    }

    /// Adds another batch's bytes.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            hierarchy_bytes,
            gbuffer_bytes,
            shading_bytes,
            frame_buffer_bytes
        );
    }

    /// Transfer time at full bandwidth (1 GB/s is 1 byte/ns).
    pub(super) fn time_ns(&self, config: &SgrtConfig) -> f64 {
        self.total() as f64 / config.memory.bandwidth_gb_s
    }
}
