//! Skinned, morphed and animated vertices against a second evaluator in double precision, and the
//! errors of damaged skins and animations.

mod damaged;
mod figure;
mod naive;

use figure::{FACE, Figure, HAT, KNEE, LEG, ROOT, VERTICES};
use glam::{DVec3, Vec3};
use naive::Vector;
use scene::{LoadOptions, Scene};

/// Times before, at, between and after keys. The last key of all is at 3 s.
const TIMES_S: [f64; 12] = [
    0.0, 0.125, 0.25, 0.5, 0.7, 1.0, 1.3, 1.5, 1.99, 2.6, 3.0, 3.5,
];

/// The time within the animation, which repeats.
fn within(time_s: f64) -> f64 {
    if time_s > 3.0 { time_s % 3.0 } else { time_s }
}

fn load(figure: &Figure, time_s: f64) -> Scene {
    load_with_warnings(figure, time_s, &[])
}

/// Loads a figure whose file gets these warnings.
fn load_with_warnings(figure: &Figure, time_s: f64, warnings: &[&str]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let options = LoadOptions {
        time_s,
        ..LoadOptions::ALL
    };
    let loaded = figure.file().load_with(folder.path(), &options).unwrap();
    assert_eq!(loaded.warnings, warnings);
    assert_eq!(loaded.animations, ["walk"]);
    loaded.scene
}

/// Vertices of the instances in the order of the nodes' walk: the hat's node is below the face's, and the leg
/// is a root of its own.
const ORDER: [usize; 3] = [FACE, HAT, LEG];

/// Checks every vertex of a scene against the second evaluator.
///
/// The tolerance of a position is 2^-22 of the sum of the magnitudes of its terms. The coordinates of
/// the mesh and of the instance are each rounded once, by 2^-24 of their value, and the test adds in
/// double precision.
fn check(scene: &Scene, figure: &Figure, time_s: f64) {
    assert_eq!(scene.instances.len(), 3);
    for (instance, node) in scene.instances.iter().zip(ORDER) {
        let mesh = &scene.meshes[instance.mesh];
        let expected: Vec<(Vector, Vector)> = figure.posed(node, within(time_s));
        assert_eq!(mesh.positions.len(), VERTICES);
        let normals = instance.normal_matrix();
        for (vertex, (position, normal)) in expected.iter().enumerate() {
            let at = || format!("node {node}, vertex {vertex}, {time_s} s");
            let [x, y, z] = [
                instance.transform.matrix3.x_axis,
                instance.transform.matrix3.y_axis,
                instance.transform.matrix3.z_axis,
            ]
            .map(|axis| Vec3::from(axis).as_dvec3());
            let start = Vec3::from(instance.transform.translation).as_dvec3();
            let p = mesh.positions[vertex].as_dvec3();
            let found = x * p.x + y * p.y + z * p.z + start + scene.origin;
            let magnitude = (x * p.x).abs() + (y * p.y).abs() + (z * p.z).abs() + start.abs();
            let off = (found - DVec3::from(*position)).abs();
            let bound = magnitude.max_element() * 2f64.powi(-22);
            assert!(
                off.max_element() <= bound,
                "{}: off by {off}, bound {bound}",
                at()
            );
            let found = (normals * mesh.normals[vertex]).normalize().as_dvec3();
            let off = (found - DVec3::from(*normal)).abs().max_element();
            assert!(off < 3e-6, "{}: normal off by {off}", at());
        }
    }
}

#[test]
fn poses_match_a_second_evaluator() {
    let figure = Figure::new();
    let mut scene = load(&figure, 0.0);
    for time_s in TIMES_S {
        check(&load(&figure, time_s), &figure, time_s);
        // One scene that is posed repeatedly gives the same result.
        scene.animate(time_s).unwrap();
        check(&scene, &figure, time_s);
    }
}

#[test]
fn every_vertex_moves_and_returns_bit_exactly() {
    let figure = Figure::new();
    let first = load(&figure, 0.3);
    let mut scene = first.clone();
    scene.animate(1.7).unwrap();
    let placed = |scene: &Scene| -> Vec<Vec3> {
        let of_instance = |instance: &scene::Instance| {
            let mesh = &scene.meshes[instance.mesh];
            let transform = instance.transform;
            let points = mesh.positions.iter();
            points
                .map(|p| transform.transform_point3(*p))
                .collect::<Vec<_>>()
        };
        scene.instances.iter().flat_map(of_instance).collect()
    };
    for (before, after) in placed(&first).iter().zip(placed(&scene)) {
        assert!((*before - after).length() > 1e-3, "{before}");
    }
    scene.animate(0.3).unwrap();
    let bits = |scene: &Scene| -> Vec<[u32; 3]> {
        let values = scene
            .meshes
            .iter()
            .flat_map(|m| m.positions.iter().chain(&m.normals));
        values.map(|v| v.to_array().map(f32::to_bits)).collect()
    };
    assert_eq!(bits(&scene), bits(&first));
    assert_eq!(placed(&scene), placed(&first));
}

#[test]
fn a_figure_far_from_zero_is_as_accurate_as_near_zero() {
    let mut figure = Figure::new();
    figure.nodes[ROOT].translation = [3e6, -1e6, 7e5];
    let scene = load(&figure, 0.7);
    assert!(scene.origin.length() > 1e6, "{}", scene.origin);
    check(&scene, &figure, 0.7);
    let mut moved = scene;
    moved.animate(1.3).unwrap();
    check(&moved, &figure, 1.3);
}

#[test]
fn mirroring_joints_mirror_the_instance() {
    let mut figure = Figure::new();
    assert!(!load(&figure, 0.7).instances[2].mirrored());
    figure.nodes[ROOT].scale = Some([-1.5, 0.5, 2.0]);
    let scene = load(&figure, 0.7);
    let mirrored: Vec<bool> = scene.instances.iter().map(|i| i.mirrored()).collect();
    assert_eq!(mirrored, [true; 3]);
    check(&scene, &figure, 0.7);
}

#[test]
fn skins_and_weights_apply_without_an_animation() {
    let figure = Figure::new();
    let folder = tempfile::tempdir().unwrap();
    let options = LoadOptions {
        animation: Some("none".into()),
        ..LoadOptions::ALL
    };
    let loaded = figure.file().load_with(folder.path(), &options).unwrap();
    assert!(loaded.scene.animation.is_none());
    let mut at_rest = figure;
    for node in &mut at_rest.nodes {
        (node.translations, node.rotations, node.scales) = (None, None, None);
    }
    at_rest.face_weights.values = vec![[0.0; 2]; 9];
    check(&loaded.scene, &at_rest, 0.0);
}

#[test]
fn vertices_without_weights_follow_their_first_joints() {
    let mut figure = Figure::new();
    for vertex in [1, 2] {
        (figure.weights[0][vertex], figure.weights[1][vertex]) = ([0.0; 4], [0.0; 4]);
    }
    let warning = "meshes[0].primitives[0].WEIGHTS, vertex 1 has no weight above 0; it follows its first joint (and 1 more like this)";
    for time_s in [0.25, 1.3] {
        check(
            &load_with_warnings(&figure, time_s, &[warning]),
            &figure,
            time_s,
        );
    }
}

#[test]
fn of_keys_with_equal_times_the_last_one_counts_from_then_on() {
    let mut figure = Figure::new();
    let keys = figure.nodes[KNEE].rotations.as_mut().unwrap();
    keys.times[2] = keys.times[1];
    assert_eq!(keys.times[1], 0.75);
    let warning = "animations[0].channels[2]: 1 keys have the time of the key before; the last one counts from then on";
    for time_s in [0.5, 0.75, 1.0, 2.6] {
        check(
            &load_with_warnings(&figure, time_s, &[warning]),
            &figure,
            time_s,
        );
    }
}

#[test]
fn parts_that_do_not_move_are_dropped() {
    let mut file = Figure::new().file();
    // Only the face's weights still move.
    let channels = file.json["animations"][0]["channels"]
        .as_array_mut()
        .unwrap();
    channels.retain(|channel| channel["target"]["path"] == "weights");
    let folder = tempfile::tempdir().unwrap();
    let scene = file.load(folder.path()).unwrap().scene;
    let animation = scene.animation.as_ref().unwrap();
    assert_eq!(animation.moving_meshes().count(), 1);
    assert_eq!(animation.moving_instances().collect::<Vec<_>>(), [0]);
    assert_eq!(animation.duration_s(), 2.75);
}

#[test]
fn a_node_with_zero_scale_covers_nothing_at_that_time() {
    let mut figure = Figure::new();
    figure.nodes[HAT].scales = Some(naive::Keys {
        between: naive::Between::Step,
        times: vec![0.0, 1.0],
        values: vec![[0.0, 1.0, 1.0], [1.0; 3]],
    });
    let mut scene = load(&figure, 0.0);
    let area = |scene: &Scene| -> f32 {
        let instance = &scene.instances[1];
        let mesh = &scene.meshes[instance.mesh];
        let at = |i: u32| {
            instance
                .transform
                .transform_point3(mesh.positions[i as usize])
        };
        let triangles = mesh.indices.chunks_exact(3);
        triangles
            .map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length())
            .sum()
    };
    assert_eq!(area(&scene), 0.0);
    assert!(scene.instances[1].normal_matrix().is_finite());
    scene.animate(1.0).unwrap();
    assert!(area(&scene) > 0.1);
    check(&scene, &figure, 1.0);
}

#[test]
fn cameras_and_lights_follow_their_nodes() {
    let mut file = Figure::new().file();
    file.json["cameras"] =
        serde_json::json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
    file.json["extensions"] =
        serde_json::json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    file.json["nodes"][HAT]["camera"] = 0.into();
    file.json["nodes"][HAT]["extensions"] =
        serde_json::json!({"KHR_lights_punctual": {"light": 0}});
    let folder = tempfile::tempdir().unwrap();
    let mut scene = file.load(folder.path()).unwrap().scene;
    let figure = Figure::new();
    for time_s in [0.0, 1.3] {
        scene.animate(time_s).unwrap();
        let world = naive::world(&figure.nodes, HAT, time_s);
        let expected = DVec3::from(naive::point(&world, [0.0; 3])).as_vec3();
        let scene::Light::Point { position, .. } = scene.lights[0] else {
            panic!("a point light");
        };
        assert!((scene.cameras[0].eye - expected).length() < 1e-5);
        assert!((position - expected).length() < 1e-5);
        let ahead = DVec3::new(-world[0][2], -world[1][2], -world[2][2])
            .normalize()
            .as_vec3();
        let camera = &scene.cameras[0];
        assert!((camera.target - camera.eye - ahead).length() < 1e-5);
    }
}
