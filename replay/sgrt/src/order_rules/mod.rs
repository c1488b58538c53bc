//! Rules that choose the tile order of the next frame from counters of the frames before. One a file, each a row of the
//! table.

mod trials;

use sim::config::Order;
use sim::registry::Named;

/// A row of the table of rules.
#[derive(Debug)]
pub struct RuleRow {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// The orders of the next frame, given the frames before.
    pub choose: fn(&[Counted], &Setting) -> Choice,
}

/// A rule.
pub type OrderRule = Named<RuleRow>;

sim::rows! { RuleRow: OrderRule::new(&trials::ROW); }

/// What the driver knows without counters.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Lines of the L2.
    pub l2_lines: u64,
    /// True if the right eye reuses the left eye's pixels.
    pub reprojects: bool,
}

/// The orders of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Of all pairs of tiles, except those of a sample.
    pub order: Order,
    /// The order of the sampled pairs, if it is another one. It must trace a pair's tiles together.
    pub sampled: Option<Order>,
}

impl Choice {
    /// One order for all pairs.
    pub fn whole(order: Order) -> Self {
        Self {
            order,
            sampled: None,
        }
    }
}

/// Lines of the hierarchy that are read in a part of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// All of them, which no order changes.
    pub read: u64,
    /// Those that the L2 fetches.
    pub fetched: u64,
}

impl Count {
    /// Adds another part.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, read, fetched);
    }

    /// The fetched lines per line read, relative to those of another frame's part. Parts without lines are equal.
    pub fn over(&self, other: &Self) -> f64 {
        let rate = |of: &Self| of.fetched.max(1) as f64 / of.read.max(1) as f64;
        rate(self) / rate(other)
    }
}

/// A frame, its orders and its counters.
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    /// Its orders.
    pub choice: Choice,
    /// The sampled pairs and the other pairs.
    pub parts: [Count; 2],
}

impl Counted {
    /// The share of the sample in all pairs.
    pub const SAMPLE_SHARE: f64 = 0.25;

    /// The part of the pair with a number on the Morton curve. Neighbours are sampled together.
    pub fn part_of(number: usize) -> usize {
        usize::from(number % 8 > 1)
    }

    /// Fetched lines of the whole frame.
    pub fn fetched(&self) -> u64 {
        self.parts.iter().map(|part| part.fetched).sum()
    }
}
