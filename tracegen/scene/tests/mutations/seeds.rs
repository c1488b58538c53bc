//! Small complete scenes in every supported form.

use serde_json::{Value, json};
use std::io::Cursor;

/// A scene's files, the one to load first, and the weight of each for mutation.
pub struct Seed {
    pub files: Vec<(&'static str, Vec<u8>)>,
    pub weights: Vec<usize>,
}

pub fn all() -> [Seed; 6] {
    let (png, jpeg) = (image("png"), image("jpeg"));
    let bytes = buffer();
    let text = gltf(json!("mesh.bin"));
    let inside = gltf(json!(data_uri(&bytes)));
    let mut blocks = gltf(json!("mesh.bin"));
    blocks["images"] = json!([{"uri": "a.ktx2"}, {"uri": "b.ktx2"}]);
    let (moving, numbers) = animated();
    [
        Seed {
            files: vec![
                ("moving.gltf", moving.to_string().into()),
                ("numbers.bin", numbers),
            ],
            weights: vec![7, 3],
        },
        Seed {
            files: vec![
                ("blocks.gltf", blocks.to_string().into()),
                ("mesh.bin", bytes.clone()),
                (
                    "a.ktx2",
                    include_bytes!("../images/etc1s-alpha.ktx2").to_vec(),
                ),
                (
                    "b.ktx2",
                    include_bytes!("../images/uastc-zstd.ktx2").to_vec(),
                ),
            ],
            weights: vec![1, 1, 5, 5],
        },
        Seed {
            files: vec![
                ("scene.gltf", text.to_string().into()),
                ("mesh.bin", bytes.clone()),
                ("a.png", png.clone()),
                ("b.jpg", jpeg.clone()),
            ],
            weights: vec![7, 3, 1, 1],
        },
        Seed {
            files: vec![
                ("inside.gltf", inside.to_string().into()),
                ("a.png", png.clone()),
                ("b.jpg", jpeg),
            ],
            weights: vec![1, 0, 0],
        },
        Seed {
            files: vec![("scene.glb", glb(&bytes, &png))],
            weights: vec![1],
        },
        Seed {
            files: vec![
                ("scene.obj", OBJ.into()),
                ("my lib.mtl", MTL.into()),
                ("a.png", png),
            ],
            weights: vec![6, 4, 1],
        },
    ]
}

const OBJ: &str = "# a house\nmtllib \"my lib.mtl\"\no floor\nv 0 0 0 1 0 0\nv 1 0 0\n\
v 1 1 0 0 0 1 0.5\nv 0 1 0 1\nv 0.5 0.5 \\\n0\nvt 0 0\nvt 1 0\nvt 1 1 0\nvn 0 0 1\nusemtl red\n\
f 1/1/1 2/2/1 3/3/1 4//1\ng group of walls\ns off\nusemtl glass\nf -5 -4 -3 -1\nf 1 2 3 5 4 # five\n\
l 1 2\np 3\nusemtl none\nf 1/1 2/2 3/3\n";

const MTL: &str = "newmtl red\nKd 0.8 0.1 0.1\nKs 0.5\nNs 32\nillum 2\nmap_Kd -s 2 2 A.PNG\n\
map_d a.png\nmap_Bump -bm 0.5 a.png\nmap_Ks missing.tga\nnewmtl glass\nTr 0.75\nNi 1.5\nillum 7\n\
Ke 0 0 0.1\n";

fn image(format: &str) -> Vec<u8> {
    let image = image::RgbImage::from_fn(8, 8, |x, y| image::Rgb([x as u8 * 30, y as u8 * 30, 9]));
    let mut bytes = Cursor::new(Vec::new());
    let format = image::ImageFormat::from_extension(format).unwrap();
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn data_uri(bytes: &[u8]) -> String {
    let escaped: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    format!("data:application/octet-stream,{escaped}")
}

/// Four positions (48 bytes), normals (48), tangents (64), coordinates (32), colours of bytes (16),
/// six indices of 16 bits (12), a sparse index and position (4 + 12).
fn buffer() -> Vec<u8> {
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut bytes: Vec<u8> = Vec::new();
    let mut floats = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    corners.iter().for_each(|[x, y]| floats(&[*x, *y, 0.0]));
    corners.iter().for_each(|_| floats(&[0.0, 0.0, 1.0]));
    corners.iter().for_each(|_| floats(&[1.0, 0.0, 0.0, 1.0]));
    corners.iter().for_each(|uv| floats(uv));
    bytes.extend([255, 0, 0, 255].repeat(4));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([1u16, 0].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([2.0f32, 0.0, 0.5].iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn gltf(uri: Value) -> Value {
    let view =
        |offset: u32, length: u32| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let vectors = |view: u32, of: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": of});
    let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 3], "rotation": 0.5}}});
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_texture_transform", "KHR_lights_punctual", "FOO_bar"],
        "scene": 0,
        "scenes": [{"nodes": [0, 3]}],
        "nodes": [
            {"name": "root", "children": [1, 2], "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]},
            {"mesh": 0, "scale": [1, -1, 2]},
            {"mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
            {"name": "cam", "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "color": [1, 1, 1], "intensity": 5}]}},
        "meshes": [
            {"name": "quad", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TANGENT": 2,
                "TEXCOORD_0": 3, "COLOR_0": 4}, "indices": 5, "material": 0, "targets": [{"POSITION": 0}]}]},
            {"primitives": [{"attributes": {"POSITION": 6}, "mode": 5, "material": 1}]}
        ],
        "materials": [
            {"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": texture, "metallicFactor": 0.25},
             "normalTexture": {"index": 1, "scale": 0.5}, "alphaMode": "MASK",
             "extensions": {
                 "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 1, "texCoord": 0}},
                 "KHR_materials_sheen": {"sheenColorFactor": [0, 1, 0], "sheenColorTexture": {"index": 0,
                     "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}}}},
            {"alphaMode": "BLEND", "emissiveFactor": [0.5, 0, 0]}
        ],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
        "samplers": [{"wrapS": 33071, "minFilter": 9985}],
        "images": [{"uri": "a.png"}, {"uri": "b.jpg"}],
        "accessors": [
            vectors(0, "VEC3"), vectors(1, "VEC3"), vectors(2, "VEC4"), vectors(3, "VEC2"),
            {"bufferView": 4, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true},
            {"bufferView": 5, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
                "indices": {"bufferView": 6, "componentType": 5123}, "values": {"bufferView": 7}}}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48, "byteStride": 12},
            view(48, 48), view(96, 64), view(160, 32), view(192, 16), view(208, 12), view(220, 4),
            view(224, 12)
        ],
        "buffers": [{"uri": uri, "byteLength": 236}]
    })
}

/// A skinned and morphed triangle below a moving node, and its buffer.
fn animated() -> (Value, Vec<u8>) {
    let (mut bytes, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |of: &str, kind: u32, count: usize, row: &[u8]| {
        views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": row.len()}));
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": kind, "type": of, "count": count}));
        bytes.extend(row);
        accessors.len() - 1
    };
    let floats =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let corners = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let position = add("VEC3", 5126, 3, &corners);
    let target = add("VEC3", 5126, 3, &corners);
    let joints = add("VEC4", 5121, 3, &[0, 1, 0, 0].repeat(3));
    let weights = add("VEC4", 5126, 3, &floats(&[0.5, 0.5, 0.0, 0.0].repeat(3)));
    let mut identity = [0.0_f32; 16];
    identity.iter_mut().step_by(5).for_each(|v| *v = 1.0);
    let binds = add("MAT4", 5126, 2, &floats(&identity.repeat(2)));
    let times = add("SCALAR", 5126, 2, &floats(&[0.0, 1.0]));
    let places = add("VEC3", 5126, 2, &floats(&[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]));
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8];
    let turns = add("VEC4", 5126, 6, &floats(&[turns; 3].concat()));
    let amounts = add("SCALAR", 5126, 2, &floats(&[0.0, 1.0]));
    let mesh = json!({"primitives": [{"attributes": {"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights},
        "targets": [{"POSITION": target}]}], "weights": [0.5]});
    let json = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [{"children": [1]}, {"translation": [0, 1, 0]}, {"mesh": 0, "skin": 0}, {"mesh": 0, "camera": 0}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "meshes": [mesh],
        "skins": [{"joints": [0, 1], "inverseBindMatrices": binds}],
        "animations": [{"samplers": [
            {"input": times, "output": places}, {"input": times, "output": turns, "interpolation": "CUBICSPLINE"},
            {"input": times, "output": amounts, "interpolation": "STEP"}, {"input": times, "output": places}
        ], "channels": [
            {"sampler": 0, "target": {"node": 1, "path": "translation"}},
            {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
            {"sampler": 2, "target": {"node": 2, "path": "weights"}},
            {"sampler": 3, "target": {"node": 3, "path": "scale"}}
        ]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"uri": "numbers.bin", "byteLength": bytes.len()}]
    });
    (json, bytes)
}

/// The same scene with everything in one file.
fn glb(bytes: &[u8], png: &[u8]) -> Vec<u8> {
    let mut json = gltf(Value::Null);
    json["buffers"] = json!([{"byteLength": bytes.len() + png.len()}]);
    let views = json["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": png.len()}));
    let inside = json!({"bufferView": views.len() - 1, "mimeType": "image/png"});
    json["images"] = json!([inside.clone(), inside]);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = [bytes, png].concat();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    [
        &b"glTF"[..],
        &word(2),
        &word(12 + 8 + text.len() + 8 + bin.len()),
        &word(text.len()),
        b"JSON",
        &text,
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ]
    .concat()
}
