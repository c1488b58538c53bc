//! Builder of glTF files.

use scene::{LoadOptions, Loaded, SceneError, load_file};
use serde_json::{Value, json};
use std::path::Path;

/// A glTF file under construction: JSON, and the bytes of its buffer.
pub struct File {
    pub json: Value,
    pub bytes: Vec<u8>,
}

/// The corners of a unit quad.
pub const QUAD: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// Its triangles.
pub const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

impl File {
    /// A quad with texture coordinates and a material of one node.
    pub fn quad() -> Self {
        let mut file = Self::empty();
        let position = file.floats("VEC3", &QUAD);
        let uv = file.floats("VEC2", &QUAD.map(|[x, y, _]| [x, 1.0 - y]));
        let indices = file.indices(&INDICES);
        file.json["meshes"] = json!([{"primitives": [{
            "attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": indices, "material": 0
        }]}]);
        file.json["materials"] = json!([{"name": "paint"}]);
        file
    }

    /// One node of mesh 0, and no mesh.
    pub fn empty() -> Self {
        Self {
            json: json!({
                "asset": {"version": "2.0"},
                "scene": 0,
                "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}],
                "accessors": [],
                "bufferViews": []
            }),
            bytes: Vec::new(),
        }
    }

    /// Appends a row to a table of the JSON. Returns its index.
    pub fn push(&mut self, table: &str, row: Value) -> usize {
        let rows = self.json.as_object_mut().unwrap();
        let rows = rows.entry(table).or_insert_with(|| json!([]));
        let rows = rows.as_array_mut().unwrap();
        rows.push(row);
        rows.len() - 1
    }

    /// Appends bytes, four-byte aligned, and a view of them.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.push(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}),
        )
    }

    pub fn accessor(&mut self, view: usize, kind: u32, of: &str, count: usize) -> usize {
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": kind, "type": of, "count": count}),
        )
    }

    pub fn floats<const N: usize>(&mut self, of: &str, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values
            .as_flattened()
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let view = self.view(&bytes);
        self.accessor(view, 5126, of, values.len())
    }

    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(view, 5123, "SCALAR", values.len())
    }

    /// Gives the material a base colour texture with this image, optionally through an extension.
    pub fn with_image(mut self, folder: &Path, extension: &str, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(folder.join(name), bytes).unwrap();
        self.json["images"] = json!([{"uri": name}]);
        self.json["textures"] = match extension {
            "" => json!([{"source": 0}]),
            extension => json!([{"extensions": {extension: {"source": 0}}}]),
        };
        self.requires(extension);
        let color = json!({"baseColorTexture": {"index": 0}});
        self.json["materials"][0]["pbrMetallicRoughness"] = color;
        self
    }

    /// Names a required extension.
    pub fn requires(&mut self, extension: &str) {
        if !extension.is_empty() {
            self.push("extensionsUsed", json!(extension));
            self.push("extensionsRequired", json!(extension));
        }
    }

    pub fn load(self, folder: &Path) -> Result<Loaded, SceneError> {
        self.load_with(folder, &LoadOptions::ALL)
    }

    pub fn load_with(mut self, folder: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
        if self.json.get("buffers").is_none() {
            let length = self.bytes.len();
            self.json["buffers"] = json!([{"uri": "mesh.bin", "byteLength": length}]);
        }
        std::fs::write(folder.join("mesh.bin"), &self.bytes).unwrap();
        let path = folder.join("scene.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        load_file(&path, options)
    }
}
