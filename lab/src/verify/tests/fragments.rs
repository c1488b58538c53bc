//! Compares fragments, coordinates and levels with the reference.

use super::*;

#[test]
fn coverage_depth_order_coordinates_and_levels_of_random_triangles_agree_with_the_reference() {
    let meshes = vec![
        triangles(150, 1, 0),
        triangles(80, 2, 1),
        triangles(60, 3, 2),
    ];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Opaque, false),
        textured(AlphaMode::Blend, true),
    ];
    let mut scene = scene(meshes, materials, vec![checker()]);
    // A mirrored instance reverses the winding of the single-sided mesh.
    scene.instances.push(Instance {
        mesh: 1,
        transform: Affine3A::from_scale_rotation_translation(
            Vec3::new(-1.0, 1.2, 0.8),
            glam::Quat::from_rotation_z(0.4),
            Vec3::new(0.3, -0.2, -0.5),
        ),
    });
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    for pass in 0..2 {
        let a = agreement(&scene, &captured, pass, &passes);
        println!("pass {pass}: {a:?}, IoU {:.6}", a.coverage_iou());
        assert!(a.both > 20_000, "{a:?}");
        assert!(a.coverage_iou() >= 0.999, "{a:?}");
        let [mean, _, max] = a.uv_errors_texels.summary();
        assert!(max < 0.05 && mean < 0.002, "{a:?}");
        let same_levels = a.capture.levels_differ as f64 / a.capture.samples as f64;
        assert!(same_levels < 0.001, "{a:?}");
        assert_eq!(a.of_class(Class::Unexplained), 0, "{a:?}");
    }
    assert!(captured.pictures_match);
}

#[test]
fn masked_draws_keep_exactly_the_lanes_that_an_in_order_gpu_keeps() {
    // Masked draws among opaque ones, with heavy overlap inside each draw.
    let meshes = vec![
        triangles(40, 11, 0),
        triangles(500, 12, 1),
        triangles(20, 13, 0),
        triangles(500, 14, 1),
    ];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    assert!(
        captured.counts.masked_lanes_killed > 10_000,
        "the scene must exercise the replay, killed {}",
        captured.counts.masked_lanes_killed
    );
    for pass in 0..2 {
        let a = agreement(&scene, &captured, pass, &checker_passes);
        println!("pass {pass}: {a:?}, IoU {:.6}", a.coverage_iou());
        assert!(a.coverage_iou() >= 0.999, "{a:?}");
    }
    assert!(captured.pictures_match);
}

#[test]
fn every_lane_of_a_shadowed_draw_takes_at_most_one_cascade() {
    let scene = crowd(&[(80, 51, AlphaMode::Opaque)]);
    let captured = capture(&scene, SIZE_PX, 4, BUDGET);
    let mut shadowed = 0;
    for tile in captured.tiles.iter().flatten() {
        for run in &tile.runs {
            let records = &tile.records[run.first as usize..(run.first + run.count) as usize];
            for quad in records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y)) {
                for record in quad.iter().filter(|r| r.group > 0) {
                    let edge = SHADOW_SIZE as i32 * SUBTEXELS;
                    let inside = |v: i32| v > SUBTEXELS && v < edge - SUBTEXELS;
                    for lane in (0..4).filter(|lane| record.mask >> lane & 1 == 1) {
                        assert!(record.lane_uv(lane).into_iter().all(inside), "{record:?}");
                    }
                }
                let cascades: Vec<u8> = quad
                    .iter()
                    .filter(|r| r.group > 0)
                    .map(|r| r.mask)
                    .collect();
                let lanes: u32 = cascades.iter().map(|m| m.count_ones()).sum();
                let union = cascades.iter().fold(0, |all, m| all | m);
                assert_eq!(lanes, union.count_ones());
                // A clipped primitive may cover a quad in two parts.
                let covered = quad
                    .iter()
                    .filter(|r| r.group == 0)
                    .fold(0, |all, r| all | r.mask);
                assert_eq!(union & !covered, 0);
                shadowed += u64::from(union != 0);
            }
        }
    }
    assert!(shadowed > 5000, "{shadowed}");
    assert!(captured.pictures_match);
}

#[test]
fn a_built_in_scene_agrees_with_the_reference() {
    let scene = scenes::load("atrium-plain").unwrap();
    let captured = capture(&scene, [240, 272], 0, BUDGET);
    let a = agreement(&scene, &captured, 1, &passes);
    println!("atrium-plain: {a:?}, IoU {:.6}", a.coverage_iou());
    assert!(a.both > 40_000, "{a:?}");
    assert!(a.coverage_iou() >= 0.999, "{a:?}");
    assert!(a.uv_errors_texels.summary()[0] < 0.01, "{a:?}");
    assert!(
        (a.capture.levels_differ as f64) < 0.002 * a.capture.samples as f64,
        "{a:?}"
    );
    assert_eq!(a.of_class(Class::Unexplained), 0, "{a:?}");
}

#[test]
fn vertex_colours_show_and_mask_as_the_same_base_colour_does() {
    let quad = |color: Option<Vec4>| Mesh {
        positions: [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
            .map(|[x, y]| Vec3::new(x, y, -6.0))
            .to_vec(),
        normals: vec![Vec3::Z; 4],
        uv0: [[0.0, 4.0], [4.0, 4.0], [4.0, 0.0], [0.0, 0.0]]
            .map(Vec2::from)
            .to_vec(),
        colors: color.map_or_else(Vec::new, |color| vec![color; 4]),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    let color = Vec4::new(0.75, 0.25, 0.5, 0.5);
    // An opaque texel passes this cutoff with alpha 1 and fails with alpha 0.5.
    for alpha in [AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask(0.75)] {
        let material = |base_color| Material {
            base_color,
            ..textured(alpha, false)
        };
        let shot = |vertex: Option<Vec4>, base_color| {
            let (meshes, materials) = (vec![quad(vertex)], vec![material(base_color)]);
            let scene = Scene {
                sky: Vec3::ONE,
                ..scene(meshes, materials, vec![checker()])
            };
            capture(&scene, SIZE_PX, 0, BUDGET)
        };
        let (vertex, base) = (shot(Some(color), Vec4::ONE), shot(None, color));
        let (white, plain) = (shot(Some(Vec4::ONE), Vec4::ONE), shot(None, Vec4::ONE));
        for (a, b) in [(&vertex, &base), (&white, &plain)] {
            assert!(a.pictures_match && b.pictures_match);
            let differences = a.pictures.concat().into_iter().zip(b.pictures.concat());
            let largest = differences.map(|(a, b)| a.abs_diff(b)).max();
            assert!(largest <= Some(1), "{alpha:?}: {largest:?}");
            assert_eq!(a.tiles, b.tiles, "{alpha:?}");
        }
        assert!(vertex.pictures != plain.pictures, "{alpha:?}");
    }
}
