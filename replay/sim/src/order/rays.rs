//! Tile orders of ray traces: the tiles of both eyes are those of passes 0 and 1 of one frame.

use super::{Interleave, Order, PlanInputs, TileRef, WorkItem, plan_frame};
use formats::Broken;
use formats::raytrace::RaytraceTables;
use formats::textrace::{Pass, PassKind};
use formats::view::Eye;
use std::collections::BTreeMap;

/// The passes that stand for the eyes of a ray trace.
pub fn ray_passes(tables: &RaytraceTables, frame: u32) -> [Pass; 2] {
    [Eye::Left, Eye::Right].map(|eye| Pass {
        frame,
        kind: PassKind::Main,
        eye: Some(eye),
        layer: 0,
        size_px: tables.camera(eye).size_px,
        tiles: tables.tiles(),
    })
}

/// The eye of a tile of a ray trace.
pub fn eye_of(at: TileRef) -> Eye {
    if at.pass == 0 { Eye::Left } else { Eye::Right }
}

/// The tiles of a ray trace in an order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RayPlan {
    items: Vec<WorkItem>,
    /// Items that are traced at the same time, each by a unit of its own; 1 if all units share each tile.
    items_per_batch: usize,
    has_own_units: bool,
}

/// A pixel of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// Position of its tile among the batch's tiles.
    pub tile: usize,
    /// Its record in the tile.
    pub pixel: usize,
    /// Number of the unit that traces it, to be taken modulo the units.
    pub unit: usize,
}

impl RayPlan {
    /// The tiles of a frame. If the order has an assignment, each unit traces whole items; otherwise the pixels of each
    /// tile go to all units in turn. `inputs.cores` is the number of units.
    pub fn new(order: Order, inputs: &PlanInputs<'_>, tables: &RaytraceTables, frame: u32) -> Self {
        let has_own_units = order.parts().assignment.is_some();
        Self {
            items: plan_frame(order, inputs, &ray_passes(tables, frame), frame).concat(),
            items_per_batch: if has_own_units {
                inputs.cores.max(1) as usize
            } else {
                1
            },
            has_own_units,
        }
    }

    /// This plan, in which `other` takes the place of the items of some tiles. Neither has an assignment, and both pair
    /// equal tile numbers.
    #[must_use]
    pub fn with_tiles_of(&self, other: &Self, has: impl Fn(u32) -> bool) -> Self {
        let tile_of = |item: &WorkItem| item.tiles().next().map_or(0, |at| at.tile);
        let mut theirs: BTreeMap<u32, Vec<WorkItem>> = BTreeMap::new();
        for item in other.items.iter().filter(|item| has(tile_of(item))) {
            theirs.entry(tile_of(item)).or_default().push(*item);
        }
        let replaced = |item: &WorkItem| {
            let tile = tile_of(item);
            if has(tile) {
                theirs.remove(&tile).unwrap_or_default()
            } else {
                vec![*item]
            }
        };
        Self {
            items: self.items.iter().flat_map(replaced).collect(),
            ..*self
        }
    }

    /// Checks that an order can be applied to rays.
    ///
    /// # Errors
    /// The order sorts by primitives, which rays find only by tracing.
    pub fn check(order: Order) -> Result<(), Broken> {
        if order.parts().eyes != super::parts::Eyes::OneCore(Interleave::Merge) {
            return Ok(());
        }
        let expected = "sv, lrta, sta or halves for rays, whose primitives are not known before";
        Err(Broken::new("eyes part", expected, order.name()))
    }

    /// The items that the units trace at the same time, batch by batch.
    pub fn batches(&self) -> impl Iterator<Item = &[WorkItem]> {
        self.items.chunks(self.items_per_batch.max(1))
    }

    /// The pixels of a batch in the order in which their rays start, given the pixels of each of its tiles. Two tiles of
    /// one item alternate by pixels, or by halves with [`Interleave::Halves`].
    pub fn turns(&self, batch: &[WorkItem], pixels: &[usize]) -> Vec<Turn> {
        let mut first = 0;
        let of_item = |item: &WorkItem| {
            let tiles = first..first + item.tiles().count();
            first = tiles.end;
            let longest = tiles.clone().map(|tile| pixels[tile]).max().unwrap_or(0);
            let step = match item {
                WorkItem::Tile(_) => longest,
                WorkItem::Pair(.., Interleave::Halves) => longest.div_ceil(2),
                WorkItem::Pair(..) => 1,
            };
            let starts = (0..longest).step_by(step.max(1));
            let chunks = starts.flat_map(|from| tiles.clone().map(move |tile| (tile, from)));
            chunks
                .flat_map(|(tile, from)| {
                    (from..(from + step).min(pixels[tile])).map(move |pixel| (tile, pixel))
                })
                .collect()
        };
        let lists: Vec<Vec<(usize, usize)>> = batch.iter().map(of_item).collect();
        let longest = lists.iter().map(Vec::len).max().unwrap_or(0);
        let mut turns = Vec::with_capacity(pixels.iter().sum());
        for at in 0..longest {
            for (item, list) in lists.iter().enumerate() {
                turns.extend(list.get(at).map(|&(tile, pixel)| Turn {
                    tile,
                    pixel,
                    unit: if self.has_own_units { item } else { pixel },
                }));
            }
        }
        turns
    }
}

/// All tiles of a batch.
pub fn tiles_of(batch: &[WorkItem]) -> impl Iterator<Item = TileRef> {
    batch.iter().flat_map(WorkItem::tiles)
}
