//! Small generated files: what is read from them, and what is said about broken ones.

use crate::{AlphaMode, Light, LoadOptions, Loaded, SceneError, load_file};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};
use std::path::PathBuf;
use tempfile::TempDir;

/// Three positions, then three u16 indices: `base()`'s buffer.
fn triangle_bytes(positions: [[f32; 3]; 3], indices: [u16; 3]) -> Vec<u8> {
    let mut bytes: Vec<u8> = positions
        .concat()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// One triangle in `mesh.bin`.
fn base() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "tri", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6}
        ],
        "buffers": [{"uri": "mesh.bin", "byteLength": 42}]
    })
}

/// A folder with `scene.gltf`, `mesh.bin` and other files.
struct Files {
    folder: TempDir,
}

impl Files {
    fn new(json: &Value) -> Self {
        let files = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        files.write("scene.gltf", json.to_string().as_bytes());
        files.write("mesh.bin", &triangle_bytes(CORNERS, [0, 1, 2]));
        files
    }

    fn write(&self, name: &str, bytes: &[u8]) -> &Self {
        std::fs::write(self.path(name), bytes).unwrap();
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn load(&self) -> Result<Loaded, SceneError> {
        load_file(&self.path("scene.gltf"), &LoadOptions::ALL)
    }

    /// The error's text, which must name the file and hold every part.
    fn fails_with(&self, parts: &[&str]) {
        let error = self
            .load()
            .expect_err("a broken file was accepted")
            .to_string();
        for part in [self.folder.path().to_str().unwrap()].iter().chain(parts) {
            assert!(error.contains(part), "'{part}' is not in: {error}");
        }
    }
}

/// Changes the value at a JSON pointer.
fn with(mut json: Value, pointer: &str, value: Value) -> Value {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match json.pointer_mut(parent).expect(parent) {
        Value::Array(items) => items[key.parse::<usize>().unwrap()] = value,
        object => object[key] = value,
    }
    json
}

fn png(size: [u32; 2], texel: [u8; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_pixel(size[0], size[1], image::Rgba(texel));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn textured() -> Value {
    let json = with(base(), "/images", json!([{"uri": "my%20image.png"}]));
    let json = with(json, "/textures", json!([{"source": 0}]));
    let json = with(
        json,
        "/materials",
        json!([{
            "name": "paint",
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}
        }]),
    );
    with(json, "/meshes/0/primitives/0/material", json!(0))
}

mod reading {
    use super::*;

    #[test]
    fn a_file_without_normals_camera_or_lights_gets_them() {
        let scene = Files::new(&base()).load().unwrap().scene;
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.positions, CORNERS.map(Vec3::from_array));
        assert_eq!(mesh.indices, [0, 1, 2]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
        assert_eq!(mesh.tangents.len(), 3);
        assert_eq!(scene.cameras[0].name, "default");
        assert!(matches!(scene.lights[..], [Light::Directional { .. }]));
    }

    #[test]
    fn the_same_scene_comes_from_gltf_data_uris_and_glb() {
        let files = Files::new(&base());
        let expected = files.load().unwrap().scene.meshes[0].positions.clone();
        let bytes = triangle_bytes(CORNERS, [0, 1, 2]);

        let hex: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
        let json = with(base(), "/buffers/0/uri", json!(format!("data:,{hex}")));
        assert_eq!(
            Files::new(&json).load().unwrap().scene.meshes[0].positions,
            expected
        );

        let mut json = base();
        json["buffers"][0].as_object_mut().unwrap().remove("uri");
        let glb = gltf::binary::Glb {
            header: gltf::binary::Header {
                magic: *b"glTF",
                version: 2,
                length: 0,
            },
            json: json.to_string().into_bytes().into(),
            bin: Some(bytes.into()),
        };
        files.write("scene.glb", &glb.to_vec().unwrap());
        let path = files.path("scene.glb");
        let scene = load_file(&path, &LoadOptions::ALL).unwrap().scene;
        assert_eq!(scene.meshes[0].positions, expected);
    }

    #[test]
    fn transforms_multiply_down_the_tree_and_mirrors_are_told() {
        let json = with(
            base(),
            "/nodes",
            json!([
                {"children": [1], "translation": [10.0, 0.0, 0.0]},
                {"mesh": 0, "scale": [-2.0, 1.0, 3.0]}
            ]),
        );
        let scene = Files::new(&json).load().unwrap().scene;
        let instance = scene.instances[0];
        assert!(instance.mirrored());
        let corner = instance.transform.transform_point3(Vec3::ONE);
        assert_eq!(corner, Vec3::new(8.0, 1.0, 3.0));
    }

    #[test]
    fn two_nodes_of_one_mesh_are_two_instances() {
        let json = with(base(), "/scenes/0/nodes", json!([0, 1]));
        let json = with(json, "/nodes", json!([{"mesh": 0}, {"mesh": 0}]));
        let scene = Files::new(&json).load().unwrap().scene;
        assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
        assert_eq!(scene.triangle_count(), 2);
    }

    #[test]
    fn a_camera_node_looks_along_its_minus_z() {
        let json = with(
            base(),
            "/cameras",
            json!([
                {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.5, "zfar": 50.0}}
            ]),
        );
        // Turned by 90 degrees about y: -z becomes -x.
        let turned = json!([
            0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 1.0
        ]);
        let json = with(
            json,
            "/nodes",
            json!([
                {"mesh": 0}, {"name": "cam_side", "camera": 0, "matrix": turned}
            ]),
        );
        let json = with(json, "/scenes/0/nodes", json!([0, 1]));
        let camera = &Files::new(&json).load().unwrap().scene.cameras[0];
        assert_eq!(camera.name, "cam_side");
        assert_eq!(camera.eye, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(camera.target, Vec3::new(0.0, 2.0, 3.0));
        assert_eq!((camera.near, camera.far, camera.up), (0.5, 50.0, Vec3::Y));
    }

    #[test]
    fn an_image_in_both_colour_spaces_is_listed_twice_and_otherwise_once() {
        let json = with(
            textured(),
            "/materials/0/occlusionTexture",
            json!({"index": 0}),
        );
        let json = with(json, "/materials/0/emissiveTexture", json!({"index": 0}));
        let files = Files::new(&json);
        files.write("my image.png", &png([2, 2], [10, 20, 30, 255]));
        let scene = files.load().unwrap().scene;
        assert_eq!(scene.images.len(), 2);
        let material = &scene.materials[0];
        assert_eq!(material.base_color_texture.unwrap().image, 0);
        assert_eq!(material.emissive_texture.unwrap().image, 0);
        assert_eq!(material.occlusion_texture.unwrap().image, 1);
        assert_eq!(&scene.images[0].rgba[..4], [10, 20, 30, 255]);
    }

    #[test]
    fn without_images_an_image_has_its_size_only() {
        let files = Files::new(&textured());
        files.write("my image.png", &png([6, 3], [0; 4]));
        let path = files.path("scene.gltf");
        let scene = load_file(&path, &LoadOptions::NO_IMAGES).unwrap().scene;
        assert_eq!(
            (scene.images[0].size, scene.images[0].rgba.len()),
            ([6, 3], 0)
        );
    }

    #[test]
    fn materials_keep_their_alpha_mode_transmission_and_mirror() {
        let json = with(
            base(),
            "/materials",
            json!([
                {"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true},
                {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}},
                {"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}},
                {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
                                "KHR_materials_ior": {"ior": 1.33}}}
            ]),
        );
        let primitive =
            |m: u32| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": m});
        let primitives: Vec<Value> = (0..4).map(primitive).collect();
        let json = with(json, "/meshes/0/primitives", json!(primitives));
        let materials = Files::new(&json).load().unwrap().scene.materials;
        assert_eq!(materials[0].alpha, AlphaMode::Mask(0.25));
        assert!(materials[0].double_sided);
        assert_eq!(
            (materials[1].alpha, materials[1].transmission),
            (AlphaMode::Blend, 0.75)
        );
        assert_eq!((materials[2].mirror, materials[1].mirror), (1.0, 0.0));
        assert_eq!((materials[3].transmission, materials[3].ior), (0.5, 1.33));
    }

    #[test]
    fn a_texture_transform_turns_as_the_extension_says() {
        let transform = json!({"offset": [0.5, 0.25], "rotation": std::f32::consts::FRAC_PI_2,
                               "scale": [2.0, 3.0]});
        let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
        let json = with(
            textured(),
            "/materials/0/pbrMetallicRoughness/baseColorTexture",
            texture.clone(),
        );
        let json = with(json, "/materials/0/normalTexture", texture);
        let files = Files::new(&json);
        files.write("my image.png", &png([2, 2], [0; 4]));
        let material = files.load().unwrap().scene.materials.remove(0);
        let rows = material.base_color_texture.unwrap().uv_transform;
        assert_eq!(rows, material.normal_texture.unwrap().uv_transform);
        // (1, 0) scales to (2, 0), turns to (0, -2), moves to (0.5, -1.75).
        let u = rows[0][0] + rows[0][2];
        let v = rows[1][0] + rows[1][2];
        assert!(
            (u - 0.5).abs() < 1e-6 && (v + 1.75).abs() < 1e-6,
            "{rows:?}"
        );
    }

    #[test]
    fn tangents_of_the_file_are_kept() {
        let mut bytes = triangle_bytes(CORNERS, [0, 1, 2]);
        bytes.extend([0, 0]);
        bytes.extend(
            [0.0f32, 1.0, 0.0, -1.0]
                .repeat(3)
                .iter()
                .flat_map(|v| v.to_le_bytes()),
        );
        let json = with(base(), "/buffers/0/byteLength", json!(92));
        let mut json = with(json, "/meshes/0/primitives/0/attributes/TANGENT", json!(2));
        json["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({"buffer": 0, "byteOffset": 44, "byteLength": 48}));
        json["accessors"]
            .as_array_mut()
            .unwrap()
            .push(json!({"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC4"}));
        let files = Files::new(&json);
        files.write("mesh.bin", &bytes);
        let scene = files.load().unwrap().scene;
        assert_eq!(
            scene.meshes[0].tangents,
            [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]
        );
    }

    #[test]
    fn points_and_lines_are_skipped_with_a_warning() {
        let mut json = base();
        json["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap()
            .push(json!({"attributes": {"POSITION": 0}, "mode": 1}));
        let loaded = Files::new(&json).load().unwrap();
        assert_eq!(loaded.scene.triangle_count(), 1);
        assert!(
            loaded.warnings[0].contains("Lines"),
            "{:?}",
            loaded.warnings
        );
    }

    #[test]
    fn degenerate_triangles_are_kept() {
        let files = Files::new(&base());
        files.write("mesh.bin", &triangle_bytes([[1.0; 3]; 3], [0, 0, 0]));
        assert_eq!(files.load().unwrap().scene.triangle_count(), 1);
    }
}

mod bad_input {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        let files = Files::new(&base());
        std::fs::remove_file(files.path("mesh.bin")).unwrap();
        files.fails_with(&["mesh.bin", "buffers[0]", "cannot read"]);
    }

    #[test]
    fn a_cut_buffer_is_told_with_both_lengths() {
        let files = Files::new(&base());
        files.write("mesh.bin", &[0; 40]);
        files.fails_with(&["buffers[0]", "42 bytes", "40 bytes"]);
    }

    #[test]
    fn cut_or_foreign_json_is_an_error() {
        let files = Files::new(&base());
        let text = base().to_string();
        for cut in [0, 1, text.len() / 2, text.len() - 1] {
            files.write("scene.gltf", &text.as_bytes()[..cut]);
            files.fails_with(&["JSON"]);
        }
        for glb in [
            &b"glTF"[..],
            b"glTF\x02\0\0\0\x05\0\0\0",
            b"glTF\x02\0\0\0\xff\0\0\0abcd",
        ] {
            files.write("scene.gltf", glb);
            files.fails_with(&["GLB"]);
        }
    }

    #[test]
    fn ranges_outside_their_buffer_are_told() {
        for (pointer, value, place) in [
            ("/accessors/0/count", json!(4), "accessors[0]"),
            ("/accessors/0/byteOffset", json!(1), "accessors[0]"),
            ("/accessors/1/count", json!(u64::MAX), "accessors[1]"),
            ("/bufferViews/0/byteLength", json!(1000), "bufferViews[0]"),
            (
                "/bufferViews/0/byteOffset",
                json!(u64::MAX),
                "bufferViews[0]",
            ),
            ("/bufferViews/0/byteStride", json!(252), "accessors[0]"),
        ] {
            Files::new(&with(base(), pointer, value)).fails_with(&[place, "range inside"]);
        }
    }

    #[test]
    fn indices_outside_their_table_are_told() {
        for (pointer, value) in [
            ("/nodes/0/mesh", json!(7)),
            ("/meshes/0/primitives/0/material", json!(3)),
            ("/meshes/0/primitives/0/indices", json!(9)),
            ("/accessors/0/bufferView", json!(2)),
            ("/bufferViews/1/buffer", json!(1)),
            ("/scene", json!(4)),
        ] {
            Files::new(&with(base(), pointer, value)).fails_with(&["index inside its table"]);
        }
    }

    #[test]
    fn a_vertex_index_past_the_vertices_is_told() {
        let files = Files::new(&base());
        files.write("mesh.bin", &triangle_bytes(CORNERS, [0, 1, 3]));
        files.fails_with(&[
            "'tri'",
            "accessors[1], index 2",
            "vertex below 3",
            "found 3",
        ]);
    }

    #[test]
    fn a_position_that_is_not_finite_names_mesh_accessor_and_vertex() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut corners = CORNERS;
            corners[1][2] = bad;
            let files = Files::new(&base());
            files.write("mesh.bin", &triangle_bytes(corners, [0, 1, 2]));
            files.fails_with(&[
                "meshes[0] 'tri'",
                "accessors[0], vertex 1",
                "finite position",
            ]);
        }
    }

    #[test]
    fn accessors_of_the_wrong_type_are_told() {
        for (pointer, value) in [
            ("/accessors/0/type", json!("VEC2")),
            ("/accessors/0/componentType", json!(5125)),
            ("/accessors/1/componentType", json!(5126)),
            ("/accessors/1/type", json!("MAT4")),
        ] {
            Files::new(&with(base(), pointer, value)).fails_with(&["accessors["]);
        }
    }

    #[test]
    fn cycles_and_nodes_with_two_parents_are_told() {
        let cycle = json!([{"children": [1]}, {"mesh": 0, "children": [0]}]);
        Files::new(&with(base(), "/nodes", cycle)).fails_with(&["nodes[0]", "cycle"]);
        let own_child = json!([{"mesh": 0, "children": [0]}]);
        Files::new(&with(base(), "/nodes", own_child)).fails_with(&["nodes[0]", "cycle"]);
    }

    #[test]
    fn a_chain_of_a_hundred_thousand_nodes_does_not_overflow_the_stack() {
        let n = 100_000;
        let mut nodes: Vec<Value> = (1..n).map(|i| json!({"children": [i]})).collect();
        nodes.push(json!({"mesh": 0}));
        assert!(
            Files::new(&with(base(), "/nodes", json!(nodes)))
                .load()
                .is_ok()
        );
    }

    #[test]
    fn zeros_without_a_buffer_view_are_bounded() {
        let sparse = json!({"count": 1,
            "indices": {"bufferView": 1, "componentType": 5123},
            "values": {"bufferView": 0}});
        let accessor = json!({"componentType": 5126, "count": 1_000_000_000_000u64,
                              "type": "VEC3", "sparse": sparse});
        Files::new(&with(base(), "/accessors/0", accessor)).fails_with(&["without a buffer view"]);
    }

    #[test]
    fn missing_corrupt_and_empty_images_are_told() {
        let files = Files::new(&textured());
        files.fails_with(&["my image.png", "images[0], used by materials[0] 'paint'"]);
        let good = png([4, 4], [1, 2, 3, 255]);
        for bytes in [&b""[..], b"not an image", &good[..good.len() / 2]] {
            files.write("my image.png", bytes);
            files.fails_with(&["my image.png", "PNG or JPEG"]);
        }
        // The width in the header of a PNG, which has a checksum: 0x4.
        let mut empty = good.clone();
        empty[16..20].fill(0);
        files.write("my image.png", &empty);
        files.fails_with(&["my image.png"]);
        files.write("my image.png", &good);
        assert!(files.load().is_ok());
    }

    #[test]
    fn a_huge_image_is_refused_before_it_is_decoded() {
        // 0xffff x 0xffff in the frame header of an otherwise empty JPEG.
        let jpeg = [
            0xff, 0xd8, 0xff, 0xc0, 0, 11, 8, 0xff, 0xff, 0xff, 0xff, 1, 1, 0x11, 0,
        ];
        let files = Files::new(&textured());
        files.write("my image.png", &jpeg);
        files.fails_with(&["my image.png"]);
    }

    #[test]
    fn required_extensions_that_are_not_known_are_told() {
        let json = with(
            base(),
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
        );
        Files::new(&json).fails_with(&["KHR_draco_mesh_compression", "unsupported"]);
    }

    #[test]
    fn a_scene_without_triangles_is_an_error() {
        let files = Files::new(&with(base(), "/meshes/0/primitives/0/mode", json!(0)));
        files.fails_with(&["at least one triangle"]);
    }

    #[test]
    fn no_single_changed_byte_of_the_json_panics() {
        let text = textured().to_string().into_bytes();
        let files = Files::new(&textured());
        files.write("my image.png", &png([4, 4], [1, 2, 3, 255]));
        for at in 0..text.len() {
            let mut changed = text.clone();
            changed[at] = if changed[at].is_ascii_digit() {
                b'9'
            } else {
                b'1'
            };
            files.write("scene.gltf", &changed);
            // Either outcome will do: what counts is that there is one.
            let _ = files.load();
        }
    }
}
