//! The memory to which shaders append records.
//!
//! It is host memory, because a device address of lavapipe is an address in the process. Untouched pages take
//! no memory.

use memmap2::{MmapMut, MmapOptions};
use spool::buffer::COUNTER_BYTES;
use spool::{UNIT_BYTES, Unit};
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};

/// The record buffer of a device.
#[derive(Debug)]
pub(crate) struct RecordBuffer {
    map: MmapMut,
    /// Capacity in units.
    capacity: u32,
}

/// A capacity that no buffer has.
pub(crate) const NO_CAPACITY: u32 = u32::MAX;

/// Word of the buffer with the number of appended units.
const COUNT: usize = 0;
/// Word of the buffer with its capacity, for shaders.
const CAPACITY: usize = 1;

impl RecordBuffer {
    /// Reserves `bytes` bytes for records.
    pub fn new(bytes: u64) -> io::Result<Self> {
        let capacity = u32::try_from(bytes / UNIT_BYTES).unwrap_or(u32::MAX);
        let capacity = capacity.min(NO_CAPACITY - 1);
        let bytes = COUNTER_BYTES + u64::from(capacity) * UNIT_BYTES;
        let bytes = usize::try_from(bytes).map_err(|_| io::ErrorKind::OutOfMemory)?;
        let map = MmapOptions::new().len(bytes).no_reserve_swap().map_anon()?;
        Ok(Self { map, capacity })
    }

    /// Device address for shaders.
    pub fn address(&self) -> u64 {
        self.map.as_ptr() as u64
    }

    /// Enables or disables recording.
    pub fn open(&self, open: bool) {
        let capacity = if open { self.capacity } else { 0 };
        self.word(CAPACITY).store(capacity, Ordering::SeqCst);
    }

    /// Whether recording is enabled.
    pub fn is_open(&self) -> bool {
        self.word(CAPACITY).load(Ordering::SeqCst) != 0
    }

    /// Passes the records to `take` with the number of bytes that did not fit, and resets the buffer. If some
    /// did not fit, no records are passed. No shader may be running.
    pub fn take<T>(&self, take: impl FnOnce(&[Unit], u64) -> T) -> T {
        let count = self.word(COUNT).load(Ordering::SeqCst);
        let lost = count.saturating_sub(self.capacity);
        let fitting = if lost == 0 { count as usize } else { 0 };
        let bytes = self.map[COUNTER_BYTES as usize..].get(..fitting * UNIT_BYTES as usize);
        let records: &[Unit] = bytemuck::cast_slice(bytes.unwrap_or_default());
        let taken = take(records, u64::from(lost) * UNIT_BYTES);
        self.word(COUNT).store(0, Ordering::SeqCst);
        taken
    }

    fn word(&self, place: usize) -> &AtomicU32 {
        let words: *const AtomicU32 = self.map.as_ptr().cast();
        // SAFETY: the counter's bytes are mapped as long as `self` lives and contain both words. All other
        // accesses are also atomic.
        unsafe { &*words.add(place) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_taken_once_and_an_overflow_is_counted() {
        let buffer = RecordBuffer::new(3 * UNIT_BYTES).unwrap();
        assert!(!buffer.is_open());
        buffer.open(true);
        assert!(buffer.is_open());
        buffer.word(COUNT).store(2, Ordering::SeqCst);
        assert_eq!(buffer.take(|records, lost| (records.len(), lost)), (2, 0));
        buffer.word(COUNT).store(10, Ordering::SeqCst);
        assert_eq!(buffer.take(|records, lost| (records.len(), lost)), (0, 112));
        assert_eq!(buffer.take(|records, lost| (records.len(), lost)), (0, 0));
    }
}
