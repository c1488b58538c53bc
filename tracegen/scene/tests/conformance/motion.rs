//! Moving nodes and vertices at a time. `scene/tests/poses` checks values against a second evaluator.

use super::files::{File, QUAD};
use super::rows::{Row, Status, drawn};
use glam::{Affine3A, Vec3};
use scene::{LoadOptions, Loaded, SceneError};
use serde_json::{Value, json};
use std::f32::consts::FRAC_PI_2;
use std::path::Path;

const TEST: &str = "scene/tests/conformance/motion.rs";

pub const ROWS: &[Row] = &[
    drawn(
        "animation: LINEAR translation",
        "`--time SECONDS`",
        |f| {
            at(
                animated(
                    "translation",
                    "VEC3",
                    "LINEAR",
                    &[[0.0; 3], [4.0, 0.0, 0.0]],
                ),
                0.25,
                f,
            )
        },
        |l, f| placed(l, f, Affine3A::from_translation(Vec3::X)),
    ),
    drawn(
        "animation: LINEAR rotation",
        "along the shorter arc",
        |f| {
            let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.0]];
            at(animated("rotation", "VEC4", "LINEAR", &turns), 0.5, f)
        },
        |l, f| placed(l, f, Affine3A::from_rotation_z(-FRAC_PI_2)),
    ),
    drawn(
        "animation: STEP scale",
        "the key before",
        |f| {
            at(
                animated("scale", "VEC3", "STEP", &[[2.0; 3], [3.0; 3]]),
                0.75,
                f,
            )
        },
        |l, f| placed(l, f, Affine3A::from_scale(Vec3::splat(2.0))),
    ),
    drawn(
        "animation: CUBICSPLINE",
        "Hermite splines",
        |f| {
            let (zero, out) = ([0.0; 3], [8.0, 0.0, 0.0]);
            let keys = [zero, zero, out, zero, [4.0, 0.0, 0.0], zero];
            at(
                animated("translation", "VEC3", "CUBICSPLINE", &keys),
                0.5,
                f,
            )
        },
        |l, f| placed(l, f, Affine3A::from_translation(Vec3::X * 3.0)),
    ),
    drawn(
        "animation: keys with equal times",
        "the last one counts, with a warning",
        |f| {
            let places = [[0.0; 3], [4.0, 0.0, 0.0]];
            let mut file = animated("translation", "VEC3", "LINEAR", &places);
            let times = file.floats("SCALAR", &[[0.0], [0.0]]);
            file.json["animations"][0]["samplers"][0]["input"] = json!(times);
            at(file, 0.0, f)
        },
        |l, f| placed(l, f, Affine3A::from_translation(Vec3::X * 4.0)),
    ),
    drawn(
        "animations by name",
        "`--animation NAME`; the first one plays",
        |f| {
            let mut file = animated("translation", "VEC3", "LINEAR", &[[0.0; 3], [4.0; 3]]);
            let first = json!({"name": "first", "channels": [], "samplers": []});
            file.json["animations"]
                .as_array_mut()
                .unwrap()
                .insert(0, first);
            let options = LoadOptions {
                animation: Some("move".into()),
                time_s: 1.0,
                ..LoadOptions::ALL
            };
            file.load_with(f, &options)
        },
        |l, f| placed(l, f, Affine3A::from_translation(Vec3::splat(4.0))),
    ),
    drawn(
        "skins: JOINTS_0, WEIGHTS_0",
        "linear-blend skinning",
        |f| at(skinned(1), 0.5, f),
        |l, f| corner(l, f, Vec3::new(2.0, 1.0, 0.0)),
    ),
    drawn(
        "skins: JOINTS_1, WEIGHTS_1",
        "any number of sets",
        |f| at(skinned(2), 0.5, f),
        |l, f| corner(l, f, Vec3::new(2.0, 1.0, 0.0)),
    ),
    drawn(
        "skins: vertices without weights",
        "follow their first joint, with a warning",
        |f| {
            let mut file = skinned(1);
            let weights = file.floats("VEC4", &[[0.0; 4]; 4]);
            attributes(&mut file)["WEIGHTS_0"] = json!(weights);
            at(file, 0.5, f)
        },
        |l, f| corner(l, f, Vec3::new(3.0, 1.0, 0.0)),
    ),
    drawn(
        "morph targets: weights of mesh and node",
        "positions, normals, tangents",
        |f| {
            let mut file = morphed();
            file.json["nodes"][0]["weights"] = json!([0.25]);
            file.load(f)
        },
        |l, f| corner(l, f, Vec3::new(1.0, 1.0, 1.0)),
    ),
    drawn(
        "morph targets: animated weights",
        "positions, normals, tangents",
        |f| {
            let mut file = morphed();
            animate(&mut file, "weights", "SCALAR", "LINEAR", &[[0.0], [1.0]]);
            at(file, 0.5, f)
        },
        |l, f| corner(l, f, Vec3::new(1.0, 1.0, 2.0)),
    ),
    Row {
        feature: "animation of a camera's node",
        status: Status::Approximated,
        how: "the camera stands where it is at `--time`; `--path FILE.gltf` follows it",
        load: |f| {
            let mut file = animated(
                "translation",
                "VEC3",
                "LINEAR",
                &[[0.0; 3], [4.0, 0.0, 0.0]],
            );
            file.json["cameras"] =
                json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
            file.json["nodes"][0]["camera"] = json!(0);
            at(file, 0.5, f)
        },
        check: |l, f| assert_eq!(l.scene.cameras[0].eye, Vec3::X * 2.0, "{f}"),
        test: TEST,
    },
    Row {
        feature: "orthographic cameras",
        status: Status::Approximated,
        how: "seen in perspective from their place, with a warning",
        load: |f| {
            let mut file = File::quad();
            file.json["cameras"] = json!([{"type": "orthographic", "name": "plan",
                "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}]);
            file.json["nodes"][0]["camera"] = json!(0);
            file.load(f)
        },
        check: |l, f| {
            let camera = &l.scene.cameras[0];
            assert_eq!((camera.name.as_str(), camera.near), ("plan", 0.1), "{f}");
            assert_eq!(camera.target - camera.eye, -Vec3::Z, "{f}");
            assert!(
                l.warnings[0].contains("'plan' is orthographic"),
                "{:?}",
                l.warnings
            );
        },
        test: TEST,
    },
];

fn at(file: File, time_s: f64, folder: &Path) -> Result<Loaded, SceneError> {
    let options = LoadOptions {
        time_s,
        ..LoadOptions::ALL
    };
    file.load_with(folder, &options)
}

/// A quad whose node moves during one second.
fn animated<const N: usize>(
    path: &str,
    of: &str,
    interpolation: &str,
    values: &[[f32; N]],
) -> File {
    let mut file = File::quad();
    animate(&mut file, path, of, interpolation, values);
    file
}

fn animate<const N: usize>(
    file: &mut File,
    path: &str,
    of: &str,
    interpolation: &str,
    values: &[[f32; N]],
) {
    let input = file.floats("SCALAR", &[[0.0], [1.0]]);
    let output = file.floats(of, values);
    file.json["animations"] = json!([{
        "name": "move",
        "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}]
    }]);
}

fn attributes(file: &mut File) -> &mut Value {
    &mut file.json["meshes"][0]["primitives"][0]["attributes"]
}

/// A quad with equal weights for joint 0, which moves by 2 m in a second, and joint 1. A second set
/// repeats both joints.
fn skinned(sets: usize) -> File {
    let mut file = animated(
        "translation",
        "VEC3",
        "LINEAR",
        &[[0.0; 3], [4.0, 0.0, 0.0]],
    );
    for set in 0..sets {
        let joints = file.view(&[0, 1, 0, 0].repeat(4));
        let joints = file.accessor(joints, 5121, "VEC4", 4);
        let weights = file.floats(
            "VEC4",
            &[[0.5 / sets as f32, 0.5 / sets as f32, 0.0, 0.0]; 4],
        );
        attributes(&mut file)[format!("JOINTS_{set}")] = json!(joints);
        attributes(&mut file)[format!("WEIGHTS_{set}")] = json!(weights);
    }
    file.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    file.json["nodes"] = json!([{}, {}, {"mesh": 0, "skin": 0, "translation": [50, 0, 0]}]);
    file.json["skins"] = json!([{"joints": [0, 1]}]);
    file
}

/// A quad with one morph target, 4 m in front of it.
fn morphed() -> File {
    let mut file = File::quad();
    let target = file.floats("VEC3", &[[0.0, 0.0, 4.0]; 4]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    file.json["meshes"][0]["weights"] = json!([0.125]);
    file
}

/// Checks that the corners of the quad are where `expected` puts them.
fn placed(loaded: &Loaded, feature: &str, expected: Affine3A) {
    let (mesh, transform) = (
        &loaded.scene.meshes[0],
        &loaded.scene.instances[0].transform,
    );
    for (found, corner) in mesh.positions.iter().zip(QUAD) {
        let found = transform.transform_point3(*found);
        let expected = expected.transform_point3(corner.into());
        assert!(
            (found - expected).length() < 1e-6,
            "{feature}: {found} {expected}"
        );
    }
}

/// Checks the position of the quad's third corner, (1, 1, 0).
fn corner(loaded: &Loaded, feature: &str, expected: Vec3) {
    let (mesh, transform) = (
        &loaded.scene.meshes[0],
        &loaded.scene.instances[0].transform,
    );
    let found = transform.transform_point3(mesh.positions[2]);
    assert!(
        (found - expected).length() < 1e-6,
        "{feature}: {found} {expected}"
    );
}
