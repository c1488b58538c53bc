//! Small generated files: how they are read, and the errors for broken ones.

mod bad_input;
mod camera_track;
mod reading;

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

    /// Checks that loading, or decoding the images, fails. The error must name the file and contain
    /// every part.
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
