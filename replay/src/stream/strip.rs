//! Leaves out what no cache notices: an access to the line that was the last one of its set.
//!
//! With fewer sets, more lines share one, so a line that came last in its set of a cache of few sets did so
//! in every cache of more. It is there, and asking for it again changes nothing, whatever the policy: where
//! misses fill at once, neither hits nor victims change if the access is left out (Puzak's trace stripping).
//!
//! What a core did before a primitive depends on the order, so each primitive starts without a past.

use super::lines::{Tag, TileLines};

/// Most sets that are looked at: more would leave out little more and take longer to empty.
const MOST_SETS: usize = 64;

/// No line has this number.
const NONE: u32 = u32::MAX;

/// The line used last of each set.
#[derive(Debug)]
pub(super) struct Strip {
    last: [u32; MOST_SETS],
    set_mask: usize,
}

impl Strip {
    /// For caches of at least `sets` sets, a power of two.
    pub fn new(sets: u32) -> Self {
        Self {
            last: [NONE; MOST_SETS],
            set_mask: (sets as usize).min(MOST_SETS) - 1,
        }
    }

    /// A primitive starts.
    pub fn begin(&mut self) {
        self.last = [NONE; MOST_SETS];
    }

    /// Appends what a cache may notice of a footprint that is asked for so many times.
    #[inline(always)]
    pub fn list(
        &mut self,
        cell: u32,
        lines: impl Iterator<Item = u32> + Clone,
        times: u32,
        out: &mut TileLines,
    ) {
        let [first, other] = Tag::of_footprint(cell, 0);
        for _ in 0..times {
            let mut tag = first;
            for line in lines.clone() {
                let last = &mut self.last[line as usize & self.set_mask & (MOST_SETS - 1)];
                if *last != line {
                    *last = line;
                    out.lines.push(line);
                    out.tags.push(tag);
                    tag = other;
                }
            }
            // Unless its lines crowd each other out, the next time finds them all.
            if tag == first {
                break;
            }
        }
    }
}
