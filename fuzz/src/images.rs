//! KTX2 and DDS images: an input is the image of a square.

/// A triangle whose base colour is the image.
const SCENE: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
"materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
"textures": [{"source": 0}], "images": [{"uri": "image"}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
{"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}],
"bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
"buffers": [{"byteLength": 60, "uri": "mesh.bin"}]}"#;

/// Positions and coordinates of the triangle.
fn mesh() -> Vec<u8> {
    let numbers: [f32; 15] = [
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0,
    ];
    numbers.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Loads the scene and decodes its image.
pub fn run(bytes: &[u8]) {
    let files = [
        ("scene.gltf", SCENE.as_bytes()),
        ("mesh.bin", &mesh()),
        ("image", bytes),
    ];
    crate::gltf::with_files(&files, |folder| {
        crate::gltf::load(&folder.join("scene.gltf"))
    });
}
