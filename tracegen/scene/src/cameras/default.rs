//! Views of files without a camera: from inside at eye height where there is an inside, else around.

use super::super::{Camera, Scene};
use super::probe::Probe;
use glam::{Quat, Vec3};
use std::f32::consts::TAU;

/// Name of the view of a file without a camera.
pub const DEFAULT_NAME: &str = "default";

/// Near plane of a file in metres.
const NEAR_M: f32 = 0.05;

/// Height of the eyes above the floor, and the least height of a room, metres.
const EYE_M: f32 = 1.6;
const ROOM_M: f32 = 1.9;

/// Distance of views around a scene in radii of its bounds. The scene fills most of a picture of 100
/// degrees and all of it is before the eye.
const AROUND_RADII: f32 = 1.25;

/// Share of directions that must end at a surface.
const ENCLOSED: f32 = 0.75;

/// Directions of a place, horizontal directions of a view, and floors of a column that are looked at.
const DIRECTIONS: usize = 48;
const HEADINGS: usize = 16;
const MAX_FLOORS: usize = 8;

/// The view of a file without a camera.
pub fn default_camera(scene: &Scene) -> Camera {
    inside(scene).unwrap_or_else(|| around(scene, 1).swap_remove(0))
}

/// This many views from all sides, slightly from above. The bounds of the scene decide the distance.
pub fn around(scene: &Scene, count: u32) -> Vec<Camera> {
    let (low, high) = scene.bounds().unwrap_or((-Vec3::ONE, Vec3::ONE));
    let target = (low + high) / 2.0;
    let radius = radius(low, high);
    let first = Vec3::new(0.55, 0.4, 1.0).normalize();
    (0..count.max(1))
        .map(|number| {
            let turn = Quat::from_rotation_y(TAU * number as f32 / count.max(1) as f32);
            camera(scene, target + turn * first * radius * AROUND_RADII, target)
        })
        .collect()
}

/// Half of the bounds' diagonal. All points may coincide.
fn radius(low: Vec3, high: Vec3) -> f32 {
    let half = (high - low).length() / 2.0;
    if half > 0.0 { half } else { 1e-3 }
}

/// A view with the planes that suit the scene: the near one by its unit, or by its size where the unit
/// is unknown or the scene is small; nothing is too far away.
fn camera(scene: &Scene, eye: Vec3, target: Vec3) -> Camera {
    let (low, high) = scene.bounds().unwrap_or((-Vec3::ONE, Vec3::ONE));
    let by_size = radius(low, high) * 0.01;
    Camera {
        name: DEFAULT_NAME.into(),
        eye,
        target,
        up: Vec3::Y,
        vfov_deg: 60.0,
        near: if scene.in_metres {
            by_size.min(NEAR_M)
        } else {
            by_size
        },
        far: f32::INFINITY,
    }
}

/// A place to stand, and what is seen from it.
struct Place {
    eye: Vec3,
    /// Height of the eyes above the floor.
    height: f32,
    /// How far the median distance is from that of a room, as a factor's logarithm.
    strangeness: f32,
}

/// A view from the place that is most like a room: enclosed by surfaces at a few times the eyes' height.
fn inside(scene: &Scene) -> Option<Camera> {
    let probe = Probe::new(scene)?;
    let places = probe
        .columns()
        .flat_map(|column| floors(scene, &probe, column));
    let best = places.min_by(|a, b| a.strangeness.total_cmp(&b.strangeness))?;
    let ahead = longest_view(&probe, &best);
    let mut camera = camera(scene, best.eye, best.eye + ahead * best.height);
    // A room may be small beside what surrounds it.
    camera.near = camera.near.min(best.height * (NEAR_M / EYE_M));
    Some(camera)
}

/// The enclosed places above the floors at a horizontal position.
fn floors(scene: &Scene, probe: &Probe, [x, z]: [f32; 2]) -> Vec<Place> {
    let surfaces = probe.surfaces_below(x, z);
    let mut places = Vec::new();
    for (number, surface) in surfaces.iter().enumerate() {
        if !surface.is_floor || places.len() == MAX_FLOORS {
            continue;
        }
        let above = number
            .checked_sub(1)
            .map(|above| surfaces[above].y - surface.y);
        let height = match (scene.in_metres, above) {
            (true, above) if above.is_none_or(|room| room >= ROOM_M) => EYE_M,
            (false, Some(room)) => room * 0.4,
            _ => continue,
        };
        let eye = Vec3::new(x, surface.y + height, z);
        places.extend(enclosed(probe, eye, height));
    }
    places
}

/// The place, if most directions from it end at a surface.
fn enclosed(probe: &Probe, eye: Vec3, height: f32) -> Option<Place> {
    let mut distances: Vec<f32> = (0..DIRECTIONS)
        .filter_map(|number| probe.distance(eye, direction(number)))
        .collect();
    distances.sort_by(f32::total_cmp);
    let nearest = distances.first()?;
    let is_enclosed = distances.len() as f32 >= ENCLOSED * DIRECTIONS as f32;
    (is_enclosed && *nearest > height / 8.0).then(|| Place {
        eye,
        height,
        strangeness: (distances[distances.len() / 2] / (2.5 * height)).ln().abs(),
    })
}

/// The horizontal direction with the longest view.
fn longest_view(probe: &Probe, place: &Place) -> Vec3 {
    let most = 10.0 * place.height;
    let heading = |turn: f32| Quat::from_rotation_y(turn) * Vec3::NEG_Z;
    let view = |turn: f32| {
        let rays = [-0.5, -0.25, 0.0, 0.25, 0.5].map(|aside| heading(turn + aside));
        let seen = rays.map(|ray| probe.distance(place.eye, ray).unwrap_or(0.0).min(most));
        seen.iter().sum::<f32>()
    };
    let turns = (0..HEADINGS).map(|number| TAU * number as f32 / HEADINGS as f32);
    let views = turns.map(|turn| (view(turn), turn));
    let best = views.reduce(|best, next| if next.0 > best.0 { next } else { best });
    heading(best.map_or(0.0, |(_, turn)| turn))
}

/// Directions that are spread evenly over the sphere.
fn direction(number: usize) -> Vec3 {
    let y = 1.0 - (2.0 * number as f32 + 1.0) / DIRECTIONS as f32;
    let turn = number as f32 * 2.399_963;
    let level = (1.0 - y * y).sqrt();
    Vec3::new(level * turn.cos(), y, level * turn.sin())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Material, Mesh};

    /// Axis-aligned boxes that are seen from inside.
    fn boxes(in_metres: bool, boxes: &[[[f32; 3]; 2]], double_sided: bool) -> Scene {
        let mut mesh = Mesh::default();
        for [low, high] in boxes {
            let first = mesh.positions.len() as u32;
            let corner = |i: usize| {
                Vec3::from([0, 1, 2].map(|a| if i >> a & 1 == 0 { low[a] } else { high[a] }))
            };
            mesh.positions.extend((0..8).map(corner));
            // Counter-clockwise from inside.
            for [a, b, c, d] in [
                [0, 4, 6, 2],
                [1, 3, 7, 5],
                [0, 1, 5, 4],
                [2, 6, 7, 3],
                [0, 2, 3, 1],
                [4, 5, 7, 6],
            ] {
                mesh.indices.extend([a, c, b, a, d, c].map(|i| first + i));
            }
        }
        let material = Material {
            double_sided,
            ..Material::default()
        };
        Scene {
            in_metres,
            meshes: vec![mesh],
            materials: vec![material],
            instances: vec![Instance {
                mesh: 0,
                transform: glam::Affine3A::IDENTITY,
            }],
            ..Scene::default()
        }
    }

    const ROOM: [[f32; 3]; 2] = [[-2.0, 0.0, -4.0], [2.0, 3.0, 4.0]];
    const SKY: [[f32; 3]; 2] = [[-500.0; 3], [500.0; 3]];

    #[test]
    fn a_room_is_seen_from_inside_at_eye_height_with_or_without_a_sky() {
        for parts in [&[ROOM][..], &[ROOM, SKY], &[SKY, ROOM]] {
            for double_sided in [false, true] {
                let camera = default_camera(&boxes(true, parts, double_sided));
                assert!((camera.eye.y - 1.6).abs() < 1e-4, "{camera:?}");
                assert!(
                    camera.eye.x.abs() < 2.0 && camera.eye.z.abs() < 4.0,
                    "{camera:?}"
                );
                let ahead = (camera.target - camera.eye).normalize();
                assert!(ahead.z.abs() > 0.9, "along the room: {camera:?}");
                assert!(camera.near <= 0.05 && camera.far == f32::INFINITY);
            }
        }
    }

    #[test]
    fn the_inside_of_a_solid_and_low_things_are_seen_from_outside() {
        let mut solid = boxes(true, &[ROOM], false);
        solid.meshes[0]
            .indices
            .chunks_exact_mut(3)
            .for_each(|t| t.swap(1, 2));
        let low = boxes(true, &[[[-2.0, 0.0, -4.0], [2.0, 1.0, 4.0]]], true);
        for scene in [solid, low, Scene::default()] {
            let camera = default_camera(&scene);
            assert_eq!(camera, around(&scene, 8)[0]);
            let (low, high) = scene.bounds().unwrap_or((-Vec3::ONE, Vec3::ONE));
            let radius = (high - low).length() / 2.0;
            assert!(
                camera.eye.distance((low + high) / 2.0) > radius,
                "{camera:?}"
            );
        }
    }

    #[test]
    fn a_file_without_a_unit_has_planes_by_its_size() {
        let room = ROOM.map(|corner| corner.map(|v| v * 100.0));
        let camera = default_camera(&boxes(false, &[room], true));
        assert!(camera.eye.y > 50.0 && camera.eye.y < 250.0, "{camera:?}");
        let small = boxes(true, &[[[-0.01; 3], [0.01; 3]]], true);
        let camera = default_camera(&small);
        assert!(camera.near < 2e-4, "{camera:?}");
        let flat = boxes(true, &[[[-200.0, 0.0, -200.0], [200.0, 0.0, 200.0]]], true);
        assert_eq!(default_camera(&flat).near, 0.05);
    }

    #[test]
    fn views_around_stand_apart_and_look_at_the_middle() {
        let scene = boxes(true, &[ROOM], true);
        let views = around(&scene, 8);
        assert_eq!(views.len(), 8);
        for (a, b) in views.iter().zip(views.iter().cycle().skip(1)) {
            let angle = (a.eye - a.target)
                .with_y(0.0)
                .angle_between((b.eye - b.target).with_y(0.0));
            assert!((angle - TAU / 8.0).abs() < 1e-3);
            assert_eq!(a.target, b.target);
        }
    }
}
