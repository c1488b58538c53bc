//! Updates the boxes of moving draws and the boxes around them.

use super::{Hierarchy, NOWHERE, WIDTH, is_finite};
use glam::Vec3;
use std::collections::BinaryHeap;

impl Hierarchy {
    /// Changes the bounds of draws without changing the structure of the tree. The tree remains correct for
    /// any motion. It remains efficient if draws stay near their original positions.
    /// A draw without finite bounds stays outside the tree. A draw whose bounds are no longer finite is
    /// always drawn from then on.
    /// then on.
    pub fn refit(&mut self, moved: impl IntoIterator<Item = (u32, [Vec3; 2])>) {
        // Children have larger indices than their parents, so the node with the largest index can be updated
        // next.
        let mut stale = BinaryHeap::new();
        for (draw, bounds) in moved {
            let Some(place) = self.place.get_mut(draw as usize) else {
                continue;
            };
            if *place == NOWHERE {
                continue;
            }
            let (node, lane) = (*place / WIDTH as u32, *place as usize % WIDTH);
            let parts = &mut self.nodes[node as usize];
            if is_finite(bounds) {
                parts.set_lane(lane, bounds);
                stale.push(node);
            } else {
                // The old box can remain, because the draw is always drawn.
                *place = NOWHERE;
                self.unbounded.push(draw);
            }
        }
        let mut last = None;
        while let Some(node) = stale.pop() {
            if last.replace(node) == Some(node) || node == 0 {
                continue;
            }
            let around = self.nodes[node as usize].bounds();
            let place = self.parent[node as usize];
            let (above, lane) = (place / WIDTH as u32, place as usize % WIDTH);
            let parent = &mut self.nodes[above as usize];
            if parent.lane(lane) != around {
                parent.set_lane(lane, around);
                stale.push(above);
            }
        }
    }
}
