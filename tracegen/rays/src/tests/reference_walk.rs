//! An independent walk of a hierarchy by the rules of FORMAT.md (Traversal), in plain `f32`, which
//! counts the work of a ray.

use formats::raytrace::{ChildKind, ChildOrder, Hierarchy, HierarchyChild};
use glam::Vec3;
use rays::bvh::count::Counts;
use rays::ray::{PreparedRay, Ray};

/// The constants of a ray on one axis.
#[derive(Clone, Copy)]
pub(crate) struct Axis {
    near: f32,
    far: f32,
    near_offset: f32,
    far_offset: f32,
    forward: bool,
}

/// A hierarchy to walk.
pub struct ReferenceWalk<'a> {
    hierarchy: &'a Hierarchy,
    /// Children of a node.
    width: usize,
    bounds: (Vec3, Vec3),
    /// The order of children. Only the nearest first compares boxes again when they are popped.
    pub child_order: ChildOrder,
}

impl<'a> ReferenceWalk<'a> {
    /// A walk of a hierarchy whose nodes have `width` children.
    pub fn new(hierarchy: &'a Hierarchy, width: usize) -> Self {
        let triangles = hierarchy.triangles.iter();
        let points = triangles.flat_map(|triangle| triangle.vertices.map(Vec3::from));
        let bounds = points.fold((Vec3::MAX, Vec3::MIN), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        Self {
            hierarchy,
            width,
            bounds,
            child_order: ChildOrder::Nearest,
        }
    }

    pub(crate) fn axes(&self, ray: &Ray) -> [Axis; 3] {
        let (o, d) = (ray.origin, ray.direction);
        let e = 2f32.powi(-23);
        let reach = (o - self.bounds.0).abs().max((o - self.bounds.1).abs());
        let longest = d.abs().max_element();
        let z = (0..3).rev().find(|axis| d[*axis].abs() == longest);
        let reach_z = reach[z.unwrap_or(2)];
        [0, 1, 2].map(|axis| {
            let pad =
                2.0 * (5.0 * 2f32.powi(-24)) * (reach[axis] + reach_z) + 2.0 * e * o[axis].abs();
            let pad = pad.copysign(d[axis]);
            let d = if d[axis].abs() < 1e-18 {
                1e-18_f32.copysign(d[axis])
            } else {
                d[axis]
            };
            let (near, far) = ((1.0 / d) * (1.0 - 2.0 * e), (1.0 / d) * (1.0 + 2.0 * e));
            Axis {
                near,
                far,
                near_offset: (o[axis] + pad) * near,
                far_offset: (o[axis] - pad) * far,
                forward: d >= 0.0,
            }
        })
    }

    /// The work of a ray, and the slot of the triangle at which it ends. Distances to triangles are
    /// those of the tracer.
    pub fn walk(&self, ray: &Ray, any_hit: bool) -> (Counts, Option<u32>) {
        let (axes, prepared) = (self.axes(ray), PreparedRay::new(ray, self.bounds));
        let mut counts = Counts::default();
        let mut nearest: Option<(f32, u32, u32)> = None;
        let (mut stack, mut next) = (Vec::new(), Some(ChildKind::Node(0)));
        loop {
            let limit = nearest.map_or(ray.t_max, |(t, ..)| t);
            let kind = match next.take() {
                Some(kind) => kind,
                None => match stack.pop() {
                    Some((enter, kind)) if enter <= limit => kind,
                    Some(_) => continue,
                    None => return (counts, nearest.map(|(_, _, slot)| slot)),
                },
            };
            match kind {
                ChildKind::Node(node) => {
                    counts.steps += 1;
                    let mut hit = self.hit_children(ray, &axes, node, limit).into_iter();
                    next = hit.next().map(|(_, kind)| kind);
                    stack.extend(hit.rev());
                }
                ChildKind::Leaf(first, count) => {
                    for slot in first..first + count {
                        counts.triangle_tests += 1;
                        let triangle = &self.hierarchy.triangles[slot as usize];
                        if !prepared.line_hits(&triangle.vertices) {
                            continue;
                        }
                        let Some(t) = prepared.distance(&triangle.vertices) else {
                            continue;
                        };
                        let found = (t, triangle.primitive, slot);
                        if nearest.is_none_or(|n| found < n) {
                            nearest = Some(found);
                        }
                        if any_hit {
                            return (counts, Some(slot));
                        }
                    }
                }
            }
        }
    }

    /// The children of a node that a ray hits, the next first.
    pub(crate) fn hit_children(
        &self,
        ray: &Ray,
        axes: &[Axis; 3],
        node: u32,
        limit: f32,
    ) -> Vec<(f32, ChildKind)> {
        let children = &self.hierarchy.children[self.width * node as usize..][..self.width];
        let mut hit: Vec<(f32, ChildKind)> = children
            .iter()
            .flatten()
            .filter_map(|child| Some((entry(ray, axes, child, limit)?, child.kind)))
            .collect();
        if self.child_order == ChildOrder::InnerFirst {
            hit.sort_by_key(|(_, kind)| matches!(kind, ChildKind::Leaf(..)));
        }
        if self.child_order != ChildOrder::Nearest {
            return hit.into_iter().map(|(_, kind)| (0.0, kind)).collect();
        }
        // Two that are entered at the same distance stay in order. Of more, nodes come before
        // leaves, nodes by their numbers, leaves by their count and slot.
        let more = hit.len() > 2;
        hit.sort_by_key(|(enter, kind)| {
            let place = match kind {
                ChildKind::Node(node) => (0, 0, *node),
                ChildKind::Leaf(first, count) => (1, *count, *first),
            };
            (enter.to_bits() & 0x7FFF_FFFF, more.then_some(place))
        });
        hit
    }
}

/// Where a box is entered, if it is hit before `limit`.
fn entry(ray: &Ray, axes: &[Axis; 3], child: &HierarchyChild, limit: f32) -> Option<f32> {
    let (mut enter, mut leave) = (ray.t_min, limit);
    for (at, axis) in axes.iter().enumerate() {
        let (mut near, mut far) = (child.min[at], child.max[at]);
        if !axis.forward {
            std::mem::swap(&mut near, &mut far);
        }
        enter = enter.max(near.mul_add(axis.near, -axis.near_offset));
        leave = leave.min(far.mul_add(axis.far, -axis.far_offset));
    }
    (enter <= leave).then_some(enter)
}
