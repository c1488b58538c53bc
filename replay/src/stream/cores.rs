//! What each core works on: the quads of its work item, one after another.

use super::expand::Work;
use super::lines::{Listed, interleaved};
use super::{Frame, QuadLines, StreamError, TileLines};
use crate::order::{TileRef, WorkItem};
use std::collections::HashSet;
use std::ops::Range;

/// The cores' work items and their positions in them.
pub struct Cores<'f> {
    frame: &'f Frame<'f>,
    cores: Vec<Core<'f>>,
    /// Tiles of an item that no core has yet.
    upcoming: [Slot<'f>; 2],
}

/// A core's item. Runs are left to do in order: which tile, which run.
#[derive(Debug, Default)]
struct Core<'f> {
    tiles: [Slot<'f>; 2],
    runs: Vec<Listed>,
    next_run: usize,
    /// Quads of the current run that are left, and the tile that they are of.
    slot: usize,
    quads: Range<usize>,
}

/// A tile of an item.
#[derive(Debug, Default)]
enum Slot<'f> {
    #[default]
    None,
    /// From the frame.
    Kept(&'f TileLines),
    /// Expanded for this core.
    Own(Box<Work>),
}

impl Slot<'_> {
    #[inline(always)]
    fn lines(&self) -> Option<&TileLines> {
        match self {
            Self::None => None,
            Self::Kept(lines) => Some(lines),
            Self::Own(work) => Some(&work.lines),
        }
    }
}

impl<'f> Cores<'f> {
    /// Idle cores.
    #[must_use]
    pub fn new(frame: &'f Frame<'f>, cores: usize) -> Self {
        Self {
            frame,
            cores: (0..cores).map(|_| Core::default()).collect(),
            upcoming: Default::default(),
        }
    }

    /// Number of cores.
    #[must_use]
    pub fn count(&self) -> usize {
        self.cores.len()
    }

    /// Gives a core its next work item. Whatever was left of the last one is dropped.
    ///
    /// # Errors
    /// A tile that cannot be read.
    pub fn load(&mut self, core: usize, item: &WorkItem) -> Result<(), StreamError> {
        let frame = self.frame;
        let core = &mut self.cores[core];
        for (slot, at) in core.tiles.iter_mut().zip(item.tiles()) {
            fill(slot, frame, at)?;
        }
        core.runs.clear();
        core.next_run = 0;
        core.slot = 0;
        core.quads = 0..0;
        let [left, right] = core.tiles.each_ref().map(Slot::lines);
        match (*item, left, right) {
            (WorkItem::Pair(_, _, interleave), Some(left), Some(right)) => {
                let lists = [&mut left.list(), &mut right.list()];
                let lists = lists.map(|list| list as &mut dyn Iterator<Item = _>);
                interleaved(interleave, lists, &mut core.runs);
            }
            (_, left, _) => core.quads = 0..left.map_or(0, TileLines::quad_count),
        }
        Ok(())
    }

    /// The distinct lines of an item, up to so many, in the order of their first use.
    ///
    /// # Errors
    /// A tile that cannot be read.
    pub fn lines_of(&mut self, item: &WorkItem, most: usize) -> Result<Vec<u32>, StreamError> {
        let (mut lines, mut known) = (Vec::new(), HashSet::new());
        for (slot, at) in self.upcoming.iter_mut().zip(item.tiles()) {
            fill(slot, self.frame, at)?;
            let Some(tile) = slot.lines() else { continue };
            // Where only distinct lines are listed, quad by quad.
            let all = match tile.lines.is_empty() {
                true => &tile.distinct,
                false => &tile.lines,
            };
            lines.extend(all.iter().copied().filter(|&line| known.insert(line)));
        }
        lines.truncate(most);
        Ok(lines)
    }

    /// The quad that [`Self::next_quad`] gave last; none after [`Self::load`].
    #[inline]
    #[must_use]
    pub fn quad(&self, core: usize) -> Option<QuadLines<'_>> {
        let core = &self.cores[core];
        let quad = core.quads.start.checked_sub(1)?;
        core.tiles[core.slot].lines().map(|tile| tile.quad(quad))
    }

    /// The core's next quad, until the item is done.
    #[inline(always)]
    pub fn next_quad(&mut self, core: usize) -> Option<QuadLines<'_>> {
        let core = &mut self.cores[core];
        loop {
            if let Some(quad) = core.quads.next() {
                return core.tiles[core.slot].lines().map(|tile| tile.quad(quad));
            }
            let &Listed { tile, run, part } = core.runs.get(core.next_run)?;
            core.next_run += 1;
            core.slot = usize::from(tile);
            core.quads = core.tiles[core.slot].lines()?.run(run as usize, part);
        }
    }
}

fn fill<'f>(slot: &mut Slot<'f>, frame: &'f Frame<'f>, at: TileRef) -> Result<(), StreamError> {
    if let Some(kept) = frame.kept(at) {
        if !kept.distinct.is_empty() {
            kept.touch();
        }
        *slot = Slot::Kept(kept);
        return Ok(());
    }
    let expander = frame.expander();
    if !matches!(slot, Slot::Own(_)) {
        *slot = Slot::Own(Box::new(expander.work()));
    }
    if let Slot::Own(work) = slot {
        expander.expand(at, work)?;
        frame.keep(at, &work.lines);
    }
    Ok(())
}
