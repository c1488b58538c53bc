//! The hardware cost of an order.
//!
//! The figures describe a plain implementation with 16-bit tile coordinates: bytes that change during a frame
//! (*state*), bytes of tables in memory or on the chip, work items that must be known in advance
//! (*look-ahead*), and cycles until the next item is known (*decision*).

use serde::Serialize;

/// The information that an order uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Information {
    /// The grid alone.
    #[default]
    Grid,
    /// Constants of the display: its projections.
    Display,
    /// Counters of the last frame.
    LastFrame,
    /// Accesses of the current frame. They are not known in advance, so this is a bound, not an order.
    Future,
}

impl Information {
    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Display => "display",
            Self::LastFrame => "last-frame",
            Self::Future => "future",
        }
    }
}

/// The cost of an order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Registers.
    pub state_bytes: u32,
    /// Tables that are constant during a frame.
    pub table_bytes: u64,
    /// Work items that must be known in advance.
    pub look_ahead_items: u32,
    /// Tile buffers per core.
    pub tile_buffers: u32,
    /// Cycles until the next item is known.
    pub decision_cycles: u32,
    /// The information that it uses.
    pub information: Information,
}

impl Cost {
    /// Registers of this size and one tile buffer.
    pub fn state(state_bytes: u32) -> Self {
        Self {
            state_bytes,
            tile_buffers: 1,
            ..Self::default()
        }
    }

    pub(super) fn with_table(self, table_bytes: u64) -> Self {
        Self {
            table_bytes,
            ..self
        }
    }

    pub(super) fn deciding_in(self, decision_cycles: u32) -> Self {
        Self {
            decision_cycles,
            ..self
        }
    }

    pub(super) fn with_information(self, information: Information) -> Self {
        Self {
            information,
            ..self
        }
    }

    pub(super) fn looking_ahead(self, look_ahead_items: u32) -> Self {
        Self {
            look_ahead_items,
            ..self
        }
    }

    pub(super) fn with_tile_buffers(self, tile_buffers: u32) -> Self {
        Self {
            tile_buffers,
            ..self
        }
    }

    /// The sum of two costs. Decisions take place one after the other.
    #[must_use]
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            state_bytes: self.state_bytes + other.state_bytes,
            table_bytes: self.table_bytes + other.table_bytes,
            look_ahead_items: self.look_ahead_items.max(other.look_ahead_items),
            tile_buffers: self.tile_buffers.max(other.tile_buffers),
            decision_cycles: self.decision_cycles + other.decision_cycles,
            information: self.information.max(other.information),
        }
    }

    /// True if hardware can implement the order, because it does not use accesses of the current frame.
    pub fn is_buildable(&self) -> bool {
        self.information < Information::Future
    }
}
