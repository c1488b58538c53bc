use super::*;
use crate::bvh::count::NoCounter;
use crate::bvh::{AllOpaque, TraversalStack, TreeOptions};
use crate::ray::Ray;
use formats::raytrace::{ChildKind, Hierarchy};
use glam::{DAffine3, DQuat, DVec3};
use lab::traversal::reference::{Random, TestMesh};

fn options(kind: TraversalKind, treelet_bytes: Option<u32>) -> TreeOptions {
    TreeOptions {
        treelet_bytes,
        refit: true,
        ..kind.into()
    }
}

/// A torus, and its triangles after a part of it has moved: the first so many keep their places.
fn torus(kept: usize) -> [Vec<Triangle>; 2] {
    let before = TestMesh::torus(48, 24).rounded(DVec3::ZERO);
    let bent = |[x, y, z]: [f32; 3]| [x + 0.3 * y * y, y - 0.2 * x * z, 2.0 * z + x.sin()];
    let after = before.iter().enumerate();
    let after = after.map(|(n, t)| if n < kept { *t } else { t.map(bent) });
    let after = after.collect();
    [before, after]
}

/// Rays from everywhere in a cube, half of them at vertices.
fn rays(triangles: &[Triangle], count: usize) -> Vec<Ray> {
    let mut random = Random(5);
    let ray = |i| {
        let mut point = || Vec3::from([0; 3].map(|_| random.unit() * 60.0 - 30.0));
        let (origin, free) = (point(), point());
        let at = &triangles[random.below(triangles.len())];
        let aim = if i % 2 == 0 {
            Vec3::from(at[i % 3])
        } else {
            free
        };
        Ray::new(origin, aim - origin)
    };
    (0..count).map(ray).collect()
}

/// Compares nearest hits bit for bit, and whether there is any. Returns the number of hits.
fn assert_equal_hits(kind: TraversalKind, [a, b]: [&Bvh; 2], rays: &[Ray]) -> usize {
    let mut stack = TraversalStack::default();
    let mut hits = 0;
    for (i, ray) in rays.iter().enumerate() {
        let [a, b] = [a, b].map(|bvh| {
            let hit = bvh.closest(kind, ray, &mut stack, &mut NoCounter, &AllOpaque);
            let any = bvh.blocker(kind, ray, &mut stack, &mut NoCounter, &AllOpaque);
            let hit = hit.map(|hit| (hit.t.to_bits(), hit.primitive, hit.vertices));
            (hit, any.is_some())
        });
        assert_eq!(a, b, "{kind:?}, ray {i}");
        hits += usize::from(a.1);
    }
    hits
}

/// The primitives below a child, each of which its box contains, added to `out`.
fn below(tree: &Hierarchy, width: usize, child: usize, out: &mut Vec<u32>) {
    let Some(child) = &tree.children[child] else {
        return;
    };
    let own = out.len();
    match child.kind {
        ChildKind::Node(node) => {
            (0..width).for_each(|side| below(tree, width, node as usize * width + side, out));
        }
        ChildKind::Leaf(slot, count) => {
            out.extend((slot..slot + count).map(|slot| tree.triangles[slot as usize].primitive));
        }
    }
    let by_primitive = |p: &u32| tree.triangles.iter().find(|t| t.primitive == *p);
    for triangle in out[own..].iter().filter_map(by_primitive) {
        for point in triangle.vertices {
            let ends = child.min.iter().zip(&child.max);
            assert!(
                { ends }
                    .zip(point)
                    .all(|((min, max), at)| *min <= at && at <= *max)
            );
        }
    }
}

#[test]
fn refitted_trees_have_the_hits_of_rebuilt_ones() {
    let [before, after] = torus(100);
    let rays = rays(&after, 2000);
    for kind in TraversalKind::ALL {
        for treelets in [None, Some(1024)] {
            let options = options(kind, treelets);
            let mut refitted = Bvh::build_for(options, &before, |_| false).expect("small");
            refitted.refit(&after).expect("finite");
            let rebuilt = Bvh::build_for(options, &after, |_| false).expect("small");
            let hits = assert_equal_hits(kind, [&refitted, &rebuilt], &rays);
            assert!(hits > 500, "{hits}");
            let [kept, new] = [&refitted, &rebuilt].map(|bvh| bvh.summary(kind));
            assert!(kept.sah_cost > new.sah_cost && kept.triangles == new.triangles);
            // Back where they were, all boxes are the built ones.
            refitted.refit(&before).expect("finite");
            let built = Bvh::build_for(options, &before, |_| false).expect("small");
            assert_eq!(refitted.contents(kind), built.contents(kind));
            let [cost, expected] = [&refitted, &built].map(|bvh| bvh.summary(kind).sah_cost);
            assert!((cost / expected - 1.0).abs() < 1e-5, "{cost} {expected}");
        }
    }
}

#[test]
fn boxes_contain_their_triangles_and_an_update_is_what_lies_above_the_moved_ones() {
    let [before, after] = torus(2000);
    for kind in TraversalKind::ALL {
        let mut bvh = Bvh::build_for(options(kind, None), &before, |_| false).expect("small");
        bvh.refit(&after).expect("finite");
        let is_moved = |p: &u32| before[*p as usize] != after[*p as usize];
        let moved = Moved {
            objects: Objects::new([before.len()].into_iter()),
            mesh_of: vec![0],
            placed: vec![false],
            triangles: vec![(0..before.len() as u32).map(|p| is_moved(&p)).collect()],
        };
        let (tree, width) = (bvh.contents(kind), kind.width());
        let mut expected = BvhUpdate {
            method: UpdateMethod::Refit,
            ..BvhUpdate::default()
        };
        for node in tree.children.chunks_exact(width).enumerate() {
            let mut all = Vec::new();
            (0..width).for_each(|side| below(&tree, width, node.0 * width + side, &mut all));
            expected.nodes += u64::from(all.iter().any(is_moved));
        }
        for child in tree.children.iter().flatten() {
            if let ChildKind::Leaf(slot, count) = child.kind {
                let leaf = &tree.triangles[slot as usize..(slot + count) as usize];
                let moved = leaf.iter().filter(|t| is_moved(&t.primitive)).count() as u64;
                expected.triangles_written += moved;
                expected.triangles_read += if moved > 0 { count.into() } else { 0 };
            }
        }
        let update = bvh.update(kind, UpdateMethod::Refit, &moved);
        assert_eq!(update, expected);
        assert_eq!(update.triangles_written, before.len() as u64 - 2000);
        assert!(update.triangles_read > update.triangles_written);
        let summary = bvh.summary(kind);
        assert!(0 < update.nodes && update.nodes < summary.nodes);
        let rebuild = bvh.update(kind, UpdateMethod::Rebuild, &moved);
        let counts = (
            rebuild.triangles_read,
            rebuild.triangles_written,
            rebuild.nodes,
        );
        assert_eq!(
            counts,
            (summary.triangles, summary.triangles, summary.nodes)
        );
    }
}

#[test]
fn equal_triangles_can_move_apart() {
    let [_, after] = torus(0);
    let before = vec![after[7]; after.len()];
    for kind in [TraversalKind::Bvh2, TraversalKind::Cwbvh8] {
        let mut refitted = Bvh::build_for(options(kind, None), &before, |_| false).expect("small");
        refitted.refit(&after).expect("finite");
        let rebuilt = Bvh::build_for(kind.into(), &after, |_| false).expect("small");
        assert_equal_hits(kind, [&refitted, &rebuilt], &rays(&after, 1000));
    }
}

#[test]
fn instances_follow_their_matrices_and_trees_that_do_not_move_are_kept() {
    let [mesh, bent] = torus(0);
    let small = TestMesh::sphere(2).rounded(DVec3::ZERO);
    let rest = TestMesh::sphere(1).rounded(DVec3::ZERO);
    let place = |mesh, turn: f64, at| Placement {
        mesh,
        transform: DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), at),
        mirrored: false,
    };
    let placements = |turn: f64| {
        let across = DVec3::X * 25.0;
        vec![
            place(0, 0.0, DVec3::ZERO),
            place(0, turn, across),
            place(1, 0.3, DVec3::Y * 20.0),
            place(2, 0.0, -across + DVec3::Z * turn),
            place(1, 0.6, DVec3::Y * -20.0),
        ]
    };
    let counts = [mesh.len(), mesh.len(), small.len(), rest.len(), small.len()];
    // Only the second instance and the mesh that is placed once move; or also the first mesh changes its shape.
    for (kind, first) in TraversalKind::ALL.iter().zip([&mesh, &bent, &mesh, &bent]) {
        let kind = *kind;
        let options = TreeOptions {
            instances: true,
            ..options(kind, None)
        };
        let meshes = |first: &Vec<Triangle>| [first.clone(), small.clone(), rest.clone()];
        let built = |first, turn, origin| {
            let (meshes, placements) = (meshes(first), placements(turn));
            Bvh::build_instanced(options, origin, &meshes, &placements, |_| false).expect("small")
        };
        let origin = DVec3::new(0.5, -0.25, 2.0);
        let mut refitted = built(&mesh, 0.0, DVec3::ZERO);
        (refitted.refit_instanced(origin, &meshes(first), &placements(0.7))).expect("invertible");
        let at = |p: &Placement| {
            meshes(first)[p.mesh]
                .clone()
                .into_iter()
                .map(|t| p.triangle(origin, t))
                .collect()
        };
        let all: Vec<Vec<Triangle>> = placements(0.7).iter().map(at).collect();
        let rebuilt = built(first, 0.7, origin);
        let hits = assert_equal_hits(kind, [&refitted, &rebuilt], &rays(&all.concat(), 2000));
        assert!(hits > 500, "{hits}");

        let is_bent = first == &bent;
        let moved = Moved {
            objects: Objects::new(counts.into_iter()),
            mesh_of: vec![0, 0, 1, 2, 1],
            placed: vec![false, true, false, true, false],
            triangles: vec![vec![is_bent; mesh.len()], Vec::new(), Vec::new()],
        };
        let of = |method| refitted.update(kind, method, &moved);
        let triangles = (rest.len() + if is_bent { mesh.len() } else { 0 }) as u64;
        let refit = of(UpdateMethod::Refit);
        assert_eq!(
            (refit.triangles_read, refit.triangles_written),
            (triangles, triangles)
        );
        assert_eq!(refit.instances, if is_bent { 3 } else { 2 });
        let rebuild = of(UpdateMethod::Rebuild);
        assert_eq!(
            (rebuild.triangles_written, rebuild.instances),
            (triangles, 5)
        );
        let all = refitted.summary(kind);
        let below = refitted.below.as_ref().expect("instances");
        // The second tree is that of the small sphere.
        let kept = below.trees[1].bvh.size(kind).0
            + if is_bent {
                0
            } else {
                below.trees[0].bvh.size(kind).0
            };
        assert_eq!(rebuild.nodes, all.nodes - 5 - kept);
        assert!(refit.nodes <= rebuild.nodes);
    }
    let mut flat = placements(0.0);
    flat[1].transform.matrix3.y_axis = DVec3::ZERO;
    let meshes = [mesh, small, rest];
    let options = options(TraversalKind::Bvh2, None);
    let mut tree = Bvh::build_instanced(options, DVec3::ZERO, &meshes, &placements(0.0), |_| false)
        .expect("small");
    let error = tree
        .refit_instanced(DVec3::ZERO, &meshes, &flat)
        .expect_err("no inverse");
    assert!(
        error
            .to_string()
            .starts_with("instance 1 cannot be refitted"),
        "{error}"
    );
}
