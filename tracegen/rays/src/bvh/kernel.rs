//! The two inner loops of traversal, box and triangle tests, in plain Rust and with AVX2.
//!
//! Both perform the same operations in the same order on every lane. Their results are
//! bit-identical, so a trace does not depend on the processor.

use super::count::Counter;
use super::leaf::LeafTest;
use super::node::{BLOCK, Block, Child, Node2, Node8};
use crate::ray::PreparedRay;

/// Box and triangle tests. Methods are inlined into a traversal that is compiled for their
/// instructions.
pub trait Kernel: Copy + Sized {
    /// The kernel's data of a ray.
    type Ray<'a>: Copy;
    /// Prepares a ray for the kernel; [`Self::step2`] needs `for_step2`.
    fn load<'a>(ray: &PreparedRay<'a>, for_step2: bool) -> Self::Ray<'a>;
    /// The two-box test: minus the entry distances, and a bit for each child that is hit before
    /// `t_max`. With negated entries, one minimum serves entries and exits.
    fn step2(ray: &Self::Ray<'_>, node: &Node2, t_max: f32) -> ([f32; 2], u32);
    /// The eight-box test: entry distances into `near`, and a bit for each child that is hit.
    fn step8(ray: &Self::Ray<'_>, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32;
    /// A bit mask of a block's triangles through which the line passes.
    fn lines_hit(ray: &Self::Ray<'_>, block: &Block) -> u32;
    /// A bit mask of two blocks' triangles through which the line would pass after moving sheared
    /// vertices by at most `pad`.
    fn lines_near(ray: &Self::Ray<'_>, blocks: [&Block; 2], pad: f32) -> u32;
    /// Entries and exits of the boxes of a block's triangles, and a bit mask of those whose box is
    /// on the segment up to `t_max`.
    fn boxes_hit(ray: &Self::Ray<'_>, block: &Block, t_max: f32, ends: &mut Ends) -> u32;
    /// Starts to load the first and the third cache line from an address, which need not be valid.
    #[inline(always)]
    fn load_ahead(_: *const i8) {}
    /// Calls a leaf test as a separate function, so that a small loop around it keeps its
    /// registers.
    fn leaf_out_of_line<C: Counter, L: LeafTest<Self>>(
        test: &mut L,
        ray: &Self::Ray<'_>,
        counter: &mut C,
        leaf: Child,
    ) -> Option<f32> {
        test.test(ray, counter, leaf)
    }
}

/// Eight values, aligned for one store.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Lanes8(pub [f32; 8]);

/// Entries, then exits, of four boxes.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub struct Ends(pub [[f32; BLOCK]; 2]);

/// Plain Rust: the reference, and the fallback for processors without AVX2.
#[derive(Clone, Copy)]
pub struct Scalar;

impl Kernel for Scalar {
    type Ray<'a> = PreparedRay<'a>;

    fn load<'a>(ray: &PreparedRay<'a>, _: bool) -> PreparedRay<'a> {
        *ray
    }

    #[inline]
    fn step2(ray: &PreparedRay<'_>, node: &Node2, t_max: f32) -> ([f32; 2], u32) {
        let mut mask = 0;
        let minus_near = std::array::from_fn(|child| {
            let plane = |axis: usize, far: usize| {
                let side = ray.negative[axis] ^ far;
                node.bounds[axis][child + 2 * side]
            };
            let enter = |axis| -ray.near_distance(axis, plane(axis, 0));
            let leave = |axis| ray.far_distance(axis, plane(axis, 1));
            let near = least(least(enter(0), enter(1)), least(enter(2), -ray.ray.t_min));
            let far = least(least(leave(0), leave(1)), least(leave(2), t_max));
            mask |= u32::from(!(far + near).is_sign_negative()) << child;
            near
        });
        (minus_near, mask)
    }

    #[inline]
    fn step8(ray: &PreparedRay<'_>, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32 {
        let mut mask = 0;
        for child in 0..8 {
            let corner = |side: usize| {
                let b = &node.bounds;
                [b[0][side][child], b[1][side][child], b[2][side][child]]
            };
            let (enter, leave) = ray.slab(corner(0), corner(1));
            near.0[child] = enter.max(ray.ray.t_min);
            mask |= u32::from(near.0[child] <= leave.min(t_max)) << child;
        }
        mask
    }

    #[inline]
    fn lines_hit(ray: &PreparedRay<'_>, block: &Block) -> u32 {
        let hit = |lane| ray.line_hits(&block.triangle(lane));
        (0..BLOCK).map(|lane| u32::from(hit(lane)) << lane).sum()
    }

    #[inline]
    fn lines_near(ray: &PreparedRay<'_>, blocks: [&Block; 2], pad: f32) -> u32 {
        let near = |at: usize| ray.line_nears(&blocks[at / BLOCK].triangle(at % BLOCK), pad);
        (0..2 * BLOCK).map(|at| u32::from(near(at)) << at).sum()
    }

    #[inline]
    fn boxes_hit(ray: &PreparedRay<'_>, block: &Block, t_max: f32, ends: &mut Ends) -> u32 {
        let mut mask = 0;
        for lane in 0..BLOCK {
            let (near, far) = ray.triangle_slab(&block.triangle(lane));
            let hit = near <= far && near <= t_max && far > ray.ray.t_min;
            mask |= u32::from(hit) << lane;
            (ends.0[0][lane], ends.0[1][lane]) = (near, far);
        }
        mask
    }
}

/// [`Scalar`] for rays that visit children in the order of the node, with `INNER_FIRST` leaves after inner nodes. They test
/// a box before they push it but not when they pop it: children get their place as entry distance, which is below all
/// limits.
#[derive(Clone, Copy)]
pub struct NodeOrder<const INNER_FIRST: bool>;

impl<const INNER_FIRST: bool> NodeOrder<INNER_FIRST> {
    fn place(children: &[Child], child: usize) -> f32 {
        let waits = INNER_FIRST && children[child].is_leaf();
        let after = if waits { children.len() } else { 0 };
        f32::from_bits((child + after) as u32)
    }
}

impl<const INNER_FIRST: bool> Kernel for NodeOrder<INNER_FIRST> {
    type Ray<'a> = PreparedRay<'a>;

    fn load<'a>(ray: &PreparedRay<'a>, _: bool) -> PreparedRay<'a> {
        *ray
    }

    fn step2(ray: &PreparedRay<'_>, node: &Node2, t_max: f32) -> ([f32; 2], u32) {
        let minus_near = std::array::from_fn(|child| -Self::place(&node.children, child));
        (minus_near, Scalar::step2(ray, node, t_max).1)
    }

    fn step8(ray: &PreparedRay<'_>, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32 {
        let mask = Scalar::step8(ray, node, t_max, near);
        near.0 = std::array::from_fn(|child| Self::place(&node.children, child));
        mask
    }

    fn lines_hit(ray: &PreparedRay<'_>, block: &Block) -> u32 {
        Scalar::lines_hit(ray, block)
    }

    fn lines_near(ray: &PreparedRay<'_>, blocks: [&Block; 2], pad: f32) -> u32 {
        Scalar::lines_near(ray, blocks, pad)
    }

    fn boxes_hit(ray: &PreparedRay<'_>, block: &Block, t_max: f32, ends: &mut Ends) -> u32 {
        Scalar::boxes_hit(ray, block, t_max, ends)
    }
}

/// The processor's minimum: the second operand if neither is smaller.
#[inline]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
