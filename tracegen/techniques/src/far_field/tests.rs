//! Compares the closed forms with random points, which are projected into both eyes and into the camera
//! between them.

use super::*;
use formats::random::Random;
use formats::view::FovTangents;
use glam::{EulerRot, Vec2, Vec3};

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.unit_f64()
}

/// Eyes at a distance of `ipd_m` and rotated outwards, for a head in an arbitrary pose; `fov` is the left
/// eye's.
fn eyes(fov: FovTangents, ipd_m: f64, cant_deg: f64, far_m: f64) -> [EyeView; 2] {
    let head = DMat4::from_translation(DVec3::new(3.0, 1.7, -2.0))
        * DMat4::from_euler(EulerRot::YXZ, 0.6, -0.2, 0.1);
    [-1.0, 1.0].map(|side: f64| {
        let pose = head
            * DMat4::from_translation(DVec3::new(side * ipd_m / 2.0, 0.0, 0.0))
            * DMat4::from_rotation_y(-side * cant_deg.to_radians());
        let [left, right] = if side < 0.0 {
            [fov.left, fov.right]
        } else {
            [fov.right, fov.left]
        };
        let near = 0.1;
        let plane = |tangent: f32| f64::from(tangent) * near;
        let mut projection = frustum(
            -plane(left),
            plane(right),
            -plane(fov.down),
            plane(fov.up),
            near,
            far_m,
        );
        projection.z_axis.z = near / (far_m - near);
        projection.w_axis.z = near * far_m / (far_m - near);
        EyeView {
            world_to_eye: pose.inverse().as_mat4().to_cols_array_2d(),
            eye_to_clip: projection.as_mat4().to_cols_array_2d(),
            position: pose.w_axis.truncate().as_vec3().to_array(),
        }
    })
}

fn fov(left: f32, right: f32, up: f32, down: f32) -> FovTangents {
    FovTangents::new(left, right, up, down)
}

const SIZE_PX: [u32; 2] = [960, 1080];

/// Parallel, asymmetric and canted displays.
fn displays() -> Vec<[EyeView; 2]> {
    vec![
        eyes(fov(1.19, 1.19, 1.34, 1.34), 0.064, 0.0, 200.0),
        eyes(fov(1.4, 1.25, 1.47, 1.46), 0.058, 0.0, 200.0),
        eyes(fov(1.2, 0.8, 0.9, 1.3), 0.07, 5.0, 200.0),
        eyes(fov(1.1, 1.1, 1.0, 1.0), 0.064, 12.0, 200.0),
    ]
}

/// A random point in an eye's picture between the split and the far plane, and its pixel.
fn point_beyond(stereo: &Stereo, eye: usize, split_m: f64, random: &mut Random) -> (DVec3, DVec2) {
    let e = &stereo.eyes[eye];
    let ndc = DVec2::new(between(random, -1.0, 1.0), between(random, -1.0, 1.0));
    let depth = 1.0 / between(random, 1.0 / (0.99 * e.far_m), 1.0 / split_m);
    let point = e
        .world_from_eye
        .transform_point3(e.tangents(ndc).extend(-1.0) * depth);
    let px = (ndc * DVec2::new(0.5, -0.5) + 0.5) * DVec2::from_array(stereo.size_px);
    (point, px)
}

/// Position of a point in the far field's picture, in pixels.
fn far_px(view: &FarView, point: DVec3) -> DVec3 {
    let clip = Mat4::from_cols_array_2d(&view.camera.eye_to_clip).as_dmat4()
        * Mat4::from_cols_array_2d(&view.camera.world_to_eye).as_dmat4();
    let ndc = clip.project_point3(point);
    let size = DVec2::new(view.size_px[0].into(), view.size_px[1].into());
    ((ndc.truncate() * DVec2::new(0.5, -0.5) + 0.5) * size).extend(ndc.z)
}

fn through(map: &Mat3, px: DVec2) -> DVec2 {
    let p = map.as_dmat3() * px.extend(1.0);
    p.truncate() / p.z
}

const VARIANTS: [Variant; 3] = [Variant::Plain, Variant::DepthShift, Variant::AlternateEye];

#[test]
fn the_largest_shift_beyond_the_split_is_close_to_the_prediction_and_not_above() {
    let mut random = Random(1);
    for (display, eyes) in displays().iter().enumerate() {
        for variant in VARIANTS {
            for frame in [0, 1] {
                let stereo = Stereo::new(eyes, SIZE_PX, variant, frame);
                for budget_px in [0.3, 1.0, 4.0] {
                    let split_m = stereo.split_m(budget_px);
                    let view = stereo.view(split_m, 8192).unwrap();
                    assert!(view.worst_shift_px <= budget_px, "{view:?}");
                    let mut worst = 0.0_f64;
                    for number in 0..4000 {
                        let eye = number % 2;
                        let (point, px) = point_beyond(&stereo, eye, split_m.into(), &mut random);
                        let drawn =
                            through(&view.eye_from_far_px[eye], far_px(&view, point).truncate());
                        worst = worst.max(drawn.distance(px));
                    }
                    let bound = f64::from(budget_px);
                    let place = format!("display {display} {variant:?} {budget_px} px: {worst}");
                    // Matrices of 32 bits are accurate to a hundredth of a pixel.
                    assert!(worst <= bound + 0.01, "{place}");
                    // The far plane ends the depth shift before infinity.
                    assert!(
                        worst >= 0.8 * bound * (1.0 - f64::from(split_m) / 200.0),
                        "{place}"
                    );
                }
            }
        }
    }
}

#[test]
fn parallel_eyes_have_the_published_split_and_shift() {
    let (width, tangent, ipd_m) = (1024.0_f32, 1.0_f32, 0.064_f32);
    let pair = eyes(fov(tangent, tangent, 1.0, 1.0), ipd_m.into(), 0.0, 1000.0);
    let plain = Stereo::new(&pair, [1024, 1024], Variant::Plain, 0);
    for budget_px in [0.5, 1.0, 2.0] {
        let expected = width * ipd_m / (4.0 * budget_px * tangent);
        let split_m = plain.split_m(budget_px);
        assert!(
            (split_m / expected - 1.0).abs() < 1e-4,
            "{split_m} {expected}"
        );
        // The distance from the eye is twice that from the midpoint.
        let alternate = Stereo::new(&pair, [1024, 1024], Variant::AlternateEye, 1);
        assert!((alternate.split_m(budget_px) / expected - 2.0).abs() < 2e-4);
    }
    // W = 1024, 90 degrees, 7.5 m: 4.4 pixels between the eyes, 2.2 from the middle.
    assert!((plain.worst_shift_px(7.5) - 2.18).abs() < 0.01);
    let split_m = 5.0;
    let shifted = Stereo::new(&pair, [1024, 1024], Variant::DepthShift, 0)
        .view(split_m, 8192)
        .unwrap();
    let unshifted = plain.view(split_m, 8192).unwrap();
    // The plane of the shift is at twice the split, so both the split and the largest error are halved.
    let ndc_shift = 1.0 / tangent * (ipd_m / 2.0) / (2.0 * split_m);
    let of_shift = Stereo::new(&pair, [1024, 1024], Variant::DepthShift, 0);
    assert!((of_shift.split_m(1.0) / plain.split_m(1.0) - 0.5).abs() < 1e-6);
    assert!((shifted.worst_shift_px / unshifted.worst_shift_px - 0.5).abs() < 1e-6);
    for (eye, sign) in [(0, -1.0), (1, 1.0)] {
        let px = DVec2::new(300.5, 200.5);
        let moved = through(&shifted.far_from_eye_px[eye], px)
            - through(&unshifted.far_from_eye_px[eye], px);
        let expected = sign * f64::from(ndc_shift * width / 2.0);
        assert!(
            (moved - DVec2::new(expected, 0.0)).length() < 1e-3,
            "{moved} {expected}"
        );
    }
}

#[test]
fn the_camera_contains_everything_visible_beyond_the_split() {
    let mut random = Random(2);
    for eyes in displays() {
        for variant in VARIANTS {
            let stereo = Stereo::new(&eyes, SIZE_PX, variant, 0);
            let view = stereo.view(3.0, 8192).unwrap();
            for number in 0..4000 {
                let (point, px) = point_beyond(&stereo, number % 2, 3.0, &mut random);
                for p in [
                    far_px(&view, point),
                    through(&view.far_from_eye_px[number % 2], px).extend(0.5),
                ] {
                    let inside = p.x >= 1.0
                        && p.y >= 1.0
                        && p.x <= f64::from(view.size_px[0]) - 1.0
                        && p.y <= f64::from(view.size_px[1]) - 1.0;
                    assert!(
                        inside && (0.0..=1.0).contains(&p.z),
                        "{variant:?}: {p} of {:?}",
                        view.size_px
                    );
                }
            }
        }
    }
}

#[test]
fn parallel_eyes_with_equal_views_map_to_whole_pixels() {
    let [pair, ..] = &displays()[..] else {
        unreachable!()
    };
    let view = Stereo::new(pair, SIZE_PX, Variant::Plain, 0)
        .view(5.0, 8192)
        .unwrap();
    for map in view.far_from_eye_px {
        let px = through(&map, DVec2::new(700.5, 900.5)) - 0.5;
        assert!((px - px.round()).length() < 1e-3, "{px}");
        assert!((through(&map, DVec2::new(701.5, 900.5)) - 0.5 - px - DVec2::X).length() < 1e-4);
    }
    // The size of the eyes' pictures, plus a margin for the disparity at the split.
    assert!((964..975).contains(&view.size_px[0]), "{:?}", view.size_px);
    assert_eq!(view.size_px[1], 1084);
}

#[test]
fn the_camera_has_at_least_as_many_pixels_per_angle_as_an_eye() {
    for (eyes, limit) in displays().iter().zip([1.001, 1.001, 1.1, 1.1]) {
        let view = Stereo::new(eyes, SIZE_PX, Variant::Plain, 0)
            .view(8.0, 8192)
            .unwrap();
        for (eye, view_of_eye) in eyes.iter().enumerate() {
            let e = Eye::new(view_of_eye);
            let scale = DVec2::from_array(SIZE_PX.map(f64::from));
            let ahead = e.clip_from_eye.project_point3(DVec3::NEG_Z).truncate();
            let px = (ahead * DVec2::new(0.5, -0.5) + 0.5) * scale;
            let [a, b] = [px, px + DVec2::X].map(|p| through(&view.far_from_eye_px[eye], p));
            assert!((0.999..limit).contains(&a.distance(b)), "{}", a.distance(b));
        }
    }
}

#[test]
fn maps_between_pixels_are_inverse_and_depth_is_converted() {
    let mut random = Random(3);
    for eyes in displays() {
        let stereo = Stereo::new(&eyes, SIZE_PX, Variant::DepthShift, 0);
        let view = stereo.view(4.0, 8192).unwrap();
        for (eye, view_of_eye) in eyes.iter().enumerate() {
            let (point, px) = point_beyond(&stereo, eye, 4.0, &mut random);
            let back = through(
                &view.eye_from_far_px[eye],
                through(&view.far_from_eye_px[eye], px),
            );
            assert!(back.distance(px) < 0.01);
            let clip = Mat4::from_cols_array_2d(&view.camera.eye_to_clip)
                * Mat4::from_cols_array_2d(&view.camera.world_to_eye);
            let far_ndc = clip.project_point3(point.as_vec3());
            let eye_ndc = view.eye_from_far_clip[eye].project_point3(far_ndc);
            let e = Mat4::from_cols_array_2d(&view_of_eye.eye_to_clip)
                * Mat4::from_cols_array_2d(&view_of_eye.world_to_eye);
            let expected: Vec3 = e.project_point3(point.as_vec3());
            assert!(
                (eye_ndc.z - expected.z).abs() < 1e-4,
                "{eye_ndc} {expected}"
            );
            assert!(Vec2::distance(eye_ndc.truncate(), expected.truncate()) < 1e-3);
        }
    }
}

#[test]
fn eyes_that_look_away_from_each_other_have_no_far_field() {
    let pair = eyes(fov(3.0, 3.0, 1.0, 1.0), 0.064, 40.0, 100.0);
    let error = Stereo::new(&pair, SIZE_PX, Variant::Plain, 0)
        .view(5.0, 8192)
        .unwrap_err();
    assert!(
        error.to_string().contains("less than 180 degrees"),
        "{error}"
    );
}

#[test]
fn eyes_at_one_place_have_a_split_at_zero_and_no_shift() {
    let pair = eyes(fov(1.0, 1.0, 1.0, 1.0), 0.0, 0.0, 100.0);
    let stereo = Stereo::new(&pair, SIZE_PX, Variant::Plain, 0);
    assert!(stereo.split_m(1.0) < 1e-5);
    assert!(stereo.worst_shift_px(0.5) < 1e-3);
}

#[test]
fn a_split_beyond_the_far_plane_gives_no_far_field_and_least_work_keeps_its_budget() {
    let [pair, ..] = &displays()[..] else {
        unreachable!()
    };
    let stereo = Stereo::new(pair, SIZE_PX, Variant::Plain, 0);
    let boxes = |near_m: f32| {
        let object = Object {
            near_m,
            far_m: near_m + 5.0,
            triangles: 3000,
            area_px: 9000.0,
        };
        move || vec![object; 200]
    };
    let view = |split, near_m| {
        let far_field = FarField {
            split,
            variant: Variant::Plain,
        };
        far_field.view(&stereo, 8192, boxes(near_m)).unwrap()
    };
    assert_eq!(view(Split::Metres(250.0), 5.0), None);
    assert_eq!(view(Split::Metres(0.01), 5.0).unwrap().split_m, 0.1);
    assert_eq!(view(Split::Metres(7.0), 5.0).unwrap().split_m, 7.0);
    let one_px = view(Split::Pixels(1.0), 5.0).unwrap().split_m;
    assert_eq!(one_px, stereo.split_m(1.0));
    let least = Split::LeastWork { within_px: 1.0 };
    assert_eq!(view(least, 50.0).unwrap().split_m, one_px);
    // For boxes from 10 m on, the area across the split equals that beyond it.
    let split_m = view(least, 10.0).map_or(f32::INFINITY, |view| view.split_m);
    assert!(split_m >= one_px, "{split_m}");
    assert_eq!(view(least, 1.0), None);
}
