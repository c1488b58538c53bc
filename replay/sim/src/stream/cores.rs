//! The work of each core: the quads of its work item, in order.

use super::expand::TileBuffers;
use super::lines::{ListedRun, interleaved};
use super::{Frame, QuadLines, StreamError, TileLines};
use crate::order::{TileRef, WorkItem};
use std::collections::HashSet;
use std::ops::Range;

/// The cores' work items, and their positions in them.
pub struct Cores<'f> {
    frame: &'f Frame<'f>,
    cores: Vec<Core<'f>>,
    /// Tiles of an item that has not been given to a core.
    upcoming: [Slot<'f>; 2],
}

/// A core's item. The remaining runs are listed in order by tile and run.
#[derive(Debug, Default)]
struct Core<'f> {
    tiles: [Slot<'f>; 2],
    runs: Vec<ListedRun>,
    next_run: usize,
    /// Remaining quads of the current run, and the slot of their tile.
    slot: usize,
    quads: Range<usize>,
}

/// A tile of an item.
#[derive(Debug, Default)]
enum Slot<'f> {
    #[default]
    None,
    /// Lines kept in the frame.
    Kept(&'f TileLines),
    /// Lines expanded for this core.
    Own(Box<TileBuffers>),
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
    pub fn new(frame: &'f Frame<'f>, cores: usize) -> Self {
        Self {
            frame,
            cores: (0..cores).map(|_| Core::default()).collect(),
            upcoming: Default::default(),
        }
    }

    /// Number of cores.
    pub fn count(&self) -> usize {
        self.cores.len()
    }

    /// Assigns the next work item to a core, dropping the rest of its previous one.
    ///
    /// # Errors
    /// An unreadable tile.
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

    /// Up to `most` distinct lines of an item, in order of first use.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn lines_of(&mut self, item: &WorkItem, most: usize) -> Result<Vec<u32>, StreamError> {
        let (mut lines, mut known) = (Vec::new(), HashSet::new());
        for (slot, at) in self.upcoming.iter_mut().zip(item.tiles()) {
            fill(slot, self.frame, at)?;
            let Some(tile) = slot.lines() else { continue };
            // If only distinct lines are listed, they are listed per quad.
            let all = match tile.lines.is_empty() {
                true => &tile.distinct,
                false => &tile.lines,
            };
            lines.extend(all.iter().copied().filter(|&line| known.insert(line)));
        }
        lines.truncate(most);
        Ok(lines)
    }

    /// The quad last returned by [`Self::next_quad`]; none after [`Self::load`].
    #[inline]
    pub fn quad(&self, core: usize) -> Option<QuadLines<'_>> {
        let core = &self.cores[core];
        let quad = core.quads.start.checked_sub(1)?;
        core.tiles[core.slot].lines().map(|tile| tile.quad(quad))
    }

    /// The core's next quad, or none at the end of the item.
    #[inline(always)]
    pub fn next_quad(&mut self, core: usize) -> Option<QuadLines<'_>> {
        let core = &mut self.cores[core];
        loop {
            if let Some(quad) = core.quads.next() {
                return core.tiles[core.slot].lines().map(|tile| tile.quad(quad));
            }
            let &ListedRun { tile, run, part } = core.runs.get(core.next_run)?;
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
