//! Small generated files.

use crate::{
    AlphaMode, LoadOptions, Loaded, SceneError, TextureRef, TextureSlot, Textures, load_file,
};
use formats::texture::Wrap;
use glam::{DVec3, Vec2, Vec3, Vec4};
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
fn a_quad_becomes_two_triangles_with_v_reversed() {
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
fn positions_far_from_zero_keep_the_digits_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |far: f64| {
        let point = |x: f64, y: f64| format!("v {} {} {far}\n", far + x, y - 2.0 * far);
        let corners = [[-1.0, 0.0], [0.75, 0.0], [0.5, 1.0 / 1024.0]];
        let corners = corners.map(|[x, y]| point(x, y)).concat();
        // A point that no face uses does not affect the origin.
        let text = format!("{corners}v 1e20 0 0\nf 1 2 3\n");
        load(folder.path(), &text, None).unwrap().scene
    };
    let near = at(0.0);
    assert_eq!(near.origin, DVec3::ZERO);
    for far in [1e3, 1e5, 1e6, 1e7] {
        let scene = at(far);
        assert_eq!(scene.origin, DVec3::new(far, -2.0 * far, far));
        assert_eq!(scene.meshes[0].positions, near.meshes[0].positions, "{far}");
        assert_eq!(scene.meshes[0].normals, near.meshes[0].normals);
        assert_eq!(scene.cameras, near.cameras);
    }
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
    let image = material.textures[TextureSlot::BaseColor].unwrap().image;
    let texels = crate::image::texels(&scene.images, |i| i == image).unwrap();
    assert_eq!(texels[image].as_ref().unwrap()[..4], [200, 100, 50, 77]);
    assert!(material.textures[TextureSlot::Normal].is_some());
}

#[test]
fn a_missing_material_library_causes_a_warning() {
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
fn broken_files_are_refused_with_the_line_number() {
    let folder = tempfile::tempdir().unwrap();
    for (obj, place, expected, found) in [
        (
            "v 0 0 0\nv 1 0 0\nf 1 2 9\n",
            "line 3, f",
            "the file's 2 v",
            "9",
        ),
        (
            "v 0 0 0\nf 1/2 1 1\nvt 0 0\n",
            "line 2, f",
            "the file's 1 vt",
            "2",
        ),
        (
            "v 0 0 0\nv 1 0 nan\nv 0 1 0\n\nf 1 2 3\n",
            "line 5, f, v number 2",
            "finite",
            "NaN",
        ),
        ("# x\nv a b c\n", "line 2, v", "3 numbers", "'a'"),
        ("v 1 2\n", "line 1, v", "3 numbers", "2"),
        ("v 0 0 0 1 1\n", "line 1, v", "weight", "'0 0 0 1 1'"),
        ("v 0 0 0 0\n", "line 1, v", "weight", "'0 0 0 0'"),
        ("vn 0 1 x\n", "line 1, vn", "3 numbers", "'x'"),
        ("f -1 -2 -3\n", "line 1, f", "negative ones", "'-1'"),
        ("v 0 0 0\nf 0 0 0\n", "line 2, f", "v/vt/vn", "'0'"),
        (
            "v 0 0 0\nf 1/1/1/1 1 1\n",
            "line 2, f",
            "v/vt/vn",
            "'1/1/1/1'",
        ),
        (
            "f 99999999999999999999 1 1\n",
            "line 1, f",
            "v/vt/vn",
            "'9999",
        ),
        (
            "f -9223372036854775808 1 1\n",
            "line 1, f",
            "v/vt/vn",
            "'-9223",
        ),
        ("", "scene", "at least one triangle", "none"),
        ("\u{fffe}", "scene", "at least one triangle", "none"),
    ] {
        let error = load(folder.path(), obj, None).expect_err(obj).to_string();
        for part in ["a.obj", place, expected, found] {
            assert!(error.contains(part), "{obj}: '{part}' is not in: {error}");
        }
    }
    std::fs::write(folder.path().join("a.obj"), b"\xff\xfev\x00").unwrap();
    let error = load_file(&folder.path().join("a.obj"), &LoadOptions::ALL).unwrap_err();
    assert!(error.to_string().contains("UTF-16"), "{error}");
}

/// A triangle, with each statement in a form that exporters write.
#[test]
fn statements_are_read_in_the_forms_that_exporters_write() {
    let folder = tempfile::tempdir().unwrap();
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let texts: [Vec<u8>; 9] = [
        plain.into(),
        format!("\u{feff}{plain}").into(),
        plain.replace('\n', "\r\n").into(),
        plain.replace('\n', " # caf\u{e9}\n").into(),
        [b"# caf\xe9\no Z\xfcrich\n", plain.as_bytes()].concat(),
        "v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\r\n2 \\\n 3".into(),
        "v 0 0 0 # a\\b\\\nv 1 0 0\nv 0 1 0\n# c:\\x\\\nf 1 2 3 #".into(),
        "\tv\t0  0 0 1\n v 2 0 0 2\nv 0 1 0\ns off\ns 1\nf -3 -2 -1\n".into(),
        "f 1 2 3\nv 0 0 0\nv 1e0 0 0\nv 0 .1e1 -0\nl 1 2\np 1\nf 1 2\ncstype bezier\nfoo".into(),
    ];
    for text in texts {
        let told = String::from_utf8_lossy(&text).into_owned();
        std::fs::write(folder.path().join("a.obj"), &text).unwrap();
        let loaded = load_file(&folder.path().join("a.obj"), &LoadOptions::ALL);
        let mesh = &loaded.expect(&told).scene.meshes[0];
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y], "{told}");
        assert_eq!(
            (&*mesh.indices, &*mesh.normals),
            (&[0, 1, 2][..], &[Vec3::Z; 3][..])
        );
    }
}

#[test]
fn a_name_in_latin_1_is_read_and_one_with_escapes_is_made_printable() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let text = b"o Z\xfcrich\x1b[2J\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(&path, text).unwrap();
    let scene = load_file(&path, &LoadOptions::ALL).unwrap().scene;
    assert_eq!(scene.meshes[0].name, "Zürich\\u{1b}[2J");
}

#[test]
fn corners_with_and_without_coordinates_and_normals_can_be_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5\nvt 0.25 0.75 9\nvn 1 0 0\nvn nan 1.#QNAN 0\n\
               f 1/2 2//1 3/1/2\nf 1 2/1/ 3//\n";
    let mesh = load(folder.path(), obj, None)
        .unwrap()
        .scene
        .meshes
        .remove(0);
    let uv = [
        [0.25, 0.25],
        [0.0, 0.0],
        [0.5, 1.0],
        [0.0, 0.0],
        [0.5, 1.0],
        [0.0, 0.0],
    ];
    assert_eq!(mesh.uv0, uv.map(Vec2::from));
    let (x, z) = (Vec3::X, Vec3::Z);
    assert_eq!(mesh.normals, [z, x, z, z, z, z]);
}

#[test]
fn concave_polygons_are_covered_once() {
    let folder = tempfile::tempdir().unwrap();
    // An L-shape, which a fan from its first corner would not cover.
    let obj = "v 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n";
    let mesh = load(folder.path(), obj, None)
        .unwrap()
        .scene
        .meshes
        .remove(0);
    let areas = mesh.indices.chunks_exact(3).map(|t| {
        let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
        (b - a).cross(c - a).z / 2.0
    });
    let areas: Vec<f32> = areas.collect();
    assert_eq!((areas.len(), areas.iter().sum()), (4, 3.0));
    assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
}

#[test]
fn vertex_colours_are_srgb_and_white_where_a_vertex_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 0 1 0 0.25\no plain\nv 5 0 0\nv 6 0 0\nv 5 1 0\n\
               f 4 5 6\no coloured\nf 1 2 3\n";
    let scene = load(folder.path(), obj, None).unwrap().scene;
    assert!(scene.meshes[0].colors.is_empty());
    let colors = &scene.meshes[1].colors;
    assert!((colors[0] - Vec4::new(1.0, 0.0, 0.214_041_14, 1.0)).length() < 1e-6);
    assert_eq!(colors[1..], [Vec4::ONE, Vec4::new(0.0, 1.0, 0.0, 0.25)]);

    let bytes = "v 0 0 0 255 0 0\nv 1 0 0\nv 0 1 0 0 0 51\nf 1 2 3\n";
    let loaded = load(folder.path(), bytes, None).unwrap();
    let colors = &loaded.scene.meshes[0].colors;
    assert_eq!(colors[..2], [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::ONE]);
    assert!((colors[2].z - 0.033_104_766).abs() < 1e-6, "{}", colors[2]);
    warns(&loaded, "0 to 255");
}

fn warns(loaded: &Loaded, part: &str) {
    let warnings = &loaded.warnings;
    assert!(
        warnings.iter().any(|w| w.contains(part)),
        "'{part}' is not in: {warnings:?}"
    );
}

#[test]
fn objects_groups_and_materials_split_meshes_and_a_repeated_material_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl a\ng x y\ns 1\nf 1 2 3\n\
               usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\no\nf 1 2 3\nusemtl none\nf 1 2 3\n\
               usemtl other\nf 1 2 3\n";
    let loaded = load(folder.path(), obj, Some("newmtl a\nnewmtl b\n")).unwrap();
    let meshes = loaded.scene.meshes.iter();
    let meshes: Vec<_> = meshes
        .map(|m| (&*m.name, m.material, m.triangles()))
        .collect();
    let expected = [
        ("unnamed_object", 2, 1),
        ("x y", 0, 2),
        ("x y", 1, 1),
        ("unnamed_object", 1, 1),
        ("unnamed_object", 2, 2),
    ];
    assert_eq!(meshes, expected);
    warns(
        &loaded,
        "no library has a material 'none'; a default is used (and 1 more",
    );
}

#[test]
fn libraries_are_found_by_quoted_and_unquoted_names() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my Lib.mtl"), "newmtl brick\nKd 0 1 0\n").unwrap();
    std::fs::write(folder.path().join("b.MTL"), "newmtl other\n").unwrap();
    for name in [
        "my Lib.mtl",
        "\"my Lib.mtl\"",
        "MY LIB.MTL # exported",
        ".\\my lib.mtl",
        "C:\\models\\my Lib.mtl",
        "b.MTL my Lib.mtl",
        "\"b.MTL\" \"my Lib.mtl\"",
        "b.MTL\nmtllib my Lib.mtl\nmtllib my Lib.mtl\nmtllib ./my Lib.mtl",
    ] {
        let obj = QUAD.replace("a.mtl", name);
        let scene = load(folder.path(), &obj, None).expect(name).scene;
        let material = &scene.materials[scene.meshes[0].material];
        assert_eq!(
            (&*material.name, material.base_color.x),
            ("brick", 0.0),
            "{name}"
        );
        assert!(scene.materials.len() <= 2, "{name}");
    }
}

#[test]
fn material_names_with_a_hash_and_with_a_comment_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "newmtl brick # red\nnewmtl brick #2\nnewmtl wood\n";
    for (name, expected) in [
        ("brick", "brick #2"),
        ("brick # red", "brick # red"),
        ("brick #2", "brick #2"),
        ("wood # oak", "wood"),
    ] {
        let obj = QUAD.replace("usemtl brick", &format!("usemtl {name}"));
        let scene = load(folder.path(), &obj, Some(mtl)).unwrap().scene;
        let material = &scene.materials[scene.meshes[0].material];
        assert_eq!(material.name, expected, "{name}");
    }
}

#[test]
fn an_unreadable_library_statement_causes_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "Kd 9\nnewmtl brick\nKd 0.8 0.8\nKs spectral file.rfl\nNs\nillum glass\nd -halo 0.5\n\
               map_Kd\nmap_Ks -s\nKd 0.5\nKe xyz 1 1\nNi 1.25 # glass\n";
    let loaded = load(folder.path(), QUAD, Some(mtl)).unwrap();
    warns(&loaded, "a.mtl: line 3: Kd: expected 1 or 3 numbers");
    warns(&loaded, "'0.8 0.8'; ignored (and 6 more");
    let material = &loaded.scene.materials[0];
    assert_eq!(material.base_color, Vec4::new(0.5, 0.5, 0.5, 0.5));
    assert_eq!((material.ior, material.emissive), (1.25, Vec3::ZERO));
}

#[test]
fn transparency_is_one_minus_dissolve_and_dissolve_takes_precedence() {
    let folder = tempfile::tempdir().unwrap();
    for (mtl, alpha) in [
        ("Tr 0.25", 0.75),
        ("Tr 0\nd 0.5", 0.5),
        ("d 1.0\nTr 1.0", 1.0),
        ("Tr 1", 1.0),
        ("", 1.0),
    ] {
        let mtl = format!("newmtl brick\n{mtl}\n");
        let scene = load(folder.path(), QUAD, Some(&mtl)).unwrap().scene;
        assert_eq!(scene.materials[0].base_color.w, alpha, "{mtl}");
    }
}

#[test]
fn textures_are_found_with_options_quotes_spaces_backslashes_and_any_case() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("Maps")).unwrap();
    save_png(folder.path(), "Maps/Old Brick.png", [1, 2, 3, 255]);
    save_png(folder.path(), "-s.png", [1, 2, 3, 255]);
    for (statement, inexact) in [
        ("Maps/Old Brick.png", false),
        ("Maps\\Old Brick.png # red", false),
        ("\"Maps\\Old Brick.png\"", false),
        (
            "-blendu on -mm 0 1 -type sphere -texres 64 Maps/Old Brick.png",
            false,
        ),
        ("-s 2 -o 0.5 0.25 -clamp on \\\nMaps\\Old Brick.png", false),
        ("-s 1 1 1 -imfchan l -s.png", false),
        ("maps/OLD BRICK.PNG", true),
        ("D:\\work\\textures\\-S.PNG", true),
    ] {
        let mtl = format!("newmtl brick\nmap_Kd {statement}\n");
        let loaded = load(folder.path(), QUAD, Some(&mtl)).expect(statement);
        let images = &loaded.scene.images;
        assert_eq!(images.len(), 1, "{statement}: {:?}", loaded.warnings);
        let texels = crate::image::texels(images, |_| true).unwrap();
        assert_eq!(texels[0].as_ref().unwrap()[..3], [1, 2, 3]);
        assert_eq!(
            loaded.warnings.len(),
            usize::from(inexact),
            "{:?}",
            loaded.warnings
        );
    }
}

#[test]
fn options_scale_move_and_clamp_a_texture_whose_v_grows_upwards() {
    let folder = tempfile::tempdir().unwrap();
    save_png(folder.path(), "c.png", [0; 4]);
    let mtl = "newmtl brick\nmap_Kd -s 2 3 -o 0.5 0.25 0 -clamp on c.png\nbump -bm 0.5 c.png\n";
    let scene = load(folder.path(), QUAD, Some(mtl)).unwrap().scene;
    let material = &scene.materials[0];
    let texture = material.textures[TextureSlot::BaseColor].unwrap();
    assert_eq!(texture.uv_transform, [[2.0, 0.0, 0.5], [0.0, 3.0, -2.25]]);
    assert_eq!(texture.sampler.wrap, [Wrap::ClampToEdge; 2]);
    assert_eq!(material.normal_scale, 0.5);
    let normal = material.textures[TextureSlot::Normal].unwrap();
    assert_eq!(normal.uv_transform, TextureRef::IDENTITY);
}

#[test]
fn missing_textures_and_unsupported_formats_cause_one_warning_each() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("t.tga"), [0, 0, 2, 0, 0]).unwrap();
    let mtl = "newmtl brick\nmap_Kd none.png\nmap_Ks gone.png\nbump t.tga\nmap_d lost.png\n";
    let loaded = load(folder.path(), QUAD, Some(mtl)).unwrap();
    warns(
        &loaded,
        "texture 'gone.png' is not there; left out (and 2 more like this)",
    );
    warns(&loaded, "t.tga is no PNG, JPEG, WebP, KTX2 or DDS image");
    let material = &loaded.scene.materials[0];
    assert_eq!(material.textures, Textures::default());
    assert_eq!(material.alpha, AlphaMode::Opaque);
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused_as_input() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "newmtl brick\nmap_Kd /dev/zero\n";
    for (obj, mtl, place) in [
        (QUAD, Some(mtl), "material 'brick'"),
        (&*QUAD.replace("a.mtl", "/dev/zero"), None, "mtllib"),
    ] {
        match load(folder.path(), obj, mtl) {
            Ok(loaded) => warns(&loaded, "/dev/zero"),
            Err(error) => {
                let error = error.to_string();
                for part in [place, "/dev/zero", "a regular file", "a device"] {
                    assert!(error.contains(part), "'{part}' is not in: {error}");
                }
            }
        }
    }
    let fifo = folder.path().join("pipe.obj");
    let made = std::process::Command::new("mkfifo").arg(&fifo).status();
    assert!(made.unwrap().success());
    for pipe in [fifo, "/dev/null".into()] {
        let error = load_file(&pipe, &LoadOptions::ALL).unwrap_err().to_string();
        assert!(error.contains("can be a pipe"), "{error}");
    }
    let error = load_file(folder.path(), &LoadOptions::ALL).unwrap_err();
    assert!(error.to_string().contains("a folder"), "{error}");
}

#[test]
fn a_million_statements_that_repeat_long_names_stay_small() {
    let folder = tempfile::tempdir().unwrap();
    let mut obj = format!(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\no {}\n",
        "n".repeat(1 << 20)
    );
    for i in 0..100_000 {
        obj.push_str(if i % 2 == 0 {
            "usemtl a\nf 1 2 3\n"
        } else {
            "usemtl\nf 1 2 3\n"
        });
    }
    obj.push_str(&"\\\n".repeat(1_000_000));
    let loaded = load(folder.path(), &obj, Some("newmtl a\n")).unwrap();
    assert_eq!(loaded.scene.meshes.len(), 100_000);
    assert!(loaded.scene.meshes[0].name.len() < 400);
}
