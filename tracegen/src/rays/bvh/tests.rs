use super::count::Counts;
use super::*;
use crate::rays::reference::{TestMesh, brute_force_f32};
use glam::{DVec3, Vec3};

#[test]
fn both_trees_and_both_kernels_find_what_brute_force_finds() {
    for mesh in [
        TestMesh::sphere(2),
        TestMesh::grid_box(6),
        TestMesh::torus(24, 12),
    ] {
        let triangles = mesh.rounded(DVec3::ZERO);
        let fast = Bvh::build(&triangles, |_| false).expect("builds");
        let plain = Bvh::build(&triangles, |_| false)
            .expect("builds")
            .with_instructions(Instructions::Scalar);
        let mut stack = TraversalStack::default();
        let mut seed = 1u64;
        let mut next = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut hits = 0;
        for i in 0..4000 {
            let mut point = || Vec3::new(next(), next(), next()) * 24.0 - 12.0;
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
            for bvh in [&fast, &plain] {
                for tree in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
                    let mut counts = Counts::default();
                    let hit = bvh.closest(tree, &ray, &mut stack, &mut counts, &AllOpaque);
                    assert_eq!(
                        hit.map(|h| (h.t, h.primitive)),
                        expected,
                        "{} ray {i}",
                        mesh.name
                    );
                    let any = bvh.occluded(tree, &ray, &mut stack, &mut counts, &AllOpaque);
                    assert_eq!(any, expected.is_some(), "{} ray {i}", mesh.name);
                }
            }
        }
        assert!(hits > 1500, "{hits}");
    }
}
