//! Searches for better orders of a frame, given the frame's accesses.

use super::anneal::anneal;
use super::greedy::greedy;
use super::items::Lru;
use super::stream::lines_of_items;
use super::{Items, OrderFile};
use sim::config::{Order, RunConfig};
use sim::engine::ReplayError;
use sim::order::{Phase, Views, WorkItem, views};
use sim::stream::{Expander, LineMemory, TileSource, Walk, rendered};
use std::collections::HashMap;

pub use super::anneal::Schedule;

/// A search method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Always takes the item of which the cache holds the largest share, among the next `ahead` remaining
    /// items.
    Greedy {
        /// The look-ahead in items; none for all items.
        ahead: Option<u32>,
    },
    /// Annealing from the order that the search starts from.
    Anneal(Schedule),
}

impl Method {
    /// Name of the orders that it finds.
    pub fn name(self) -> String {
        match self {
            Self::Greedy { ahead: None } => "greedy".to_owned(),
            Self::Greedy { ahead: Some(ahead) } => format!("greedy-{ahead}"),
            Self::Anneal(_) => "anneal".to_owned(),
        }
    }

    /// The method of that name.
    pub fn find(name: &str, schedule: &Schedule) -> Option<Self> {
        match name {
            "greedy" => Some(Self::Greedy { ahead: None }),
            "anneal" => Some(Self::Anneal(*schedule)),
            _ => {
                let ahead = name.strip_prefix("greedy-")?.parse().ok();
                ahead
                    .filter(|ahead| *ahead > 0)
                    .map(|ahead| Self::Greedy { ahead: Some(ahead) })
            }
        }
    }
}

/// The items of a frame's pair of views, in the order from which searches start, and their lines.
pub struct Ground {
    items: Vec<WorkItem>,
    lines: Items,
    /// The neighbours of each item: right, left, below, above.
    beside: Vec<[Option<u32>; 4]>,
    config: RunConfig,
}

impl Ground {
    /// Reads the items of the first pair of views of a frame; none if the frame has no pair.
    ///
    /// # Errors
    /// An impossible configuration, or an unreadable trace.
    pub fn new(
        trace: &dyn TileSource,
        start: Order,
        frame: u32,
        config: &RunConfig,
    ) -> Result<Option<Self>, ReplayError> {
        config.validate()?;
        let rendered = rendered(trace, config)?;
        let passes = &TileSource::tables(&rendered).passes;
        let phases = views(passes, frame);
        let Some(pair) = phases
            .iter()
            .position(|phase| matches!(phase, Views::Pair(..)))
        else {
            return Ok(None);
        };
        let expander = Expander::new(&rendered, config)?;
        let memory = LineMemory::new(LineMemory::USUAL_BYTES);
        let mut walk = Walk::new(&expander, &memory, config, [start]);
        let expanded = walk.expand(frame)?;
        let order = RunConfig {
            order: start,
            ..*config
        };
        let items: Phase = walk.plan(&expanded)?.phases(&order).swap_remove(pair);
        let lines = Items::new(&lines_of_items(&expanded, &items, config)?);
        let place = |item: &WorkItem| {
            let at = item.tiles().next()?;
            let columns = passes.get(at.pass as usize)?.tiles[0];
            Some((at.pass, at.tile % columns, at.tile / columns))
        };
        let places: Vec<_> = items.iter().map(place).collect();
        let at: HashMap<_, u32> = places.iter().copied().zip(0..).collect();
        let beside = |place: &Option<(u32, u32, u32)>| {
            let (pass, x, y) = place.unwrap_or_default();
            let neighbours = [(1, 0), (-1, 0), (0, 1), (0, -1)];
            neighbours.map(|(dx, dy)| {
                let to = (pass, x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
                at.get(&Some(to)).copied()
            })
        };
        let beside = places.iter().map(beside).collect();
        Ok(Some(Self {
            items,
            lines,
            beside,
            config: *config,
        }))
    }

    /// The lines of the items.
    pub fn lines(&self) -> &Items {
        &self.lines
    }

    /// Searches an order for an L2 of this size with the configured ways.
    ///
    /// # Errors
    /// An impossible L2 size.
    pub fn search(
        &self,
        method: Method,
        l2_bytes: u64,
        trace: &str,
    ) -> Result<OrderFile, ReplayError> {
        let mut l2 = self.config.level.l2;
        l2.size_bytes = l2_bytes;
        let sets = l2.sets("L2", self.config.line_bytes)?;
        let cache = Lru::new(&self.lines, sets, l2.ways);
        let start: Vec<u32> = (0..self.items.len() as u32).collect();
        let order = match method {
            Method::Greedy { ahead } => {
                let ahead = ahead.map_or(usize::MAX, |ahead| ahead as usize);
                greedy(&self.lines, &cache, &start, ahead)
            }
            Method::Anneal(schedule) => {
                let beside = |item: u32, side: usize| self.beside[item as usize][side % 4];
                anneal(&self.lines, &cache, start, &schedule, &beside)
            }
        };
        Ok(OrderFile {
            trace: trace.to_owned(),
            name: method.name(),
            l2_bytes,
            items: order
                .iter()
                .map(|&item| self.items[item as usize])
                .collect(),
        })
    }
}
