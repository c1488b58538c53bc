//! Leaf tests of a ray: the nearest hit, or any hit.

use super::Bvh;
use super::count::Counter;
use super::kernel::{Ends, Kernel};
use super::node::{BLOCK, Block, Child, MASKED};
use crate::ray::{PreparedRay, Ray, barycentrics};
use formats::raytrace::TraversalKind;

/// The hit of a ray on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Primitive number.
    pub primitive: u32,
    /// The triangle's vertices.
    pub vertices: [[f32; 3]; 3],
    /// Place in the blocks: four times the block, plus the lane.
    place: u32,
}

impl Bvh {
    /// Slot of a triangle that was hit, its place in the order of a tree's leaves.
    pub fn slot(&self, tree: TraversalKind, hit: &RayHit) -> u32 {
        let (block, lane) = (hit.place / BLOCK as u32, hit.place % BLOCK as u32);
        match &self.below {
            None => self.slots_of(tree)[block as usize] + lane,
            Some(below) => below.slot(tree, block) + lane,
        }
    }
}

/// Decides at a masked triangle whether a ray stops.
pub trait AlphaTest {
    /// True if the triangle is opaque at these weights of its second and third vertex.
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool;
}

impl AlphaTest for &dyn AlphaTest {
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool {
        (**self).opaque(primitive, bary)
    }
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
pub trait LeafTest<K: Kernel> {
    /// Whether the test is too long to be inlined into any traversal.
    const LONG: bool = false;
    /// Tests a leaf and returns the new `t_max`, or `None` to stop.
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32>;
    /// Called before each test with the number of entries on the stack.
    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        let _ = entries;
    }
}

/// Where the triangles of a tree are.
pub(super) trait Place {
    /// Added to the numbers of primitives.
    fn first_primitive(&self) -> u32;
    /// Added to the numbers of blocks.
    fn first_block(&self) -> u32;
    /// A bit mask of a block's triangles that the line may hit.
    fn lines_hit<K: Kernel>(&self, ray: &K::Ray<'_>, block: &Block) -> u32;
    /// A triangle of that mask in the world, and the ends of its box, if the ray hits it.
    fn triangle(
        &self,
        ray: &PreparedRay<'_>,
        vertices: [[f32; 3]; 3],
        ends: [f32; 2],
    ) -> Option<([[f32; 3]; 3], [f32; 2])>;
}

/// Triangles in the world.
pub(super) struct InPlace;

impl Place for InPlace {
    #[inline(always)]
    fn first_primitive(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn first_block(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn lines_hit<K: Kernel>(&self, ray: &K::Ray<'_>, block: &Block) -> u32 {
        K::lines_hit::<false>(ray, block, 0.0)
    }

    #[inline(always)]
    fn triangle(
        &self,
        _: &PreparedRay<'_>,
        vertices: [[f32; 3]; 3],
        ends: [f32; 2],
    ) -> Option<([[f32; 3]; 3], [f32; 2])> {
        Some((vertices, ends))
    }
}

/// What both leaf tests need.
pub(super) struct Query<'a, A, P> {
    pub bvh: &'a Bvh,
    pub first_slots: &'a [u32],
    pub prepared: &'a PreparedRay<'a>,
    pub alpha: &'a A,
    pub place: P,
}

impl<'a, A, P> Query<'a, A, P> {
    /// Goes on in another tree.
    #[inline(always)]
    pub fn enter(&mut self, bvh: &'a Bvh, first_slots: &'a [u32], place: P) {
        (self.bvh, self.first_slots, self.place) = (bvh, first_slots, place);
    }
}

impl<A: AlphaTest, P: Place> Query<'_, A, P> {
    /// The triangles of a block that the ray may hit up to `t_max`, and the ends of their boxes.
    #[inline(always)]
    fn candidates<K: Kernel>(&self, ray: &K::Ray<'_>, block: &Block, t_max: f32) -> (u32, Ends) {
        let mut ends = Ends([[0.0; BLOCK]; 2]);
        let mut mask = self.place.lines_hit::<K>(ray, block);
        if mask != 0 {
            mask &= K::boxes_hit(ray, block, t_max, &mut ends);
        }
        (mask, ends)
    }

    /// Distance and vertices of a candidate, if the ray hits it.
    #[inline(always)]
    fn hit(&self, block: &Block, lane: usize, ends: &Ends) -> Option<(f32, [[f32; 3]; 3])> {
        let ends = ends.0.map(|end| end[lane]);
        let (vertices, [near, far]) =
            (self.place).triangle(self.prepared, block.triangle(lane), ends)?;
        let t = self.prepared.distance_within(&vertices, near, far)?;
        Some((t, vertices))
    }

    #[inline(always)]
    fn primitive(&self, block: &Block, lane: usize) -> u32 {
        self.place.first_primitive() + (block.primitives[lane] & !MASKED)
    }

    /// [`RayHit::place`] of a triangle.
    #[inline(always)]
    fn place(&self, block: u32, lane: usize) -> u32 {
        (self.place.first_block() + block) * BLOCK as u32 + lane as u32
    }

    /// True if a masked triangle stops the ray.
    fn opaque(&self, counter: &mut impl Counter, primitive: u32, vertices: &[[f32; 3]; 3]) -> bool {
        counter.alpha();
        let bary = barycentrics(self.prepared.ray, vertices);
        self.alpha.opaque(primitive, bary)
    }
}

pub(super) struct Closest<'a, A, P> {
    pub query: Query<'a, A, P>,
    /// The nearest hit. Before the first, the end of the ray and [`NO_PRIMITIVE`].
    best: RayHit,
}

/// Above the numbers of all primitives.
const NO_PRIMITIVE: u32 = u32::MAX;

impl<'a, A: AlphaTest, P: Place> Closest<'a, A, P> {
    pub fn new(query: Query<'a, A, P>) -> Self {
        Self {
            best: RayHit {
                t: query.prepared.ray.t_max,
                primitive: NO_PRIMITIVE,
                vertices: [[0.0; 3]; 3],
                place: 0,
            },
            query,
        }
    }

    pub fn hit(self) -> Option<RayHit> {
        (self.best.primitive != NO_PRIMITIVE).then_some(self.best)
    }
}

impl<K: Kernel, A: AlphaTest, P: Place> LeafTest<K> for Closest<'_, A, P> {
    #[inline(always)]
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32> {
        let query = &self.query;
        let (first, count) = leaf.leaf_range();
        let blocks = &query.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        counter.triangles(|| query.first_slots[first as usize], count);
        for (number, block) in (first..).zip(blocks) {
            let (mut mask, ends) = query.candidates::<K>(ray, block, self.best.t);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let Some((t, vertices)) = query.hit(block, lane, &ends) else {
                    continue;
                };
                let primitive = query.primitive(block, lane);
                if t <= query.prepared.ray.t_min
                    || (t, primitive) >= (self.best.t, self.best.primitive)
                {
                    continue;
                }
                let masked = block.primitives[lane] & MASKED != 0;
                if masked && !query.opaque(counter, primitive, &vertices) {
                    continue;
                }
                self.best = RayHit {
                    t,
                    primitive,
                    vertices,
                    place: query.place(number, lane),
                };
            }
        }
        Some(self.best.t)
    }
}

pub(super) struct AnyHit<'a, A, P> {
    pub query: Query<'a, A, P>,
    blocker: Option<RayHit>,
}

impl<'a, A: AlphaTest, P: Place> AnyHit<'a, A, P> {
    pub fn new(query: Query<'a, A, P>) -> Self {
        Self {
            query,
            blocker: None,
        }
    }

    pub fn hit(self) -> Option<RayHit> {
        self.blocker
    }
}

impl<K: Kernel, A: AlphaTest, P: Place> LeafTest<K> for AnyHit<'_, A, P> {
    #[inline(always)]
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32> {
        let query = &self.query;
        let Ray { t_min, t_max, .. } = *query.prepared.ray;
        let (first, count) = leaf.leaf_range();
        let blocks = &query.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        let first_slot = || query.first_slots[first as usize];
        for (number, block) in blocks.iter().enumerate() {
            let (mut mask, ends) = query.candidates::<K>(ray, block, t_max);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let Some((t, vertices)) = query.hit(block, lane, &ends) else {
                    continue;
                };
                if t <= t_min || t > t_max {
                    continue;
                }
                let primitive = query.primitive(block, lane);
                let masked = block.primitives[lane] & MASKED != 0;
                if masked && !query.opaque(counter, primitive, &vertices) {
                    continue;
                }
                counter.triangles(first_slot, (number * BLOCK + lane + 1) as u32);
                self.blocker = Some(RayHit {
                    t,
                    primitive,
                    vertices,
                    place: query.place(first + number as u32, lane),
                });
                return None;
            }
        }
        counter.triangles(first_slot, count);
        Some(t_max)
    }
}
