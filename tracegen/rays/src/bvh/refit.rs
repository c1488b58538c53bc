//! Refit: a tree over other positions of its triangles, and the work of an update.
//!
//! Every node is behind its parent, so one pass from the last node to the first moves all boxes.

use super::compress::quantised_boxes;
use super::instances::{Instance, boxed, half_area, in_range, relative_cost};
use super::node::{BLOCK, Block, Child, MASKED, Node2, Node8};
use super::treelets::Renumbered;
use super::{Bvh, BvhError, Placement};
use crate::moved::Moved;
use formats::raytrace::{BvhUpdate, TraversalKind, UpdateMethod};
use glam::{DVec3, Vec3};

type Triangle = [[f32; 3]; 3];
type Bounds = (Vec3, Vec3);

const NOTHING: Bounds = (Vec3::MAX, Vec3::MIN);

fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A node whose children's boxes can be moved.
trait Boxed: Renumbered {
    fn set(&mut self, side: usize, bounds: Bounds);
}

impl Boxed for Node2 {
    fn set(&mut self, side: usize, (min, max): Bounds) {
        for axis in 0..3 {
            (self.bounds[axis][side], self.bounds[axis][side + 2]) = (min[axis], max[axis]);
        }
    }
}

impl Boxed for Node8 {
    fn set(&mut self, side: usize, (min, max): Bounds) {
        for axis in 0..3 {
            (self.bounds[axis][0][side], self.bounds[axis][1][side]) = (min[axis], max[axis]);
        }
    }
}

/// The values of all nodes, each combined from those of its children, which `store` gets as well.
fn fold_up<N: Renumbered, T: Copy>(
    nodes: &mut [N],
    start: T,
    mut leaf: impl FnMut(Child) -> T,
    combine: impl Fn(T, T) -> T,
    store: impl Fn(&mut N, usize, T),
) -> Vec<T> {
    let mut own = vec![start; nodes.len()];
    for (at, node) in nodes.iter_mut().enumerate().rev() {
        for side in 0..node.children().len() {
            let of = match node.children()[side] {
                Child::NONE => continue,
                child if child.is_leaf() => leaf(child),
                child => own[child.0 as usize],
            };
            store(node, side, of);
            own[at] = combine(own[at], of);
        }
    }
    own
}

fn refit<N: Boxed>(nodes: &mut [N], leaf: impl Fn(Child) -> Bounds) -> Bounds {
    let own = fold_up(nodes, NOTHING, leaf, union, N::set);
    own.first().copied().unwrap_or_default()
}

/// Nodes with a moved leaf below.
fn moved_nodes<N: Renumbered>(nodes: &[N], moved: impl FnMut(Child) -> bool) -> u64 {
    let own = fold_up(
        &mut nodes.to_vec(),
        false,
        moved,
        |a, b| a || b,
        |_, _, _| (),
    );
    own.into_iter().filter(|moved| *moved).count() as u64
}

/// The triangles of a leaf, as block and lane.
fn members(leaf: Child) -> impl Iterator<Item = (usize, usize)> {
    let (first, count) = leaf.leaf_range();
    (0..count as usize).map(move |i| (first as usize + i / BLOCK, i % BLOCK))
}

/// Surface-area cost of a binary tree, as the builder computes it.
fn sah_cost(nodes: &[Node2], whole: Bounds) -> f64 {
    let sides = nodes
        .iter()
        .flat_map(|node| [0, 1].map(|side| (node, side)));
    let parts = sides.filter_map(|(node, side)| {
        let (child, corner) = (node.children[side], |at: usize| {
            node.bounds.map(|axis| axis[at]).into()
        });
        let weight = if child.is_leaf() {
            child.leaf_range().1
        } else {
            1
        };
        (child != Child::NONE).then(|| ((corner(side), corner(side + 2)), f64::from(weight)))
    });
    // The inner node above a single leaf is none of the builder's.
    let is_leaf = nodes
        .iter()
        .any(|node| node.children.contains(&Child::NONE));
    let root = u8::from(half_area(whole) > 0.0 && !is_leaf);
    relative_cost(whole, parts) + f64::from(root)
}

impl Bvh {
    /// Moves the triangles, which keep their numbers, and the boxes of all trees. The tree must have been built to be
    /// refitted ([`TreeOptions::refit`](super::TreeOptions)).
    ///
    /// # Errors
    /// A coordinate is not finite or exceeds the limit.
    pub fn refit(&mut self, triangles: &[Triangle]) -> Result<(), BvhError> {
        self.refit_with(|number| triangles[number as usize])
    }

    fn refit_with(&mut self, triangle: impl Fn(u32) -> Triangle) -> Result<(), BvhError> {
        for block in &mut self.blocks {
            for lane in (0..BLOCK).filter(|lane| block.primitives[*lane] != u32::MAX) {
                let number = block.primitives[lane] & !MASKED;
                let vertices = triangle(number);
                if !vertices.iter().all(in_range) {
                    return Err(BvhError::NotRefitted {
                        what: "triangle",
                        number,
                    });
                }
                for (v, vertex) in vertices.iter().enumerate() {
                    for (axis, value) in vertex.iter().enumerate() {
                        block.vertices[v][axis][lane] = *value;
                    }
                }
            }
        }
        let blocks = std::mem::take(&mut self.blocks);
        let bounds = |(block, lane): (usize, usize)| {
            let points = Block::triangle(&blocks[block], lane).map(Vec3::from);
            points
                .into_iter()
                .fold(NOTHING, |sum, p| union(sum, (p, p)))
        };
        self.move_boxes(|leaf| members(leaf).map(bounds).fold(NOTHING, union));
        self.blocks = blocks;
        Ok(())
    }

    fn move_boxes(&mut self, leaf: impl Fn(Child) -> Bounds) {
        self.bounds = refit(&mut self.nodes2, &leaf);
        refit(&mut self.nodes8, &leaf);
        refit(&mut self.on_demand.nodes, &leaf);
        if self.on_demand.kind == Some(TraversalKind::Cwbvh8) {
            for node in &mut self.on_demand.nodes {
                node.bounds = quantised_boxes(node);
            }
        }
        self.sah_cost = sah_cost(&self.nodes2, self.bounds);
    }

    /// [`Self::refit`] for a tree of instances ([`Self::build_instanced`]).
    ///
    /// # Errors
    /// A coordinate exceeds the limit, or the matrix of an instance has no inverse.
    ///
    /// # Panics
    /// The tree has no instances.
    pub fn refit_instanced(
        &mut self,
        origin: DVec3,
        meshes: &[Vec<Triangle>],
        placements: &[Placement],
    ) -> Result<(), BvhError> {
        let mut below = self.below.take().expect("a tree of instances");
        let objects = Objects::new(placements.iter().map(|p| meshes[p.mesh].len()));
        let trees = &mut below.trees;
        let mut mesh_of = vec![None; trees.len()];
        for instance in &below.instances {
            let object = objects.of(instance.first_primitive);
            let is_rest = below.has_rest && instance.tree as usize + 1 == trees.len();
            mesh_of[instance.tree as usize] = (!is_rest).then(|| placements[object].mesh);
        }
        for (tree, mesh) in trees.iter_mut().zip(&mesh_of) {
            tree.bvh.refit_with(|number| match mesh {
                Some(mesh) => meshes[*mesh][number as usize],
                None => {
                    let (object, number) = objects.within(number);
                    let at = &placements[object];
                    at.triangle(origin, meshes[at.mesh][number as usize])
                }
            })?;
        }
        for instance in &mut below.instances {
            let (tree, first) = (instance.tree as usize, instance.first_primitive);
            let Some(mesh) = mesh_of[tree] else {
                let (min, max) = trees[tree].bvh.bounds;
                *instance =
                    Instance::of_rest(&boxed([min, max].map(|p| p.to_array()).into_iter()), tree);
                continue;
            };
            let object = objects.of(first);
            let at = placements[object];
            let bounds = boxed(meshes[mesh].iter().flatten().map(|p| at.point(origin, *p)));
            if !at.is_invertible() || !bounds.iter().all(in_range) {
                let number = object as u32;
                return Err(BvhError::NotRefitted {
                    what: "instance",
                    number,
                });
            }
            *instance = Instance::new(at, &bounds, origin, tree, first);
        }
        self.move_boxes(|leaf| below.instances[leaf.leaf_range().0 as usize].bounds);
        let parts = below.instances.iter();
        let parts = parts.map(|of| (of.bounds, trees[of.tree as usize].bvh.sah_cost));
        below.sah_cost = relative_cost(self.bounds, parts);
        self.below = Some(below);
        Ok(())
    }

    /// What an update of a tree reads and writes after some of its triangles have moved.
    pub fn update(&self, kind: TraversalKind, method: UpdateMethod, moved: &Moved) -> BvhUpdate {
        let Some(below) = &self.below else {
            return self.own_update(kind, method, |number| moved.triangle(number));
        };
        let mut sum = BvhUpdate {
            method,
            ..BvhUpdate::default()
        };
        let mut moved_trees = vec![false; below.trees.len()];
        let is_rest = |tree: usize| below.has_rest && tree + 1 == below.trees.len();
        let mut objects = vec![0; below.trees.len()];
        for instance in &below.instances {
            objects[instance.tree as usize] = moved.objects.of(instance.first_primitive);
        }
        for (tree, lower) in below.trees.iter().enumerate() {
            let own = lower.bvh.own_update(kind, method, |number| {
                if is_rest(tree) {
                    moved.triangle(number)
                } else {
                    moved.in_mesh_of(objects[tree], number)
                }
            });
            moved_trees[tree] = own.nodes > 0;
            formats::add_fields!(sum, own, triangles_read, triangles_written, nodes);
        }
        let above = self.nodes_above(kind, |leaf| {
            let instance = &below.instances[leaf.leaf_range().0 as usize];
            let tree = instance.tree as usize;
            let placed =
                || !is_rest(tree) && moved.placed[moved.objects.of(instance.first_primitive)];
            let is_moved = moved_trees[tree] || placed();
            sum.instances += u64::from(is_moved);
            is_moved
        });
        let is_built = method == UpdateMethod::Rebuild && above > 0;
        if is_built {
            sum.instances = below.instances.len() as u64;
        }
        sum.nodes += if is_built { self.size(kind).0 } else { above };
        sum
    }

    /// [`Self::update`] of a tree over triangles.
    fn own_update(
        &self,
        kind: TraversalKind,
        method: UpdateMethod,
        moved: impl Fn(u32) -> bool,
    ) -> BvhUpdate {
        let (mut read, mut written) = (0, 0);
        let nodes = self.nodes_above(kind, |leaf| {
            let number =
                |(block, lane): (usize, usize)| self.blocks[block].primitives[lane] & !MASKED;
            let of_leaf = members(leaf).filter(|at| moved(number(*at))).count() as u64;
            written += of_leaf;
            read += if of_leaf > 0 {
                u64::from(leaf.leaf_range().1)
            } else {
                0
            };
            of_leaf > 0
        });
        let counts = if method == UpdateMethod::Rebuild && nodes > 0 {
            [self.triangles, self.triangles, self.size(kind).0]
        } else {
            [read, written, nodes]
        };
        let [triangles_read, triangles_written, nodes] = counts;
        BvhUpdate {
            method,
            triangles_read,
            triangles_written,
            instances: 0,
            nodes,
        }
    }

    /// Nodes of a tree, without what is below, that have a moved leaf below.
    fn nodes_above(&self, kind: TraversalKind, moved: impl FnMut(Child) -> bool) -> u64 {
        match kind {
            TraversalKind::Bvh2 => moved_nodes(&self.nodes2, moved),
            TraversalKind::Bvh8 => moved_nodes(&self.nodes8, moved),
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => {
                moved_nodes(&self.on_demand.nodes, moved)
            }
        }
    }
}

/// Which primitives each object has.
#[derive(Debug)]
pub(crate) struct Objects {
    /// First primitive of each.
    first: Vec<u32>,
}

impl Objects {
    /// Objects with so many triangles each.
    pub fn new(triangles: impl Iterator<Item = usize>) -> Self {
        let mut next = 0;
        let first = triangles.map(|count| {
            next += count as u32;
            next - count as u32
        });
        Self {
            first: first.collect(),
        }
    }

    /// The object of a primitive.
    pub fn of(&self, primitive: u32) -> usize {
        self.first.partition_point(|first| *first <= primitive) - 1
    }

    /// The object of a primitive, and the number of the primitive within it.
    pub fn within(&self, primitive: u32) -> (usize, u32) {
        let object = self.of(primitive);
        (object, primitive - self.first[object])
    }
}

#[cfg(test)]
mod tests;
