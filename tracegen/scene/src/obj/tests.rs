//! Small generated files.

use crate::{AlphaMode, LoadOptions, Loaded, SceneError, load_file};
use glam::{Vec2, Vec3};
use std::path::Path;

const QUAD: &str = "mtllib a.mtl\no quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl brick\nf 1/1 2/2 3/3 4/4\n";

fn load(folder: &Path, obj: &str, mtl: Option<&str>) -> Result<Loaded, SceneError> {
    let path = folder.join("a.obj");
    std::fs::write(&path, obj).unwrap();
    if let Some(mtl) = mtl {
        std::fs::write(folder.join("a.mtl"), mtl).unwrap();
    }
    load_file(&path, &LoadOptions::ALL)
}

fn save_png(folder: &Path, name: &str, texel: [u8; 4]) {
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba(texel));
    image
        .save_with_format(folder.join(name), image::ImageFormat::Png)
        .unwrap();
}

#[test]
fn a_quad_becomes_two_triangles_with_v_turned_over() {
    let folder = tempfile::tempdir().unwrap();
    let scene = load(folder.path(), QUAD, Some("newmtl brick\nKd 0.5 0.25 1\n"))
        .unwrap()
        .scene;
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.triangles(), mesh.positions.len()), (2, 4));
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    let at = mesh
        .positions
        .iter()
        .position(|p| *p == Vec3::ZERO)
        .unwrap();
    assert_eq!(mesh.uv0[at], Vec2::new(0.0, 1.0));
    assert_eq!(scene.materials[0].base_color.y, 0.25);
}

#[test]
fn an_opacity_map_becomes_the_colour_maps_alpha() {
    let folder = tempfile::tempdir().unwrap();
    save_png(folder.path(), "c.png", [200, 100, 50, 255]);
    save_png(folder.path(), "d.png", [77, 77, 77, 255]);
    let mtl = "newmtl brick\nmap_Kd c.png\nmap_d d.png\nmap_Bump -bm 0.5 d.png\n";
    let scene = load(folder.path(), QUAD, Some(mtl)).unwrap().scene;
    let material = &scene.materials[0];
    assert_eq!(material.alpha, AlphaMode::Mask(0.5));
    let image = &scene.images[material.base_color_texture.unwrap().image];
    assert_eq!(&image.rgba[..4], [200, 100, 50, 77]);
    assert!(material.normal_texture.is_some());
}

#[test]
fn a_missing_material_library_costs_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = load(folder.path(), QUAD, None).unwrap();
    assert!(
        loaded.warnings[0].contains("a.mtl"),
        "{:?}",
        loaded.warnings
    );
    assert_eq!(loaded.scene.materials[0].name, "default");
}

#[test]
fn broken_files_are_told() {
    let folder = tempfile::tempdir().unwrap();
    for (obj, part) in [
        ("v 0 0 0\nv 1 0 0\nf 1 2 9\n", "a.obj"),
        ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "finite position"),
        ("v a b c\n", "a.obj"),
        ("", "at least one triangle"),
        ("f -1 -2 -3\n", "a.obj"),
        ("v 0 0 0\nf 0 0 0\n", "a.obj"),
    ] {
        let error = load(folder.path(), obj, None).expect_err(obj).to_string();
        assert!(error.contains(part), "{obj}: {error}");
    }
    let error = load(folder.path(), QUAD, Some("newmtl brick\nmap_Kd none.png\n")).unwrap_err();
    assert!(error.to_string().contains("none.png"), "{error}");
}

#[test]
fn no_single_changed_byte_panics() {
    let folder = tempfile::tempdir().unwrap();
    for at in 0..QUAD.len() {
        for byte in [b'9', b'-', b' ', b'/'] {
            let mut changed = QUAD.as_bytes().to_vec();
            changed[at] = byte;
            let _ = load(folder.path(), std::str::from_utf8(&changed).unwrap(), None);
        }
    }
}
