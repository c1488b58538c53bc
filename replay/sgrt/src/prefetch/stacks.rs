//! The traversal stack of a ray at each of its steps, from its visits, its geometry and the boxes of the hierarchy.
//!
//! A visit of a child right after its node means that the ray went down. Its other children whose boxes the ray hits before
//! the nearest triangle so far went onto the stack, the nearest on top (or the first of the node, if rays visit children in
//! its order). Any other visit is a pop. Entries above the popped one were dropped, because a nearer triangle had been found
//! since. Where leaves go onto the stack, every visit of a leaf is a pop.

use super::Step;
use crate::detect::intersect;
use formats::raytrace::{
    BvhSummary, ChildKind, ChildOrder, Hierarchy, HierarchyChild, RayGeometry, Visit,
};

/// The boxes and triangles that rays meet.
pub(super) struct Stacks<'a> {
    hierarchy: &'a Hierarchy,
    width: usize,
    child_order: ChildOrder,
}

impl<'a> Stacks<'a> {
    /// Of a trace's hierarchy.
    pub fn new(hierarchy: &'a Hierarchy, bvh: &BvhSummary) -> Self {
        Self {
            hierarchy,
            width: bvh.traversal.width(),
            child_order: bvh.child_order(),
        }
    }

    /// Calls `each` with each visit of a ray, and with the step that it begins, if it does. With `visits_dropped`, entries that
    /// the ray drops are visited as well; `is_ended` is true for a ray that a hit ends before its stack is empty.
    pub fn for_visits(
        &self,
        (ray, is_ended): (&RayGeometry, bool),
        visits: &[Visit],
        visits_dropped: bool,
        mut each: impl FnMut(Visit, Option<&Step<'_>>),
    ) {
        let drop_to = |least: usize,
                       stack: &mut Vec<ChildKind>,
                       pops: &mut u32,
                       each: &mut dyn FnMut(Visit, Option<&Step<'_>>)| {
            while stack.len() > least
                && let Some(kind) = stack.pop()
            {
                *pops += 1;
                if visits_dropped {
                    for (number, visit) in visits_of(kind).enumerate() {
                        let (pops, stack) = (*pops, stack.as_slice());
                        each(visit, (number == 0).then_some(&Step { visit, pops, stack }));
                    }
                }
            }
        };
        let mut limit = ray.t_max;
        let (mut stack, mut pops) = (Vec::new(), 0);
        let mut went_down = true;
        // End of the current leaf's slots after the last visit.
        let mut in_leaf = None;
        for (number, &visit) in visits.iter().enumerate() {
            if in_leaf != Some(visit) {
                if went_down {
                    pops = 0;
                } else {
                    let at = stack.iter().rposition(|kind| starts_with(*kind, visit));
                    let at = at.unwrap_or(stack.len());
                    drop_to(at + 1, &mut stack, &mut pops, &mut each);
                    stack.truncate(at);
                    pops += 1;
                }
                let stack = stack.as_slice();
                each(visit, Some(&Step { visit, pops, stack }));
            } else {
                each(visit, None);
            }
            went_down = false;
            match visit {
                Visit::Node(node) => {
                    in_leaf = None;
                    if let Some(next) = visits.get(number + 1) {
                        let pushed_from = stack.len();
                        went_down = self.push(ray, node, *next, limit, &mut stack);
                        if stack.len() > pushed_from {
                            pops = 0;
                        }
                    }
                }
                Visit::Triangle(slot) => {
                    // A leaf's slots follow each other; the first slot of a leaf on the stack can, too.
                    let next = Visit::Triangle(slot + 1);
                    let is_popped = stack.iter().any(|kind| starts_with(*kind, next));
                    in_leaf = (!is_popped).then_some(next);
                    limit = limit.min(self.distance(ray, slot));
                }
            }
        }
        if !is_ended {
            drop_to(0, &mut stack, &mut pops, &mut each);
        }
    }

    /// Pushes the children of a node that a ray hits. Returns true if the ray goes down to `next`, a child that is not pushed.
    fn push(
        &self,
        ray: &RayGeometry,
        node: u32,
        next: Visit,
        limit: f32,
        stack: &mut Vec<ChildKind>,
    ) -> bool {
        let children = self.hierarchy.children.chunks_exact(self.width);
        let children = || {
            children
                .clone()
                .nth(node as usize)
                .into_iter()
                .flatten()
                .flatten()
        };
        if !children().any(|child| starts_with(child.kind, next)) {
            return false;
        }
        let goes_down =
            self.child_order != ChildOrder::InnerFirst || matches!(next, Visit::Node(_));
        let others = children().filter(|child| !goes_down || !starts_with(child.kind, next));
        let hit = others.filter_map(|child| Some((entry(ray, child, limit)?, child.kind)));
        let mut hit: Vec<(f32, ChildKind)> = hit.collect();
        match self.child_order {
            ChildOrder::Nearest => hit.sort_by(|a, b| b.0.total_cmp(&a.0)),
            ChildOrder::Node => hit.reverse(),
            ChildOrder::InnerFirst => {
                hit.reverse();
                hit.sort_by_key(|(_, kind)| matches!(kind, ChildKind::Node(_)));
            }
        }
        stack.extend(hit.into_iter().map(|(_, kind)| kind));
        goes_down
    }

    /// Where a ray ends at a triangle; infinite if it does not. An alpha test, which the trace does not record, lets all
    /// rays through but the one that ended here.
    fn distance(&self, ray: &RayGeometry, slot: u32) -> f32 {
        if let Some(hit) = ray.hit.filter(|hit| hit.slot == slot) {
            return hit.t;
        }
        let triangle = self.hierarchy.triangles.get(slot as usize);
        let solid = triangle.filter(|triangle| !triangle.masked);
        solid
            .and_then(|solid| intersect(ray.origin, ray.direction, &solid.vertices))
            .filter(|t| *t > ray.t_min)
            .unwrap_or(f32::INFINITY)
    }
}

/// The visits of a node or a leaf.
pub(super) fn visits_of(kind: ChildKind) -> impl Iterator<Item = Visit> {
    let (node, slots) = match kind {
        ChildKind::Node(node) => (Some(Visit::Node(node)), 0..0),
        ChildKind::Leaf(first, count) => (None, first..first + count),
    };
    node.into_iter().chain(slots.map(Visit::Triangle))
}

/// True if a child is first visited by this visit.
fn starts_with(kind: ChildKind, visit: Visit) -> bool {
    match (kind, visit) {
        (ChildKind::Node(node), Visit::Node(visited)) => node == visited,
        (ChildKind::Leaf(first, _), Visit::Triangle(visited)) => first == visited,
        _ => false,
    }
}

/// Where a ray enters a box, if it does before `limit`.
fn entry(ray: &RayGeometry, child: &HierarchyChild, limit: f32) -> Option<f32> {
    let (mut enter, mut leave) = (ray.t_min, limit);
    for axis in 0..3 {
        let inverse = 1.0 / ray.direction[axis];
        let [a, b] =
            [child.min, child.max].map(|corner| (corner[axis] - ray.origin[axis]) * inverse);
        // NaN, of a ray within a face, does not count.
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some(enter)
}
