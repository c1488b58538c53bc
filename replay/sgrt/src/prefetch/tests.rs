use super::treelet::Treelets;
use super::*;
use crate::testing::bvh;
use formats::raytrace::{ChildOrder, HierarchyChild, HierarchyTriangle, SlotHit, TraversalKind};
use proptest::prelude::*;

fn child(kind: ChildKind, z: [f32; 2]) -> Option<HierarchyChild> {
    Some(HierarchyChild {
        kind,
        min: [-1.0, -1.0, z[0]],
        max: [1.0, 1.0, z[1]],
    })
}

/// Node `n` has a leaf of slot `n` in front, and the next node or the last leaf behind it.
fn comb(nodes: u32) -> Hierarchy {
    let depth = |at: u32| at as f32 + 1.0;
    let children = (0..nodes).flat_map(|node| {
        let front = child(ChildKind::Leaf(node, 1), [depth(node); 2]);
        let behind = match node + 1 == nodes {
            true => ChildKind::Leaf(nodes, 1),
            false => ChildKind::Node(node + 1),
        };
        [front, child(behind, [depth(node + 1), depth(nodes)])]
    });
    Hierarchy {
        children: children.collect(),
        triangles: vec![HierarchyTriangle::default(); nodes as usize + 1],
    }
}

fn ray(hit: Option<SlotHit>) -> RayGeometry {
    RayGeometry {
        direction: [0.0, 0.0, 1.0],
        t_max: f32::MAX,
        hit,
        ..RayGeometry::default()
    }
}

fn steps(
    hierarchy: &Hierarchy,
    ray: &RayGeometry,
    visits: &[Visit],
) -> Vec<(usize, u32, Vec<ChildKind>)> {
    let mut found = Vec::new();
    let mut seen = Vec::new();
    let stacks = Stacks::new(hierarchy, &bvh());
    stacks.for_visits((ray, false), visits, false, |visit, step| {
        found.extend(step.map(|step| (seen.len(), step.pops, step.stack.to_vec())));
        seen.push(visit);
    });
    assert_eq!(seen, visits);
    found
}

use ChildKind::{Leaf, Node};
use Visit::Triangle;

#[test]
fn pops_and_stacks_follow_from_the_visits() {
    let visits = [
        Visit::Node(0),
        Triangle(0),
        Visit::Node(1),
        Triangle(1),
        Triangle(2),
    ];
    let expected = [
        (0, 0, vec![]),
        (1, 0, vec![Node(1)]),
        (2, 1, vec![]),
        (3, 0, vec![Leaf(2, 1)]),
        (4, 1, vec![]),
    ];
    assert_eq!(steps(&comb(2), &ray(None), &visits), expected);
}

#[test]
fn boxes_behind_the_nearest_triangle_so_far_are_not_pushed() {
    // The far child of the root is visited first; the ray ends in front of node 1's other leaf.
    let hit = Some(SlotHit { t: 2.5, slot: 1 });
    let visits = [Visit::Node(0), Visit::Node(1), Triangle(1), Triangle(0)];
    let found = steps(&comb(2), &ray(hit), &visits);
    assert_eq!(found[2], (2, 0, vec![Leaf(0, 1), Leaf(2, 1)]));
    // The leaf of slot 2 is dropped: two pops lead to slot 0.
    assert_eq!(found[3], (3, 2, vec![]));
    let mut all = Vec::new();
    let hierarchy = comb(2);
    let stacks = Stacks::new(&hierarchy, &bvh());
    stacks.for_visits((&ray(hit), false), &visits, true, |visit, _| {
        all.push(visit)
    });
    assert_eq!(
        all,
        [visits[0], visits[1], visits[2], Triangle(2), visits[3]]
    );
}

#[test]
fn the_order_of_children_says_what_goes_onto_the_stack() {
    let found = |order: ChildOrder, visits: &[Visit]| {
        let (name, value) = order.setting().expect("is not the default");
        let bvh = BvhSummary {
            settings: vec![(name.to_owned(), value.to_owned())],
            traversal: TraversalKind::Bvh4,
            ..bvh()
        };
        // A node with two leaves and a node with two leaves, the first of which are the farthest.
        let leaf = |slot: u32| child(Leaf(slot, 1), [6.0 - slot as f32; 2]);
        let children = [leaf(0), child(Node(1), [1.0, 9.0]), leaf(1), None];
        let hierarchy = Hierarchy {
            children: [children, [leaf(2), leaf(3), None, None]].concat(),
            triangles: vec![HierarchyTriangle::default(); 4],
        };
        let mut found = Vec::new();
        let stacks = Stacks::new(&hierarchy, &bvh);
        stacks.for_visits((&ray(None), false), visits, false, |_, step| {
            found.extend(step.map(|step| (step.pops, step.stack.to_vec())));
        });
        found
    };
    let [a, b, c, d] = [0, 1, 2, 3].map(Triangle);
    let [root, inner] = [0, 1].map(Visit::Node);
    assert_eq!(
        found(ChildOrder::Node, &[root, a, inner, c, d, b]),
        [
            (0, vec![]),
            (0, vec![Leaf(1, 1), Node(1)]),
            (1, vec![Leaf(1, 1)]),
            (0, vec![Leaf(1, 1), Leaf(3, 1)]),
            (1, vec![Leaf(1, 1)]),
            (2, vec![]),
        ]
    );
    // Leaves wait for the inner node, and both nodes push all of theirs.
    let pairs = vec![Leaf(1, 1), Leaf(0, 1)];
    assert_eq!(
        found(ChildOrder::InnerFirst, &[root, inner, c, d, a, b]),
        [
            (0, vec![]),
            (0, pairs.clone()),
            (1, [pairs.as_slice(), &[Leaf(3, 1)]].concat()),
            (2, pairs),
            (3, vec![Leaf(1, 1)]),
            (4, vec![]),
        ]
    );
}

#[test]
fn ttp_fetches_the_next_entries_at_a_pop_after_another() {
    let row = |name| RayPrefetching::find(name).expect("a row").row();
    let config = Prefetch {
        stack_entries: 2,
        ..Prefetch::default()
    };
    let ttp = row("ttp").build.expect("builds")(&config, &bvh(), &comb(1));
    let stack = [Node(7), Node(8), Leaf(9, 2)];
    for (pops, expected) in [(0, vec![]), (1, vec![]), (2, vec![Leaf(9, 2), Node(8)])] {
        let mut ahead = Vec::new();
        let visit = Visit::Node(1);
        ttp.observe(
            &Step {
                visit,
                pops,
                stack: &stack,
            },
            &mut ahead,
        );
        assert_eq!(ahead, expected);
    }
    assert!(row("none").build.is_none());
}

proptest! {
    /// Random trees: each node and leaf is in one treelet at most, with its parent, and only leaves too large for any are in
    /// none.
    #[test]
    fn treelets_are_connected_parts_of_limited_size(
        parents in prop::collection::vec(any::<prop::sample::Index>(), 0..60),
        most in 64_u64..1000,
    ) {
        // Each new node takes the place of a leaf.
        let mut children = vec![None; 2];
        let mut places = vec![0, 1];
        for (number, parent) in (1u32..).zip(&parents) {
            let place = places.swap_remove(parent.index(places.len()));
            children[place] = child(Node(number), [0.0, place as f32]);
            places.extend([children.len(), children.len() + 1]);
            children.extend([None, None]);
        }
        for (slot, place) in (0u32..).zip(places) {
            children[place] = child(Leaf(slot, 1), [0.0, 1.0]);
        }
        let hierarchy = Hierarchy { children, triangles: Vec::new() };
        let treelets = Treelets::new(most, &bvh(), &hierarchy).below;
        let mut seen = Vec::new();
        for (root, below) in (0u32..).zip(&treelets) {
            let mut nodes = vec![root];
            let mut bytes = 64;
            for kind in below {
                let at = hierarchy.children.iter().position(|c| c.is_some_and(|c| c.kind == *kind));
                let parent = at.expect("in the tree") as u32 / 2;
                prop_assert!(nodes.contains(&parent));
                prop_assert!(!seen.contains(kind));
                seen.push(*kind);
                match kind {
                    Node(node) => { nodes.push(*node); bytes += 64 }
                    Leaf(_, count) => bytes += 48 * u64::from(*count),
                }
            }
            prop_assert!(below.is_empty() || bytes <= most);
        }
        if most >= 64 + 64 * parents.len() as u64 + 48 * (parents.len() as u64 + 2) {
            prop_assert_eq!(seen.len(), 2 * parents.len() + 2);
        }
    }
}
