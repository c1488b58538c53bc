//! What every built-in scene promises to the renderers.

use super::{build, names};
use glam::Vec3;
use scene::{Mesh, Scene};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::OnceLock;

/// Triangles that a scene must have, instances counted.
const TRIANGLES: &[(&str, std::ops::RangeInclusive<u64>)] = &[
    ("atrium", 200_000..=280_000),
    ("atrium-plain", 64_000..=68_000),
    ("atrium-shadows", 64_000..=68_000),
    ("jungle", 300_000..=450_000),
    ("teapot", 14_700..=15_300),
    ("chess", 41_160..=42_840),
    ("car", 53_900..=56_100),
    ("lab", 96_040..=99_960),
    ("music-box", 103_880..=108_120),
    ("meadow", 588_000..=612_000),
];

/// All built-in scenes, built once for all tests.
fn scenes() -> &'static [Scene] {
    static SCENES: OnceLock<Vec<Scene>> = OnceLock::new();
    SCENES.get_or_init(|| names().iter().filter_map(|(name, _)| build(name)).collect())
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
    for image in &scene.images {
        image.rgba.hash(&mut hasher);
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
fn every_listed_scene_can_be_built_and_no_other() {
    for (name, description) in names() {
        assert!(scene(name).is_some(), "{name}");
        assert!(!description.is_empty());
    }
    assert!(build("no-such-scene").is_none());
}

#[test]
fn triangle_counts_are_those_of_the_scenes_stood_for() {
    assert_eq!(TRIANGLES.len(), names().len());
    for (name, range) in TRIANGLES {
        let count = scene(name).map_or(0, Scene::triangle_count);
        assert!(
            range.contains(&count),
            "{name}: {count} is not in {range:?}"
        );
    }
}

#[test]
fn the_same_scene_comes_out_with_one_thread_as_with_all() {
    for (name, _) in names() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let alone = pool.map(|pool| pool.install(|| build(name)));
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
            assert_eq!(image.rgba.len(), (w * h * 4) as usize, "{}", image.name);
        }
        for material in &scene.materials {
            for texture in material.textures().into_iter().flatten() {
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
fn atriums_differ_in_textures_and_shadows_only_where_they_should() {
    let textures = |name: &str| scene(name).map_or(0, |s| s.images.len());
    assert!(textures("atrium") >= 60);
    assert!((6..=9).contains(&textures("atrium-plain")));
    let cascades = |name: &str| scene(name).map(|s| s.shadow_cascades);
    assert_eq!(cascades("atrium"), Some(0));
    assert_eq!(cascades("atrium-shadows"), Some(4));
}
