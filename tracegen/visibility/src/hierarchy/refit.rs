//! Updates the boxes of moving draws and those around them.

use super::{Hierarchy, NOWHERE, WIDTH, is_finite};
use glam::Vec3;
use std::collections::BinaryHeap;

impl Hierarchy {
    /// Gives draws new bounds. The tree keeps its shape: it stays correct however far they move,
    /// and stays good while they move about where they were when it was built.
    ///
    /// Draws that had no finite bounds stay so; one that gets such bounds is drawn always from
    /// then on.
    pub fn refit(&mut self, moved: impl IntoIterator<Item = (u32, [Vec3; 2])>) {
        // Children have larger numbers than their parents: the largest is always ready.
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
                // Its old box stays, because what it finds is found anyway.
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
