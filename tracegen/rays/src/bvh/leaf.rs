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
    /// Whether to load children ahead that are visited later.
    const LOADS_AHEAD: bool = true;
    /// Tests a leaf and returns the new `t_max`, or `None` to stop.
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32>;
    /// Called before each test with the number of entries on the stack.
    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        let _ = entries;
    }
}

/// Where the triangles of a tree are.
pub(super) trait Place<K: Kernel> {
    /// Blocks that one line test takes.
    const BLOCKS: usize;
    /// Added to the numbers of primitives.
    fn first_primitive(&self) -> u32;
    /// Added to the numbers of blocks.
    fn first_block(&self) -> u32;
    /// A bit mask of the triangles of the first [`Self::BLOCKS`] that the line may hit.
    fn lines_hit(&self, ray: &K::Ray<'_>, blocks: &[Block]) -> u32;
    /// The block in the world, and those triangles of a mask that the ray may hit up to `t_max`,
    /// with the ends of their boxes.
    fn candidates<'b>(
        &self,
        ray: &K::Ray<'_>,
        mask: u32,
        block: &'b Block,
        t_max: f32,
        room: &'b mut Block,
    ) -> (&'b Block, u32, Ends);
}

/// Triangles in the world.
pub(super) struct InPlace;

impl<K: Kernel> Place<K> for InPlace {
    const BLOCKS: usize = 1;

    #[inline(always)]
    fn first_primitive(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn first_block(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn lines_hit(&self, ray: &K::Ray<'_>, blocks: &[Block]) -> u32 {
        K::lines_hit(ray, &blocks[0])
    }

    #[inline(always)]
    fn candidates<'b>(
        &self,
        ray: &K::Ray<'_>,
        mask: u32,
        block: &'b Block,
        t_max: f32,
        _: &'b mut Block,
    ) -> (&'b Block, u32, Ends) {
        let mut ends = Ends([[0.0; BLOCK]; 2]);
        let mask = mask & K::boxes_hit(ray, block, t_max, &mut ends);
        (block, mask, ends)
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

/// The mask of all triangles of a block.
const ALL: u32 = (1 << BLOCK) - 1;

impl<A, P> Query<'_, A, P> {
    /// The line test of a leaf's block, in the lowest bits. `last` is that of the block before.
    #[inline(always)]
    fn lines_hit<K: Kernel>(
        &self,
        ray: &K::Ray<'_>,
        blocks: &[Block],
        number: usize,
        last: u32,
    ) -> u32
    where
        P: Place<K>,
    {
        if number.is_multiple_of(P::BLOCKS) {
            self.place.lines_hit(ray, &blocks[number..])
        } else {
            last >> BLOCK
        }
    }

    /// [`RayHit::place`] of a triangle.
    #[inline(always)]
    fn place_of<K: Kernel>(&self, first: u32, number: usize, lane: usize) -> u32
    where
        P: Place<K>,
    {
        (self.place.first_block() + first + number as u32) * BLOCK as u32 + lane as u32
    }
}

impl<A: AlphaTest, P> Query<'_, A, P> {
    /// Distance and vertices of a candidate, if the ray hits it.
    #[inline(always)]
    fn hit(&self, block: &Block, lane: usize, ends: &Ends) -> Option<(f32, [[f32; 3]; 3])> {
        let [near, far] = ends.0.map(|end| end[lane]);
        if near > far {
            return None;
        }
        let vertices = block.triangle(lane);
        let t = self.prepared.distance_within(&vertices, near, far)?;
        Some((t, vertices))
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

impl<'a, A, P> Closest<'a, A, P> {
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

impl<K: Kernel, A: AlphaTest, P: Place<K>> LeafTest<K> for Closest<'_, A, P> {
    #[inline(always)]
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32> {
        let query = &self.query;
        let (first, count) = leaf.leaf_range();
        let blocks = &query.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        counter.triangles(|| query.first_slots[first as usize], count);
        let (mut lines, mut room) = (0, Block::EMPTY);
        for (number, block) in blocks.iter().enumerate() {
            lines = query.lines_hit::<K>(ray, blocks, number, lines);
            if lines & ALL == 0 {
                continue;
            }
            let (block, mut mask, ends) =
                (query.place).candidates(ray, lines & ALL, block, self.best.t, &mut room);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let Some((t, vertices)) = query.hit(block, lane, &ends) else {
                    continue;
                };
                let primitive = query.place.first_primitive() + (block.primitives[lane] & !MASKED);
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
                    place: query.place_of::<K>(first, number, lane),
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

impl<'a, A, P> AnyHit<'a, A, P> {
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

impl<K: Kernel, A: AlphaTest, P: Place<K>> LeafTest<K> for AnyHit<'_, A, P> {
    // Few are visited.
    const LOADS_AHEAD: bool = P::BLOCKS == 1;

    #[inline(always)]
    fn test<C: Counter>(&mut self, ray: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32> {
        let query = &self.query;
        let Ray { t_min, t_max, .. } = *query.prepared.ray;
        let (first, count) = leaf.leaf_range();
        let blocks = &query.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        let first_slot = || query.first_slots[first as usize];
        let (mut lines, mut room) = (0, Block::EMPTY);
        for (number, block) in blocks.iter().enumerate() {
            lines = query.lines_hit::<K>(ray, blocks, number, lines);
            if lines & ALL == 0 {
                continue;
            }
            let (block, mut mask, ends) =
                (query.place).candidates(ray, lines & ALL, block, t_max, &mut room);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let Some((t, vertices)) = query.hit(block, lane, &ends) else {
                    continue;
                };
                if t <= t_min || t > t_max {
                    continue;
                }
                let primitive = query.place.first_primitive() + (block.primitives[lane] & !MASKED);
                let masked = block.primitives[lane] & MASKED != 0;
                if masked && !query.opaque(counter, primitive, &vertices) {
                    continue;
                }
                counter.triangles(first_slot, (number * BLOCK + lane + 1) as u32);
                self.blocker = Some(RayHit {
                    t,
                    primitive,
                    vertices,
                    place: query.place_of::<K>(first, number, lane),
                });
                return None;
            }
        }
        counter.triangles(first_slot, count);
        Some(t_max)
    }
}
