//! A tree over the world-space bounds of a scene's draws, which is kept between frames.
//!
//! A node has four boxes, with one array per coordinate, so that a volume is tested against four boxes at a
//! time. The draws below any box are a range of one array. A box completely inside a volume is accepted as
//! that range without further tests. A box completely outside is rejected with one test.

mod build;
mod refit;
#[cfg(test)]
mod tests;
mod walk;

pub use walk::Scratch;

use glam::{DVec3, Vec3, Vec4};

/// Number of boxes per node.
const WIDTH: usize = 4;

/// Four boxes and their contents.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Lower and upper corners: `[low or high][axis]`, one lane per box.
    corners: [[Vec4; 3]; 2],
    /// Node with the parts of each box, if it contains more than one draw.
    child: [u32; WIDTH],
    /// Draws of box `i`: `order[begin[i]..begin[i + 1]]`.
    begin: [u32; WIDTH + 1],
    /// Number of used boxes, which are the first ones.
    count: u32,
}

impl Node {
    fn lane(&self, lane: usize) -> [Vec3; 2] {
        self.corners
            .map(|[x, y, z]| Vec3::new(x[lane], y[lane], z[lane]))
    }

    fn set_lane(&mut self, lane: usize, bounds: [Vec3; 2]) {
        for (corner, point) in self.corners.iter_mut().zip(bounds) {
            for axis in 0..3 {
                corner[axis][lane] = point[axis];
            }
        }
    }

    /// Bounding box of the node.
    fn bounds(&self) -> [Vec3; 2] {
        (0..self.count as usize)
            .map(|lane| self.lane(lane))
            .fold(EMPTY, union)
    }
}

/// A tree over the bounds of draws `0..len`.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// Parents before children, the root first.
    nodes: Vec<Node>,
    /// Draws in the order of the tree.
    order: Vec<u32>,
    /// Node and lane (`WIDTH * node + lane`) with each node's bounds; unused for the root.
    parent: Vec<u32>,
    /// Node and lane of each draw, or [`NOWHERE`].
    place: Vec<u32>,
    /// Draws without finite bounds, which are always drawn.
    unbounded: Vec<u32>,
}

/// Place of a draw without finite bounds.
const NOWHERE: u32 = u32::MAX;

const EMPTY: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];

fn union(a: [Vec3; 2], b: [Vec3; 2]) -> [Vec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

fn is_finite([low, high]: [Vec3; 2]) -> bool {
    low.is_finite() && high.is_finite()
}

impl Hierarchy {
    /// Number of draws, including those without finite bounds.
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Whether there are no draws.
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// Largest absolute coordinate of all finite bounds, by axis. Rounding errors are proportional to it.
    pub fn extent(&self) -> DVec3 {
        let Some(root) = self.nodes.first() else {
            return DVec3::ZERO;
        };
        let [low, high] = root.bounds();
        low.abs().max(high.abs()).as_dvec3()
    }
}
