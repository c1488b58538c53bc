//! The order in which units take the rays of a batch, which are the rays of a tile or of a pair of tiles. Each is a row of
//! the table.
//!
//! Keys of origin and direction are those that Garanzha and Loop sort by ("Fast Ray Sorting and Breadth-First Packet
//! Traversal for GPU Ray Tracing", Eurographics 2010), who sort many more rays at a time.

use super::hardware::RayTurn;
use super::ray_queues;
use formats::raytrace::{BvhSummary, Visit};
use sim::registry::Named;

/// A row of the table of orders.
#[derive(Debug)]
pub struct SortRow {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    order: Order,
    /// Whether the order depends on origins and directions.
    pub(super) needs_geometry: bool,
}

#[derive(Debug)]
enum Order {
    /// Pixel by pixel.
    Pixels,
    /// By a key of two numbers.
    Key(fn(&Spot) -> [u32; 2]),
    /// By the treelet that each ray waits for.
    Queues,
}

impl SortRow {
    /// Whether rays wait for others between their visits.
    pub(super) fn interrupts_rays(&self) -> bool {
        matches!(self.order, Order::Queues)
    }
}

/// A named order of the rays of a batch.
pub type RaySort = Named<SortRow>;

sim::rows! { SortRow:
    RaySort::new(&NONE);
    RaySort::new(&SortRow {
        name: "generation",
        help: "By depth and kind: primary rays first, then their shadow rays, and so on",
        order: Order::Key(|of| [of.generation, 0]),
        needs_geometry: false,
    });
    RaySort::new(&SortRow {
        name: "direction",
        help: "By octant of the direction, then by origin along a Morton curve",
        order: Order::Key(|of| [of.octant, of.cell]),
        needs_geometry: true,
    });
    RaySort::new(&SortRow {
        name: "origin",
        help: "By origin along a Morton curve, then by octant of the direction",
        order: Order::Key(|of| [of.cell, of.octant]),
        needs_geometry: true,
    });
    RaySort::new(&SortRow {
        name: "treelet",
        help: "By the part of the hierarchy, as large as a node cache, that each ray visits next",
        order: Order::Queues,
        needs_geometry: false,
    });
}

static NONE: SortRow = SortRow {
    name: "none",
    help: "Pixel by pixel, each with its whole tree of rays",
    order: Order::Pixels,
    needs_geometry: false,
};

/// The order without sorting.
pub fn none() -> RaySort {
    RaySort::new(&NONE)
}

/// Cells of the Morton curve along each axis of the box of a batch's origins, as a power of two.
const CELL_BITS: u32 = 5;

/// What rays are sorted by.
#[derive(Default)]
struct Spot {
    /// Depth and kind.
    generation: u32,
    octant: u32,
    cell: u32,
}

/// Sorts the rays of a batch, whose node caches have `node_l1_bytes`. Equal ones keep their order.
pub(super) fn sort<'a>(
    by: RaySort,
    mut turns: Vec<RayTurn<'a>>,
    (bvh, node_l1_bytes): (&BvhSummary, u64),
) -> Vec<RayTurn<'a>> {
    let key = match &by.row().order {
        Order::Pixels => return turns,
        Order::Queues => {
            return ray_queues::queued(turns, |node| {
                bvh.address(Visit::Node(node)) / node_l1_bytes
            });
        }
        Order::Key(key) => key,
    };
    let origins = turns.iter().filter_map(|turn| Some(turn.geometry?.origin));
    let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
    for origin in origins {
        low = std::array::from_fn(|axis| low[axis].min(origin[axis]));
        high = std::array::from_fn(|axis| high[axis].max(origin[axis]));
    }
    let spot = |turn: &RayTurn<'_>| {
        let mut spot = Spot {
            generation: u32::from(turn.ray.depth) << 8 | turn.ray.kind as u32,
            ..Spot::default()
        };
        let Some(geometry) = turn.geometry else {
            return spot;
        };
        for axis in 0..3 {
            let within = (geometry.origin[axis] - low[axis]) / (high[axis] - low[axis]);
            // NaN in a box without extent becomes 0.
            let cell = (within * (1 << CELL_BITS) as f32) as u32;
            let cell = cell.min((1 << CELL_BITS) - 1);
            let spread = (0..CELL_BITS).map(|bit| (cell >> bit & 1) << (3 * bit + axis as u32));
            spot.cell |= spread.sum::<u32>();
            spot.octant |= u32::from(geometry.direction[axis] < 0.0) << axis;
        }
        spot
    };
    turns.sort_by_cached_key(|turn| key(&spot(turn)));
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::raytrace::{RayGeometry, RayKind, RayRecord};
    use sim::order::TileRef;

    /// Names of rays in the order of a sort.
    fn sorted(by: &str) -> String {
        let rays = [
            ("a", RayKind::Primary, 0, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ("b", RayKind::Diffuse, 1, [9.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            ("c", RayKind::Shadow, 2, [9.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ("d", RayKind::Primary, 0, [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            ("e", RayKind::Diffuse, 1, [0.0, 0.0, 8.0], [1.0, 0.0, 0.0]),
            ("f", RayKind::Shadow, 1, [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
            ("g", RayKind::Diffuse, 1, [0.0, 0.0, 7.0], [-1.0, 0.0, 0.0]),
        ];
        let records = rays.map(|(_, kind, depth, ..)| RayRecord {
            kind,
            depth,
            ..RayRecord::default()
        });
        let geometry = rays.map(|(.., origin, direction)| RayGeometry {
            origin,
            direction,
            ..RayGeometry::default()
        });
        let turn = |sample: usize| RayTurn {
            at: TileRef { pass: 0, tile: 0 },
            sample,
            unit: 0,
            ray: &records[sample],
            is_first: false,
            visits: &[],
            geometry: Some(&geometry[sample]),
        };
        let turns: Vec<_> = (0..rays.len()).map(turn).collect();
        let turns = sort(
            RaySort::find(by).unwrap(),
            turns,
            (&BvhSummary::default(), 1),
        );
        turns.iter().map(|turn| rays[turn.sample].0).collect()
    }

    #[test]
    fn rays_are_sorted_by_generation_direction_or_origin() {
        assert_eq!(sorted("none"), "abcdefg");
        assert_eq!(sorted("generation"), "adfbegc");
        assert_eq!(sorted("direction"), "acedbgf");
        assert_eq!(sorted("origin"), "adfcbge");
    }
}
