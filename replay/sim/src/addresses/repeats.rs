//! Drops repeated look-ups of the previous line, which hit in every cache of every policy and change nothing.

use super::lines::{BLOCK, LineBlock};
use crate::stream::Tag;
use formats::interop::plain::AccessKind;

/// Drops repeats, also across blocks.
pub(super) struct Repeats {
    /// The previous line, or `u32::MAX` for none.
    last: u32,
    drops: bool,
    lines: Box<[u32; BLOCK]>,
    tags: Vec<Tag>,
    /// The tag of a read, repeated.
    reads: Box<[Tag; BLOCK]>,
}

impl Repeats {
    /// Without `drops`, all look-ups are kept.
    pub fn new(drops: bool) -> Self {
        Self {
            last: u32::MAX,
            drops,
            lines: Box::new([0; BLOCK]),
            tags: Vec::with_capacity(BLOCK),
            reads: Box::new([tag(AccessKind::Read); BLOCK]),
        }
    }

    /// The remaining lines of a block, each with a tag for its kind of access.
    #[inline(always)]
    pub(super) fn drop_from<'a>(&'a mut self, block: &LineBlock<'a>) -> (&'a [u32], &'a [Tag]) {
        self.tags.clear();
        if !self.drops {
            self.tags.extend(block.kinds.iter().map(|&kind| tag(kind)));
            return (block.lines, self.tags_of(block.lines.len()));
        }
        let mut last = self.last;
        for (&line, &kind) in block.lines.iter().zip(block.kinds) {
            if line != last {
                self.tags.push(tag(kind));
            }
            last = line;
        }
        let (mut last, mut count) = (self.last, 0);
        for &line in block.lines {
            // Branch-free: whether a line repeats is unpredictable.
            self.lines[count % BLOCK] = line;
            count += usize::from(line != last);
            last = line;
        }
        self.last = last;
        (&self.lines[..count], self.tags_of(count))
    }

    /// The tags of a block, which are all reads if it has no kinds.
    fn tags_of(&self, count: usize) -> &[Tag] {
        match self.tags.is_empty() {
            true => &self.reads[..count],
            false => &self.tags,
        }
    }
}

/// Kinds correspond to the cells of [`crate::stream::Bins::of_kinds`].
fn tag(kind: AccessKind) -> Tag {
    Tag::of_line(kind as u32)
}
