//! Records the tiles that each core works on over time, for `replay run --timeline`.

use crate::memory::SecondLevel;
use crate::order::WorkItem;
use crate::result::{TileAt, Timeline, TimelineItem};
use crate::tmu::PipelineStats;

/// The items recorded so far.
#[derive(Clone, Debug)]
pub struct Recorder {
    timeline: Timeline,
    /// Counters at the start of each core's current item.
    at_start: Vec<Option<(u64, PipelineStats, Vec<TileAt>)>>,
}

impl Recorder {
    /// An empty record.
    pub fn new(cores: usize) -> Self {
        Self {
            timeline: Timeline::default(),
            at_start: vec![None; cores],
        }
    }

    /// Ends the core's current item, if any, and starts another.
    pub fn start(&mut self, core: usize, cycle: u64, stats: PipelineStats, item: &WorkItem) {
        self.end(core, cycle, stats);
        let tile = |at: crate::order::TileRef| TileAt {
            pass: at.pass,
            tile: at.tile,
        };
        self.at_start[core] = Some((cycle, stats, item.tiles().map(tile).collect()));
    }

    /// Ends the core's current item, if any.
    pub fn end(&mut self, core: usize, cycle: u64, stats: PipelineStats) {
        let Some((start_cycle, before, tiles)) = self.at_start[core].take() else {
            return;
        };
        self.timeline.items.push(TimelineItem {
            core: core as u32,
            start_cycle,
            end_cycle: cycle,
            useful_cycles: stats.useful - before.useful,
            wasted_cycles: stats.wasted - before.wasted,
            tiles,
        });
    }

    /// All items, sorted by start and core, and what the L2 recorded.
    pub fn timeline<D>(&self, l2: &SecondLevel<D>) -> Timeline {
        let mut timeline = self.timeline.clone();
        (timeline.items).sort_by_key(|item| (item.start_cycle, item.core));
        timeline.fetched_lines = l2.fetched_lines().to_vec();
        timeline.l2_changes = l2.changes().to_vec();
        timeline
    }
}
