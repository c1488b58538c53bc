//! Culling of 100,000 draws for a stereo frame, on one core.

use criterion::{Criterion, criterion_group, criterion_main};
use formats::view::Lens;
use glam::Vec3;
use scene::{Camera, cameras, hmd};
use std::hint::black_box;
use visibility::{Culling, Eye, Hierarchy, Rig, Scratch};

const HALL: [Vec3; 2] = [
    Vec3::new(-100.0, 0.0, -100.0),
    Vec3::new(100.0, 12.0, 100.0),
];
const BEHIND: [Vec3; 2] = [
    Vec3::new(-100.0, 0.0, 100.0),
    Vec3::new(100.0, 12.0, 2000.0),
];

/// Randomly placed boxes of 0.1 to 2 m, most of them small, in a room.
fn boxes(count: usize, [low, high]: [Vec3; 2]) -> Vec<[Vec3; 2]> {
    let mut state = 1_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f32 / 16_777_216.0
    };
    (0..count)
        .map(|_| {
            let t = Vec3::new(random(), random(), random());
            let corner = low + t * (high - low);
            let size = Vec3::new(random(), random(), random()) * (0.1 + 1.9 * random().powi(4));
            [corner, corner + size]
        })
        .collect()
}

/// A head in the middle of the hall, looking along it.
fn rig() -> Rig {
    let hmd = hmd::preset(hmd::PRESETS[0]).unwrap();
    let camera = Camera {
        name: String::new(),
        eye: Vec3::new(0.0, 1.7, 0.0),
        target: Vec3::new(0.3, 1.6, -1.0),
        up: Vec3::Y,
        vfov_deg: 60.0,
        near: 0.1,
        far: 500.0,
    };
    let eyes = cameras::eye_views(&camera, &hmd).into_iter().zip(&hmd.fov);
    Rig::new(
        eyes.map(|(view, fov)| Eye {
            view,
            lens: Lens::of(fov),
            size_px: hmd.eye_size_px,
        })
        .collect(),
    )
}

fn culling(c: &mut Criterion) {
    let rig = rig();
    let (mut scratch, mut list) = (Scratch::default(), Vec::new());
    let hall = boxes(100_000, HALL);
    let tree = Hierarchy::new(&hall);
    for technique in Culling::all() {
        let tests = tree
            .cull(&rig, technique, 0, &mut scratch, &mut list)
            .unwrap();
        println!("{technique}: {tests} tests, {} draws kept", list.len());
        c.bench_function(&format!("100000 draws, {technique}"), |b| {
            b.iter(|| {
                let tests = tree.cull(&rig, technique, 0, &mut scratch, &mut list);
                black_box(tests.unwrap())
            });
        });
    }
    let more = [hall.clone(), boxes(900_000, BEHIND)].concat();
    let tree = Hierarchy::new(&more);
    c.bench_function("1000000 draws, 900000 behind the viewer, per-eye", |b| {
        b.iter(|| {
            let tests = tree.cull(&rig, Culling::PER_EYE, 0, &mut scratch, &mut list);
            black_box(tests.unwrap())
        });
    });
    let mut moving = Hierarchy::new(&hall);
    c.bench_function("refit of 1000 of 100000 draws", |b| {
        b.iter(|| {
            let moved = (0..1000).map(|i| (100 * i, hall[100 * i as usize]));
            moving.refit(moved);
        });
    });
    c.bench_function("build over 100000 draws", |b| {
        b.iter(|| Hierarchy::new(&hall))
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(50);
    targets = culling
}
criterion_main!(benches);
