//! Ways to store geometry. Each must produce the corners of a unit quad.

use super::files::{File, INDICES, QUAD};
use super::rows::{Row, Status, drawn};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute,
};
use glam::{Vec2, Vec3};
use scene::{LoadOptions, Loaded, TextureSlot};
use serde_json::json;

const TEST: &str = "scene/tests/conformance/geometry.rs";

pub const ROWS: &[Row] = &[
    drawn(
        "buffers, accessors, indices",
        "as stored",
        |f| File::quad().load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "triangle strips",
        "triangles",
        |f| mode(5, &[0, 1, 3, 2]).load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "triangle fans",
        "triangles",
        |f| mode(6, &[0, 1, 2, 3]).load(f),
        |l, f| corners(l, f, 0.0),
    ),
    Row {
        feature: "points and lines",
        status: Status::Approximated,
        how: "left out, with a warning",
        load: |f| {
            let mut file = File::quad();
            let mut lines = file.json["meshes"][0]["primitives"][0].clone();
            lines["mode"] = json!(1);
            file.json["meshes"][0]["primitives"]
                .as_array_mut()
                .unwrap()
                .push(lines);
            file.load(f)
        },
        check: |l, f| {
            corners(l, f, 0.0);
            assert!(
                l.warnings.iter().any(|w| w.contains("lines")),
                "{:?}",
                l.warnings
            );
        },
        test: TEST,
    },
    Row {
        feature: "points or lines alone",
        status: Status::Refused,
        how: "holds points, not triangles",
        load: |f| mode(0, &[0, 1, 2, 3]).load(f),
        check: |_, _| {},
        test: TEST,
    },
    Row {
        feature: "glTF 1.0",
        status: Status::Refused,
        how: "expected 2.0, found '1.0'",
        load: |f| {
            let mut file = File::quad();
            file.json["asset"]["version"] = json!("1.0");
            // Version 1.0 has objects where 2.0 has lists.
            file.json["materials"] = json!({"paint": {}});
            file.load(f)
        },
        check: |_, _| {},
        test: TEST,
    },
    drawn(
        "TEXCOORD_2 and up",
        "any two sets per material",
        |f| coordinates(&[0, 3]).load(f),
        |l, f| {
            let material = &l.scene.materials[0];
            let sets = [
                material.textures[TextureSlot::BaseColor],
                material.textures[TextureSlot::Normal],
            ];
            assert_eq!(sets.map(|t| t.unwrap().uv_set), [0, 1], "{f}");
            assert_eq!(l.scene.meshes[0].uv1, [Vec2::splat(3.0); 4], "{f}");
            assert!(l.warnings.is_empty(), "{:?}", l.warnings);
        },
    ),
    Row {
        feature: "three sets of texture coordinates in a material",
        status: Status::Approximated,
        how: "the texture of the third set is left out, with a warning",
        load: |f| coordinates(&[0, 3, 1]).load(f),
        check: |l, f| {
            let material = &l.scene.materials[0];
            assert!(material.textures[TextureSlot::Normal].is_some(), "{f}");
            assert!(material.textures[TextureSlot::Occlusion].is_none(), "{f}");
            assert!(
                l.warnings[0].contains("TEXCOORD_0, TEXCOORD_3 and TEXCOORD_1"),
                "{:?}",
                l.warnings
            );
        },
        test: TEST,
    },
    drawn(
        "sparse accessors",
        "as stored",
        |f| sparse().load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "KHR_mesh_quantization",
        "16-bit integers become floats",
        |f| quantized().load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "EXT_meshopt_compression: attributes, triangles",
        "decoded by meshoptimizer",
        |f| meshopt("EXT_meshopt_compression", false, false).load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "EXT_meshopt_compression: exponential filter",
        "decoded by meshoptimizer",
        |f| meshopt("EXT_meshopt_compression", true, false).load(f),
        |l, f| corners(l, f, 1e-3),
    ),
    drawn(
        "EXT_meshopt_compression: index sequence",
        "decoded by meshoptimizer",
        |f| meshopt("EXT_meshopt_compression", false, true).load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "KHR_meshopt_compression",
        "decoded by meshoptimizer",
        |f| meshopt("KHR_meshopt_compression", false, false).load(f),
        |l, f| corners(l, f, 0.0),
    ),
    drawn(
        "KHR_draco_mesh_compression: edge breaker",
        "decoded by draco-core",
        |f| draco(5).load(f),
        |l, f| corners(l, f, 1e-3),
    ),
    drawn(
        "KHR_draco_mesh_compression: sequential",
        "decoded by draco-core",
        |f| draco(10).load(f),
        |l, f| corners(l, f, 1e-3),
    ),
    drawn(
        "EXT_mesh_gpu_instancing",
        "an instance each",
        |f| {
            let mut file = File::quad();
            let places = file.floats("VEC3", &[[0.0; 3], [3.0, 0.0, 0.0]]);
            file.json["nodes"][0]["extensions"] =
                json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
            file.requires("EXT_mesh_gpu_instancing");
            file.load(f)
        },
        |l, f| {
            let places: Vec<f32> = l
                .scene
                .instances
                .iter()
                .map(|i| i.transform.translation.x)
                .collect();
            assert_eq!(places, [0.0, 3.0], "{f}");
        },
    ),
    drawn(
        "KHR_materials_variants",
        "`--variant NAME`",
        |f| {
            let mut file = File::quad();
            file.json["materials"] = json!([{"name": "paint"}, {"name": "rust"}]);
            file.json["extensions"] =
                json!({"KHR_materials_variants": {"variants": [{"name": "new"}, {"name": "old"}]}});
            file.json["meshes"][0]["primitives"][0]["extensions"] =
                json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}});
            file.requires("KHR_materials_variants");
            file.load_with(
                f,
                &LoadOptions {
                    variant: Some("old".into()),
                    ..LoadOptions::ALL
                },
            )
        },
        |l, f| assert_eq!(l.scene.materials[0].name, "rust", "{f}"),
    ),
];

fn corners(loaded: &Loaded, feature: &str, tolerance: f32) {
    let scene = &loaded.scene;
    let (mesh, transform) = (&scene.meshes[0], &scene.instances[0].transform);
    let corner = |&i: &u32| transform.transform_point3(mesh.positions[i as usize]);
    let mut area = Vec3::ZERO;
    for triangle in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [&triangle[0], &triangle[1], &triangle[2]].map(corner);
        area += (b - a).cross(c - a) / 2.0;
        for corner in [a, b, c] {
            let of_quad = |q: &[f32; 3]| (Vec3::from(*q) - corner).abs().max_element() <= tolerance;
            assert!(QUAD.iter().any(of_quad), "{feature}: {corner}");
        }
    }
    // Both triangles must have the file's winding.
    assert!((area - Vec3::Z).length() < 1e-2, "{feature}: {area}");
}

fn mode(mode: u32, indices: &[u16]) -> File {
    let mut file = File::quad();
    let indices = file.indices(indices);
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["mode"] = json!(mode);
    primitive["indices"] = json!(indices);
    file
}

/// A quad with textures of base colour, normals and occlusion in these sets of texture coordinates. Each set but
/// the first one has one value.
fn coordinates(sets: &[u32]) -> File {
    const PIXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==";
    let mut file = File::quad();
    for &set in &sets[1..] {
        let uv = file.floats("VEC2", &[[set as f32; 2]; 4]);
        file.json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] =
            json!(uv);
    }
    file.json["images"] = json!([{"uri": PIXEL}]);
    file.json["textures"] = json!([{"source": 0}]);
    let material = &mut file.json["materials"][0];
    material["pbrMetallicRoughness"] =
        json!({"baseColorTexture": {"index": 0, "texCoord": sets[0]}});
    for (texture, set) in ["normalTexture", "occlusionTexture"].iter().zip(&sets[1..]) {
        material[texture] = json!({"index": 0, "texCoord": set});
    }
    file
}

fn sparse() -> File {
    let mut file = File::quad();
    let zeros: Vec<[f32; 3]> = vec![[0.0; 3], QUAD[1], [9.0; 3], QUAD[3]];
    let base = file.floats("VEC3", &zeros);
    let at = file.view(&2_u16.to_le_bytes());
    let value: Vec<u8> = QUAD[2].iter().flat_map(|v| v.to_le_bytes()).collect();
    let value = file.view(&value);
    file.json["accessors"][base]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": at, "componentType": 5123},
        "values": {"bufferView": value}
    });
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(base);
    file
}

fn quantized() -> File {
    let mut file = File::quad();
    let bytes: Vec<u8> = (QUAD.iter())
        .flat_map(|q| [q[0], q[1], q[2], 0.0].map(|v| (v * 1000.0) as u16))
        .flat_map(u16::to_le_bytes)
        .collect();
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = json!(8);
    let position = file.accessor(view, 5123, "VEC3", 4);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
    file.json["nodes"][0]["scale"] = json!([0.001, 0.001, 0.001]);
    file.requires("KHR_mesh_quantization");
    file
}

/// Replaces the views of positions and indices by compressed ones of a second buffer.
fn meshopt(extension: &str, filtered: bool, sequence: bool) -> File {
    let mut file = File::quad();
    let positions = if filtered {
        let values: Vec<f32> = QUAD.as_flattened().to_vec();
        let rows: Vec<[f32; 3]> = values.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
        let encoded =
            meshopt::encode_filter_exp::<3>(&rows, 15, meshopt::EncodeExpMode::SharedComponent);
        meshopt::encode_vertex_buffer(&encoded).unwrap()
    } else {
        meshopt::encode_vertex_buffer(&QUAD).unwrap()
    };
    let wide: Vec<u32> = INDICES.iter().map(|&i| u32::from(i)).collect();
    let indices = if sequence {
        meshopt::encode_index_sequence(&wide, 4).unwrap()
    } else {
        meshopt::encode_index_buffer(&wide, 4).unwrap()
    };
    let whole = file.bytes.len();
    let mut view =
        |number: usize, encoded: &[u8], stride: u32, count: u32, mode: &str, filter: &str| {
            let offset = file.bytes.len();
            file.bytes.extend(encoded);
            let view = &mut file.json["bufferViews"][number];
            view["buffer"] = json!(1);
            view["extensions"] = json!({extension: {
                "buffer": 0, "byteOffset": offset, "byteLength": encoded.len(),
                "byteStride": stride, "count": count, "mode": mode, "filter": filter
            }});
        };
    let filter = if filtered { "EXPONENTIAL" } else { "NONE" };
    view(0, &positions, 12, 4, "ATTRIBUTES", filter);
    let mode = if sequence { "INDICES" } else { "TRIANGLES" };
    view(2, &indices, 2, 6, mode, "NONE");
    let length = file.bytes.len();
    file.json["buffers"] = json!([
        {"uri": "mesh.bin", "byteLength": length},
        {"byteLength": whole, "extensions": {extension: {"fallback": true}}}
    ]);
    file.requires(extension);
    file
}

fn draco(speed: i32) -> File {
    let mut mesh = Mesh::new();
    mesh.set_num_points(4);
    let mut add = |of: GeometryAttributeType, components: u8, values: &[f32]| {
        let mut attribute = PointAttribute::new();
        attribute.init(of, components, DataType::Float32, false, 4);
        attribute.buffer_mut().update_f32s_le(0, values);
        mesh.add_attribute(attribute)
    };
    let position = add(GeometryAttributeType::Position, 3, QUAD.as_flattened());
    let uv = QUAD.map(|[x, y, _]| [x, 1.0 - y]);
    let uv = add(GeometryAttributeType::TexCoord, 2, uv.as_flattened());
    mesh.set_num_faces(2);
    mesh.set_face_from_indices(0, [0, 1, 2]);
    mesh.set_face_from_indices(1, [0, 2, 3]);
    let ids = [position, uv].map(|id| mesh.attribute(id).unique_id());
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut options = EncoderOptions::new();
    options.set_compression_level(10 - speed);
    let mut encoded = EncoderBuffer::new();
    encoder.encode(&options, &mut encoded).unwrap();
    let mut file = File::empty();
    let view = file.view(encoded.data());
    let [position, uv, indices] =
        [("VEC3", 5126, 4), ("VEC2", 5126, 4), ("SCALAR", 5123, 6)].map(|(of, kind, count)| {
            file.push(
                "accessors",
                json!({"componentType": kind, "type": of, "count": count}),
            )
        });
    file.json["meshes"] = json!([{"primitives": [{
        "attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": indices,
        "extensions": {"KHR_draco_mesh_compression": {
            "bufferView": view, "attributes": {"POSITION": ids[0], "TEXCOORD_0": ids[1]}
        }}
    }]}]);
    file.requires("KHR_draco_mesh_compression");
    file
}
