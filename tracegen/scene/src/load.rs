//! From a file to a complete [`Scene`].

use super::{Camera, LoadOptions, Loaded, Scene, SceneError, cameras, coarse, gltf, obj};
use crate::files::{check_regular, shown};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Largest extent of a scene along an axis, metres. Cubes of lengths must stay within the range of
/// single precision.
const MAX_EXTENT_M: f32 = 1e12;

/// Loads a glTF or OBJ file and completes it as [`complete`] does.
///
/// # Errors
/// See [`SceneError`]. No file contents cause a panic.
pub fn load_file(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut loaded = match extension.as_deref() {
        // VRM, for avatars, is a GLB with extensions that say how one moves.
        Some("gltf" | "glb" | "vrm") => gltf::load(path, options)?,
        Some("obj") => obj::load(path, options)?,
        _ => {
            // The format follows from the name, which a pipe does not have.
            if path.exists() {
                check_regular(path, "scene")?;
            }
            return Err(SceneError::Unknown {
                spec: shown(&path.to_string_lossy()),
                or_built_in: String::new(),
            });
        }
    };
    loaded.scene.name = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    if loaded.scene.triangle_count() == 0 {
        // The warnings say what was left out.
        let why = match loaded.warnings.as_slice() {
            [] => String::new(),
            warnings => format!(" ({})", warnings.join("; ")),
        };
        return Err(SceneError::Invalid {
            file: path.to_owned(),
            place: "scene".into(),
            expected: "at least one triangle".into(),
            found: format!("none{why}"),
        });
    }
    let bounds = loaded.scene.bounds();
    let extent_m = bounds.map_or(0.0, |(low, high)| (high - low).max_element());
    // NaN if both ends are infinite.
    if extent_m.is_nan() || extent_m > MAX_EXTENT_M {
        return Err(SceneError::Invalid {
            file: path.to_owned(),
            place: "positions".into(),
            expected: format!("a scene of at most {MAX_EXTENT_M:e} m along each axis"),
            found: format!("{extent_m:e} m"),
        });
    }
    make_names_printable(&mut loaded.scene);
    loaded.warnings.extend(coarse::warning(&loaded.scene));
    complete(&mut loaded.scene);
    Ok(loaded)
}

/// Adds the parts that a scene's source lacks: a camera, and a sun with a sky.
pub fn complete(scene: &mut Scene) {
    if scene.cameras.is_empty() {
        scene.cameras.push(cameras::default_camera(scene));
    }
    make_names_unique(&mut scene.cameras);
    scene.light_if_unlit();
}

/// `name`, `name-2`, `name-3`, ... so that `--camera` can choose any of them.
fn make_names_unique(cameras: &mut [Camera]) {
    let mut taken = HashSet::new();
    // The next number to try, by name: a file may use one name a million times.
    let mut next: HashMap<String, u64> = HashMap::new();
    for camera in cameras {
        let base = camera.name.clone();
        while !taken.insert(camera.name.clone()) {
            let n = next.entry(base.clone()).or_insert(2);
            camera.name = format!("{base}-{n}");
            *n += 1;
        }
    }
}

/// Makes every name from the file printable in a terminal and limits its length.
fn make_names_printable(scene: &mut Scene) {
    let names = std::iter::once(&mut scene.name)
        .chain(scene.meshes.iter_mut().map(|mesh| &mut mesh.name))
        .chain((scene.materials.iter_mut()).map(|material| &mut material.name))
        .chain(scene.images.iter_mut().map(|image| &mut image.name))
        .chain(scene.cameras.iter_mut().map(|camera| &mut camera.name));
    for name in names {
        *name = shown(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_whose_lengths_leave_single_precision_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("far.obj");
        let load = |extent: &str| {
            let text = format!("v 0 0 0\nv {extent} 0 0\nv 0 1 0\nf 1 2 3\n");
            std::fs::write(&file, text).unwrap();
            load_file(&file, &LoadOptions::ALL)
        };
        let camera = load("9e11").unwrap().scene.cameras[0].clone();
        assert!(camera.eye.is_finite() && camera.near.is_finite());
        for extent in ["1.1e12", "1e30", "3e38"] {
            let error = load(extent).unwrap_err().to_string();
            let parts = ["far.obj: positions", "at most 1e12 m", "found"];
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        }
    }

    #[test]
    fn cameras_of_equal_name_are_numbered() {
        let names = ["a", "a", "a-2", "b", "a", "a-2"];
        let mut cameras = names.map(|name| Camera {
            name: name.into(),
            ..cameras::default_camera(&Scene::default())
        });
        make_names_unique(&mut cameras);
        let names = cameras.map(|camera| camera.name);
        assert_eq!(names, ["a", "a-2", "a-2-2", "b", "a-3", "a-2-3"]);
    }
}
