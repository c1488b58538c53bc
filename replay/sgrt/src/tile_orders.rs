//! The order of the tiles of both eyes, and the caches between the frames of a sequence.

use super::cache::{DeviceCaches, Misses};
use super::config::SgrtConfig;
use super::frame::{Frame, FrameError, RaySource};
use super::hardware::{Kept, misses_of};
use super::order_rules::{Choice, Count, Counted, OrderRule, Setting};
use formats::raytrace::RaytraceTables;
use serde::{Deserialize, Serialize};
use sim::config::{BetweenFrames, Order};
use sim::order::curve::Curve;
use sim::order::parts::{Eyes, Parts};
use sim::order::rays::{RayPlan, tiles_of};
use sim::order::{Counters, PlanInputs};
use sim::registry::Row;
use sim::stream::ray_counters;
use std::fmt;
use std::str::FromStr;

/// A tile order for all frames, or a rule that chooses one for each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayOrder {
    /// The same for all frames.
    Fixed(Order),
    /// Chosen for each frame.
    Rule(OrderRule),
}

impl fmt::Display for RayOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed(order) => order.name(),
            Self::Rule(rule) => rule.name(),
        })
    }
}

impl FromStr for RayOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(rule) = OrderRule::find(text) {
            return Ok(Self::Rule(rule));
        }
        let order = Order::by_name(text).map_err(|why| {
            why.unwrap_or_else(|| {
                let names = Order::all().map(Order::name);
                let rules = OrderRule::all().map(OrderRule::name);
                let names: Vec<&str> = names.chain(rules).collect();
                format!(
                    "expected a rule, an order or its parts (docs/models/orders.md), one of {}",
                    names.join(", ")
                )
            })
        })?;
        RayPlan::check(order).map_err(|broken| broken.to_string())?;
        Ok(Self::Fixed(order))
    }
}

/// Help for the option that takes a [`RayOrder`].
pub fn help() -> String {
    let rules = OrderRule::all().map(|rule| format!("\n  {}: {}", rule.name(), rule.row().help()));
    format!(
        "Order of the tiles of both eyes: a name, parts as in zig-zag+sta+offset (docs/models/orders.md), or a rule that \
         chooses one for each frame [default: rows, left and right tile in turn]{}",
        rules.collect::<String>()
    )
}

/// What the results say about the order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TileOrders {
    /// Order or rule; none for the default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<String>,
    /// What happened to the caches before the frame; none if the trace is not part of a sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between_frames: Option<String>,
    /// Number of the frame in the sequence.
    pub frame: u32,
    /// The order of the reference, of the selected rule's run and of plain reuse.
    pub chosen: [String; 3],
    /// The order that a rule tries on the sampled pairs of tiles, for the same runs; none if it tries none.
    pub tried: [Option<String>; 3],
}

/// The tile order of a sequence of frames, and what the frames so far left behind.
#[derive(Default)]
pub struct TileSequence {
    order: Option<RayOrder>,
    between: Option<BetweenFrames>,
    frame: u32,
    /// Tile columns and rows of the last frame.
    tiles: Option<[u32; 2]>,
    counters: Option<Counters>,
    runs: Vec<RunState>,
}

/// One run through all frames.
struct RunState {
    caches: DeviceCaches,
    choice: Choice,
    /// The frames so far, for a rule.
    counted: Vec<Counted>,
    plan: RayPlan,
}

/// The default order.
fn usual_order() -> Order {
    Order::of(Parts::of(Curve::SCANLINE).with(Eyes::InTurn))
}

/// The default plan: row by row, left and right tile in turn.
pub(super) fn usual_plan(tables: &RaytraceTables) -> RayPlan {
    RayPlan::new(usual_order(), &PlanInputs::default(), tables, 0)
}

/// The part of each tile in [`Counted`].
fn parts(tables: &RaytraceTables) -> Vec<usize> {
    let mut parts = vec![0; tables.tile_count() as usize];
    let curve = RayPlan::new(Order::Z2_STA, &PlanInputs::default(), tables, 0);
    for (number, batch) in curve.batches().enumerate() {
        for at in tiles_of(batch) {
            parts[at.tile as usize] = Counted::part_of(number);
        }
    }
    parts
}

impl TileSequence {
    /// The first frame follows. Without `between`, each frame starts with empty caches and is a sequence of its own.
    pub fn new(order: Option<RayOrder>, between: Option<BetweenFrames>) -> Self {
        Self {
            order,
            between,
            ..Self::default()
        }
    }

    /// The plans of the current frame: of the reference, of the selected rule's run and of plain reuse.
    pub(super) fn plans(&self) -> [&RayPlan; 3] {
        [0, 1, 2].map(|run| &self.runs[run].plan)
    }

    /// What the results say about the current frame; nothing without an order and a sequence.
    pub fn report(&self) -> Option<TileOrders> {
        if self.order.is_none() && self.between.is_none() {
            return None;
        }
        let of_run = |run: usize| &self.runs[run];
        let name = |order: Order| order.name().to_owned();
        Some(TileOrders {
            order: self.order.map(|order| order.to_string()),
            between_frames: self.between.map(|between| between.to_string()),
            frame: self.frame,
            chosen: [0, 1, 2].map(|run| name(of_run(run).choice.order)),
            tried: [0, 1, 2].map(|run| of_run(run).choice.sampled.map(name)),
        })
    }

    /// Ends the current frame.
    pub fn advance(&mut self) {
        if self.between.is_none() {
            *self = Self::new(self.order, None);
            return;
        }
        self.frame += 1;
    }

    /// Plans the frame for each run, the first of which traces both eyes in full. `source` is read for an order that needs
    /// counters.
    ///
    /// # Errors
    /// [`FrameError`] for a trace without visits, for another grid than the last frame's, and for an unreadable tile.
    pub(super) fn begin(
        &mut self,
        source: &dyn RaySource,
        frame: &Frame,
        runs: &[(&Kept<'_>, &SgrtConfig)],
    ) -> Result<(), FrameError> {
        let tables = &frame.tables;
        if self.order.is_some() && !tables.meta.has_visits {
            return Err(FrameError::NoVisits("--order"));
        }
        if self.between.is_some() && !tables.meta.has_visits {
            return Err(FrameError::NoVisits("--between"));
        }
        if let Some(expected) = self.tiles.filter(|&tiles| tiles != tables.tiles()) {
            return Err(FrameError::Grid {
                expected,
                found: tables.tiles(),
            });
        }
        self.tiles = Some(tables.tiles());
        let empty = |(_, config): &(&Kept<'_>, &SgrtConfig)| RunState {
            caches: DeviceCaches::new(config),
            choice: Choice::whole(usual_order()),
            counted: Vec::new(),
            plan: RayPlan::default(),
        };
        if self.runs.is_empty() {
            self.runs = runs.iter().map(empty).collect();
        } else if let Some(between) = self.between {
            for (run, (_, config)) in self.runs.iter_mut().zip(runs) {
                run.caches
                    .between_frames(between, self.frame as usize, config);
            }
        }
        let before = self.counters.take();
        let inputs = |config: &SgrtConfig| PlanInputs {
            cores: config.tni.units,
            tile_px: formats::view::TILE_SIZE_PX,
            l2_bytes: config.cache.l2_bytes,
            line_bytes: config.cache.line_bytes as u32,
            meta: Some(&tables.meta.trace),
            ..PlanInputs::default()
        };
        if let (Some(RayOrder::Fixed(order)), Some((_, config))) = (self.order, runs.first())
            && order.parts().needs_counters()
        {
            let own = ray_counters(tables, &inputs(config), |eye, tile, data| {
                let decoded = source.tile(eye, tile, data);
                decoded.map_err(|source| FrameError::Tile { eye, tile, source })
            })?;
            self.counters = Some(own);
        }
        for (number, (run, (_, config))) in self.runs.iter_mut().zip(runs).enumerate() {
            let last = before.as_ref().or(self.counters.as_ref());
            let inputs = PlanInputs {
                last,
                ..inputs(config)
            };
            let plan = |order: Order| RayPlan::new(order, &inputs, tables, self.frame);
            run.choice = match self.order {
                None => Choice::whole(usual_order()),
                Some(RayOrder::Fixed(order)) => Choice::whole(order),
                Some(RayOrder::Rule(rule)) => {
                    run.caches.count(tables.tile_count());
                    let setting = Setting {
                        l2_lines: config.cache.l2_bytes / config.cache.line_bytes,
                        reprojects: number > 0,
                    };
                    (rule.row().choose)(&run.counted, &setting)
                }
            };
            run.plan = plan(run.choice.order);
            if let Some(tried) = run.choice.sampled {
                let parts = parts(tables);
                let is_sampled = |tile: u32| parts[tile as usize] == 0;
                run.plan = run.plan.with_tiles_of(&plan(tried), is_sampled);
            }
        }
        Ok(())
    }

    /// The misses of each run, by eye and tile. Runs of one plan read the trace once.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub(super) fn misses_of(
        &mut self,
        source: &dyn RaySource,
        frame: &Frame,
        runs: &[(&Kept<'_>, &SgrtConfig)],
    ) -> Result<Vec<[Vec<Misses>; 2]>, FrameError> {
        self.begin(source, frame, runs)?;
        let mut found = vec![Default::default(); runs.len()];
        for first in 0..self.runs.len() {
            let plan = self.runs[first].plan.clone();
            if self.runs[..first].iter().any(|run| run.plan == plan) {
                continue;
            }
            let mut choices = Vec::new();
            let mut caches = Vec::new();
            let mut places = Vec::new();
            for (place, run) in self.runs.iter_mut().enumerate() {
                if run.plan == plan {
                    choices.push(runs[place]);
                    caches.push(&mut run.caches);
                    places.push(place);
                }
            }
            let of_plan = misses_of(source, frame, &plan, &choices, &mut caches)?;
            for (place, misses) in places.into_iter().zip(of_plan) {
                found[place] = misses;
            }
        }
        if let Some(RayOrder::Rule(_)) = self.order {
            let part_of = parts(&frame.tables);
            for run in &mut self.runs {
                let mut parts = [Count::default(); 2];
                for (count, part) in run.caches.take_counted().iter().zip(&part_of) {
                    parts[*part].add(count);
                }
                let choice = run.choice;
                run.counted.push(Counted { choice, parts });
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{View, frame};
    use sim::order::WorkItem;

    #[test]
    fn sampled_pairs_have_their_own_order_and_every_tile_comes_once() {
        let tables = frame(&[], View::default()).tables;
        let parts = parts(&tables);
        let size = |part| parts.iter().filter(|of| **of == part).count();
        assert_eq!([0, 1].map(size), [4, 11]);
        let plan = |order| RayPlan::new(order, &PlanInputs::default(), &tables, 0);
        let choices = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];
        for (order, tried) in choices.into_iter().flat_map(|a| choices.map(|b| (a, b))) {
            let mixed = plan(order).with_tiles_of(&plan(tried), |tile| parts[tile as usize] == 0);
            let mut tiles: Vec<_> = mixed.batches().flat_map(tiles_of).collect();
            tiles.sort_unstable_by_key(|at| (at.pass, at.tile));
            let all = (0..2).flat_map(|pass| (0..15).map(move |tile| (pass, tile)));
            assert!(all.eq(tiles.iter().map(|at| (at.pass, at.tile))));
            for item in mixed.batches().flatten() {
                let of_pair = parts[item.tiles().next().unwrap().tile as usize] == 0;
                let expected = if of_pair { tried } else { order } == Order::Z2_STA;
                assert_eq!(matches!(item, WorkItem::Pair(..)), expected);
            }
        }
    }
}
