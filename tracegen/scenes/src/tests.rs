//! Properties of every built-in scene that renderers rely on.

use super::{BUILTINS, build};
use glam::Vec3;
use scene::{LoadOptions, Mesh, Scene, TextureRef, TextureSlot, TextureSlots};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::OnceLock;

/// All built-in scenes, built once for all tests.
fn scenes() -> &'static [Scene] {
    static SCENES: OnceLock<Vec<Scene>> = OnceLock::new();
    SCENES.get_or_init(|| {
        BUILTINS
            .iter()
            .filter_map(|b| build(b.name).ok()?)
            .collect()
    })
}

fn scene(name: &str) -> Option<&'static Scene> {
    scenes().iter().find(|s| s.name == name)
}

fn digest(scene: &Scene) -> u64 {
    let mut hasher = DefaultHasher::new();
    for mesh in &scene.meshes {
        bytemuck::cast_slice::<_, u8>(&mesh.positions).hash(&mut hasher);
        bytemuck::cast_slice::<_, u8>(&mesh.normals).hash(&mut hasher);
        bytemuck::cast_slice::<_, u8>(&mesh.tangents).hash(&mut hasher);
        bytemuck::cast_slice::<_, u8>(&mesh.uv0).hash(&mut hasher);
        mesh.indices.hash(&mut hasher);
    }
    for rgba in scene::image::texels(&scene.images, |_| true).unwrap() {
        rgba.hash(&mut hasher);
    }
    format!(
        "{:?}{:?}{:?}",
        scene.instances, scene.materials, scene.cameras
    )
    .hash(&mut hasher);
    hasher.finish()
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [usize; 3]> {
    mesh.indices
        .chunks_exact(3)
        .map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
}

#[test]
fn the_table_has_the_triangles_and_cameras_of_every_scene() {
    for listed in BUILTINS {
        let Some(built) = scene(listed.name) else {
            panic!("{} cannot be built under its name", listed.name);
        };
        assert_eq!(built.triangle_count(), listed.triangles, "{}", listed.name);
        let cameras: Vec<&str> = built.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(cameras, listed.cameras, "{}", listed.name);
    }
    assert!(build("no-such-scene").unwrap().is_none());
}

#[test]
fn scenes_do_not_depend_on_the_number_of_threads() {
    for name in BUILTINS.iter().map(|b| b.name) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let alone = pool.map(|pool| pool.install(|| build(name).ok().flatten()));
        let alone = alone.ok().flatten().map(|s| digest(&s));
        assert!(alone.is_some());
        assert_eq!(alone, scene(name).map(digest), "{name}");
    }
}

#[test]
fn vertices_are_finite_with_unit_normals_and_tangents_across_them() {
    for scene in scenes() {
        for mesh in &scene.meshes {
            let at = format!("{}/{}", scene.name, mesh.name);
            let n = mesh.positions.len();
            assert_eq!(
                [mesh.normals.len(), mesh.tangents.len(), mesh.uv0.len()],
                [n; 3],
                "{at}"
            );
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3),
                "{at}"
            );
            for (t, n) in mesh.tangents.iter().zip(&mesh.normals) {
                assert!(
                    (t.truncate().length() - 1.0).abs() < 1e-3 && t.w.abs() == 1.0,
                    "{at}"
                );
                assert!(
                    t.truncate().dot(*n).abs() < 1e-2,
                    "{at}: tangent {t} normal {n}"
                );
            }
            let widest = mesh
                .uv0
                .iter()
                .map(|uv| uv.abs().max_element())
                .fold(0.0, f32::max);
            assert!(widest <= 16.0, "{at}: uv reaches {widest}");
        }
    }
}

#[test]
fn indices_are_in_range_and_no_triangle_is_degenerate() {
    for scene in scenes() {
        for mesh in &scene.meshes {
            assert_eq!(mesh.indices.len() % 3, 0);
            assert!(
                mesh.triangles() > 0,
                "{}/{} is empty",
                scene.name,
                mesh.name
            );
            for [a, b, c] in corners(mesh) {
                let p = |i: usize| mesh.positions[i];
                let area = (p(b) - p(a)).cross(p(c) - p(a)).length();
                assert!(area > 0.0, "{}/{}", scene.name, mesh.name);
            }
        }
        let (meshes, materials) = (scene.meshes.len(), scene.materials.len());
        assert!(scene.instances.iter().all(|i| i.mesh < meshes));
        assert!(scene.meshes.iter().all(|m| m.material < materials));
    }
}

#[test]
fn winding_agrees_with_normals() {
    for scene in scenes() {
        for mesh in &scene.meshes {
            let agree = corners(mesh)
                .filter(|&[a, b, c]| {
                    let p = |i: usize| mesh.positions[i];
                    let normals: Vec3 = [a, b, c].iter().map(|&i| mesh.normals[i]).sum();
                    (p(b) - p(a)).cross(p(c) - p(a)).dot(normals) > 0.0
                })
                .count();
            let share = agree as f32 / mesh.triangles() as f32;
            assert!(share > 0.95, "{}/{}: {share}", scene.name, mesh.name);
        }
    }
}

#[test]
fn textures_are_powers_of_two_and_referenced_in_range() {
    for scene in scenes() {
        for image in &scene.images {
            let [w, h] = image.size;
            assert!(w.is_power_of_two() && h.is_power_of_two(), "{}", image.name);
        }
        for material in &scene.materials {
            for texture in material.textures.all() {
                assert!(texture.image < scene.images.len(), "{}", material.name);
            }
        }
    }
}

#[test]
fn every_scene_has_a_default_camera_inside_its_far_plane_and_a_light() {
    for scene in scenes() {
        let camera = &scene.cameras[0];
        assert_eq!(camera.name, "default");
        assert!(camera.near > 0.0 && camera.far > camera.eye.distance(camera.target));
        assert!(!scene.lights.is_empty());
    }
}

#[test]
fn atriums_differ_only_in_their_declared_textures_and_shadows() {
    let textures = |name: &str| scene(name).map_or(0, |s| s.images.len());
    assert!(textures("atrium") >= 60);
    assert!((6..=9).contains(&textures("atrium-plain")));
    let cascades = |name: &str| scene(name).map(|s| s.shadow_cascades);
    assert_eq!(cascades("atrium"), Some(0));
    assert_eq!(cascades("atrium-shadows"), Some(4));
}

#[test]
fn a_plant_has_the_requested_number_of_instances_sorted_by_mesh() {
    for (spec, instances) in [
        ("plant", 20_000),
        ("plant:54321", 54_321),
        ("plant:100000", 100_000),
    ] {
        let built = build(spec).unwrap().unwrap();
        assert_eq!(built.instances.len(), instances, "{spec}");
        assert!(built.instances.is_sorted_by_key(|i| i.mesh), "{spec}");
        assert!(
            (40..=140).contains(&built.meshes.len()),
            "{}",
            built.meshes.len()
        );
        // Everything is within the hall and above its floor, except for foundations.
        let (low, high) = built.bounds().unwrap();
        assert!(low.y > -3.0 && high.y < 13.5, "{low} {high}");
    }
    for (spec, part) in [
        (
            "plant:19999",
            "plant:N with N instances from 20000 to 100000",
        ),
        ("plant:100001", "from 20000 to 100000"),
        ("plant:", "from 20000 to 100000"),
        ("plant:-1", "from 20000 to 100000"),
        ("plant:99999999999999999999", "from 20000 to 100000"),
        (
            "teapot:5",
            "scene 'teapot:5': expected teapot, which has no parameter",
        ),
    ] {
        let error = crate::load(spec).unwrap_err().to_string();
        assert!(error.contains(part), "{spec}: {error}");
    }
}

#[test]
fn moving_parts_of_the_plant_start_in_place_and_stay_inside() {
    let plant = scene("plant").unwrap();
    let moving: Vec<usize> = (plant.motions.iter())
        .flat_map(|motion| motion.instances.iter().copied())
        .collect();
    assert!((20..100).contains(&moving.len()), "{}", moving.len());
    let (low, high) = plant.bounds().unwrap();
    for (index, transform) in plant.moved(0.0) {
        assert!(transform.abs_diff_eq(plant.instances[index].transform, 1e-4));
    }
    let mut travelled = 0.0f32;
    for time_s in [0.5, 3.0, 11.0, 47.0, 160.0] {
        for (index, transform) in plant.moved(time_s) {
            let at = Vec3::from(transform.translation);
            assert!(
                at.cmpgt(low).all() && at.cmplt(high).all(),
                "{time_s} s: {at}"
            );
            let from = plant.instances[index].transform.translation;
            travelled = travelled.max(transform.translation.distance(from));
        }
    }
    assert!(travelled > 20.0, "{travelled}");
}

#[test]
fn removing_texture_slots_removes_their_images() {
    let slots = TextureSlots::ALL.without(TextureSlot::Normal);
    let whole = crate::load("teapot").unwrap();
    let part = crate::load_with(
        "teapot",
        &LoadOptions {
            slots,
            ..LoadOptions::ALL
        },
    )
    .unwrap()
    .scene;
    let names =
        |scene: &Scene| -> Vec<String> { scene.images.iter().map(|i| i.name.clone()).collect() };
    let colors: Vec<String> = (names(&whole).into_iter())
        .filter(|name| name.ends_with("-color"))
        .collect();
    assert!(colors.len() < whole.images.len());
    assert_eq!(names(&part), colors);
    for (before, after) in whole.materials.iter().zip(&part.materials) {
        assert_eq!(after.textures[TextureSlot::Normal], None);
        let image = |scene: &Scene, texture: Option<TextureRef>| {
            texture.map(|t| scene.images[t.image].name.clone())
        };
        assert_eq!(
            image(&part, after.textures[TextureSlot::BaseColor]),
            image(&whole, before.textures[TextureSlot::BaseColor])
        );
    }
}

#[test]
#[should_panic(expected = "test, line 2: expected 3 numbers instead of '0,0'")]
fn a_row_of_another_form_is_refused_with_its_place() {
    let mut scene = crate::SceneBuilder::new("test");
    crate::scene_text::read(&mut scene, "sky 1,1,1\nlamp 0,0 1,1,1\n", crate::Code::NONE);
}
