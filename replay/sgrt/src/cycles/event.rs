//! Events, and their order within a cycle.

/// Phase of an event within its cycle.
pub mod phase {
    pub const CORES: u64 = 0;
    pub const L2_RETRY: u64 = 1;
    pub const UNIT: u64 = 2;
    pub const RETURN: u64 = 3;
    pub const ACCEPT: u64 = 4;
}

/// Kind of a unit's event for its slots; lower kinds are retries of its two caches.
pub const SLOT: u64 = 2;

/// The key of an event: keys in order are the order within a cycle.
pub fn key(phase: u64, unit: usize, kind: u64, slot: usize) -> u64 {
    phase << 60 | (unit as u64) << 36 | kind << 32 | slot as u64
}
