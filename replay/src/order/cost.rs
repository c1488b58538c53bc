//! What an order needs of hardware.
//!
//! Figures are those of a plain implementation with 16-bit tile coordinates: bytes that change while a frame is
//! traversed (*state*), bytes of tables in memory or on the chip, work items that must be known ahead, and cycles until
//! the next item is known.

use serde::Serialize;

/// What an order knows when it decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knows {
    /// The grid alone.
    #[default]
    Grid,
    /// Constants of the display: its projections.
    Display,
    /// What was counted in the last frame.
    LastFrame,
    /// The frame's own accesses, which nobody knows before they are made: a bound, not an order.
    Future,
}

impl Knows {
    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Display => "display",
            Self::LastFrame => "last-frame",
            Self::Future => "future",
        }
    }
}

/// What an order needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Registers.
    pub state_bytes: u32,
    /// Tables, constant in a frame.
    pub table_bytes: u64,
    /// Work items that must be known ahead.
    pub look_ahead_items: u32,
    /// Tile buffers a core needs at a time.
    pub tile_buffers: u32,
    /// Cycles until the next item is known.
    pub decision_cycles: u32,
    /// What it knows.
    pub knows: Knows,
}

impl Cost {
    /// So many registers, one tile buffer, and nothing else.
    #[must_use]
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

    pub(super) fn knowing(self, knows: Knows) -> Self {
        Self { knows, ..self }
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

    /// Both together, one deciding after the other.
    #[must_use]
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            state_bytes: self.state_bytes + other.state_bytes,
            table_bytes: self.table_bytes + other.table_bytes,
            look_ahead_items: self.look_ahead_items.max(other.look_ahead_items),
            tile_buffers: self.tile_buffers.max(other.tile_buffers),
            decision_cycles: self.decision_cycles + other.decision_cycles,
            knows: self.knows.max(other.knows),
        }
    }

    /// True for what hardware can have: nothing of it lies in the future.
    #[must_use]
    pub fn is_buildable(&self) -> bool {
        self.knows < Knows::Future
    }
}
