//! Materials with additional layers (clear coat, sheen and so on): their textures are sampled, recorded and
//! verified like the others.

use parallax_tests::{program, run_ok};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// Extension, factor and textures of each layer.
const LAYERS: [(&str, &str, &[&str]); 7] = [
    (
        "clearcoat",
        "clearcoatFactor",
        &["clearcoat", "clearcoatRoughness", "clearcoatNormal"],
    ),
    (
        "sheen",
        "sheenColorFactor",
        &["sheenColor", "sheenRoughness"],
    ),
    ("transmission", "transmissionFactor", &["transmission"]),
    ("volume", "thicknessFactor", &["thickness"]),
    (
        "iridescence",
        "iridescenceFactor",
        &["iridescence", "iridescenceThickness"],
    ),
    ("anisotropy", "anisotropyStrength", &["anisotropy"]),
    (
        "diffuse_transmission",
        "diffuseTransmissionFactor",
        &["diffuseTransmission", "diffuseTransmissionColor"],
    ),
];

/// Number of textures of layers.
const OF_LAYERS: usize = 12;
/// Number of the other textures: one image as colours and as data.
const OF_OTHERS: usize = 2;

/// Writes a quad in front of the camera whose material has a texture in every slot. `strength` is the factor of
/// every layer, and `coordinates` gives the texture coordinates of the n-th texture of the layers.
fn write(folder: &Path, strength: f64, coordinates: impl Fn(usize) -> Value) -> String {
    let corners: [[f32; 3]; 4] = [[-2., -2., 0.], [2., -2., 0.], [2., 2., 0.], [-2., 2., 0.]];
    let uv: [[f32; 2]; 4] = [[0., 2.], [2., 2.], [2., 0.], [0., 0.]];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let floats = corners.as_flattened().iter().chain(uv.as_flattened());
    let bytes: Vec<u8> = floats
        .flat_map(|v| v.to_le_bytes())
        .chain(indices.iter().flat_map(|i| i.to_le_bytes()))
        .collect();
    let plain = json!({"index": 0});
    let mut extensions = json!({"KHR_materials_specular": {"specularColorTexture": plain}});
    let mut number = 0;
    for (extension, factor, textures) in LAYERS {
        let mut of = json!({});
        of[factor] = match factor {
            "sheenColorFactor" => json!([strength, strength, strength]),
            _ => json!(strength),
        };
        for texture in textures {
            let mut reference = coordinates(number);
            reference["index"] = json!(1 + number);
            of[format!("{texture}Texture")] = reference;
            number += 1;
        }
        extensions[format!("KHR_materials_{extension}")] = of;
    }
    assert_eq!(number, OF_LAYERS);
    let names: Vec<Value> = (0..=OF_LAYERS)
        .map(|n| json!({"uri": format!("{n}.png")}))
        .collect();
    for n in 0..=OF_LAYERS {
        let image = image::RgbaImage::from_fn(64, 64, |x, y| {
            let of = |k: u32| ((x * 3 + y * 5 + k * 40 + 17 * n as u32) % 256) as u8;
            image::Rgba([of(0), of(1), of(2), of(3)])
        });
        image
            .save(folder.join(format!("{n}.png")))
            .expect("writable");
    }
    fs::write(folder.join("quad.bin"), &bytes).expect("writable");
    let file = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"name": "front", "camera": 0, "translation": [0, 0, 3]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.125, "zfar": 64}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": plain, "metallicRoughnessTexture": plain},
            "normalTexture": plain, "occlusionTexture": plain,
            "emissiveTexture": plain, "emissiveFactor": [1, 1, 1], "extensions": extensions
        }],
        "textures": (0..=OF_LAYERS).map(|n| json!({"source": n})).collect::<Vec<_>>(),
        "images": names,
        "buffers": [{"uri": "quad.bin", "byteLength": bytes.len()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 12}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-2, -2, 0], "max": [2, 2, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ]
    });
    let path = folder.join("layers.gltf");
    fs::write(&path, file.to_string()).expect("writable");
    path.to_str().expect("a path of Unicode").to_owned()
}

fn scaled(factor: usize) -> Value {
    json!({"extensions": {"KHR_texture_transform": {"scale": [factor, factor]}}})
}

fn captured(scene: &str, trace: &Path, more: &[&str]) -> (Value, String) {
    let mut command = program("tracegen");
    command.args(["raster", scene, "--size", "96x96", "--no-plain"]);
    let output = run_ok(command.args(more).arg("-o").arg(trace));
    let info = run_ok(program("replay").args(["info", "--json"]).arg(trace));
    let info = serde_json::from_slice(&info.stdout).expect("JSON");
    (info, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn textures_of_all_layers_are_recorded_and_agree_with_the_reference() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Four groups of coordinates, of the other textures and of three more scales.
    let scene = write(folder.path(), 0.5, |number| match number % 4 {
        0 => json!({}),
        group => scaled(1 + group),
    });
    let trace = folder.path().join("layers.textrace");
    let (info, _) = captured(&scene, &trace, &[]);
    let textures = info["textures"].as_array().expect("textures");
    // Shadow maps are a texture as well.
    assert_eq!(textures.len(), OF_OTHERS + OF_LAYERS, "{info:#}");
    run_ok(program("replay").arg("validate").arg(&trace));
    let mut command = program("tracegen");
    command.args(["verify", &scene, "--size", "96x96", "--colour", "--json"]);
    let report: Value = serde_json::from_slice(&run_ok(&mut command).stdout).expect("JSON");
    assert_eq!(report["failures"], json!([]), "{report:#}");
    let colours = report["colour"].as_array().expect("colours");
    assert_eq!(colours.len(), 6 + OF_LAYERS, "{report:#}");
    for of_slot in colours {
        assert!(of_slot["fragments"].as_u64() > Some(1000), "{of_slot:#}");
        assert_eq!(of_slot["unrecorded"], json!(0), "{of_slot:#}");
    }
}

#[test]
fn absent_layers_sample_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = write(folder.path(), 0.0, |_| json!({}));
    let trace = folder.path().join("absent.textrace");
    let (info, _) = captured(&scene, &trace, &[]);
    let textures = info["textures"].as_array().expect("textures");
    assert_eq!(textures.len(), OF_OTHERS, "{info:#}");
}

#[test]
fn textures_with_too_many_coordinates_are_left_out_with_a_warning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = write(folder.path(), 1.0, |number| scaled(2 + number));
    let trace = folder.path().join("many.textrace");
    let (_, messages) = captured(&scene, &trace, &[]);
    assert!(
        messages.contains("more than 11 different coordinates"),
        "{messages}"
    );
    run_ok(program("replay").arg("validate").arg(&trace));
}

#[test]
fn both_drivers_record_the_same_layers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = write(folder.path(), 0.5, |_| json!({}));
    let [a, b] = ["lavapipe", "osmesa"].map(|backend| {
        let trace = folder.path().join(format!("{backend}.textrace"));
        let (info, _) = captured(&scene, &trace, &["--backend", backend]);
        info["totals"]["records"].clone()
    });
    assert_eq!(a, b);
}
