//! Builds the tree: divides draws into groups of equal size where the boxes around both parts are smallest.

use super::{EMPTY, Hierarchy, NOWHERE, Node, WIDTH, is_finite, union};
use glam::{Vec3, Vec4};
use std::ops::Range;

impl Hierarchy {
    /// A tree over the bounds (low and high corner) of draws `0..bounds.len()`.
    ///
    /// The result depends only on the bounds. Draws whose bounds are not finite are kept outside the tree and
    /// are always drawn.
    ///
    /// # Panics
    /// More than 2^30 draws.
    pub fn new(bounds: &[[Vec3; 2]]) -> Self {
        assert!(
            bounds.len() < 1 << 30,
            "a place is a node and a lane in 32 bits"
        );
        let (finite, unbounded): (Vec<u32>, Vec<u32>) =
            (0..bounds.len() as u32).partition(|&draw| is_finite(bounds[draw as usize]));
        let mut tree = Self {
            order: finite,
            place: vec![NOWHERE; bounds.len()],
            unbounded,
            ..Self::default()
        };
        if !tree.order.is_empty() {
            let mut order = std::mem::take(&mut tree.order);
            tree.add(&mut order, 0, bounds);
            tree.order = order;
        }
        tree
    }

    /// Adds a node for `draws`, which start at `begin` in the order. Returns its index.
    fn add(&mut self, draws: &mut [u32], begin: usize, bounds: &[[Vec3; 2]]) -> u32 {
        let number = self.nodes.len();
        self.nodes.push(Node {
            corners: [EMPTY[0], EMPTY[1]].map(|corner| corner.to_array().map(Vec4::splat)),
            child: [0; WIDTH],
            begin: [(begin + draws.len()) as u32; WIDTH + 1],
            count: 0,
        });
        self.parent.push(0);
        // All boxes except the last have complete trees, so that only the last node of a level has gaps.
        let mut unit = 1;
        while unit * WIDTH < draws.len() {
            unit *= WIDTH;
        }
        let mut groups = Vec::with_capacity(WIDTH);
        cut(draws, 0, unit, bounds, &mut groups);
        if unit == 1 {
            draws.sort_unstable();
        }
        for (lane, group) in groups.into_iter().enumerate() {
            let place = (WIDTH * number + lane) as u32;
            let part = &mut draws[group.clone()];
            let around = if let [draw] = part {
                self.place[*draw as usize] = place;
                bounds[*draw as usize]
            } else {
                let child = self.add(part, begin + group.start, bounds);
                self.parent[child as usize] = place;
                self.nodes[number].child[lane] = child;
                self.nodes[child as usize].bounds()
            };
            let node = &mut self.nodes[number];
            node.set_lane(lane, around);
            node.begin[lane] = (begin + group.start) as u32;
            node.count += 1;
        }
        number as u32
    }
}

/// Divides `draws` into groups of `unit` (the last may be smaller) by repeated halving, and appends their
/// ranges. `start` is the position of `draws` in the node's draws.
fn cut(
    draws: &mut [u32],
    start: usize,
    unit: usize,
    bounds: &[[Vec3; 2]],
    groups: &mut Vec<Range<usize>>,
) {
    let count = draws.len().div_ceil(unit);
    if count <= 1 {
        groups.push(start..start + draws.len());
        return;
    }
    let middle = count / 2 * unit;
    let select = |draws: &mut [u32], axis: usize| {
        let twice_center = |draw: u32| {
            let [low, high] = bounds[draw as usize];
            low[axis] + high[axis]
        };
        draws.select_nth_unstable_by(middle, |&a, &b| {
            (twice_center(a).total_cmp(&twice_center(b))).then(a.cmp(&b))
        });
    };
    let cost = |draws: &[u32]| {
        let half_area = |part: &[u32]| {
            let around = part.iter().map(|&d| bounds[d as usize]);
            let [low, high] = around.fold(EMPTY, union);
            let size = high - low;
            f64::from(size.x * size.y + size.y * size.z + size.z * size.x)
        };
        let (low, high) = draws.split_at(middle);
        low.len() as f64 * half_area(low) + high.len() as f64 * half_area(high)
    };
    let mut best = (f64::INFINITY, 0);
    for axis in 0..3 {
        select(draws, axis);
        let cost = cost(draws);
        if cost < best.0 {
            best = (cost, axis);
        }
    }
    if best.1 != 2 {
        select(draws, best.1);
    }
    let (low, high) = draws.split_at_mut(middle);
    cut(low, start, unit, bounds, groups);
    cut(high, start + middle, unit, bounds, groups);
}
