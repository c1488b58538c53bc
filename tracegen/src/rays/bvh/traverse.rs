//! Closest-hit and any-hit traversal of both trees, over any kernel and counter.

use super::Bvh;
use super::count::Counter;
use super::kernel::{Kernel, Lanes8};
use super::node::{BLOCK, Child, MASKED};
use crate::rays::ray::{PreparedRay, Ray, barycentrics};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Primitive number.
    pub primitive: u32,
    /// The triangle's vertices.
    pub vertices: [[f32; 3]; 3],
}

/// Decides at a masked triangle whether a ray stops there.
pub trait AlphaTest {
    /// True where the triangle is opaque at these weights of its second and third vertex.
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool;
}

/// Every triangle stops every ray.
#[derive(Clone, Copy, Debug)]
pub struct AllOpaque;

impl AlphaTest for AllOpaque {
    #[inline(always)]
    fn opaque(&self, _: u32, _: [f32; 2]) -> bool {
        true
    }
}

/// Nodes to visit; kept between rays to spare the allocation.
#[derive(Clone, Debug, Default)]
pub struct TraversalStack {
    /// Entry distance in the upper half (its bits sort like the number, for it is not negative),
    /// child in the lower.
    entries: Vec<u64>,
}

impl TraversalStack {
    /// A stack for trees that need up to `capacity` entries.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self {
            entries: vec![0; capacity],
        }
    }
}

#[inline(always)]
fn pack(near: f32, child: Child) -> u64 {
    // Clearing the sign turns a -0 into the 0 it stands for.
    u64::from(near.to_bits() & 0x7FFF_FFFF) << 32 | u64::from(child.0)
}

#[inline(always)]
fn unpack(entry: u64) -> (f32, Child) {
    (f32::from_bits((entry >> 32) as u32), Child(entry as u32))
}

/// Which tree is walked.
pub trait Width {
    /// Visits an inner node: pushes its hit children but for the nearest, which it returns.
    fn visit<K: Kernel>(
        bvh: &Bvh,
        ray: &K::Ray,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child>;
}

/// The binary tree.
pub struct Two;

impl Width for Two {
    #[inline(always)]
    fn visit<K: Kernel>(
        bvh: &Bvh,
        ray: &K::Ray,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child> {
        let node = &bvh.nodes2[node as usize];
        let (near, mask) = K::step2(ray, node, t_max);
        // Nested tests rather than a match, which would become a jump table.
        let [left, right] = node.children;
        if mask & 1 != 0 {
            if mask & 2 != 0 {
                let (nearer, pushed) = if near[0] <= near[1] {
                    (left, pack(near[1], right))
                } else {
                    keep_branch();
                    (right, pack(near[0], left))
                };
                stack[*top] = pushed;
                *top += 1;
                Some(nearer)
            } else {
                keep_branch();
                Some(left)
            }
        } else if mask & 2 != 0 {
            Some(right)
        } else {
            None
        }
    }
}

/// Keeps a two-way choice a branch. A compiler's select (or, for four cases, a jump table) makes
/// the next node's address wait for the box test, where a predicted branch fetches it meanwhile:
/// measured to gain a tenth in the binary tree.
#[inline(always)]
fn keep_branch() {
    // SAFETY: the assembly is empty; it has no effect but to be there.
    unsafe { std::arch::asm!("", options(nomem, nostack, preserves_flags)) }
}

/// The eight-wide tree.
pub struct Eight;

impl Width for Eight {
    #[inline(always)]
    fn visit<K: Kernel>(
        bvh: &Bvh,
        ray: &K::Ray,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child> {
        let node = &bvh.nodes8[node as usize];
        let mut lanes = Lanes8([0.0; 8]);
        let mut mask = K::step8(ray, node, t_max, &mut lanes);
        if mask == 0 {
            return None;
        }
        let first = mask.trailing_zeros() as usize & 7;
        mask &= mask - 1;
        let child = node.children[first];
        if mask == 0 {
            return Some(child);
        }
        let near = lanes.0[first];
        let second = mask.trailing_zeros() as usize & 7;
        mask &= mask - 1;
        let (near1, child1) = (lanes.0[second], node.children[second]);
        // One or two hit children, most of the cases, need no sorting.
        let base = *top;
        if mask == 0 {
            *top = base + 1;
            if near <= near1 {
                stack[base] = pack(near1, child1);
                return Some(child);
            }
            keep_branch();
            stack[base] = pack(near, child);
            return Some(child1);
        }
        // Insertion keeps the pushed entries nearest on top.
        let (e0, e1) = (pack(near, child), pack(near1, child1));
        let mut nearest = e0.min(e1);
        stack[base] = e0.max(e1);
        *top = base + 1;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let entry = pack(lanes.0[lane], node.children[lane]);
            let pushed = nearest.max(entry);
            nearest = nearest.min(entry);
            let mut at = *top;
            *top += 1;
            while at > base && stack[at - 1] < pushed {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = pushed;
        }
        Some(unpack(nearest).1)
    }
}

/// Walks a tree from the root.
#[inline(always)]
fn walk<K: Kernel, W: Width, C: Counter>(
    bvh: &Bvh,
    ray: &K::Ray,
    mut t_max: f32,
    stack: &mut TraversalStack,
    counter: &mut C,
    leaf: &mut impl LeafTest<K, C>,
) {
    if stack.entries.len() < bvh.stack_size() {
        stack.entries.resize(bvh.stack_size(), 0);
    }
    let entries = &mut stack.entries[..];
    let mut top = 0;
    let mut at = Child(0);
    loop {
        let next = if at.is_leaf() {
            match leaf.test(ray, counter, at) {
                Some(shorter) => t_max = shorter,
                None => return,
            }
            None
        } else {
            counter.step(at.0);
            W::visit::<K>(bvh, ray, at.0, t_max, entries, &mut top)
        };
        at = match next {
            Some(child) => child,
            None => loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                let (near, child) = unpack(entries[top]);
                if near <= t_max {
                    break child;
                }
            },
        };
    }
}

/// What happens at a leaf. Methods rather than closures: a closure that is not inlined would be
/// compiled without the instructions of its traversal.
trait LeafTest<K: Kernel, C: Counter> {
    /// Tests a leaf and returns the new `t_max`, or `None` to stop.
    fn test(&mut self, ray: &K::Ray, counter: &mut C, leaf: Child) -> Option<f32>;
}

struct Closest<'a, A> {
    bvh: &'a Bvh,
    prepared: &'a PreparedRay,
    alpha: &'a A,
    best: Option<RayHit>,
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
                });
            }
        }
        Some(self.best.map_or(self.prepared.ray.t_max, |b| b.t))
    }
}

struct AnyHit<'a, A> {
    bvh: &'a Bvh,
    prepared: &'a PreparedRay,
    alpha: &'a A,
    blocked: bool,
}

impl<K: Kernel, C: Counter, A: AlphaTest> LeafTest<K, C> for AnyHit<'_, A> {
    #[inline(always)]
    fn test(&mut self, ray: &K::Ray, counter: &mut C, leaf: Child) -> Option<f32> {
        let (first, count) = leaf.leaf_range();
        let blocks = &self.bvh.blocks[first as usize..][..(count as usize).div_ceil(BLOCK)];
        let mut tested = 0;
        for block in blocks {
            let mut mask = K::lines_hit(ray, self.prepared, block);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (BLOCK - 1);
                mask &= mask - 1;
                let vertices = block.triangle(lane);
                if self.prepared.distance(&vertices).is_none() {
                    continue;
                }
                if block.primitives[lane] & MASKED != 0 {
                    counter.alpha();
                    let primitive = block.primitives[lane] & !MASKED;
                    if !self
                        .alpha
                        .opaque(primitive, barycentrics(&self.prepared.ray, &vertices))
                    {
                        continue;
                    }
                }
                counter.triangles(blocks[0].first_slot, tested + lane as u32 + 1);
                self.blocked = true;
                return None;
            }
            tested += BLOCK as u32;
        }
        counter.triangles(blocks[0].first_slot, count);
        Some(self.prepared.ray.t_max)
    }
}

/// The nearest triangle, the lowest primitive number among equally near ones.
#[inline(always)]
pub(super) fn closest<K: Kernel, W: Width, C: Counter, A: AlphaTest>(
    bvh: &Bvh,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &A,
) -> Option<RayHit> {
    let prepared = PreparedRay::new(ray, bvh.bounds);
    let loaded = K::load(&prepared);
    let mut leaf = Closest {
        bvh,
        prepared: &prepared,
        alpha,
        best: None,
    };
    walk::<K, W, C>(bvh, &loaded, ray.t_max, stack, counter, &mut leaf);
    leaf.best
}

/// True where something blocks the ray. Counts the triangles up to the first that does.
#[inline(always)]
pub(super) fn occluded<K: Kernel, W: Width, C: Counter, A: AlphaTest>(
    bvh: &Bvh,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &A,
) -> bool {
    let prepared = PreparedRay::new(ray, bvh.bounds);
    let loaded = K::load(&prepared);
    let mut leaf = AnyHit {
        bvh,
        prepared: &prepared,
        alpha,
        blocked: false,
    };
    walk::<K, W, C>(bvh, &loaded, ray.t_max, stack, counter, &mut leaf);
    leaf.blocked
}
