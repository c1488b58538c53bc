//! The shared test scenes: counts against their README. Skipped with a message if they are absent.

use super::{LoadOptions, load_file};
use std::io::Write;
use std::path::PathBuf;

/// File, triangles, materials, images in the file, a camera and its target or direction.
const SCENES: [(&str, u64, usize, usize, &[&str]); 7] = [
    (
        "crytek-sponza/sponza.gltf",
        262_267,
        25,
        48,
        &["cam_atrium_eye", "cam_gallery", "cam_arcade"],
    ),
    (
        "dabrovic-sponza/sponza.gltf",
        65_813,
        17,
        16,
        &["cam_atrium_eye", "cam_gallery", "cam_arcade"],
    ),
    (
        "stk-cocoa-temple/stk-cocoa-temple.gltf",
        443_619,
        79,
        91,
        &["cam_jungle", "cam_pond", "cam_bridge", "cam_temple"],
    ),
    (
        "stk-black-forest/stk-black-forest.gltf",
        599_619,
        173,
        227,
        &["cam_brook", "cam_farm"],
    ),
    (
        "chess-openchessset/chess_42k.gltf",
        42_004,
        15,
        36,
        &["cam_player", "cam_low"],
    ),
    ("bmw27/bmw_55k.gltf", 55_165, 22, 4, &["cam_blend"]),
    ("utah-teapot/teapot_16k.gltf", 16_258, 2, 0, &["cam"]),
];

fn folder() -> PathBuf {
    std::env::var_os("PARALLAX_SCENES").map_or_else(
        || {
            PathBuf::from(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../../shared/scenes"
            ))
        },
        PathBuf::from,
    )
}

#[test]
fn real_scenes_have_the_counts_and_cameras_of_their_readme() {
    for (file, triangles, materials, images, cameras) in SCENES {
        let path = folder().join(file);
        if !path.exists() {
            // Not `eprintln`, whose output libtest captures: `scripts/test.sh` lists this line.
            let _ = writeln!(
                std::io::stderr(),
                "SKIPPED: {} is absent (set PARALLAX_SCENES)",
                path.display()
            );
            continue;
        }
        let scene = load_file(&path, &LoadOptions::ALL).unwrap().scene;
        assert_eq!(scene.triangle_count(), triangles, "{file}");
        assert_eq!(scene.materials.len(), materials, "{file}");
        assert_eq!(scene.images.len(), images, "{file}");
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, cameras, "{file}");
        for mesh in &scene.meshes {
            let count = mesh.positions.len();
            assert_eq!(
                [mesh.normals.len(), mesh.tangents.len(), mesh.uv0.len()],
                [count; 3]
            );
            assert!(mesh.indices.iter().all(|&i| (i as usize) < count), "{file}");
        }
    }
}
