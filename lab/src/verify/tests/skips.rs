//! Skipping invisible work changes no output.

use super::*;
use scene::{Light, TextureSlot};

/// A floor, a finely textured wall 8 m ahead, and the same behind the viewer.
fn courtyard() -> Scene {
    let quad = |corners: [[f32; 3]; 4], material| Mesh {
        positions: corners.map(Vec3::from_array).into(),
        normals: vec![Vec3::Y; 4],
        tangents: vec![Vec4::X; 4],
        uv0: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(Vec2::from_array)
            .into(),
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    };
    let wall = |z: f32, material| {
        quad(
            [
                [-12.0, -1.5, z],
                [12.0, -1.5, z],
                [12.0, 12.0, z],
                [-12.0, 12.0, z],
            ],
            material,
        )
    };
    let floor = [
        [-3.0, -1.5, -8.0],
        [3.0, -1.5, -8.0],
        [3.0, -1.5, -0.5],
        [-3.0, -1.5, -0.5],
    ];
    let with_image = |image: usize| Material {
        textures: [(TextureSlot::BaseColor, Some(TextureRef::new(image)))].into(),
        double_sided: true,
        ..Material::default()
    };
    let fine = || cells(512, |x, y| (x * 7 + y * 3) % 5 < 2);
    let meshes = vec![quad(floor, 0), wall(-8.0, 1), wall(8.0, 2)];
    let materials = (0..3).map(with_image).collect();
    Scene {
        lights: vec![Light::Directional {
            direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
            color: Vec3::splat(2.0),
        }],
        ..scene(meshes, materials, vec![checker(), fine(), fine()])
    }
}

#[test]
fn pictures_and_traces_are_the_same_bytes_with_and_without_each_skip() {
    let scene = courtyard();
    let planner = baseline(SIZE_PX, BOTH);
    let of = |skips| {
        let tested = Fragments::DepthTested;
        capture_skipping(&planner, &scene, 4, 1 << 19, true, skips, tested).unwrap()
    };
    let (all, set, skipped) = of(Skips::default());
    assert!(all.pictures_match);
    assert_eq!(set.unseen(), 1, "the wall behind");
    assert_eq!(set.shortened(), 1, "the wall ahead");
    assert!(skipped.cascades > 0, "{skipped:?}");
    assert!(all.work.regions > 2);
    let keep = |names: &str| Skips::without(&[names.parse().unwrap()]);
    let each = ["all", "images", "mip-levels", "cascades", "regions"];
    for name in each {
        let (kept, kept_set, kept_skipped) = of(keep(name));
        assert!(kept.trace == all.trace, "{name}: the trace differs");
        assert!(kept.pictures == all.pictures, "{name}: a picture differs");
        let costs_more = match name {
            "images" | "mip-levels" => kept_set.bytes() > set.bytes(),
            "cascades" => {
                kept_skipped.cascades == 0 && kept.work.shadow_maps > all.work.shadow_maps
            }
            _ => kept.work.draws > all.work.draws,
        };
        assert!(costs_more, "{name}: nothing was saved");
    }
}
