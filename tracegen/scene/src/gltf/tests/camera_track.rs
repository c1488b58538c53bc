//! Animated cameras against hand computations, and the errors for damaged ones.

use crate::gltf::camera_track::camera_track;
use crate::paths::CameraTrack;
use glam::{Quat, Vec3};
use serde_json::{Value, json};
use std::f32::consts::FRAC_1_SQRT_2;

/// Times 1, 2, 3. Translations 0, x, x + 2 y. Rotations: none, a quarter turn to the left, the same
/// turn. Cubic translations 0 and 4 x at times 1 and 2, with an outgoing tangent of 8 x at the
/// first key.
fn buffer() -> Vec<u8> {
    let h = FRAC_1_SQRT_2;
    let cubic = [
        [0.0; 3],
        [0.0; 3],
        [8.0, 0.0, 0.0],
        [0.0; 3],
        [4.0, 0.0, 0.0],
        [0.0; 3],
    ];
    let mut floats = vec![1.0, 2.0, 3.0];
    floats.extend([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0]);
    floats.extend([0.0, 0.0, 0.0, 1.0, 0.0, h, 0.0, h, 0.0, h, 0.0, h]);
    floats.extend(cubic.iter().flatten());
    floats.iter().flat_map(|v: &f32| v.to_le_bytes()).collect()
}

fn file() -> Value {
    let accessor = |offset: u32, count: u32, of: &str| json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": count, "type": of});
    let sampler = |input: u32, output: u32, how: &str| json!({"input": input, "output": output, "interpolation": how});
    let channel = |sampler: u32, node: u32, path: &str| json!({"sampler": sampler, "target": {"node": node, "path": path}});
    let bytes = buffer();
    let escaped: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    json!({
        "asset": {"version": "2.0"},
        "nodes": [
            {"children": [1, 3], "translation": [0, 10, 0]},
            {"name": "rig", "children": [2], "scale": [2, 2, 2]},
            {"name": "head", "camera": 0, "translation": [0, 0, 1]},
            {"name": "cam_still", "camera": 0},
            {"name": "cam_slide", "camera": 0}
        ],
        "cameras": [{"type": "perspective", "name": "lens", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "animations": [
            {"channels": [channel(0, 1, "translation"), channel(1, 1, "rotation")],
             "samplers": [sampler(0, 1, "LINEAR"), sampler(0, 2, "LINEAR")]},
            {"channels": [channel(0, 4, "translation")],
             "samplers": [sampler(3, 4, "CUBICSPLINE")]}
        ],
        "accessors": [
            accessor(0, 3, "SCALAR"), accessor(12, 3, "VEC3"), accessor(48, 3, "VEC4"),
            accessor(0, 2, "SCALAR"), accessor(96, 6, "VEC3")
        ],
        "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}],
        "buffers": [{"uri": format!("data:application/octet-stream,{escaped}"), "byteLength": bytes.len()}]
    })
}

fn read(file: &Value, camera: Option<&str>) -> Result<CameraTrack, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("path.gltf");
    std::fs::write(&path, file.to_string()).unwrap();
    let (track, warnings) = camera_track(&path, camera).map_err(|e| e.to_string())?;
    assert!(warnings.is_empty(), "{warnings:?}");
    Ok(track)
}

fn check(track: &CameraTrack, time_s: f64, eye: Vec3, forward: Vec3) {
    let pose = track.pose(time_s).unwrap();
    let (at, ahead) = (pose.translation.as_vec3(), -pose.matrix3.z_axis.as_vec3());
    assert!((at - eye).length() < 1e-5, "{time_s}: {at} {eye}");
    assert!(
        (ahead - forward).length() < 1e-5,
        "{time_s}: {ahead} {forward}"
    );
    assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-5);
}

#[test]
fn a_camera_follows_the_curves_of_the_nodes_above_it() {
    // The first animated camera is `head`.
    let track = read(&file(), None).unwrap();
    assert_eq!(track.duration_s(), 2.0);
    let up = Vec3::Y * 10.0;
    // The rig scales by 2, so that the head's offset of 1 m becomes 2 m behind the rig.
    check(&track, 0.0, up + Vec3::Z * 2.0, Vec3::NEG_Z);
    let turned = Quat::from_rotation_y(45f32.to_radians());
    check(
        &track,
        0.5,
        up + Vec3::X * 0.5 + turned * Vec3::Z * 2.0,
        turned * Vec3::NEG_Z,
    );
    check(&track, 1.0, up + Vec3::X * 3.0, Vec3::NEG_X);
    check(&track, 2.0, up + Vec3::new(3.0, 2.0, 0.0), Vec3::NEG_X);
    check(&track, 9.0, up + Vec3::new(3.0, 2.0, 0.0), Vec3::NEG_X);
}

#[test]
fn steps_hold_and_cubic_curves_obey_their_tangents() {
    let mut stepped = file();
    stepped["animations"][0]["samplers"][0]["interpolation"] = "STEP".into();
    stepped["animations"][0]["samplers"][1]["interpolation"] = "STEP".into();
    let track = read(&stepped, Some("head")).unwrap();
    check(&track, 0.99, Vec3::new(0.0, 10.0, 2.0), Vec3::NEG_Z);
    let track = read(&file(), Some("slide")).unwrap();
    assert_eq!(track.duration_s(), 1.0);
    // 8 (t^3 - 2 t^2 + t) + 4 (3 t^2 - 2 t^3).
    for (t, x) in [
        (0.0, 0.0),
        (0.25, 1.75),
        (0.5, 3.0),
        (0.75, 3.75),
        (1.0, 4.0),
    ] {
        check(&track, t, Vec3::X * x, Vec3::NEG_Z);
    }
}

#[test]
fn invalid_animated_cameras_are_refused() {
    type Change = fn(&mut Value);
    let cases: [(Option<&str>, Change, [&str; 2]); 12] = [
        (
            Some("still"),
            |_| {},
            ["an animated camera: head, cam_slide", "found 'still'"],
        ),
        (
            Some("nobody"),
            |_| {},
            ["an animated camera: head, cam_slide", "found 'nobody'"],
        ),
        (
            None,
            |f| f["animations"] = json!([]),
            ["a camera that an animation moves", "found none"],
        ),
        (
            None,
            |f| f["nodes"][0]["children"] = json!([1, 3, 2]),
            ["nodes[2]", "two parents"],
        ),
        (
            Some("slide"),
            |f| f["nodes"][2]["children"] = json!([0]),
            ["nodes[0]", "a cycle"],
        ),
        (
            None,
            |f| f["animations"][1]["channels"][0]["target"]["node"] = 1.into(),
            [
                "one channel for the translation of nodes[1]",
                "a second one",
            ],
        ),
        (
            None,
            |f| f["animations"][0]["channels"][0]["target"]["node"] = 9.into(),
            [
                "animations[0].channels[0].target.node",
                "one of 5 nodes, found 9",
            ],
        ),
        (
            None,
            |f| f["animations"][0]["samplers"][0]["input"] = 4.into(),
            ["accessors[4]", "times: scalar floats"],
        ),
        (
            None,
            |f| f["accessors"][1]["count"] = 2.into(),
            [
                "animations[0].channels[0], its sampler",
                "3 values for 3 times, found 2",
            ],
        ),
        (
            None,
            |f| f["accessors"][0]["byteOffset"] = 8.into(),
            [
                "animations[0].channels[0], its sampler",
                "finite and ascending",
            ],
        ),
        (
            None,
            |f| f["accessors"][2]["byteOffset"] = 12.into(),
            ["animations[0].channels[1], its sampler", "unit quaternions"],
        ),
        (
            None,
            |f| {
                let one = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
                f["nodes"][1] = json!({"children": [2], "matrix": one});
            },
            ["nodes[1]", "found a matrix"],
        ),
    ];
    for (camera, change, parts) in cases {
        let mut damaged = file();
        change(&mut damaged);
        let error = read(&damaged, camera).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "no {part:?} in {error}");
        }
    }
    let mut flat = file();
    flat["nodes"][1]["scale"] = json!([0, 0, 0]);
    let error = read(&flat, None)
        .unwrap()
        .pose(0.0)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("camera 'head' at 1 s") && error.contains("scaled to nothing"),
        "{error}"
    );
}
