//! Stacks: many triangles with the same vertices.
//!
//! The builder merges nearest neighbours. Within a stack all distances are equal, and its time
//! grows with the square of the stack's size. A stack too large for one leaf is therefore built as
//! one triangle and replaced by a balanced subtree afterwards. Triangles behind the first opaque
//! one of a stack are left out: of equally near hits the lowest number counts, so no ray can end at
//! them.

use super::node::MASKED;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

type Vertices = [[f32; 3]; 3];

/// The triangles to build.
pub(super) struct Stacks {
    /// Position of each built triangle in the list of all.
    pub built: Vec<u32>,
    /// Stacks too large for a leaf: the built triangle that represents each, ascending, and the
    /// positions of all triangles of the stack at which a ray can end.
    stacks: Vec<(u32, Vec<u32>)>,
    /// Most triangles of a leaf.
    most: usize,
}

/// The bits of a triangle's coordinates.
fn bits(triangle: &Vertices) -> [[u32; 3]; 3] {
    triangle.map(|vertex| vertex.map(f32::to_bits))
}

/// FNV-1a of a triangle's vertices.
fn hash(triangle: &Vertices) -> u64 {
    let words = bits(triangle);
    words
        .as_flattened()
        .iter()
        .fold(0xCBF2_9CE4_8422_2325, |hash, word| {
            (hash ^ u64::from(*word)).wrapping_mul(0x0000_0100_0000_01B3)
        })
}

impl Stacks {
    /// Finds the stacks. `numbers` are primitive numbers, ascending, with their mask flags.
    /// With `keep_all`, none is left out: triangles that are equal now may move apart.
    pub fn find(triangles: &[Vertices], numbers: &[u32], most: usize, keep_all: bool) -> Self {
        let mut hashes: Vec<(u64, u32)> = triangles.iter().map(hash).zip(0..).collect();
        hashes.sort_unstable();
        let mut left_out = vec![false; triangles.len()];
        let mut stacks: Vec<(u32, Vec<u32>)> = Vec::new();
        for alike in hashes.chunk_by(|a, b| a.0 == b.0) {
            if alike.len() <= most {
                continue;
            }
            let mut alike: Vec<u32> = alike.iter().map(|(_, at)| *at).collect();
            let of = |at: &u32| bits(&triangles[*at as usize]);
            alike.sort_unstable_by_key(|at| (of(at), *at));
            for stack in alike.chunk_by(|a, b| of(a) == of(b)) {
                if stack.len() <= most {
                    continue;
                }
                let opaque = |at: &u32| !keep_all && numbers[*at as usize] & MASKED == 0;
                let end = stack
                    .iter()
                    .position(opaque)
                    .map_or(stack.len(), |at| at + 1);
                let (kept, behind) = stack.split_at(end);
                // A stack that fits into a leaf needs no representative.
                let not_built = if kept.len() > most { &kept[1..] } else { &[] };
                for at in behind.iter().chain(not_built) {
                    left_out[*at as usize] = true;
                }
                if kept.len() > most {
                    stacks.push((kept[0], kept.to_vec()));
                }
            }
        }
        let all = 0..triangles.len() as u32;
        let built: Vec<u32> = all.filter(|at| !left_out[*at as usize]).collect();
        for (stands_for, _) in &mut stacks {
            *stands_for = built.partition_point(|at| at < stands_for) as u32;
        }
        stacks.sort_unstable();
        Self {
            built,
            stacks,
            most,
        }
    }

    /// Converts a tree over the built triangles into one over all triangles at which a ray can end.
    pub fn expand(&self, tree: &mut Bvh2, triangles: &[Vertices]) {
        if self.built.len() == triangles.len() {
            return;
        }
        let stack = |built: u32| {
            let found = self.stacks.binary_search_by_key(&built, |(at, _)| *at);
            found.ok().map(|at| &self.stacks[at].1)
        };
        let built = std::mem::take(&mut tree.primitive_indices);
        for at in 0..tree.nodes.len() {
            if !tree.nodes[at].is_leaf() {
                continue;
            }
            let first = tree.nodes[at].first_index as usize;
            let mut members = Vec::new();
            for &one in &built[first..first + tree.nodes[at].prim_count as usize] {
                match stack(one) {
                    Some(all) => members.extend(all),
                    None => members.push(self.built[one as usize]),
                }
            }
            subtree(tree, at, &members, triangles, self.most);
        }
    }
}

/// Places members below a node, halved until they fit into a leaf.
fn subtree(tree: &mut Bvh2, at: usize, members: &[u32], triangles: &[Vertices], most: usize) {
    if members.len() <= most {
        let first = tree.primitive_indices.len();
        tree.primitive_indices.extend(members);
        let aabb = *tree.nodes[at].aabb();
        tree.nodes[at] = Bvh2Node::new(aabb, members.len() as u32, first as u32);
        return;
    }
    let first = tree.nodes.len();
    let halves = members.split_at(members.len() / 2);
    for half in [halves.0, halves.1] {
        let corners = half
            .iter()
            .flat_map(|member| triangles[*member as usize].map(Vec3A::from));
        let bounds = corners.fold((Vec3A::MAX, Vec3A::MIN), |(low, high), corner| {
            (low.min(corner), high.max(corner))
        });
        tree.nodes
            .push(Bvh2Node::new(Aabb::new(bounds.0, bounds.1), 1, 0));
    }
    let aabb = *tree.nodes[at].aabb();
    tree.nodes[at] = Bvh2Node::new(aabb, 0, first as u32);
    subtree(tree, first, halves.0, triangles, most);
    subtree(tree, first + 1, halves.1, triangles, most);
}

#[cfg(test)]
mod tests {
    use super::super::count::Counts;
    use super::super::{AlphaTest, Bvh, TraversalStack};
    use super::*;
    use crate::ray::Ray;
    use formats::raytrace::TraversalKind;
    use glam::Vec3;

    const ACROSS: Vertices = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];

    /// An alpha test in which only one triangle is opaque.
    struct Only(u32);

    impl AlphaTest for Only {
        fn opaque(&self, primitive: u32, _: [f32; 2]) -> bool {
            primitive == self.0
        }
    }

    fn hit(bvh: &Bvh, tree: TraversalKind, alpha: &impl AlphaTest) -> (Option<u32>, Counts) {
        let ray = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z);
        let (mut stack, mut counts) = (TraversalStack::default(), Counts::default());
        let hit = bvh.closest(tree, &ray, &mut stack, &mut counts, alpha);
        (hit.map(|hit| hit.primitive), counts)
    }

    #[test]
    fn a_stack_costs_as_much_as_its_first_opaque_triangle() {
        for count in [16_000, 64_000] {
            let triangles = vec![ACROSS; count];
            let numbers: Vec<u32> = (0..count as u32).collect();
            assert_eq!(Stacks::find(&triangles, &numbers, 8, false).built, [0]);
            let bvh = Bvh::build(&triangles, |_| false).unwrap();
            for tree in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
                let (found, counts) = hit(&bvh, tree, &Only(0));
                assert_eq!((found, counts.triangle_tests), (Some(0), 1));
            }
        }
    }

    #[test]
    fn a_stack_of_masked_triangles_gives_a_tree_of_logarithmic_depth() {
        let mut depths = Vec::new();
        for count in [16_000_u32, 64_000] {
            let mut triangles = vec![ACROSS; count as usize];
            // A triangle behind the stack, not part of it.
            triangles.push(ACROSS.map(|[x, y, _]| [x, y, -1.0]));
            let masked = |number| number < count;
            let numbers: Vec<u32> = (0..count).map(|n| n | MASKED).chain([count]).collect();
            assert_eq!(
                Stacks::find(&triangles, &numbers, 8, false).built,
                [0, count]
            );
            let bvh = Bvh::build(&triangles, masked).unwrap();
            for tree in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
                for only in [0, 1, 777, count - 1] {
                    assert_eq!(hit(&bvh, tree, &Only(only)).0, Some(only));
                }
                let (found, counts) = hit(&bvh, tree, &Only(u32::MAX));
                assert_eq!(found, Some(count));
                assert_eq!(counts.triangle_tests, count + 1);
                assert!(counts.steps <= count / 2, "{} steps", counts.steps);
                depths.push(bvh.summary(tree).depth);
            }
        }
        assert!(depths.iter().all(|depth| *depth < 20), "{depths:?}");
    }

    #[test]
    fn only_triangles_behind_the_first_opaque_one_are_left_out() {
        let triangles = [ACROSS; 20];
        let bvh = Bvh::build(&triangles, |number| number != 2).unwrap();
        assert_eq!(bvh.summary(TraversalKind::Bvh2).triangles, 3);
        for tree in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
            assert_eq!(hit(&bvh, tree, &Only(1)).0, Some(1));
            assert_eq!(hit(&bvh, tree, &Only(9)).0, Some(2));
        }
    }

    #[test]
    fn triangles_that_fit_into_a_leaf_are_not_a_stack() {
        let numbers: Vec<u32> = (0..8).collect();
        assert_eq!(
            Stacks::find(&[ACROSS; 8], &numbers, 8, false).built,
            numbers
        );
    }
}
