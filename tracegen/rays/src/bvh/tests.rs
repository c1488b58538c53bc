use super::count::Counts;
use super::*;
use crate::ray::brute_force_f32;
use formats::random::Random;
use glam::{DVec3, Vec3};
use lab::traversal::reference::TestMesh;

#[test]
fn hits_of_all_trees_and_both_kernels_equal_brute_force() {
    for kind in TraversalKind::ALL {
        for treelet_bytes in [None, Some(1024)] {
            hits_equal_brute_force(TreeOptions {
                treelet_bytes,
                ..kind.into()
            });
        }
    }
}

fn hits_equal_brute_force(options: TreeOptions) {
    for mesh in [
        TestMesh::sphere(2),
        TestMesh::grid_box(6),
        TestMesh::torus(24, 12),
    ] {
        let triangles = mesh.rounded(DVec3::ZERO);
        let build = || Bvh::build_for(options, &triangles, |_| false).expect("builds");
        let fast = build();
        let plain = build().with_instructions(Instructions::Scalar);
        let mut stack = TraversalStack::default();
        let mut random = Random(1);
        let mut hits = 0;
        for i in 0..4000 {
            let mut point = || Vec3::from([0; 3].map(|_| random.unit_f32())) * 24.0 - 12.0;
            let origin = point();
            let aim = match i % 3 {
                0 => point(),
                1 => mesh.vertices[(point().length() * 1000.0) as usize % mesh.vertices.len()]
                    .as_vec3(),
                _ => Vec3::from(triangles[i % triangles.len()][0])
                    .lerp(Vec3::from(triangles[i % triangles.len()][1]), 0.375),
            };
            let ray = Ray::new(origin, aim - origin);
            let expected = brute_force_f32(&triangles, fast.bounds, &ray);
            hits += u32::from(expected.is_some());
            for tree in [TraversalKind::Bvh2, options.kind] {
                let work = [&fast, &plain].map(|bvh| {
                    let mut counts = Counts::default();
                    let hit = bvh.closest(tree, &ray, &mut stack, &mut counts, &AllOpaque);
                    assert_eq!(
                        hit.map(|h| (h.t, h.primitive)),
                        expected,
                        "{} ray {i}",
                        mesh.name
                    );
                    let any = bvh
                        .blocker(tree, &ray, &mut stack, &mut counts, &AllOpaque)
                        .is_some();
                    assert_eq!(any, expected.is_some(), "{} ray {i}", mesh.name);
                    counts
                });
                assert_eq!(work[0], work[1], "{} ray {i}: both kernels", mesh.name);
            }
        }
        assert!(hits > 1500, "{hits}");
    }
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let triangles = TestMesh::torus(160, 80).rounded(DVec3::ZERO);
    let [one, four] = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool")
            .install(|| Bvh::build(&triangles, |_| false).expect("builds"))
    });
    let nodes = |bvh: &Bvh| -> Vec<_> {
        let nodes = bvh.nodes2.iter();
        nodes
            .map(|n| (n.bounds.map(|b| b.map(f32::to_bits)), n.children))
            .collect()
    };
    assert!(nodes(&one) == nodes(&four));
    let triangles = |bvh: &Bvh| -> Vec<_> { bvh.blocks.iter().map(|b| b.primitives).collect() };
    assert!(triangles(&one) == triangles(&four));
}

#[test]
fn leaves_hold_every_triangle_once_and_fill_their_blocks() {
    let triangles = TestMesh::grid_box(24).rounded(DVec3::ZERO);
    let bvh = Bvh::build(&triangles, |_| false).expect("builds");
    let mut seen: Vec<u32> = bvh
        .blocks
        .iter()
        .flat_map(|b| b.primitives)
        .filter(|p| *p != u32::MAX)
        .collect();
    seen.sort_unstable();
    assert!(seen.iter().copied().eq(0..triangles.len() as u32));
    // A regular grid fills its blocks. Leaves of three triangles would leave a quarter empty.
    let fill = triangles.len() as f64 / (bvh.blocks.len() * node::BLOCK) as f64;
    assert!(fill > 0.85, "{fill}");
}

#[test]
fn triangles_beyond_the_largest_coordinate_are_left_out() {
    let far = [[1e19, 0.0, 5.0], [-1e19, 1.0, 5.0], [0.0, -1e19, 5.0]];
    let near = [[-1.0, -1.0, 9.0], [1.0, -1.0, 9.0], [0.0, 1.0, 9.0]];
    let bvh = Bvh::build(&[far, near], |_| false).expect("builds");
    let mut stack = TraversalStack::default();
    for tree in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
        let mut closest = |origin| {
            let ray = Ray::new(origin, Vec3::Z);
            bvh.closest(tree, &ray, &mut stack, &mut Counts::default(), &AllOpaque)
        };
        assert_eq!(
            closest(Vec3::ZERO).map(|h| (h.t, h.primitive)),
            Some((9.0, 1))
        );
        for outside in [-1e19, f32::NEG_INFINITY, f32::NAN] {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                let origin = Vec3::select(axis.cmpeq(Vec3::ONE), Vec3::splat(outside), Vec3::ZERO);
                assert_eq!(closest(origin), None, "from {origin}");
                assert!(!Ray::new(origin, Vec3::Z).is_valid(), "from {origin}");
            }
        }
    }
}
