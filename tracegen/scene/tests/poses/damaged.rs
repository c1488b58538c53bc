//! Damaged skins, morph targets and animations. Each error names the place, the expected value and
//! the found one.

use super::figure::Figure;
use crate::conformance::files::File;
use scene::{LoadOptions, cameras};
use serde_json::json;

fn refused(file: File, options: &LoadOptions, parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let error = match file.load_with(folder.path(), options) {
        Ok(_) => panic!("read, without {parts:?}"),
        Err(error) => error.to_string(),
    };
    for part in ["scene.gltf"].iter().chain(parts) {
        assert!(error.contains(part), "no '{part}' in: {error}");
    }
}

#[test]
fn damaged_skins_are_refused() {
    let refused = |figure: &Figure, change: fn(&mut File), parts: &[&str]| {
        let mut file = figure.file();
        change(&mut file);
        refused(file, &LoadOptions::ALL, parts);
    };
    let whole = Figure::new();
    refused(
        &whole,
        |f| f.json["skins"][0]["joints"] = json!([2, 3]),
        &[
            "meshes[0].primitives[0].JOINTS, vertex",
            "one of the 2 joints of its skin, found joint 2",
        ],
    );
    refused(
        &whole,
        |f| f.json["skins"][0]["joints"] = json!([]),
        &["skins[0].joints: expected at least one joint, found none"],
    );
    refused(
        &whole,
        |f| f.json["skins"][0]["joints"] = json!([2, 3, 1, 0]),
        &["skins[0].inverseBindMatrices: expected at least 4 matrices, one a joint, found 3"],
    );
    refused(
        &whole,
        |f| f.json["skins"][0]["inverseBindMatrices"] = json!(0),
        &["accessors[0]: expected inverse bind matrices: MAT4 of floats, found VEC3 of floats"],
    );
    refused(
        &whole,
        |f| {
            let attributes = &mut f.json["meshes"][0]["primitives"][0]["attributes"];
            attributes["JOINTS_0"] = attributes["POSITION"].clone();
        },
        &["joints: Vec4 of U8 or U16, not normalized, found VEC3 of floats"],
    );
    refused(
        &whole,
        |f| {
            let attributes = &mut f.json["meshes"][0]["primitives"][0]["attributes"];
            attributes.as_object_mut().unwrap().remove("WEIGHTS_0");
        },
        &["meshes[0].primitives[0].WEIGHTS_0: expected 6 elements, one a position, found 0"],
    );
    let mut weightless = Figure::new();
    (weightless.weights[0][0], weightless.weights[1][0]) = ([0.0; 4], [0.0; 4]);
    // Without weights, the first joint counts.
    weightless.joints[0][0][0] = 3;
    refused(
        &weightless,
        |_| {},
        &["JOINTS, vertex 0: expected one of the 3 joints of its skin, found joint 3"],
    );
    let mut negative = Figure::new();
    negative.weights[0][4] = [0.5, -0.5, 0.0, 0.0];
    refused(
        &negative,
        |_| {},
        &["WEIGHTS, vertex 4: expected weights of at least 0, found -0.5"],
    );
    let mut infinite = Figure::new();
    infinite.inverse_binds[1][0] = f32::INFINITY;
    refused(
        &infinite,
        |_| {},
        &[
            "skins[0].inverseBindMatrices: expected finite matrices, found NaN or infinity in matrix 1",
        ],
    );
}

#[test]
fn a_vertex_that_no_triangle_has_may_have_any_joints_and_weights() {
    let mut figure = Figure::new();
    figure.joints[0][5] = [9; 4];
    figure.weights[0][5] = [f32::NAN, 1.0, -1.0, 1.0];
    let mut file = figure.file();
    let primitive = &file.json["meshes"][0]["primitives"][0];
    let indices = primitive["indices"].as_u64().unwrap() as usize;
    // Without the last triangle, which is the only one that uses vertex 5.
    file.json["accessors"][indices]["count"] = json!(9);
    let folder = tempfile::tempdir().unwrap();
    let scene = file.load(folder.path()).unwrap().scene;
    let positions = scene.meshes.iter().flat_map(|mesh| &mesh.positions);
    assert!(positions.into_iter().all(|p| p.is_finite()));
    refused(
        figure.file(),
        &LoadOptions::ALL,
        &["vertex 5", "weights of at least 0, found NaN"],
    );
}

#[test]
fn damaged_morph_targets_are_refused() {
    let mut file = Figure::new().file();
    let indices = file.json["meshes"][0]["primitives"][0]["indices"].clone();
    file.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = indices;
    refused(file, &LoadOptions::ALL, &["displacements: Vec3 of F32"]);
    let mut short = Figure::new();
    short.targets[1].1.pop();
    let part =
        "meshes[1].primitives[0].targets[1].NORMAL: expected 6 elements, one a position, found 5";
    refused(short.file(), &LoadOptions::ALL, &[part]);
    let mut infinite = Figure::new();
    infinite.targets[1].0[3][1] = f32::NAN;
    let part =
        "meshes[1].primitives[0].targets[1].POSITION, vertex 3: expected a finite displacement";
    refused(infinite.file(), &LoadOptions::ALL, &[part]);
}

#[test]
fn damaged_animations_are_refused() {
    let mut unordered = Figure::new();
    let keys = unordered.nodes[super::figure::KNEE]
        .rotations
        .as_mut()
        .unwrap();
    keys.times[2] = keys.times[1] - 0.125;
    refused(
        unordered.file(),
        &LoadOptions::ALL,
        &[
            "animations[0].channels[",
            "its sampler: expected at least one time, finite and ascending",
        ],
    );
    let mut few = Figure::new();
    few.face_weights.values.pop();
    refused(
        few.file(),
        &LoadOptions::ALL,
        &["its sampler: expected 18 values for 3 times, found 16"],
    );
    let mut huge = Figure::new();
    let keys = huge.nodes[super::figure::HAT]
        .translations
        .as_mut()
        .unwrap();
    keys.values[1] = [1e13, 0.0, 0.0];
    refused(
        huge.file(),
        &LoadOptions::ALL,
        &["animations[0] 'walk' at 0 s", "at most 1e12 m"],
    );
    // A later frame reports the error as well.
    let mut huge = Figure::new();
    let keys = huge.nodes[super::figure::HIP]
        .translations
        .as_mut()
        .unwrap();
    keys.values[2] = [1e13, 0.0, 0.0];
    let folder = tempfile::tempdir().unwrap();
    let mut scene = huge.file().load(folder.path()).unwrap().scene;
    let error = scene.animate(2.75).unwrap_err().to_string();
    assert!(error.contains("'walk' at 2.75 s"), "{error}");
    scene.animate(0.0).unwrap();
}

#[test]
fn unknown_animations_are_refused_with_a_suggestion() {
    let wanted = |name: &str| LoadOptions {
        animation: Some(name.into()),
        ..LoadOptions::ALL
    };
    let figure = Figure::new();
    let part = "animations: expected one of walk, a number below 1, all or none, found 'wlak'; did you mean 'walk'?";
    refused(figure.file(), &wanted("wlak"), &[part]);
    refused(
        figure.file(),
        &wanted("1"),
        &["a number below 1", "found '1'"],
    );
    refused(
        File::quad(),
        &wanted("walk"),
        &["animations: expected a file with animations, found 'walk'"],
    );
    let folder = tempfile::tempdir().unwrap();
    for known in ["walk", "0", "all", "none"] {
        figure
            .file()
            .load_with(folder.path(), &wanted(known))
            .unwrap();
    }
    for known in ["all", "none"] {
        File::quad()
            .load_with(folder.path(), &wanted(known))
            .unwrap();
    }
}

#[test]
fn the_first_of_several_animations_plays_and_is_named() {
    let mut file = Figure::new().file();
    let mut second = file.json["animations"][0].clone();
    second.as_object_mut().unwrap().remove("name");
    second["channels"] = json!([second["channels"][0]]);
    file.push("animations", second);
    let folder = tempfile::tempdir().unwrap();
    let loaded = file.load(folder.path()).unwrap();
    assert_eq!(loaded.animations, ["walk", "animation-1"]);
    assert!(
        loaded.warnings[0].contains("the first of 2 animations plays, 'walk'"),
        "{:?}",
        loaded.warnings
    );
    assert_eq!(
        loaded.scene.animation.unwrap().name(),
        "animations[0] 'walk'"
    );
}

#[test]
fn unknown_cameras_are_refused_with_the_names_of_the_others() {
    let mut file = File::quad();
    file.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}
    ]);
    file.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    file.push("nodes", json!({"name": "cam_gallery", "camera": 0}));
    file.push("nodes", json!({"name": "cam_plan", "camera": 1}));
    let folder = tempfile::tempdir().unwrap();
    let scene = file.load(folder.path()).unwrap().scene;
    let error = |name| cameras::find(&scene, Some(name)).unwrap_err().to_string();
    assert_eq!(
        error("galery"),
        "no camera 'galery': expected one of cam_gallery, cam_plan; did you mean 'gallery'?"
    );
    assert_eq!(
        error("x"),
        "no camera 'x': expected one of cam_gallery, cam_plan"
    );
}
