//! Drops look-ups of the line that was looked up before: they find it in every cache of every policy
//! and change nothing.

use super::lines::{BLOCK, LineBlock};
use crate::stream::Tag;
use formats::interop::plain::AccessKind;

/// Drops repeats, also those of the last line of the block before.
pub struct Repeats {
    /// `u32::MAX` is no line.
    last: u32,
    drops: bool,
    lines: Box<[u32; BLOCK]>,
    tags: Vec<Tag>,
    /// The tags of reads alone.
    reads: Box<[Tag; BLOCK]>,
}

impl Repeats {
    /// Without `drops` all look-ups are kept.
    pub fn new(drops: bool) -> Self {
        Self {
            last: u32::MAX,
            drops,
            lines: Box::new([0; BLOCK]),
            tags: Vec::with_capacity(BLOCK),
            reads: Box::new([tag(AccessKind::Read); BLOCK]),
        }
    }

    /// The lines that are left of a block, and a tag for each with its kind of access.
    #[inline(always)]
    pub fn drop_from<'a>(&'a mut self, block: &LineBlock<'a>) -> (&'a [u32], &'a [Tag]) {
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
            // No branch: whether a line repeats is unpredictable.
            self.lines[count % BLOCK] = line;
            count += usize::from(line != last);
            last = line;
        }
        self.last = last;
        (&self.lines[..count], self.tags_of(count))
    }

    /// Without tags of its own, a block has reads alone.
    fn tags_of(&self, count: usize) -> &[Tag] {
        match self.tags.is_empty() {
            true => &self.reads[..count],
            false => &self.tags,
        }
    }
}

/// Kinds are the cells of [`crate::stream::Bins::of_kinds`].
fn tag(kind: AccessKind) -> Tag {
    Tag::of_line(kind as u32)
}
