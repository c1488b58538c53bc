//! OBJ with its materials: an input is the OBJ file up to a zero byte, then the MTL file.

/// Splits, loads and checks.
pub fn run(bytes: &[u8]) {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    let (obj, mtl) = bytes.split_at(end);
    let files = [
        ("scene.obj", obj),
        ("scene.mtl", mtl.get(1..).unwrap_or_default()),
    ];
    crate::gltf::with_files(&files, |folder| {
        crate::gltf::load(&folder.join("scene.obj"))
    });
}
