//! Matrices against hand computations and the field's disparity formula.

use super::*;
use crate::hmd::{self, disparity_px};
use glam::Vec2;

pub(crate) fn camera() -> Camera {
    Camera {
        name: "test".into(),
        eye: Vec3::new(1.0, 2.0, 3.0),
        target: Vec3::new(1.0, 2.0, -7.0),
        up: Vec3::Y,
        vfov_deg: 60.0,
        near: 0.1,
        far: 100.0,
    }
}

fn clip(view: &EyeView, point: Vec4) -> Vec4 {
    view.clip_from_world() * point
}

/// Pixel coordinates of a homogeneous world point (w = 0 is a direction: a point at infinity).
fn pixel(view: &EyeView, hmd: &Hmd, point: Vec4) -> Vec2 {
    let clip = clip(view, point);
    let ndc = clip.truncate() / clip.w;
    let size = Vec2::new(hmd.eye_size_px[0] as f32, hmd.eye_size_px[1] as f32);
    Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) * 0.5 * size
}

#[test]
fn infinity_straight_ahead_is_at_the_centre_of_both_symmetric_eyes() {
    let hmd = hmd::preset("symmetric-100").unwrap();
    for view in eye_views(&camera(), &hmd) {
        let at = pixel(&view, &hmd, Vec4::new(0.0, 0.0, -1.0, 0.0));
        assert!((at - Vec2::new(480.0, 540.0)).length() < 1e-3, "{at}");
    }
}

#[test]
fn disparity_is_width_over_two_tan_times_ipd_over_depth() {
    let hmd = hmd::preset("symmetric-100").unwrap();
    let [left, right] = eye_views(&camera(), &hmd);
    for depth in [0.5f32, 2.0, 7.5, 60.0] {
        let point = (camera().eye - Vec3::Z * depth).extend(1.0);
        let measured = pixel(&left, &hmd, point).x - pixel(&right, &hmd, point).x;
        let formula = 960.0 / (2.0 * 50f32.to_radians().tan()) * 0.064 / depth;
        assert!(
            (measured - formula).abs() < 2e-3,
            "{depth}: {measured} against {formula}"
        );
        assert!((disparity_px(&hmd, depth) - formula).abs() < 1e-3);
    }
}

#[test]
fn the_projection_matches_a_hand_computation() {
    let fov = FovTangents::new(1.0, 0.5, 2.0, 1.0);
    let m = projection(&fov, 1.0, 3.0);
    let ndc = |p: Vec3| m.project_point3(p);
    // The corners of the near and far planes, and depth at 2: n (f - z) / (z (f - n)) = 0.25.
    for (point, expected) in [
        (Vec3::new(-1.0, 2.0, -1.0), Vec3::new(-1.0, 1.0, 1.0)),
        (Vec3::new(0.5, -1.0, -1.0), Vec3::new(1.0, -1.0, 1.0)),
        (Vec3::new(1.5, 6.0, -3.0), Vec3::new(1.0, 1.0, 0.0)),
        (Vec3::new(-0.5, 1.0, -2.0), Vec3::new(0.0, 0.0, 0.25)),
    ] {
        assert!(
            (ndc(point) - expected).length() < 1e-5,
            "{} {expected}",
            ndc(point)
        );
    }
}

#[test]
fn a_far_plane_at_infinity_keeps_relative_steps_of_depth_at_every_distance() {
    let fov = hmd::preset("symmetric-100").unwrap().fov[0];
    let [endless, far_away] = [f32::INFINITY, 1e30].map(|far| projection(&fov, 0.05, far));
    assert!(endless.abs_diff_eq(far_away, 1e-30), "{endless} {far_away}");
    let depth = |z: f32| endless.project_point3(Vec3::new(0.3, -0.2, -z)).z;
    assert_eq!(depth(0.05), 1.0);
    assert!((depth(1e12) / 5e-14 - 1.0).abs() < 1e-6);
    // A millionth of the distance apart, whatever the distance.
    for z in [0.06, 1.0, 50.0, 3e3, 1e6, 1e9] {
        assert!(depth(z) > depth(z * 1.000_001), "{z}");
    }
}

#[test]
fn eyes_sit_half_the_ipd_to_each_side_of_the_camera() {
    let hmd = hmd::preset("symmetric-100").unwrap();
    let [left, right] = eye_views(&camera(), &hmd).map(|v| Vec3::from(v.position));
    assert!(
        (left - Vec3::new(0.968, 2.0, 3.0)).length() < 1e-6,
        "{left}"
    );
    assert!(
        (right - Vec3::new(1.032, 2.0, 3.0)).length() < 1e-6,
        "{right}"
    );
}

#[test]
fn asymmetric_eyes_move_infinity_by_the_offset_of_their_centres() {
    let hmd = hmd::preset("dk2").unwrap();
    let ahead = Vec4::new(0.0, 0.0, -1.0, 0.0);
    let [left, right] = eye_views(&camera(), &hmd).map(|v| pixel(&v, &hmd, ahead).x);
    // The axis is left / (left + right) of the width from the left edge.
    assert!((left - 960.0 * 1.06 / 2.15).abs() < 1e-3, "{left}");
    assert!((right - 960.0 * 1.09 / 2.15).abs() < 1e-3, "{right}");
}

#[test]
fn canted_eyes_turn_outwards() {
    let mut hmd = hmd::preset("symmetric-100").unwrap();
    hmd.cant_deg = 5.0;
    let [left, right] = eye_views(&camera(), &hmd);
    let turn = 5f32.to_radians();
    let outwards = |side: f32| Vec4::new(side * turn.sin(), 0.0, -turn.cos(), 0.0);
    for (view, side) in [(left, -1.0), (right, 1.0)] {
        let at = pixel(&view, &hmd, outwards(side));
        assert!((at - Vec2::new(480.0, 540.0)).length() < 1e-2, "{at}");
    }
}

#[test]
fn cameras_without_a_direction_are_refused() {
    let looks_at_itself = Camera {
        target: camera().eye,
        ..camera()
    };
    let up_along_view = Camera {
        up: Vec3::Z,
        ..camera()
    };
    let not_finite = Camera {
        eye: Vec3::NAN,
        ..camera()
    };
    let planes = Camera {
        near: 5.0,
        far: 1.0,
        ..camera()
    };
    for (bad, part) in [
        (looks_at_itself, "away from the eye"),
        (up_along_view, "up vector"),
        (not_finite, "finite"),
        (planes, "near < far"),
    ] {
        let error = validate(&bad).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert_eq!(validate(&camera()), Ok(()));
}

#[test]
fn cameras_are_found_with_and_without_their_prefix() {
    let named = |name: &str| Camera {
        name: name.into(),
        ..camera()
    };
    let scene = Scene {
        cameras: vec![named("cam_hall"), named("gallery"), named("cam_gallery")],
        ..Scene::default()
    };
    assert_eq!(find(&scene, None).unwrap().name, "cam_hall");
    assert_eq!(find(&scene, Some("hall")).unwrap().name, "cam_hall");
    assert_eq!(find(&scene, Some("gallery")).unwrap().name, "gallery");
    let error = find(&scene, Some("roof")).unwrap_err().to_string();
    assert!(
        error.contains("'roof'") && error.contains("cam_hall, gallery"),
        "{error}"
    );
}
