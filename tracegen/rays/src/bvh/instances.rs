//! Two levels: a tree over the boxes of instances, and below it a tree for each mesh, in the
//! mesh's own space.
//!
//! Hits are those of the flattened scene. A ray that enters an instance is moved to the mesh's
//! space with its `t` unchanged. There it finds triangles with boxes and edges that are padded for
//! the rounding of both spaces. Such a triangle is moved to the world as [`Soup`](crate::soup::Soup)
//! moves it, and the ray's own test decides there.

use super::collapse::MAX_TRIANGLES;
use super::count::Counter;
use super::kernel::{Ends, Kernel};
use super::leaf::{AnyHit, Closest, LeafTest, Place};
use super::node::{BLOCK, Block, Child, MASKED};
use super::traverse::{Two, Width, walk};
use super::{Bvh, BvhError, TreeOptions};
use crate::ray::{LARGEST_COORDINATE, PreparedRay, Ray};
use formats::raytrace::TraversalKind;
use glam::{DAffine3, DMat3, DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::collections::HashSet;
use std::marker::PhantomData;

type Triangle = [[f32; 3]; 3];

/// Meshes of fewer triangles are flattened: reading an instance would cost more than it saves.
const LEAST_TRIANGLES: usize = 32;
/// Largest magnitude of an instance's matrix, of its inverse, and of their product.
const LARGEST_SCALE: f64 = (1 << 16) as f64;
/// Padding in the mesh's space beyond that of its own slabs, in paddings of the world's slabs. The
/// world's test is off by half of one, and the rounding of vertices and of the moved ray by a third.
/// A ray that grazes a triangle at an edge may hit it further out: of a million rays at flat
/// instances, 16 then differ with one padding and 3 with four, which cost 1 % more tests.
const PADS: f32 = 4.0;

/// A mesh placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Number of the mesh.
    pub mesh: usize,
    /// Object to world.
    pub transform: DAffine3,
    /// Whether the transform mirrors, which reverses the winding.
    pub mirrored: bool,
}

impl Placement {
    /// A point in the world, relative to an origin.
    #[inline(always)]
    pub fn point(&self, origin: DVec3, p: [f32; 3]) -> [f32; 3] {
        let world = self.transform.transform_point3(Vec3::from(p).as_dvec3());
        (world - origin).as_vec3().to_array()
    }

    /// A triangle of the mesh in the world, counter-clockwise from its front.
    pub fn triangle(&self, origin: DVec3, vertices: Triangle) -> Triangle {
        wound(vertices.map(|p| self.point(origin, p)), self.mirrored)
    }

    /// Whether rays can be moved to the mesh's space with little loss.
    pub(super) fn is_invertible(&self) -> bool {
        let matrix = self.transform.matrix3;
        let [size, inverse] = [matrix, matrix.inverse()].map(|m: DMat3| {
            let sizes = m.to_cols_array().map(f64::abs);
            sizes
                .into_iter()
                .fold(0.0, |a, b| if a >= b { a } else { b })
        });
        // Not the reverse, because of NaN.
        size < LARGEST_SCALE && inverse < LARGEST_SCALE && size * inverse < LARGEST_SCALE
    }
}

#[inline(always)]
fn wound([a, b, c]: Triangle, mirrored: bool) -> Triangle {
    if mirrored { [a, c, b] } else { [a, b, c] }
}

pub(super) fn in_range(p: &[f32; 3]) -> bool {
    p.iter().all(|x| x.abs() <= LARGEST_COORDINATE)
}

/// Lowest and highest coordinates, as a triangle with that box.
pub(super) fn boxed(points: impl Iterator<Item = [f32; 3]>) -> Triangle {
    let points = points.map(Vec3::from).map(|p| (p, p));
    let ends = points.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (min, max) = ends.unwrap_or_default();
    [min.to_array(), max.to_array(), min.to_array()]
}

/// Columns of an affine map, four numbers each for vector instructions.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Columns([[f64; 4]; 4]);

impl Columns {
    fn new(map: &DAffine3) -> Self {
        let m = map.matrix3;
        let columns = [m.x_axis, m.y_axis, m.z_axis, map.translation];
        Self(columns.map(|c| [c.x, c.y, c.z, 0.0]))
    }

    /// A vector; with `POINT`, of a point. Operations are those of [`DAffine3`], in its order.
    #[inline(always)]
    fn times<const POINT: bool>(&self, [x, y, z]: [f32; 3]) -> [f64; 4] {
        let [a, b, c, moved] = &self.0;
        let [x, y, z] = [x, y, z].map(f64::from);
        std::array::from_fn(|i| {
            let sum = a[i] * x + b[i] * y + c[i] * z;
            if POINT { sum + moved[i] } else { sum }
        })
    }
}

#[inline(always)]
fn rounded(v: [f64; 4]) -> [f32; 3] {
    let v = v.map(|x| x as f32);
    [v[0], v[1], v[2]]
}

/// An instance. Rays that enter it read its first cache lines, and those that may hit it all.
#[repr(C)]
pub(super) struct Instance {
    to_object: Columns,
    /// Number of its tree.
    pub tree: u32,
    pub first_primitive: u32,
    mirrored: bool,
    /// Largest size in the mesh's space of a vector whose coordinates in the world are at most 1.
    inverse_size: f32,
    /// Box in the world.
    pub bounds: (Vec3, Vec3),
    /// World position that its coordinates in the world are relative to.
    origin: [f64; 3],
    to_world: Columns,
}

impl Instance {
    /// All triangles that are in no other instance, which a tree has in the world.
    pub fn of_rest(bounds: &Triangle, tree: usize) -> Self {
        let here = Placement {
            mesh: 0,
            transform: DAffine3::IDENTITY,
            mirrored: false,
        };
        Self::new(here, bounds, DVec3::ZERO, tree, 0)
    }

    pub fn new(
        placement: Placement,
        bounds: &Triangle,
        origin: DVec3,
        tree: usize,
        first_primitive: u32,
    ) -> Self {
        let inverse = placement.transform.matrix3.inverse();
        let rows = inverse.transpose();
        let size = |row: DVec3| row.abs().element_sum();
        let inverse_size = size(rows.x_axis)
            .max(size(rows.y_axis))
            .max(size(rows.z_axis));
        let from = placement.transform.translation - origin;
        Self {
            mirrored: placement.mirrored,
            to_world: Columns::new(&placement.transform),
            inverse_size: inverse_size as f32,
            bounds: (bounds[0].into(), bounds[1].into()),
            origin: origin.to_array(),
            to_object: Columns::new(&DAffine3::from_mat3_translation(inverse, inverse * -from)),
            tree: tree as u32,
            first_primitive,
        }
    }

    /// Padding of the mesh's space for a ray that is padded in the world.
    #[inline(always)]
    fn pad(&self, world: Vec3A) -> Vec3A {
        let sizes = Columns(self.to_object.0.map(|column| column.map(f64::abs)));
        rounded(sizes.times::<false>((PADS * world).to_array())).into()
    }

    /// How far sheared coordinates in the mesh's space may be off. Lines need less padding than
    /// slabs: the world's line test is off by the distance to the instance, whereas slabs of the
    /// world are padded for the whole scene.
    #[inline(always)]
    fn sheared_pad(
        &self,
        world: &PreparedRay<'_>,
        moved: &PreparedRay<'_>,
        bounds: (Vec3, Vec3),
    ) -> f32 {
        let own = moved.pad_within(bounds).max_element();
        let more = PADS * self.inverse_size * world.pad_within(self.bounds).max_element();
        // A vertex moves along two axes.
        2.0 * (own + more)
    }

    /// Triangles of the mesh in the world, as [`Placement::triangle`] has them.
    #[inline(always)]
    fn block(&self, block: &Block, out: &mut Block) {
        let [a, b, c, moved] = &self.to_world.0;
        for (vertex, [x, y, z]) in block.vertices.iter().enumerate() {
            let vertex = if self.mirrored {
                [0, 2, 1][vertex]
            } else {
                vertex
            };
            for axis in 0..3 {
                for lane in 0..BLOCK {
                    let [x, y, z] = [x[lane], y[lane], z[lane]].map(f64::from);
                    let world = a[axis] * x + b[axis] * y + c[axis] * z + moved[axis];
                    out.vertices[vertex][axis][lane] = (world - self.origin[axis]) as f32;
                }
            }
        }
        out.primitives = block.primitives;
    }

    /// A ray in the mesh's space.
    #[inline(always)]
    fn moved(&self, ray: &Ray) -> Ray {
        let to_object = &self.to_object;
        Ray {
            origin: rounded(to_object.times::<true>(ray.origin.to_array())).into(),
            direction: rounded(to_object.times::<false>(ray.direction.to_array())).into(),
            ..*ray
        }
    }
}

/// A mesh's tree.
pub(super) struct Lower {
    pub bvh: Bvh,
    /// Numbers of its root as a binary node, an eight-wide one and one of the tree on demand.
    pub first_nodes: [u32; 3],
    pub first_slot: u32,
    first_block: u32,
}

/// What is below the leaves of a tree over boxes.
pub(super) struct Below {
    /// In the order of the leaves.
    pub instances: Vec<Instance>,
    pub trees: Vec<Lower>,
    /// Numbers of the first instance as a node, by kind as in [`Lower`].
    pub first_instances: [u32; 3],
    /// Surface-area cost of what is below, for a ray through the upper tree.
    pub sah_cost: f64,
    /// Whether the last tree is that of all triangles in no other instance.
    pub has_rest: bool,
}

/// Half the surface area of a box.
pub(super) fn half_area((min, max): (Vec3, Vec3)) -> f64 {
    let [x, y, z] = (max - min).to_array().map(f64::from);
    x * y + y * z + z * x
}

/// Costs of parts, each weighted by the share of its box in the area of the whole.
pub(super) fn relative_cost(
    whole: (Vec3, Vec3),
    parts: impl Iterator<Item = ((Vec3, Vec3), f64)>,
) -> f64 {
    let costs = parts.map(|(bounds, cost)| half_area(bounds) * cost);
    costs.sum::<f64>() / half_area(whole).max(f64::MIN_POSITIVE)
}

impl Bvh {
    /// Builds a tree for each mesh that is placed more than once, one for all other triangles, and
    /// one over their instances. Primitives are numbered by placement. Hits are those of
    /// [`Self::build_for`] on all triangles in the world ([`Placement::triangle`]).
    ///
    /// # Errors
    /// There are more triangles than node references can number.
    pub fn build_instanced(
        options: TreeOptions,
        origin: DVec3,
        meshes: &[Vec<Triangle>],
        placements: &[Placement],
        masked: impl Fn(u32) -> bool,
    ) -> Result<Self, BvhError> {
        let of = |p: &Placement| meshes[p.mesh].len();
        let found = placements.iter().map(of).sum();
        let limit = MASKED as usize - 1;
        if found > limit {
            return Err(BvhError::TooManyTriangles { found, limit });
        }
        let number = |n: u32, of: u32| if masked(of) { n | MASKED } else { n };
        let mut uses = vec![0; meshes.len()];
        placements.iter().for_each(|p| uses[p.mesh] += 1);
        // Vertices of meshes that can become instances.
        let points = (meshes.par_iter().zip(&uses)).map(|(mesh, uses)| {
            let all = mesh.as_flattened();
            if *uses < 2 || mesh.len() < LEAST_TRIANGLES || !all.iter().all(in_range) {
                return Vec::new();
            }
            let bits: HashSet<_> = all.iter().map(|p| p.map(f32::to_bits)).collect();
            bits.into_iter().map(|p| p.map(f32::from_bits)).collect()
        });
        let points: Vec<Vec<[f32; 3]>> = points.collect();
        let boxes = placements.par_iter().map(|p| {
            let points = Some(&points[p.mesh]).filter(|points| !points.is_empty())?;
            let bounds = boxed(points.iter().map(|at| p.point(origin, *at)));
            (p.is_invertible() && bounds.iter().all(in_range)).then_some(bounds)
        });
        let boxes: Vec<Option<Triangle>> = boxes.collect();

        let mut trees: Vec<Self> = Vec::new();
        let mut tree_of: Vec<Option<usize>> = vec![None; meshes.len()];
        let mut placed: Vec<(Triangle, Instance)> = Vec::new();
        let (mut rest, mut rest_numbers) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (placement, bounds) in placements.iter().zip(boxes) {
            let mesh = &meshes[placement.mesh];
            let numbers = first..first + mesh.len() as u32;
            if let Some(bounds) = bounds {
                let tree = match tree_of[placement.mesh] {
                    Some(tree) => tree,
                    None => {
                        let number = |n| number(n, first + n);
                        trees.push(Self::build_with(options, mesh, number, MAX_TRIANGLES)?);
                        *tree_of[placement.mesh].insert(trees.len() - 1)
                    }
                };
                placed.push((
                    bounds,
                    Instance::new(*placement, &bounds, origin, tree, first),
                ));
            } else {
                rest.extend(mesh.iter().map(|t| placement.triangle(origin, *t)));
                rest_numbers.extend(numbers.clone().map(|n| number(n, n)));
            }
            first = numbers.end;
        }
        if !rest.is_empty() {
            let tree =
                Self::build_with(options, &rest, |n| rest_numbers[n as usize], MAX_TRIANGLES)?;
            let (min, max) = tree.bounds;
            let bounds = boxed([min, max].map(|p| p.to_array()).into_iter());
            placed.push((bounds, Instance::of_rest(&bounds, trees.len())));
            trees.push(tree);
        }
        Self::over(options, placed, trees, !rest.is_empty())
    }

    /// A tree over the boxes of instances.
    fn over(
        options: TreeOptions,
        placed: Vec<(Triangle, Instance)>,
        trees: Vec<Self>,
        has_rest: bool,
    ) -> Result<Self, BvhError> {
        let boxes: Vec<Triangle> = placed.iter().map(|(bounds, _)| *bounds).collect();
        // The mark keeps instances with equal boxes.
        let mut top = Self::build_with(options, &boxes, |n| n | MASKED, 1)?;
        let parts = placed.iter();
        let parts = parts.map(|(_, of)| (of.bounds, trees[of.tree as usize].sah_cost));
        let sah_cost = relative_cost(top.bounds, parts);
        let first_instances = top.node_counts();
        let mut first_nodes = first_instances.map(|n| n + placed.len() as u32);
        let mut placed: Vec<_> = placed.into_iter().map(|(_, one)| Some(one)).collect();
        // Every leaf has one instance.
        let blocks = std::mem::take(&mut top.blocks);
        let instances = (blocks.iter())
            .filter_map(|block| placed[(block.primitives[0] & !MASKED) as usize].take())
            .collect();
        let (mut first_slot, mut first_block) = (0, 0);
        let lower = |bvh: Self| {
            let (slots, blocks) = (bvh.triangles as u32, bvh.blocks.len() as u32);
            let nodes = bvh.node_counts();
            let lower = Lower {
                bvh,
                first_nodes,
                first_slot,
                first_block,
            };
            first_nodes = std::array::from_fn(|kind| first_nodes[kind] + nodes[kind]);
            (first_slot, first_block) = (first_slot + slots, first_block + blocks);
            lower
        };
        let trees = trees.into_iter().map(lower).collect();
        top.below = Some(Box::new(Below {
            instances,
            trees,
            first_instances,
            sah_cost,
            has_rest,
        }));
        Ok(top)
    }

    /// Numbers of nodes: binary, eight-wide, and of the tree on demand.
    fn node_counts(&self) -> [u32; 3] {
        let counts = [
            self.nodes2.len(),
            self.nodes8.len(),
            self.on_demand.nodes.len(),
        ];
        counts.map(|n| n as u32)
    }
}

impl Below {
    /// Slot of the first triangle of a block that a hit names.
    pub fn slot(&self, kind: TraversalKind, block: u32) -> u32 {
        let behind = self.trees.partition_point(|tree| tree.first_block <= block);
        let tree = &self.trees[behind - 1];
        tree.first_slot + tree.bvh.slots_of(kind)[(block - tree.first_block) as usize]
    }
}

/// A leaf test that searches the tree of one instance after the other.
pub(super) trait Search<'a, K: Kernel> {
    fn enter(&mut self, bvh: &'a Bvh, first_slots: &'a [u32], place: Moved<'a, K>);
}

impl<'a, K: Kernel, A> Search<'a, K> for Closest<'a, A, Moved<'a, K>> {
    fn enter(&mut self, bvh: &'a Bvh, first_slots: &'a [u32], place: Moved<'a, K>) {
        self.query.enter(bvh, first_slots, place);
    }
}

impl<'a, K: Kernel, A> Search<'a, K> for AnyHit<'a, A, Moved<'a, K>> {
    fn enter(&mut self, bvh: &'a Bvh, first_slots: &'a [u32], place: Moved<'a, K>) {
        self.query.enter(bvh, first_slots, place);
    }
}

/// Triangles of an instance.
pub(super) struct Moved<'a, K: Kernel> {
    /// The ray in the world.
    world: &'a K::Ray<'a>,
    instance: &'a Instance,
    first_block: u32,
    /// How far sheared coordinates may be off in the mesh's space.
    sheared_pad: f32,
}

impl<'a, K: Kernel> Moved<'a, K> {
    /// Before the first instance.
    pub fn nowhere(below: &'a Below, world: &'a K::Ray<'a>) -> Self {
        Self {
            world,
            instance: &below.instances[0],
            first_block: 0,
            sheared_pad: 0.0,
        }
    }
}

impl<K: Kernel> Place<K> for Moved<'_, K> {
    const BLOCKS: usize = 2;

    #[inline(always)]
    fn first_primitive(&self) -> u32 {
        self.instance.first_primitive
    }

    #[inline(always)]
    fn first_block(&self) -> u32 {
        self.first_block
    }

    #[inline(always)]
    fn lines_hit(&self, ray: &K::Ray<'_>, blocks: &[Block]) -> u32 {
        let pair = [&blocks[0], blocks.get(1).unwrap_or(&blocks[0])];
        K::lines_near(ray, pair, self.sheared_pad)
    }

    /// Boxes are those of both spaces. No box around a triangle in either starts behind the result,
    /// so hits depend on no order.
    #[inline(always)]
    fn candidates<'b>(
        &self,
        ray: &K::Ray<'_>,
        mask: u32,
        block: &'b Block,
        t_max: f32,
        room: &'b mut Block,
    ) -> (&'b Block, u32, Ends) {
        let [mut ends, mut world] = [const { Ends([[0.0; BLOCK]; 2]) }; 2];
        let mut mask = mask & K::boxes_hit(ray, block, t_max, &mut ends);
        if mask != 0 {
            self.instance.block(block, room);
            mask &= K::lines_hit(self.world, room);
            mask &= K::boxes_hit(self.world, room, t_max, &mut world);
            let ([near, far], [world_near, world_far]) = (&mut ends.0, &world.0);
            for lane in 0..BLOCK {
                near[lane] = if world_near[lane] > near[lane] {
                    world_near[lane]
                } else {
                    near[lane]
                };
                far[lane] = if world_far[lane] < far[lane] {
                    world_far[lane]
                } else {
                    far[lane]
                };
            }
        }
        (room, mask, ends)
    }
}

/// The leaf test of the upper tree: walks the tree of the leaf's instance.
pub(super) struct Enter<'a, K: Kernel, W, L> {
    below: &'a Below,
    world: &'a K::Ray<'a>,
    prepared: &'a PreparedRay<'a>,
    stack: &'a mut Vec<u64>,
    stacked: u32,
    t_max: f32,
    pub search: L,
    width: PhantomData<W>,
}

impl<'a, K: Kernel, W, L> Enter<'a, K, W, L> {
    pub fn new(
        below: &'a Below,
        world: &'a K::Ray<'a>,
        prepared: &'a PreparedRay<'a>,
        stack: &'a mut Vec<u64>,
        search: L,
    ) -> Self {
        Self {
            below,
            world,
            prepared,
            stack,
            stacked: 0,
            t_max: prepared.ray.t_max,
            search,
            width: PhantomData,
        }
    }
}

impl<'a, K: Kernel, W: Width, L: LeafTest<K> + Search<'a, K>> LeafTest<K> for Enter<'a, K, W, L> {
    const LONG: bool = true;

    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        self.stacked = entries;
    }

    #[inline(always)]
    fn test<C: Counter>(&mut self, _: &K::Ray<'_>, counter: &mut C, leaf: Child) -> Option<f32> {
        let (number, _) = leaf.leaf_range();
        let instance = &self.below.instances[number as usize];
        let tree = &self.below.trees[instance.tree as usize];
        counter.step(self.below.first_instances[W::NUMBER] + number);
        let ray = instance.moved(self.prepared.ray);
        if !ray.is_valid() {
            return Some(self.t_max);
        }
        let pad = instance.pad(self.prepared.pad);
        let prepared = PreparedRay::with_pad(&ray, tree.bvh.bounds, pad);
        let loaded = K::load(&prepared, W::NUMBER == Two::NUMBER);
        let place = Moved {
            world: self.world,
            instance,
            first_block: tree.first_block,
            sheared_pad: instance.sheared_pad(self.prepared, &prepared, tree.bvh.bounds),
        };
        self.search
            .enter(&tree.bvh, W::first_slots(&tree.bvh), place);
        let mut counter = Offset {
            counter,
            first_node: tree.first_nodes[W::NUMBER],
            first_slot: tree.first_slot,
            stacked: self.stacked,
        };
        let (stack, search) = (&mut *self.stack, &mut self.search);
        self.t_max =
            walk::<K, W, _, _>(&tree.bvh, &loaded, self.t_max, stack, &mut counter, search)?;
        Some(self.t_max)
    }
}

/// A counter of a lower tree.
struct Offset<'c, C> {
    counter: &'c mut C,
    first_node: u32,
    first_slot: u32,
    /// Entries on the stack of the upper tree.
    stacked: u32,
}

impl<C: Counter> Counter for Offset<'_, C> {
    #[inline(always)]
    fn step(&mut self, node: u32) {
        self.counter.step(self.first_node + node);
    }
    #[inline(always)]
    fn triangles(&mut self, first_slot: impl FnOnce() -> u32, count: u32) {
        let first = self.first_slot;
        self.counter.triangles(|| first + first_slot(), count);
    }
    #[inline(always)]
    fn alpha(&mut self) {
        self.counter.alpha();
    }
    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        self.counter.stacked(self.stacked + entries);
    }
}
