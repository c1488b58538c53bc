//! Drops look-ups of the line that was looked up before: they find it in every cache of every policy
//! and change nothing.

use super::lines::{BLOCK, LineBlock};
use formats::interop::plain::AccessKind;

/// Look-ups of which no two neighbours are the same line.
pub struct Distinct<'a> {
    /// The lines.
    pub lines: &'a [u32],
    /// What the first of the look-ups of each was for; empty if all are reads.
    kinds: &'a [AccessKind],
}

impl Distinct<'_> {
    /// Counts the look-ups at these places by kind.
    pub fn count(&self, places: &[u16], counts: &mut [u64; 3]) {
        if self.kinds.is_empty() {
            counts[AccessKind::Read as usize] += places.len() as u64;
            return;
        }
        for &place in places {
            counts[self.kinds[usize::from(place)] as usize] += 1;
        }
    }

    /// What the look-up at a place is for.
    pub fn kind(&self, place: usize) -> AccessKind {
        self.kinds.get(place).copied().unwrap_or_default()
    }
}

/// Drops repeats, also those of the last line of the block before.
pub struct Repeats {
    /// `u32::MAX` is no line.
    last: u32,
    lines: Box<[u32; BLOCK]>,
    kinds: Vec<AccessKind>,
}

impl Default for Repeats {
    fn default() -> Self {
        Self {
            last: u32::MAX,
            lines: Box::new([0; BLOCK]),
            kinds: Vec::with_capacity(BLOCK),
        }
    }
}

impl Repeats {
    /// What is left of a block.
    pub fn drop_from(&mut self, block: &LineBlock<'_>) -> Distinct<'_> {
        self.kinds.clear();
        let mut last = self.last;
        for (&line, &kind) in block.lines.iter().zip(block.kinds) {
            if line != last {
                self.kinds.push(kind);
            }
            last = line;
        }
        let (mut last, mut count) = (self.last, 0);
        for &line in block.lines {
            // No branch: whether a line repeats is a coin toss to the processor.
            self.lines[count % BLOCK] = line;
            count += usize::from(line != last);
            last = line;
        }
        self.last = last;
        Distinct {
            lines: &self.lines[..count],
            kinds: &self.kinds,
        }
    }
}
