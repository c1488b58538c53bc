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

    /// The text of the error, which loading or decoding the images gives, must name the file and
    /// hold every part.
    fn fails_with(&self, parts: &[&str]) {
        let texels = |loaded: Loaded| crate::image::texels(&loaded.scene.images, |_| true);
        let error = self
            .load()
            .and_then(texels)
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
        let texels = crate::image::texels(&scene.images, |i| i == 0).unwrap();
        assert_eq!(texels[0].as_ref().unwrap()[..4], [10, 20, 30, 255]);
        assert_eq!(texels[1], None);
    }

    #[test]
    fn images_are_decoded_when_their_texels_are_asked_for() {
        let files = Files::new(&textured());
        let whole = png([6, 3], [0; 4]);
        files.write("my image.png", &whole[..whole.len() - 20]);
        let scene = files.load().unwrap().scene;
        assert_eq!(scene.images[0].size, [6, 3]);
        let error = crate::image::texels(&scene.images, |_| true).unwrap_err();
        assert!(error.to_string().contains("my image.png"), "{error}");
    }

    #[test]
    fn materials_keep_their_alpha_mode_transmission_and_ior() {
        let json = with(
            base(),
            "/materials",
            json!([
                {"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true},
                {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}},
                {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
                                "KHR_materials_ior": {"ior": 1.33}}}
            ]),
        );
        let primitive =
            |m: u32| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": m});
        let primitives: Vec<Value> = (0..3).map(primitive).collect();
        let json = with(json, "/meshes/0/primitives", json!(primitives));
        let materials = Files::new(&json).load().unwrap().scene.materials;
        assert_eq!(materials[0].alpha, AlphaMode::Mask(0.25));
        assert!(materials[0].double_sided);
        assert_eq!(
            (materials[1].alpha, materials[1].transmission),
            (AlphaMode::Blend, 0.75)
        );
        assert_eq!((materials[2].transmission, materials[2].ior), (0.5, 1.33));
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
    fn what_is_left_out_is_told_once_with_its_count() {
        let mut json = with(base(), "/skins", json!([{"joints": [0]}, {"joints": [0]}]));
        json["animations"] = json!([{"samplers": [], "channels": []}]);
        json["extensionsUsed"] = json!(["FOO_a", "KHR_texture_transform", "FOO_b"]);
        let primitive = json!({"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]});
        json["meshes"][0]["primitives"] = json!([primitive, primitive, primitive]);
        let loaded = Files::new(&json).load().unwrap();
        let warnings = loaded.warnings;
        for part in [
            "1 animations are left out",
            "2 skins are left out",
            "2 unsupported extensions are left out: FOO_a, FOO_b",
            "has morph targets; it is shown at rest (and 2 more like this)",
        ] {
            let told = warnings.iter().filter(|w| w.contains(part)).count();
            assert_eq!(told, 1, "'{part}' in {warnings:?}");
        }
        assert_eq!(warnings.len(), 4, "{warnings:?}");
    }

    #[test]
    fn a_buffer_longer_than_it_says_is_read_as_far_as_it_says() {
        let files = Files::new(&base());
        let mut bytes = triangle_bytes(CORNERS, [0, 1, 2]);
        bytes.resize(100_000, 7);
        files.write("mesh.bin", &bytes);
        let loaded = files.load().unwrap();
        assert!(
            loaded.warnings[0].contains("100000 bytes, 42 are used"),
            "{:?}",
            loaded.warnings
        );
        let json = with(base(), "/bufferViews/1/byteLength", json!(7));
        files.write("scene.gltf", json.to_string().as_bytes());
        files.fails_with(&["bufferViews[1]", "buffers[0] of 42 bytes"]);
    }

    /// `base()` with COLOR_0 of three vertices in `bytes`.
    fn colored(of: &str, component: u32, bytes: &[u8]) -> Result<Vec<Vec4>, SceneError> {
        let mut json = with(
            base(),
            "/meshes/0/primitives/0/attributes/COLOR_0",
            json!(2),
        );
        let view = json!({"buffer": 1, "byteLength": bytes.len()});
        json["bufferViews"].as_array_mut().unwrap().push(view);
        let accessor = json!({"bufferView": 2, "componentType": component, "count": 3, "type": of,
                              "normalized": component != 5126});
        json["accessors"].as_array_mut().unwrap().push(accessor);
        let buffer = json!({"uri": "colors.bin", "byteLength": bytes.len()});
        json["buffers"].as_array_mut().unwrap().push(buffer);
        let files = Files::new(&json);
        files.write("colors.bin", bytes);
        files
            .load()
            .map(|mut loaded| loaded.scene.meshes.remove(0).colors)
    }

    #[test]
    fn vertex_colours_of_every_type_are_read() {
        let floats = |values: &[f32]| -> Vec<u8> {
            let all = values.repeat(3);
            all.iter().flat_map(|v| v.to_le_bytes()).collect()
        };
        let shorts = |values: &[u16]| -> Vec<u8> {
            let all = values.repeat(3);
            all.iter().flat_map(|v| v.to_le_bytes()).collect()
        };
        let (rgb, rgba) = (Vec4::new(1.0, 0.0, 0.2, 1.0), Vec4::new(1.0, 0.0, 0.2, 0.4));
        for (of, component, bytes, expected) in [
            ("VEC3", 5126, floats(&[1.0, 0.0, 0.2]), rgb),
            ("VEC4", 5126, floats(&[1.0, 0.0, 0.2, 0.4]), rgba),
            ("VEC3", 5121, [255, 0, 51].repeat(3), rgb),
            ("VEC4", 5121, [255, 0, 51, 102].repeat(3), rgba),
            ("VEC3", 5123, shorts(&[65535, 0, 13107]), rgb),
            ("VEC4", 5123, shorts(&[65535, 0, 13107, 26214]), rgba),
            ("VEC4", 5126, floats(&[9.0, -1.0, 0.2, 0.4]), rgba),
            ("VEC3", 5126, floats(&[f32::NAN, 0.0, 0.2]), Vec4::ONE),
        ] {
            let colors = colored(of, component, &bytes).unwrap();
            assert_eq!(colors, [expected; 3], "{of} of {component}");
        }
        let error = colored("VEC2", 5126, &floats(&[1.0, 0.0]))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("accessors[2]") && error.contains("colours"),
            "{error}"
        );
    }

    #[test]
    fn quantised_positions_are_read_where_the_extension_is_used() {
        let positions = [0u16, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0, 0];
        let mut bytes: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
        bytes.resize(36, 0);
        bytes.extend([0u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
        let mut json = with(base(), "/accessors/0/componentType", json!(5123));
        json["bufferViews"][0]["byteStride"] = json!(8);
        let files = Files::new(&json);
        files.write("mesh.bin", &bytes);
        files.fails_with(&["accessors[0]", "positions"]);
        json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        files.write("scene.gltf", json.to_string().as_bytes());
        let scene = files.load().unwrap().scene;
        assert_eq!(
            scene.meshes[0].positions,
            [Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0]
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
    fn elements_beyond_what_the_file_can_hold_are_refused_before_they_are_made() {
        let sparse = json!({"count": 1,
            "indices": {"bufferView": 1, "componentType": 5123},
            "values": {"bufferView": 0}});
        for count in [1_000_000_000_000u64, u64::MAX] {
            let accessor = json!({"componentType": 5126, "count": count,
                                  "type": "VEC3", "sparse": sparse});
            Files::new(&with(base(), "/accessors/0", accessor)).fails_with(&[
                "accessors[0]",
                "in a file of this size",
                &count.to_string(),
            ]);
            Files::new(&with(base(), "/accessors/1/count", json!(count))).fails_with(&[
                "accessors[1]",
                "in a file of this size",
                &count.to_string(),
            ]);
        }
    }

    #[test]
    fn a_mesh_of_many_primitives_placed_many_times_is_refused_before_it_explodes() {
        let primitive = json!({"attributes": {"POSITION": 0}});
        let json = with(
            base(),
            "/meshes/0/primitives",
            json!(vec![primitive; 10_000]),
        );
        let json = with(json, "/nodes", json!(vec![json!({"mesh": 0}); 10_000]));
        let nodes: Vec<u32> = (0..10_000).collect();
        let json = with(json, "/scenes/0/nodes", json!(nodes));
        Files::new(&json).fails_with(&["instances of meshes[0]", "in a file of this size"]);
    }

    #[test]
    fn a_stride_below_the_elements_size_is_told() {
        for stride in [4, 8] {
            let json = with(base(), "/bufferViews/0/byteStride", json!(stride));
            Files::new(&json).fails_with(&[
                "bufferViews[0].byteStride",
                "at least 12 bytes",
                &format!("found {stride}"),
            ]);
        }
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_pipes_are_refused_as_buffers_and_images() {
        for (json, place) in [
            (
                with(base(), "/buffers/0/uri", json!("/dev/zero")),
                "buffers[0]",
            ),
            (
                with(textured(), "/images/0/uri", json!("/dev/zero")),
                "images[0]",
            ),
        ] {
            let error = Files::new(&json).load().unwrap_err().to_string();
            for part in ["/dev/zero", place, "a regular file", "a device"] {
                assert!(error.contains(part), "'{part}' is not in: {error}");
            }
        }
        let files = Files::new(&base());
        std::fs::remove_file(files.path("mesh.bin")).unwrap();
        let made = std::process::Command::new("mkfifo")
            .arg(files.path("mesh.bin"))
            .status();
        assert!(made.unwrap().success());
        files.fails_with(&["mesh.bin", "buffers[0]", "a regular file", "a pipe"]);
    }

    #[test]
    fn names_and_paths_with_terminal_escapes_are_shown_escaped() {
        let json = with(base(), "/buffers/0/uri", json!("no\u{1b}]0;x\u{7}.bin"));
        Files::new(&json).fails_with(&["no\\u{1b}]0;x\\u{7}.bin", "cannot read"]);
        let json = with(base(), "/meshes/0/name", json!("a\u{1b}[2Jb\u{9b}"));
        let files = Files::new(&json);
        let scene = files.load().unwrap().scene;
        assert_eq!(scene.meshes[0].name, "a\\u{1b}[2Jb\\u{9b}");
        files.write("mesh.bin", &triangle_bytes(CORNERS, [0, 1, 3]));
        files.fails_with(&["'a\\u{1b}[2Jb\\u{9b}'"]);
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
    fn required_extensions_that_are_not_supported_are_named_before_all_else() {
        // As such files are: accessors and textures that only the extension fills.
        let mut draco = base();
        draco["accessors"][0]
            .as_object_mut()
            .unwrap()
            .remove("bufferView");
        let mut basis = textured();
        basis["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
        for (name, json) in [
            ("KHR_draco_mesh_compression", draco.clone()),
            ("EXT_meshopt_compression", draco),
            ("KHR_texture_basisu", basis),
        ] {
            let required = json!(["KHR_texture_transform", name, name]);
            let files = Files::new(&with(json, "/extensionsRequired", required));
            files.fails_with(&["extensionsRequired", &format!("found {name}, unsupported")]);
        }
    }

    #[test]
    fn a_huge_image_in_a_small_file_is_refused_before_it_is_decoded() {
        let files = Files::new(&textured());
        let mut huge = png([1, 1], [0; 4]);
        // Width and height of the header, with its checksum made good.
        huge[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        let checksum = crc(&huge[12..29]);
        huge[29..33].copy_from_slice(&checksum.to_be_bytes());
        files.write("my image.png", &huge);
        files.fails_with(&["my image.png", "16384x16384", "bytes of texels"]);
    }

    /// CRC-32 as PNG has it.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| {
                (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
            })
        })
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
