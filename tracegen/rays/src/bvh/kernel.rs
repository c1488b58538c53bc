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
    type Ray: Copy;
    /// Prepares a ray for the kernel.
    fn load(ray: &PreparedRay) -> Self::Ray;
    /// The two-box test: minus the entry distances, and a bit for each child that is hit before
    /// `t_max`. With negated entries, one minimum serves entries and exits.
    fn step2(ray: &Self::Ray, node: &Node2, t_max: f32) -> ([f32; 2], u32);
    /// The eight-box test: entry distances into `near`, and a bit for each child that is hit.
    fn step8(ray: &Self::Ray, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32;
    /// A bit mask of a block's triangles through which the line passes.
    fn lines_hit(ray: &Self::Ray, prepared: &PreparedRay, block: &Block) -> u32;
    /// Calls a leaf test as a separate function, so that a small loop around it keeps its
    /// registers.
    fn leaf_out_of_line<C: Counter, L: LeafTest<Self, C>>(
        test: &mut L,
        ray: &Self::Ray,
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

/// Plain Rust: the reference, and the fallback for processors without AVX2.
#[derive(Clone, Copy)]
pub struct Scalar;

impl Kernel for Scalar {
    type Ray = PreparedRay;

    fn load(ray: &PreparedRay) -> PreparedRay {
        *ray
    }

    #[inline]
    fn step2(ray: &PreparedRay, node: &Node2, t_max: f32) -> ([f32; 2], u32) {
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
    fn step8(ray: &PreparedRay, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32 {
        let mut mask = 0;
        for child in 0..8 {
            let corner = |side: usize| {
                let b = &node.bounds[side];
                [b[0][child], b[1][child], b[2][child]]
            };
            let (enter, leave) = ray.slab(corner(0), corner(1));
            near.0[child] = enter.max(ray.ray.t_min);
            mask |= u32::from(near.0[child] <= leave.min(t_max)) << child;
        }
        mask
    }

    #[inline]
    fn lines_hit(_: &PreparedRay, prepared: &PreparedRay, block: &Block) -> u32 {
        (0..BLOCK)
            .map(|lane| u32::from(prepared.line_hits(&block.triangle(lane))) << lane)
            .sum()
    }
}

/// The processor's minimum: the second operand if neither is smaller.
#[inline]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
