//! Damaged files of head paths and gazes.

use crate::memory;
use crate::mutate::{Random, mutate};
use scene::paths::{HeadPath, Moments, PathOrigin, PathSpec, read_gazes};
use scene::{Scene, SceneError, cameras};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};

const CASES_PER_SEED: u64 = 700;
const MAX_TIME: Duration = Duration::from_secs(5);
const MAX_BYTES: usize = 1 << 28;

const POSES: &str = "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,1.7,0,0,0,0,1\n\
0.5,0.1,1.7,-0.2,0,0.6,0,0.8\n1.25,0.2,1.6,-0.3,0.6,0,0,-0.8\n";
const GAZES: &str = "time_s,x_deg,y_deg\n0,0,0\n0.25,10.5,-3\n0.5,-20,1e1\n";

/// A camera that rotates linearly and moves along a cubic curve, below a node that moves in steps.
fn gltf() -> String {
    let floats: &[f32] = &[
        0.0, 0.5, 1.0, // times
        0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8, 0.0, 1.0, 0.0, 0.0, // rotations
        0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 1.0, 0.0, 0.0, // cubic, first key
        0.0, 0.0, 0.0, 4.0, 2.0, 3.0, 1.0, 0.0, 0.0, // second key
        0.0, 0.0, 0.0, 5.0, 2.0, 3.0, 1.0, 0.0, 0.0, // third key
    ];
    let bytes = floats.iter().flat_map(|v| v.to_le_bytes());
    let escaped: String = bytes.map(|b| format!("%{b:02x}")).collect();
    let accessor = |offset: u32, count: u32, of: &str| json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": count, "type": of});
    json!({
        "asset": {"version": "2.0"},
        "nodes": [{"name": "rig", "children": [1], "translation": [0, 1, 0]}, {"name": "cam", "camera": 0}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "animations": [{
            "channels": [
                {"sampler": 0, "target": {"node": 1, "path": "rotation"}},
                {"sampler": 1, "target": {"node": 1, "path": "translation"}},
                {"sampler": 2, "target": {"node": 0, "path": "rotation"}}
            ],
            "samplers": [
                {"input": 0, "output": 1},
                {"input": 0, "output": 2, "interpolation": "CUBICSPLINE"},
                {"input": 0, "output": 1, "interpolation": "STEP"}
            ]
        }],
        "accessors": [accessor(0, 3, "SCALAR"), accessor(12, 3, "VEC4"), accessor(60, 9, "VEC3")],
        "bufferViews": [{"buffer": 0, "byteLength": 4 * floats.len()}],
        "buffers": [{"byteLength": 4 * floats.len(), "uri": format!("data:application/octet-stream,{escaped}")}]
    })
    .to_string()
}

/// Follows a path for a second from both origins. Every pose must be finite and a rotation.
fn follow(spec: &PathSpec) -> Result<(), SceneError> {
    let camera = cameras::default_camera(&Scene::default());
    for origin in [PathOrigin::Camera, PathOrigin::World] {
        let (path, _) = HeadPath::open(spec, Some(origin))?;
        for pose in path.poses(
            &camera,
            &Moments {
                frames: 0..2,
                fps: 1.0,
                scene_start_s: 0.0,
            },
        )? {
            assert!(pose.is_finite(), "{pose}");
            let turn = pose.matrix3;
            assert!((turn.determinant() - 1.0).abs() < 1e-3, "{pose}");
            assert!(
                (turn * turn.transpose()).abs_diff_eq(glam::Mat3A::IDENTITY, 1e-3),
                "{pose}"
            );
        }
        assert!(path.start(&camera)?.eye.is_finite());
    }
    Ok(())
}

fn read(file: &Path) -> Result<(), SceneError> {
    let is = |extension| file.extension().is_some_and(|e| e == extension);
    if is("gltf") {
        follow(&PathSpec::Gltf(file.to_owned(), None))
    } else if file.ends_with("gazes.csv") {
        let rows = read_gazes(file)?;
        assert!(
            rows.iter()
                .all(|row| row.x_deg.abs() < 90.0 && row.y_deg.abs() < 90.0)
        );
        assert!(rows.is_sorted_by(|a, b| a.time_s < b.time_s));
        Ok(())
    } else {
        follow(&PathSpec::Poses(file.to_owned()))
    }
}

#[test]
fn no_damaged_path_panics_takes_long_or_takes_much_memory() {
    let _alone = memory::alone();
    let cases = std::env::var("MUTATIONS").map_or(CASES_PER_SEED, |n| n.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let gltf = gltf();
    for (name, text) in [
        ("poses.csv", POSES),
        ("gazes.csv", GAZES),
        ("path.gltf", &gltf),
    ] {
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        read(&file).expect("the undamaged file");
        let (mut accepted, mut refused) = (0, 0);
        for case in 0..cases {
            let damaged = mutate(text.as_bytes(), &mut Random::new(case));
            std::fs::write(&file, damaged).unwrap();
            memory::start();
            let start = Instant::now();
            let outcome = read(&file);
            let (time, peak) = (start.elapsed(), memory::peak());
            assert!(time < MAX_TIME, "{name}, case {case}: {time:?}");
            assert!(peak < MAX_BYTES, "{name}, case {case}: {peak} bytes");
            match outcome {
                Ok(()) => accepted += 1,
                Err(error) => {
                    let text = error.to_string();
                    assert!(
                        !text.contains(char::is_control),
                        "{name}, case {case}: {text:?}"
                    );
                    assert!(text.len() < 4000, "{name}, case {case}: {text}");
                    // A glTF file may refer to another file, which the error then names.
                    let names = text.contains(name) || name.ends_with("gltf");
                    assert!(names, "{name}, case {case}: {text}");
                    refused += 1;
                }
            }
        }
        println!("{name}: {accepted} read, {refused} refused");
        assert!(
            accepted > cases / 50 && refused > cases / 10,
            "{name}: {accepted} {refused}"
        );
    }
}
