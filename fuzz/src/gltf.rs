//! glTF and GLB with their images, up to the ray tracer's triangles.

use crate::Change;
use rays::bvh::Bvh;
use rays::soup::Soup;
use scene::{LoadOptions, Scene, load_file};
use std::cell::OnceCell;
use std::path::Path;
use tempfile::TempDir;

/// Writes files into this thread's folder.
pub fn with_files(files: &[(&str, &[u8])], work: impl FnOnce(&Path)) {
    thread_local! {
        static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
    }
    FOLDER.with(|folder| {
        let folder = folder.get_or_init(|| tempfile::tempdir().expect("a temporary folder"));
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).expect("a temporary file");
        }
        work(folder.path());
    });
}

/// Loads a file as GLB if it has the magic number, else as text.
pub fn run(bytes: &[u8]) {
    let name = match bytes.starts_with(b"glTF") {
        true => "scene.glb",
        false => "scene.gltf",
    };
    with_files(&[(name, bytes)], |folder| {
        let file = folder.join(name);
        load(&file);
        crate::paths::follow_gltf(&file);
    });
}

/// Loads a scene with its texels and builds its triangles and a hierarchy.
pub fn load(file: &Path) {
    let mut loaded = match load_file(file, &LoadOptions::ALL) {
        Ok(loaded) => loaded,
        Err(error) => return crate::paths::printable(&error),
    };
    for text in &loaded.warnings {
        assert!(!text.contains(char::is_control), "{text:?}");
    }
    check(&loaded.scene);
    if let Err(error) = loaded.scene.animate(0.625) {
        return crate::paths::printable(&error);
    }
    let scene = &loaded.scene;
    check(scene);
    match scene::image::texels(&scene.images, |_| true) {
        Ok(texels) => {
            for (image, rgba) in scene.images.iter().zip(texels) {
                let count = image.size[0] as usize * image.size[1] as usize;
                assert!(count > 0 && rgba.map_or(0, |t| t.len()) == count * 4);
            }
        }
        Err(error) => crate::paths::printable(&error),
    }
    if scene.triangle_count() <= 10_000 {
        let soup = Soup::new(scene);
        Bvh::build(&soup.triangles, |_| false).expect("few triangles");
    }
}

/// Checks the invariants that renderers rely on.
fn check(scene: &Scene) {
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        let lengths = [mesh.normals.len(), mesh.tangents.len(), mesh.uv0.len()];
        assert_eq!(lengths, [count; 3]);
        for optional in [mesh.uv1.len(), mesh.colors.len()] {
            assert!(optional == 0 || optional == count);
        }
        assert!(mesh.indices.len().is_multiple_of(3));
        assert!(mesh.indices.iter().all(|&i| (i as usize) < count));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.iter().all(|n| n.is_normalized()));
        assert!(mesh.colors.iter().all(|c| c.is_finite()));
        assert!(mesh.material < scene.materials.len());
        assert!(!mesh.name.contains(char::is_control));
    }
    for material in &scene.materials {
        let mut images = material.textures.all().map(|t| t.image);
        assert!(images.all(|i| i < scene.images.len()));
        assert!(material.base_color.is_finite() && material.emissive.is_finite());
    }
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len());
        assert!(instance.transform.is_finite());
        assert!(instance.normal_matrix().is_finite());
    }
    assert!(!scene.cameras.is_empty() && !scene.lights.is_empty());
}

/// Changes the text, or one of the two chunks of a GLB and the lengths before them.
pub fn mutate(bytes: &[u8], most_bytes: usize, seed: u32, change: Change<'_>) -> Vec<u8> {
    let chunks = (!seed.is_multiple_of(8))
        .then(|| glb_chunks(bytes))
        .flatten();
    let Some([mut json, mut bin]) = chunks else {
        return crate::plain(bytes, most_bytes, seed, change);
    };
    let room = most_bytes.saturating_sub(bytes.len() + 8);
    let chunk = if seed % 8 > 3 { &mut bin } else { &mut json };
    let most = chunk.len() + room;
    change(chunk, most.max(1));
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + json.len() + 8 + bin.len();
    let mut out = [&b"glTF"[..], &word(2), &word(length)].concat();
    for (tag, chunk) in [(b"JSON", json), (b"BIN\0", bin)] {
        out.extend(word(chunk.len()));
        out.extend(tag);
        out.extend(chunk);
    }
    out
}

/// JSON and binary chunk of a GLB that has both.
fn glb_chunks(bytes: &[u8]) -> Option<[Vec<u8>; 2]> {
    let mut rest = bytes.strip_prefix(b"glTF")?.get(8..)?;
    let mut chunk = || {
        let length = u32::from_le_bytes(rest.get(..4)?.try_into().ok()?) as usize;
        let body = rest.get(8..)?.get(..length)?;
        rest = rest.get(8 + length..)?;
        Some(body.to_vec())
    };
    Some([chunk()?, chunk()?])
}
