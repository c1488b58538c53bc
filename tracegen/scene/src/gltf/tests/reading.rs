//! Contents read from valid files.

use super::*;
use crate::TextureSlot;
use glam::{DVec3, Vec2};

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
    for name in ["scene.glb", "avatar.vrm"] {
        files.write(name, &glb.to_vec().unwrap());
        let scene = load_file(&files.path(name), &LoadOptions::ALL)
            .unwrap()
            .scene;
        assert_eq!(scene.meshes[0].positions, expected, "{name}");
    }
}

#[test]
fn a_scene_far_from_zero_has_the_coordinates_of_one_at_zero() {
    let at = |far: f64| {
        let json = with(
            base(),
            "/nodes",
            json!([
                {"children": [1, 2], "translation": [far, -far, 2.0 * far]},
                {"mesh": 0, "translation": [0.1, 0.2, 0.3], "rotation": [0.0, 0.6, 0.0, 0.8]},
                {"camera": 0, "translation": [0.0, 1.25, 3.0]}
            ]),
        );
        let lens = json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
        let files = Files::new(&with(json, "/cameras", lens));
        files.load().unwrap().scene
    };
    let near = at(0.0);
    assert_eq!(near.origin, DVec3::ZERO);
    for far in [1e5, 1e6, 1e7] {
        let scene = at(far);
        let moved = DVec3::new(far, -far, 2.0 * far);
        let origin = scene.origin - moved;
        // The grid's spacing is half of the scene's extent: one metre.
        assert_eq!(origin, origin.round());
        let [a, b] = [&near, &scene].map(|scene| scene.instances[0].transform);
        assert_eq!(a.matrix3, b.matrix3);
        let same = |a: Vec3, b: Vec3| {
            let b = b + origin.as_vec3();
            assert!(a.abs_diff_eq(b, 1e-6), "{a} {b} at {far}");
        };
        same(a.translation.into(), b.translation.into());
        same(near.cameras[0].eye, scene.cameras[0].eye);
        same(near.cameras[0].target, scene.cameras[0].target);
    }
}

#[test]
fn transforms_multiply_down_the_tree_and_mirroring_is_detected() {
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
    // Rotated by 90 degrees about y: -z becomes -x.
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
    assert_eq!(material.textures[TextureSlot::BaseColor].unwrap().image, 0);
    assert_eq!(material.textures[TextureSlot::Emissive].unwrap().image, 0);
    assert_eq!(material.textures[TextureSlot::Occlusion].unwrap().image, 1);
    let texels = crate::image::texels(&scene.images, |i| i == 0).unwrap();
    assert_eq!(texels[0].as_ref().unwrap()[..4], [10, 20, 30, 255]);
    assert_eq!(texels[1], None);
}

#[test]
fn images_are_decoded_when_their_texels_are_requested() {
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
    let primitive = |m: u32| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": m});
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
fn a_texture_transform_rotates_as_the_extension_specifies() {
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
    let rows = material.textures[TextureSlot::BaseColor]
        .unwrap()
        .uv_transform;
    assert_eq!(
        rows,
        material.textures[TextureSlot::Normal].unwrap().uv_transform
    );
    // (1, 0) scales to (2, 0), rotates to (0, -2), moves to (0.5, -1.75).
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
        loaded.warnings[0].contains("holds lines, not triangles"),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn files_are_found_as_other_systems_and_tools_name_them() {
    for (uri, on_disk, warns) in [
        ("my%20image.png", "my image.png", false),
        ("my image.png", "my image.png", false),
        ("./my%20image.png", "my image.png", false),
        ("my%20image.png", "my%20image.png", true),
        ("MY%20Image.PNG", "my image.png", true),
        ("maps\\my%20image.png", "maps/my image.png", true),
        ("../textures/maps/my image.png", "my image.png", true),
    ] {
        let json = with(textured(), "/images/0/uri", json!(uri));
        let files = Files::new(&json);
        std::fs::create_dir(files.path("maps")).unwrap();
        files.write(on_disk, &png([4, 4], [1, 2, 3, 255]));
        let loaded = files.load().unwrap();
        let texels = crate::image::texels(&loaded.scene.images, |_| true).unwrap();
        assert_eq!(texels.len(), 1, "{uri}");
        assert!(loaded.files.contains(&files.path(on_disk)), "{uri}");
        let name = on_disk.trim_start_matches("maps/");
        assert_eq!(loaded.scene.images[0].name, name);
        let told = format!("images[0], used by materials[0] 'paint': '{uri}' is taken from");
        let told = loaded.warnings.iter().any(|w| w.starts_with(&told));
        assert_eq!(told, warns, "{uri}: {:?}", loaded.warnings);
    }
    let files = Files::new(&with(base(), "/buffers/0/uri", json!("Mesh.BIN")));
    let loaded = files.load().unwrap();
    assert!(loaded.files.contains(&files.path("mesh.bin")));
    let told = &loaded.warnings[0];
    assert!(
        told.starts_with("buffers[0]: 'Mesh.BIN' is taken from"),
        "{told}"
    );
    let json = with(base(), "/materials", textured()["materials"].clone());
    let mut json = with(json, "/textures", json!([{"source": 0}]));
    json["images"] = json!([{"uri": "nowhere/absent.png"}]);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    Files::new(&json).fails_with(&["absent.png", "images[0]", "cannot read"]);
}

/// The texture coordinates of a set at the triangle's corners: u grows along x in even sets and along y in
/// odd ones.
fn coordinates(set: u32) -> [Vec2; 3] {
    let (along_x, along_y) = match set % 2 {
        0 => (Vec2::X, Vec2::Y),
        _ => (Vec2::Y, Vec2::X),
    };
    [Vec2::ZERO, along_x, along_y].map(|corner| corner + set as f32)
}

/// A triangle with these sets of texture coordinates, whose material has base colour, normal and
/// occlusion textures in three sets.
fn sets_of_coordinates(given: &[u32], sampled: [u32; 3]) -> Loaded {
    let mut json = textured();
    let mut bytes = triangle_bytes(CORNERS, [0, 1, 2]);
    bytes.resize(44, 0);
    for &set in given {
        let offset = bytes.len();
        let corners = coordinates(set).map(|corner| corner.to_array());
        bytes.extend(corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        let views = json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": 24}));
        let view = views.len() - 1;
        let accessors = json["accessors"].as_array_mut().unwrap();
        accessors
            .push(json!({"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC2"}));
        let accessor = accessors.len() - 1;
        json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] =
            json!(accessor);
    }
    json["buffers"][0]["byteLength"] = json!(bytes.len());
    let texture = |set: u32| json!({"index": 0, "texCoord": set});
    let material = &mut json["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"] = texture(sampled[0]);
    material["normalTexture"] = texture(sampled[1]);
    // The transform's set takes precedence.
    material["occlusionTexture"] = json!({"index": 0, "texCoord": 0,
        "extensions": {"KHR_texture_transform": {"texCoord": sampled[2]}}});
    let files = Files::new(&json);
    files.write("mesh.bin", &bytes);
    files.write("my image.png", &png([4, 4], [1, 2, 3, 255]));
    files.load().unwrap()
}

#[test]
fn a_material_may_sample_any_two_sets_of_texture_coordinates() {
    for sampled in [
        [0, 0, 0],
        [1, 1, 1],
        [0, 1, 0],
        [1, 0, 1],
        [2, 2, 2],
        [0, 2, 2],
        [3, 1, 3],
        [3, 0, 0],
        [5, 3, 5],
        [3, 5, 5],
    ] {
        let Loaded {
            scene, warnings, ..
        } = sets_of_coordinates(&[0, 1, 2, 3, 5], sampled);
        assert!(warnings.is_empty(), "{sampled:?}: {warnings:?}");
        let (mesh, material) = (&scene.meshes[0], &scene.materials[0]);
        let textures = [
            material.textures[TextureSlot::BaseColor],
            material.textures[TextureSlot::Normal],
            material.textures[TextureSlot::Occlusion],
        ];
        for (texture, set) in textures.into_iter().zip(sampled) {
            let found = match texture.unwrap().uv_set {
                0 => &mesh.uv0,
                1 => &mesh.uv1,
                other => panic!("set {other}"),
            };
            assert_eq!(found[..], coordinates(set), "{sampled:?}");
        }
        // Tangents follow the normal map's set.
        let tangent = [Vec3::X, Vec3::Y][sampled[1] as usize % 2];
        assert_eq!(mesh.tangents[0].truncate(), tangent, "{sampled:?}");
    }
}

#[test]
fn a_texture_that_an_extension_replaces_needs_no_coordinates() {
    let mut json = textured();
    let material = &mut json["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(2);
    let load = |json: &Value| {
        let files = Files::new(json);
        files.write("my image.png", &png([4, 4], [1, 2, 3, 255]));
        files.load().unwrap()
    };
    assert!(load(&json).warnings[0].contains("no TEXCOORD_2"));
    json["materials"][0]["extensions"] =
        json!({"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.5}});
    let loaded = load(&json);
    assert_eq!(
        loaded.scene.materials[0].textures[TextureSlot::BaseColor],
        None
    );
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn a_third_set_and_a_missing_set_of_texture_coordinates_are_reported() {
    let loaded = sets_of_coordinates(&[0, 1, 4], [4, 0, 1]);
    let material = &loaded.scene.materials[0];
    assert!(
        material.textures[TextureSlot::BaseColor].is_some()
            && material.textures[TextureSlot::Normal].is_some()
    );
    assert_eq!(material.textures[TextureSlot::Occlusion], None);
    assert_eq!(
        loaded.warnings,
        [
            "materials[0] 'paint' uses TEXCOORD_4, TEXCOORD_0 and TEXCOORD_1; a material has at most two sets, the texture of the last one is left out"
        ]
    );
    for (sampled, set) in [([0, 0, 0], 0), ([4, 4, 4], 4)] {
        let loaded = sets_of_coordinates(&[1], sampled);
        let warning = format!(
            "meshes[0] 'tri'.primitives[0] has a textured material and no TEXCOORD_{set}; (0, 0) is used"
        );
        assert_eq!(loaded.warnings, [warning]);
    }
}

#[test]
fn ignored_features_are_reported_once_with_their_count() {
    let mut json = base();
    json["extensionsUsed"] = json!(["FOO_a", "KHR_texture_transform", "FOO_b"]);
    let points = json!({"attributes": {"POSITION": 0}, "mode": 0});
    let primitives = json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.extend([points.clone(), points.clone(), points]);
    let loaded = Files::new(&json).load().unwrap();
    let warnings = loaded.warnings;
    for part in [
        "2 unsupported extensions are left out: FOO_a, FOO_b",
        "holds points, not triangles; skipped (and 2 more like this)",
    ] {
        let told = warnings.iter().filter(|w| w.contains(part)).count();
        assert_eq!(told, 1, "'{part}' in {warnings:?}");
    }
    assert_eq!(warnings.len(), 2, "{warnings:?}");
}

#[test]
fn a_buffer_longer_than_its_stated_length_is_read_up_to_that_length() {
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
fn quantised_positions_are_read_if_the_extension_is_used() {
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

/// `base()` with instances: three translations, rotations of `component`, and scales.
fn instanced(rotation_component: u32, rotations: &[u8]) -> Files {
    let mut json = base();
    json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    json["nodes"] = json!([{
        "mesh": 0,
        "translation": [10, 0, 0],
        "extensions": {"EXT_mesh_gpu_instancing": {
            "attributes": {"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}
        }}
    }]);
    let rotation_bytes = rotations.len();
    let (views, accessors) = ("bufferViews", "accessors");
    for (at, length) in [(0, 36), (36, rotation_bytes), (36 + rotation_bytes, 36)] {
        let view = json!({"buffer": 1, "byteOffset": at, "byteLength": length});
        json[views].as_array_mut().unwrap().push(view);
    }
    for (view, component, of) in [
        (2, 5126, "VEC3"),
        (3, rotation_component, "VEC4"),
        (4, 5126, "VEC3"),
    ] {
        let normalized = component != 5126;
        json[accessors].as_array_mut().unwrap().push(json!({
            "bufferView": view, "componentType": component, "count": 3, "type": of, "normalized": normalized
        }));
    }
    let floats = |values: [[f32; 3]; 3]| -> Vec<u8> {
        values
            .concat()
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect()
    };
    let translations = floats([[0.0; 3], [0.0, 5.0, 0.0], [0.0, 0.0, 7.0]]);
    let scales = floats([[1.0; 3], [2.0; 3], [1.0; 3]]);
    let bytes = [translations, rotations.to_vec(), scales].concat();
    json["buffers"]
        .as_array_mut()
        .unwrap()
        .push(json!({"uri": "instances.bin", "byteLength": bytes.len()}));
    let files = Files::new(&json);
    files.write("instances.bin", &bytes);
    files
}

#[test]
fn instances_have_the_extensions_transforms_whether_it_is_required_or_not() {
    // The third is rotated by 180 degrees about y.
    let float: Vec<u8> = [
        [0.0_f32, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 0.0],
    ]
    .concat()
    .iter()
    .flat_map(|v| v.to_le_bytes())
    .collect();
    let short: Vec<u8> = [[0_i16, 0, 0, 32767], [0, 0, 0, 32767], [0, 32767, 0, 0]]
        .concat()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let byte = vec![0, 0, 0, 127, 0, 0, 0, 127, 0, 127, 0, 0];
    for (component, rotations) in [(5126, float), (5122, short), (5120, byte)] {
        let scene = instanced(component, &rotations).load().unwrap().scene;
        let corner =
            |instance: usize, at: Vec3| scene.instances[instance].transform.transform_point3(at);
        assert_eq!(scene.instances.len(), 3);
        let near = |found: Vec3, expected: [f32; 3]| {
            assert!((found - Vec3::from(expected)).length() < 1e-5, "{found}");
        };
        near(corner(0, Vec3::X), [11.0, 0.0, 0.0]);
        near(corner(1, Vec3::X), [12.0, 5.0, 0.0]);
        near(corner(2, Vec3::X), [9.0, 0.0, 7.0]);
    }
}

#[test]
fn instances_whose_attributes_differ_in_number_are_refused() {
    let files = instanced(5120, &[0, 0, 0, 127, 0, 0, 0, 127, 0, 127, 0, 0]);
    let text = std::fs::read_to_string(files.path("scene.gltf")).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let json = with(json, "/accessors/4/count", json!(2));
    files.write("scene.gltf", json.to_string().as_bytes());
    files.fails_with(&[
        "nodes[0].extensions.EXT_mesh_gpu_instancing",
        "one count, 3",
        "found 2",
    ]);
}
