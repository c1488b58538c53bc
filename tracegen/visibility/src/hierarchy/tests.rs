use super::*;
use crate::culling::Culling;
use crate::testing::{between, rig, within};
use crate::volume::{Prepared, Volume, frustum};
use formats::random::Random;
use formats::view::FovTangents;
use glam::Mat4;
use glam::camera::rh::proj::directx::perspective;

fn field(count: usize, seed: u64) -> Vec<[Vec3; 2]> {
    let mut random = Random(seed);
    let room = [Vec3::splat(-50.0), Vec3::splat(50.0)];
    (0..count)
        .map(|_| {
            let low = within(&mut random, room);
            // A few large boxes and many small ones.
            let size = 0.1 + 4.0 * random.unit_f32().powi(6);
            [
                low,
                low + Vec3::new(random.unit_f32(), random.unit_f32(), random.unit_f32()) * size,
            ]
        })
        .collect()
}

fn list(tree: &Hierarchy, volume: &Volume) -> (Vec<u32>, u64) {
    let mut list = Vec::new();
    let prepared = volume.prepare(tree.extent());
    let tests = tree.collect(&[prepared], &mut Scratch::default(), &mut list);
    (list, tests)
}

/// Tests every box separately.
fn one_by_one(bounds: &[[Vec3; 2]], prepared: &Prepared) -> Vec<u32> {
    let kept = |bounds: &[Vec3; 2]| {
        let corners = bounds.map(|corner| corner.to_array().map(Vec4::splat));
        prepared.test(&corners, prepared.sides()).outside == 0
    };
    (0..)
        .zip(bounds)
        .filter(|(_, b)| kept(b))
        .map(|(draw, _)| draw)
        .collect()
}

fn views() -> impl Iterator<Item = Mat4> {
    let mut random = Random(5);
    (0..40).map(move |_| {
        let eye = within(&mut random, [Vec3::splat(-60.0), Vec3::splat(60.0)]);
        let direction = within(&mut random, [Vec3::NEG_ONE, Vec3::ONE]).normalize();
        perspective(
            between(&mut random, 0.3, 2.4),
            between(&mut random, 0.5, 2.0),
            0.1,
            80.0,
        ) * glam::camera::rh::view::look_at_mat4(eye, eye + direction, Vec3::Y)
    })
}

#[test]
fn the_tree_finds_the_same_draws_as_testing_every_box() {
    for count in [0, 1, 2, 3, 4, 5, 17, 64, 1000, 5000] {
        let bounds = field(count, 1);
        let tree = Hierarchy::new(&bounds);
        assert_eq!(tree.len(), count);
        for clip in views() {
            let volume = Volume::new(frustum(clip, tree.extent()), None);
            let expected = one_by_one(&bounds, &volume.prepare(tree.extent()));
            let (found, tests) = list(&tree, &volume);
            assert_eq!(found, expected);
            // The tree also tests the boxes of its nodes, which are a third of the draws.
            assert!(
                tests as usize <= count + count / 2 + 4,
                "{tests} of {count}"
            );
        }
    }
}

#[test]
fn a_refitted_tree_finds_the_same_draws_as_a_new_one() {
    let mut bounds = field(3000, 2);
    let mut tree = Hierarchy::new(&bounds);
    let mut random = Random(6);
    for (round, clip) in views().enumerate() {
        let moved: Vec<u32> = (0..50)
            .map(|_| (random.unit_f32() * 2999.0) as u32)
            .collect();
        for &draw in &moved {
            let by = within(&mut random, [Vec3::splat(-20.0), Vec3::splat(20.0)]);
            bounds[draw as usize] = bounds[draw as usize].map(|corner| corner + by);
        }
        // The same draw twice: the last bounds apply.
        tree.refit(moved.iter().map(|&draw| (draw, bounds[draw as usize])));
        let anew = Hierarchy::new(&bounds);
        assert_eq!(tree.extent(), anew.extent(), "round {round}");
        let volume = Volume::new(frustum(clip, tree.extent()), None);
        assert_eq!(
            list(&tree, &volume).0,
            list(&anew, &volume).0,
            "round {round}"
        );
    }
}

#[test]
fn draws_without_finite_bounds_are_always_found() {
    let mut bounds = field(100, 3);
    bounds[7] = [Vec3::NAN; 2];
    bounds[50] = [Vec3::NEG_INFINITY, Vec3::INFINITY];
    let mut tree = Hierarchy::new(&bounds);
    let away = Mat4::from_translation(Vec3::splat(1e5));
    let nothing = perspective(1.0, 1.0, 0.1, 10.0) * away;
    let volume = Volume::new(frustum(nothing, tree.extent()), None);
    assert_eq!(list(&tree, &volume).0, [7, 50]);
    tree.refit([(3, [Vec3::NAN; 2]), (7, [Vec3::ZERO; 2])]);
    assert_eq!(list(&tree, &volume).0, [3, 7, 50]);
}

#[test]
fn ten_times_as_many_draws_behind_the_viewer_add_at_most_a_third_of_the_tests() {
    let mut random = Random(8);
    let mut boxes = |count: usize, room: [Vec3; 2]| {
        let around = |p: Vec3| [p - Vec3::splat(0.2), p + Vec3::splat(0.2)];
        (0..count)
            .map(|_| around(within(&mut random, room)))
            .collect::<Vec<_>>()
    };
    let ahead = [Vec3::new(-30.0, -5.0, -60.0), Vec3::new(30.0, 5.0, 0.0)];
    let behind = [Vec3::new(-30.0, -5.0, 1.0), Vec3::new(30.0, 5.0, 600.0)];
    let seen = boxes(2000, ahead);
    let fov = FovTangents::new(1.2, 1.2, 1.2, 1.2);
    let rig = rig([fov; 2], 0.064, 0.0, 0.1, 100.0);
    let mut tests = |hidden: usize| {
        let tree = Hierarchy::new(&[seen.clone(), boxes(hidden, behind)].concat());
        let (mut scratch, mut list) = (Scratch::default(), Vec::new());
        tree.cull(&rig, Culling::PER_EYE, 0, &mut scratch, &mut list)
            .unwrap()
    };
    let [few, many] = [2_000, 20_000].map(&mut tests);
    assert!(many as f64 <= 1.3 * few as f64, "{few} and {many} tests");
}
