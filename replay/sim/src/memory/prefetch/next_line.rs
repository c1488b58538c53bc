//! Tagged next-line prefetching (Smith, Cache Memories, ACM Computing Surveys 1982, section 2.1): a
//! miss and the first use of a prefetched line fetch the following lines.

use super::{Demand, Prefetcher};

/// Fetches this many following lines.
pub(super) struct NextLine {
    pub lines: u32,
}

impl Prefetcher for NextLine {
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>) {
        if demand != Demand::Hit {
            lines.extend((1..=self.lines).map_while(|next| line.checked_add(next)));
        }
    }
}
