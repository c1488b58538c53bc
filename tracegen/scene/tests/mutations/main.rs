//! Thousands of damaged scene and path files. Each is read or refused, quickly and within bounds.
//!
//! The cases are deterministic. `MUTATIONS=n` sets the number of cases per seed.

mod memory;
mod mutate;
mod paths;
mod seeds;

use mutate::{Random, mutate};
use scene::{LoadOptions, Loaded, Scene, SceneError, load_file};
use std::path::Path;
use std::time::{Duration, Instant};

const CASES_PER_SEED: u64 = 1100;
const MAX_TIME: Duration = Duration::from_secs(10);
const MAX_BYTES: usize = 1 << 30;

#[test]
fn no_damaged_file_panics_takes_long_or_takes_a_gigabyte() {
    let _alone = memory::alone();
    let cases = std::env::var("MUTATIONS").map_or(CASES_PER_SEED, |n| n.parse().unwrap());
    let (mut read, mut refused, mut longest, mut largest) = (0, 0, Duration::ZERO, 0);
    for seed in seeds::all() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        };
        for (name, bytes) in &seed.files {
            write(name, bytes);
        }
        let main = folder.path().join(seed.files[0].0);
        read_all(&main).expect("the undamaged file");
        for case in 0..cases {
            let mut random = Random::new(case);
            let (name, bytes) = &seed.files[random.weighted(&seed.weights)];
            write(name, &mutate(bytes, &mut random));

            memory::start();
            let start = Instant::now();
            let loaded = read_all(&main);
            let (time, peak) = (start.elapsed(), memory::peak());

            let at = || format!("seed {}, case {case}, {name}", seed.files[0].0);
            assert!(time < MAX_TIME, "{}: {time:?}", at());
            assert!(peak < MAX_BYTES, "{}: {peak} bytes", at());
            (longest, largest) = (longest.max(time), largest.max(peak));
            match loaded {
                Ok((loaded, texels)) => {
                    check(&loaded.scene, &texels, &at());
                    for text in &loaded.warnings {
                        assert!(!text.contains(char::is_control), "{}: {text:?}", at());
                    }
                    read += 1;
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(!text.contains(char::is_control), "{}: {text:?}", at());
                    assert!(text.len() < 4000, "{}: {} bytes", at(), text.len());
                    refused += 1;
                }
            }
            write(name, bytes);
        }
    }
    println!("{read} read, {refused} refused; at most {longest:?} and {largest} bytes");
    // If nearly all mutations failed, or nearly all had no effect, the test would prove little.
    let all = read + refused;
    assert!(read > all / 10 && refused > all / 10, "{read} {refused}");
}

type Texels = Vec<Option<Vec<u8>>>;

/// The scene posed at another time than it was loaded for, and the texels of all its images.
fn read_all(file: &Path) -> Result<(Loaded, Texels), SceneError> {
    let mut loaded = load_file(file, &LoadOptions::ALL)?;
    loaded.scene.animate(0.625)?;
    let texels = scene::image::texels(&loaded.scene.images, |_| true)?;
    Ok((loaded, texels))
}

/// Checks the invariants that every renderer relies on.
fn check(scene: &Scene, texels: &Texels, at: &str) {
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        let lengths = [mesh.normals.len(), mesh.tangents.len(), mesh.uv0.len()];
        assert_eq!(lengths, [count; 3], "{at}");
        for optional in [mesh.uv1.len(), mesh.colors.len()] {
            assert!(optional == 0 || optional == count, "{at}");
        }
        assert!(mesh.indices.len().is_multiple_of(3), "{at}");
        assert!(mesh.indices.iter().all(|&i| (i as usize) < count), "{at}");
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
        assert!(mesh.normals.iter().all(|n| n.is_normalized()), "{at}");
        assert!(mesh.colors.iter().all(|c| c.is_finite()), "{at}");
        assert!(mesh.material < scene.materials.len(), "{at}");
        assert!(!mesh.name.contains(char::is_control), "{at}");
    }
    for material in &scene.materials {
        let images = material.textures.all().map(|t| t.image);
        assert!(images.into_iter().all(|i| i < scene.images.len()), "{at}");
        assert!(material.base_color.is_finite() && material.emissive.is_finite());
    }
    for (image, rgba) in scene.images.iter().zip(texels) {
        let count = image.size[0] as usize * image.size[1] as usize;
        let bytes = rgba.as_ref().map_or(0, Vec::len);
        assert!(count > 0 && bytes == count * 4, "{at}");
    }
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len(), "{at}");
        assert!(instance.transform.is_finite(), "{at}");
        assert!(instance.normal_matrix().is_finite(), "{at}");
    }
    assert!(
        !scene.cameras.is_empty() && !scene.lights.is_empty(),
        "{at}"
    );
}
