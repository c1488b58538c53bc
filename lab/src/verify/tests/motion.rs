//! Compares moving draws with a static scene in the same pose.

use super::{BOTH, SIZE_PX, baseline, driver, job, many_instances, views};
use glam::Vec3;
use raster::backend::CaptureBackend;
use raster::capture::Pictures;
use raster::draws::DrawList;
use raster::lavapipe::Lavapipe;
use scene::{AlphaMode, Motion, Movement, Scene};

/// Every third instance slides, every seventh rotates.
fn moving_scene() -> Scene {
    let mut scene = many_instances(AlphaMode::Opaque);
    scene.light_if_unlit();
    let every = |n: usize| (0..scene.instances.len()).filter(move |i| i % 21 == n);
    scene.motions = vec![
        Motion {
            instances: every(0).chain(every(3)).chain(every(6)).collect(),
            movements: vec![Movement::Shuttle {
                by: Vec3::new(2.0, 1.0, -1.0),
                period_s: 2.0,
                phase: 0.1,
            }],
        },
        Motion {
            instances: every(7).chain(every(14)).collect(),
            movements: vec![Movement::Turn {
                pivot: Vec3::new(0.0, 0.0, -8.0),
                axis: Vec3::Z,
                turns_per_s: 0.3,
            }],
        },
    ];
    scene
}

fn pictures(scene: &Scene, draws: &DrawList, backend: &mut Lavapipe) -> Pictures {
    let planner = baseline(SIZE_PX, BOTH);
    let job = job(scene, draws, &planner);
    let frame = job.frame(&views(scene, SIZE_PX)).unwrap();
    job.plain_frame(backend, &frame).unwrap().0
}

#[test]
fn what_has_moved_looks_as_if_it_had_always_stood_there() {
    let scene = moving_scene();
    let mut draws = DrawList::new(&scene, 0).unwrap();
    let mut moved = driver(&scene, &draws, SIZE_PX);
    let mut seen: Vec<Pictures> = Vec::new();
    for time_s in [0.0, 0.4, 1.3, 0.0] {
        let before = moved.work().bytes_uploaded;
        draws.pose(&scene, time_s);
        moved.pose(&scene, &draws);
        // 128 bytes per moving draw, and none for the others.
        let uploaded = moved.work().bytes_uploaded - before;
        assert_eq!(uploaded, 128 * draws.moving.len() as u64);
        let mut there = scene.clone();
        there.pose(time_s);
        there.motions.clear();
        let still = DrawList::new(&there, 0).unwrap();
        let expected = pictures(&there, &still, &mut driver(&there, &still, SIZE_PX));
        let found = pictures(&scene, &draws, &mut moved);
        assert!(found == expected, "{time_s} s");
        seen.push(found);
    }
    let differ = |a: usize, b: usize| seen[a] != seen[b];
    let found = [differ(0, 3), differ(0, 1), differ(1, 2)];
    assert_eq!(found, [false, true, true], "{} move", draws.moving.len());
}

#[test]
fn nothing_is_uploaded_of_a_scene_that_stands_still() {
    let scene = many_instances(AlphaMode::Opaque);
    let mut draws = DrawList::new(&scene, 0).unwrap();
    let mut backend = driver(&scene, &draws, SIZE_PX);
    draws.pose(&scene, 1.0);
    backend.pose(&scene, &draws);
    assert_eq!(backend.work().bytes_uploaded, 0);
}
