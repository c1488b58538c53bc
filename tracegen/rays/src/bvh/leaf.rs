//! Leaf tests of a ray: the nearest hit, or any hit.

use super::Bvh;
use super::count::Counter;
use super::kernel::Kernel;
use super::node::{BLOCK, Child, MASKED};
use crate::ray::{PreparedRay, barycentrics};

/// The hit of a ray on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Primitive number.
    pub primitive: u32,
    /// The triangle's vertices.
    pub vertices: [[f32; 3]; 3],
    /// Slot of the triangle, its place in leaf order.
    pub slot: u32,
}

/// Decides at a masked triangle whether a ray stops.
pub trait AlphaTest {
    /// True if the triangle is opaque at these weights of its second and third vertex.
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool;
}

/// Treats every triangle as opaque.
#[derive(Clone, Copy, Debug)]
pub struct AllOpaque;

impl AlphaTest for AllOpaque {
    #[inline(always)]
    fn opaque(&self, _: u32, _: [f32; 2]) -> bool {
        true
    }
}

/// The test at a leaf. It is a trait rather than a closure, because a closure that is not inlined
/// would be compiled without the instructions of its traversal.
pub trait LeafTest<K: Kernel, C: Counter> {
    /// Tests a leaf and returns the new `t_max`, or `None` to stop.
    fn test(&mut self, ray: &K::Ray, counter: &mut C, leaf: Child) -> Option<f32>;
}

pub(super) struct Closest<'a, A> {
    pub bvh: &'a Bvh,
    pub prepared: &'a PreparedRay,
    pub alpha: &'a A,
    pub best: Option<RayHit>,
}

impl<K: Kernel, C: Counter, A: AlphaTest> LeafTest<K, C> for Closest<'_, A> {
    #[inline(always)]
    fn test(&mut self, ray: &K::Ray, counter: &mut C, leaf: Child) -> Option<f32> {
        let (first, count) = leaf.leaf_range();
        let blocks = &self.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        counter.triangles(blocks[0].first_slot, count);
        for block in blocks {
            let mut mask = K::lines_hit(ray, self.prepared, block);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let vertices = block.triangle(lane);
                let Some(t) = self.prepared.distance(&vertices) else {
                    continue;
                };
                let primitive = block.primitives[lane] & !MASKED;
                if self
                    .best
                    .is_some_and(|b| (t, primitive) >= (b.t, b.primitive))
                {
                    continue;
                }
                if block.primitives[lane] & MASKED != 0 {
                    counter.alpha();
                    if !self
                        .alpha
                        .opaque(primitive, barycentrics(&self.prepared.ray, &vertices))
                    {
                        continue;
                    }
                }
                self.best = Some(RayHit {
                    t,
                    primitive,
                    vertices,
                    slot: block.first_slot + lane as u32,
                });
            }
        }
        Some(self.best.map_or(self.prepared.ray.t_max, |b| b.t))
    }
}

pub(super) struct AnyHit<'a, A> {
    pub bvh: &'a Bvh,
    pub prepared: &'a PreparedRay,
    pub alpha: &'a A,
    pub blocker: Option<RayHit>,
}

impl<K: Kernel, C: Counter, A: AlphaTest> LeafTest<K, C> for AnyHit<'_, A> {
    #[inline(always)]
    fn test(&mut self, ray: &K::Ray, counter: &mut C, leaf: Child) -> Option<f32> {
        let (first, count) = leaf.leaf_range();
        let blocks = &self.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        for (number, block) in blocks.iter().enumerate() {
            let mut mask = K::lines_hit(ray, self.prepared, block);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let vertices = block.triangle(lane);
                let Some(t) = self.prepared.distance(&vertices) else {
                    continue;
                };
                let primitive = block.primitives[lane] & !MASKED;
                if block.primitives[lane] & MASKED != 0 {
                    counter.alpha();
                    if !self
                        .alpha
                        .opaque(primitive, barycentrics(&self.prepared.ray, &vertices))
                    {
                        continue;
                    }
                }
                let tested = (number * BLOCK + lane + 1) as u32;
                counter.triangles(blocks[0].first_slot, tested);
                self.blocker = Some(RayHit {
                    t,
                    primitive,
                    vertices,
                    slot: block.first_slot + lane as u32,
                });
                return None;
            }
        }
        counter.triangles(blocks[0].first_slot, count);
        Some(self.prepared.ray.t_max)
    }
}
