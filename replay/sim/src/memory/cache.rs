//! The interface of all caches.
//!
//! Lines are identified by number (address over line size). An access takes two steps, because a
//! missing line is filled only after the miss penalty: [`Cache::lookup`] when it is requested,
//! [`Cache::fill`] when it arrives.

use super::recorded::Change;

/// Tag of an empty way; no line has this number.
pub const EMPTY: u32 = u32::MAX;

/// A cache of whole lines. Its state after a series of look-ups depends only on the order of the
/// last look-up of each resident line, so earlier look-ups need no simulation.
pub trait Cache: Send {
    /// Returns true for a hit and marks the line as used.
    fn lookup(&mut self, line: u32) -> bool;

    /// Returns true if the line is resident. Changes nothing.
    fn contains(&self, line: u32) -> bool;

    /// Looks up lines until one misses, and returns the index of that line.
    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        lines.iter().position(|&line| !self.lookup(line))
    }

    /// Inserts a line that is not resident. Returns the evicted line, or [`EMPTY`].
    fn fill(&mut self, line: u32) -> u32;

    /// Removes a line. Returns true if it was resident.
    fn remove(&mut self, line: u32) -> bool;

    /// Appends the lines evicted since the last call, if the cache records them.
    fn take_evicted(&mut self, _lines: &mut Vec<u32>) {}

    /// Appends the changes of its content since the last call, if the cache records them.
    fn take_changes(&mut self, _changes: &mut Vec<Change>) {}

    /// Removes all lines.
    fn clear(&mut self);

    /// Looks up a line and fills it immediately on a miss. Returns true for a hit.
    fn access(&mut self, line: u32) -> bool {
        let hit = self.lookup(line);
        if !hit {
            self.fill(line);
        }
        hit
    }

    /// Up to this many distinct lines accessed in sequence are all resident afterwards, and
    /// repeating the sequence changes nothing. Such repeats need no simulation.
    fn repeat_safe_lines(&self) -> u32 {
        1
    }
}

impl Cache for Box<dyn Cache> {
    fn lookup(&mut self, line: u32) -> bool {
        (**self).lookup(line)
    }

    fn contains(&self, line: u32) -> bool {
        (**self).contains(line)
    }

    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        (**self).lookup_all(lines)
    }

    fn fill(&mut self, line: u32) -> u32 {
        (**self).fill(line)
    }

    fn remove(&mut self, line: u32) -> bool {
        (**self).remove(line)
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        (**self).take_evicted(lines);
    }

    fn take_changes(&mut self, changes: &mut Vec<Change>) {
        (**self).take_changes(changes);
    }

    fn clear(&mut self) {
        (**self).clear();
    }

    fn access(&mut self, line: u32) -> bool {
        (**self).access(line)
    }

    fn repeat_safe_lines(&self) -> u32 {
        (**self).repeat_safe_lines()
    }
}

/// Empties the way that holds a line, and returns its index.
pub(super) fn empty_way(tags: &mut [u32], line: u32) -> Option<usize> {
    let way = tags.iter().position(|&tag| tag == line)?;
    tags[way] = EMPTY;
    Some(way)
}
