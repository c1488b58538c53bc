//! Closest-hit and any-hit traversal of all trees, for any kernel and counter.

use super::Bvh;
use super::count::Counter;
use super::instances::{Below, Enter, Moved};
use super::kernel::{Kernel, Lanes8};
use super::leaf::{AlphaTest, AnyHit, Closest, InPlace, LeafTest, Query, RayHit};
use super::node::{Child, Node8};
use crate::ray::{PreparedRay, Ray};

/// Nodes to visit. Reused between rays to save the allocation.
#[derive(Clone, Debug, Default)]
pub struct TraversalStack {
    /// Entry distance in the upper half (its bits sort like the number, because it is not
    /// negative), child in the lower half.
    entries: Vec<u64>,
    /// The same of the tree of an instance.
    below: Vec<u64>,
}

impl TraversalStack {
    /// A stack for trees that need up to `capacity` entries.
    pub fn new(capacity: usize) -> Self {
        Self {
            entries: vec![0; capacity],
            below: Vec::new(),
        }
    }
}

/// Not inlined, because it happens once a thread.
#[cold]
#[inline(never)]
fn grow(stack: &mut Vec<u64>, capacity: usize) {
    stack.resize(capacity, 0);
}

/// A stack entry. `near` must not be negative.
#[inline(always)]
fn pack(near: f32, child: Child) -> u64 {
    u64::from(near.to_bits() & 0x7FFF_FFFF) << 32 | u64::from(child.0)
}

#[inline(always)]
fn unpack(entry: u64) -> (f32, Child) {
    (f32::from_bits((entry >> 32) as u32), Child(entry as u32))
}

/// The tree to traverse.
pub trait Width {
    /// The same for a tree over instances.
    type Upper: Width;
    /// Whether leaf tests are separate functions. The loop of the binary tree is then short enough
    /// to stay in registers. That of the eight-wide tree is not, and the call only costs time.
    const LEAVES_OUT_OF_LINE: bool;
    /// Its place in [`Lower::first_nodes`](super::instances::Lower).
    const NUMBER: usize;

    /// By block, the slot of its first triangle.
    fn first_slots(bvh: &Bvh) -> &[u32];

    /// Visits an inner node: pushes its hit children except for the nearest, which it returns.
    fn visit<K: Kernel, L: LeafTest<K>>(
        bvh: &Bvh,
        ray: &K::Ray<'_>,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child>;
}

/// The binary tree.
pub struct Two;

impl Width for Two {
    type Upper = Self;
    const LEAVES_OUT_OF_LINE: bool = true;
    const NUMBER: usize = 0;

    #[inline(always)]
    fn first_slots(bvh: &Bvh) -> &[u32] {
        &bvh.first_slots
    }

    #[inline(always)]
    fn visit<K: Kernel, L: LeafTest<K>>(
        bvh: &Bvh,
        ray: &K::Ray<'_>,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child> {
        let node = &bvh.nodes2[node as usize];
        let (minus_near, mask) = K::step2(ray, node, t_max);
        // Nested tests, because a match would become a jump table.
        let [left, right] = node.children;
        if mask & 1 != 0 {
            if mask & 2 != 0 {
                let (nearer, pushed) = if minus_near[0] >= minus_near[1] {
                    (left, pack(minus_near[1], right))
                } else {
                    keep_branch();
                    (right, pack(minus_near[0], left))
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

/// Forces a branch for a two-way choice. With a select (or a jump table for four cases), the next
/// node's address depends on the box test; with a predicted branch, the node is fetched in
/// parallel. Measured gain in the binary tree: 10 %.
#[inline(always)]
fn keep_branch() {
    // SAFETY: the assembly is empty and has no effect.
    unsafe { std::arch::asm!("", options(nomem, nostack, preserves_flags)) }
}

/// Starts to load a child of a wide node that is visited later, if at all. Gains 1 to 5 %; loading
/// all its lines gains less, and so does loading the child that is visited next.
#[inline(always)]
fn load_ahead<K: Kernel, L: LeafTest<K>, const UPPER: bool>(
    bvh: &Bvh,
    nodes: &[Node8],
    child: Child,
) {
    if !L::LOADS_AHEAD {
        return;
    }
    let at = if child.is_leaf() {
        let (block, _) = child.leaf_range();
        match &bvh.below {
            Some(below) if UPPER => below.instances.as_ptr().wrapping_add(block as usize).cast(),
            _ => bvh.blocks.as_ptr().wrapping_add(block as usize).cast(),
        }
    } else {
        nodes.as_ptr().wrapping_add(child.0 as usize).cast()
    };
    K::load_ahead(at);
}

/// The lesser and the greater entry.
#[inline(always)]
fn ordered(a: u64, b: u64) -> (u64, u64) {
    (a.min(b), a.max(b))
}

/// A wide tree: the eight-wide one, or the one on demand, with four children or compressed nodes.
pub struct Wide<const ON_DEMAND: bool, const UPPER: bool = false>;

impl<const ON_DEMAND: bool, const UPPER: bool> Width for Wide<ON_DEMAND, UPPER> {
    type Upper = Wide<ON_DEMAND, true>;
    const LEAVES_OUT_OF_LINE: bool = false;
    const NUMBER: usize = 1 + ON_DEMAND as usize;

    #[inline(always)]
    fn first_slots(bvh: &Bvh) -> &[u32] {
        if ON_DEMAND {
            &bvh.on_demand.first_slots
        } else {
            &bvh.first_slots
        }
    }

    #[inline(always)]
    fn visit<K: Kernel, L: LeafTest<K>>(
        bvh: &Bvh,
        ray: &K::Ray<'_>,
        node: u32,
        t_max: f32,
        stack: &mut [u64],
        top: &mut usize,
    ) -> Option<Child> {
        let nodes = if ON_DEMAND {
            &bvh.on_demand.nodes
        } else {
            &bvh.nodes8
        };
        let node = &nodes[node as usize];
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
        // One or two hit children, the most frequent cases, need no sorting.
        let base = *top;
        if mask == 0 {
            *top = base + 1;
            if near <= near1 {
                load_ahead::<K, L, UPPER>(bvh, nodes, child1);
                stack[base] = pack(near1, child1);
                return Some(child);
            }
            keep_branch();
            load_ahead::<K, L, UPPER>(bvh, nodes, child);
            stack[base] = pack(near, child);
            return Some(child1);
        }
        // Three are sorted in registers.
        let third = mask.trailing_zeros() as usize & 7;
        mask &= mask - 1;
        let (a, b) = ordered(pack(near, child), pack(near1, child1));
        let (b, c) = ordered(b, pack(lanes.0[third], node.children[third]));
        let (mut nearest, b) = ordered(a, b);
        for pushed in [b, c] {
            load_ahead::<K, L, UPPER>(bvh, nodes, unpack(pushed).1);
        }
        stack[base] = c;
        stack[base + 1] = b;
        *top = base + 2;
        // Insertion sort keeps the nearest pushed entries on top.
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let entry = pack(lanes.0[lane], node.children[lane]);
            let pushed = nearest.max(entry);
            nearest = nearest.min(entry);
            load_ahead::<K, L, UPPER>(bvh, nodes, unpack(pushed).1);
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

/// Traverses a tree from the root. Returns the last `t_max`, or `None` if a leaf test stopped.
#[inline(always)]
pub(super) fn walk<K: Kernel, W: Width, C: Counter, L: LeafTest<K>>(
    bvh: &Bvh,
    ray: &K::Ray<'_>,
    mut t_max: f32,
    stack: &mut Vec<u64>,
    counter: &mut C,
    leaf: &mut L,
) -> Option<f32> {
    if stack.len() < bvh.stack_size {
        grow(stack, bvh.stack_size);
    }
    let entries = &mut stack[..];
    let mut top = 0;
    let mut at = Child(0);
    loop {
        let next = if at.is_leaf() {
            leaf.stacked(top as u32);
            t_max = if W::LEAVES_OUT_OF_LINE || L::LONG {
                K::leaf_out_of_line(leaf, ray, counter, at)?
            } else {
                leaf.test(ray, counter, at)?
            };
            None
        } else {
            counter.step(at.0);
            let next = W::visit::<K, L>(bvh, ray, at.0, t_max, entries, &mut top);
            counter.stacked(top as u32);
            next
        };
        at = match next {
            Some(child) => child,
            None => loop {
                if top == 0 {
                    return Some(t_max);
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

/// The nearest triangle (of equally near ones, the lowest primitive number), or with `ANY_HIT` the first
/// triangle found that blocks the ray, which counts the triangles up to it.
#[inline(always)]
pub(super) fn search<const ANY_HIT: bool, K: Kernel, W: Width, C: Counter, A: AlphaTest>(
    bvh: &Bvh,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &A,
) -> Option<RayHit> {
    let prepared = PreparedRay::new(ray, bvh.bounds);
    let loaded = K::load(&prepared, W::NUMBER == Two::NUMBER);
    let query = Query {
        bvh,
        first_slots: W::first_slots(bvh),
        prepared: &prepared,
        alpha,
        place: InPlace,
    };
    let entries = &mut stack.entries;
    if ANY_HIT {
        let mut leaf = AnyHit::new(query);
        walk::<K, W, C, _>(bvh, &loaded, ray.t_max, entries, counter, &mut leaf);
        leaf.hit()
    } else {
        let mut leaf = Closest::new(query);
        walk::<K, W, C, _>(bvh, &loaded, ray.t_max, entries, counter, &mut leaf);
        leaf.hit()
    }
}

/// [`search`] in the trees of instances, whose boxes are in the tree `bvh`. It is compiled for all alpha
/// tests at once, because it is long.
#[inline(always)]
pub(super) fn search_below<const ANY_HIT: bool, K: Kernel, W: Width, C: Counter>(
    bvh: &Bvh,
    below: &Below,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &dyn AlphaTest,
) -> Option<RayHit> {
    let prepared = PreparedRay::new(ray, bvh.bounds);
    let loaded = K::load(&prepared, W::NUMBER == Two::NUMBER);
    let query = Query {
        bvh,
        first_slots: W::first_slots(bvh),
        prepared: &prepared,
        alpha: &alpha,
        place: Moved::<K>::nowhere(below, &loaded),
    };
    let (entries, inner) = (&mut stack.entries, &mut stack.below);
    if ANY_HIT {
        let mut enter = Enter::<K, W, _>::new(below, &loaded, &prepared, inner, AnyHit::new(query));
        walk::<K, W::Upper, C, _>(bvh, &loaded, ray.t_max, entries, counter, &mut enter);
        enter.search.hit()
    } else {
        let mut enter =
            Enter::<K, W, _>::new(below, &loaded, &prepared, inner, Closest::new(query));
        walk::<K, W::Upper, C, _>(bvh, &loaded, ray.t_max, entries, counter, &mut enter);
        enter.search.hit()
    }
}
