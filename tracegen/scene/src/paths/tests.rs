//! Paths against hand computations, and the errors for invalid files.

use super::head::{PITCH, ROLL, YAW, sum};
use super::*;
use crate::cameras::tests::camera;
use glam::{Mat3, Quat, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

fn looking(eye: Vec3, direction: Vec3) -> Camera {
    Camera {
        eye,
        target: eye + direction,
        ..camera()
    }
}

/// A file that exists as long as its folder.
fn file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn open_csv(text: &str, origin: PathOrigin) -> HeadPath {
    let (_folder, path) = file("path.csv", text);
    HeadPath::open(&PathSpec::Poses(path), Some(origin))
        .unwrap()
        .0
}

fn close(a: impl Into<Vec3>, b: impl Into<Vec3>) {
    let (a, b) = (a.into(), b.into());
    assert!((a - b).length() < 1e-5, "{a} {b}");
}

const HEADER: &str = "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n";

#[test]
fn the_walk_starts_at_the_camera_and_goes_ahead() {
    let start = camera();
    assert_eq!(walk::camera_at(&start, 0.0), start);
    let later = walk::camera_at(&start, 36.0 / 72.0);
    // Half a second: a quarter of the sway's two-second period, 20 cm ahead.
    close(later.eye - start.eye, Vec3::new(0.05, 0.0, -0.2));
    assert_eq!(later.target - later.eye, start.target - start.eye);
}

#[test]
fn a_path_is_a_models_name_or_a_file() {
    let of = |text: &str| text.parse::<PathSpec>().unwrap();
    assert_eq!(of("walk"), PathSpec::Walk);
    assert_eq!(of("head"), PathSpec::Head);
    assert_eq!(of("a/b.CSV"), PathSpec::Poses("a/b.CSV".into()));
    assert_eq!(of("a#1.glb"), PathSpec::Gltf("a#1.glb".into(), None));
    let camera = Some("cam 1".to_owned());
    assert_eq!(
        of("a#1.gltf#cam 1"),
        PathSpec::Gltf("a#1.gltf".into(), camera)
    );
    for bad in ["", "run", "a.obj", "a.gltf#", "#x", "a.csv#x"] {
        assert!(bad.parse::<PathSpec>().is_err(), "{bad}");
    }
}

#[test]
fn the_head_model_starts_at_the_camera_and_stays_within_its_figures() {
    let camera = looking(Vec3::new(4.0, 1.7, -2.0), Vec3::new(0.3, -0.2, 1.0));
    let fps = 1000.0;
    let moments = Moments {
        frames: 0..MAX_FRAMES,
        fps,
        scene_start_s: 0.0,
    };
    let poses: Vec<Affine3A> = [0, 1, 2, 3, 4, 5]
        .iter()
        .flat_map(|part: &u32| {
            let frames = part * 10_000..(part + 1) * 10_000;
            HeadPath::Head
                .poses(
                    &camera,
                    &Moments {
                        frames,
                        ..moments.clone()
                    },
                )
                .unwrap()
        })
        .collect();
    let start = head_pose(&camera);
    close(poses[0].translation, start.translation);
    assert!(poses[0].matrix3.abs_diff_eq(start.matrix3, 1e-5));
    let quat = |pose: &Affine3A| glam::DQuat::from_mat3(&Mat3::from(pose.matrix3).as_dmat3());
    let mut speeds: Vec<f64> = Vec::new();
    let (mut fastest_m_per_s, mut widest, mut reach_m) = (0.0f32, [0.0f32; 3], 0.0f32);
    for pair in poses.windows(10).step_by(10) {
        let (a, b) = (&pair[0], &pair[9]);
        let dt = 9.0 / fps;
        let turned = quat(a).angle_between(quat(b)).to_degrees();
        speeds.push(turned / f64::from(dt));
        let moved = (b.translation - a.translation).length();
        fastest_m_per_s = fastest_m_per_s.max(moved / dt);
        reach_m = reach_m.max((b.translation - start.translation).length());
    }
    for i in 0..60_000u32 {
        let t = i as f32 / fps;
        for (widest, waves) in widest.iter_mut().zip([&YAW[..], &PITCH[..], &ROLL[..]]) {
            *widest = widest.max(sum(waves, t).abs());
        }
    }
    speeds.sort_by(f64::total_cmp);
    let (median, peak) = (speeds[speeds.len() / 2], speeds[speeds.len() - 1]);
    println!("{median} {peak} deg/s, {fastest_m_per_s} m/s, {widest:?} deg, {reach_m} m");
    // The figures of the module's documentation.
    assert!((100.0..=120.0).contains(&peak), "{peak}");
    assert!((40.0..50.0).contains(&median), "{median}");
    assert!(
        widest[0] <= 38.0 && widest[1] <= 18.0 && widest[2] <= 7.0,
        "{widest:?}"
    );
    assert!(
        fastest_m_per_s <= 0.5 && reach_m < 0.15,
        "{fastest_m_per_s} {reach_m}"
    );
}

#[test]
fn recorded_poses_are_interpolated_at_the_frames_times() {
    // A quarter turn to the left in one second while the head moves 2 m along x. Times start at an
    // arbitrary value.
    let half = FRAC_PI_4;
    let text = format!(
        "\u{feff}{HEADER}100.0,0,0,0,0,0,0,1\r\n101.0, 2,0,0, 0,{},0,{}\r\n\r\n",
        half.sin(),
        half.cos()
    );
    let path = open_csv(&text, PathOrigin::World);
    let moments = Moments {
        frames: 0..5,
        fps: 4.0,
        scene_start_s: 0.0,
    };
    let poses = path.poses(&camera(), &moments).unwrap();
    for (k, pose) in (0u8..).zip(&poses) {
        let t = f32::from(k) / 4.0;
        close(pose.translation, Vec3::X * 2.0 * t);
        let (sin, cos) = (FRAC_PI_2 * t).sin_cos();
        close(pose.matrix3.z_axis, Vec3::new(sin, 0.0, cos));
    }
    let start = path.start(&camera()).unwrap();
    assert_eq!((start.eye, start.target), (Vec3::ZERO, Vec3::NEG_Z));
    assert_eq!(start.near, camera().near);
    // The same frames from the third on.
    let later = Moments {
        frames: 2..5,
        ..moments
    };
    assert_eq!(path.poses(&camera(), &later).unwrap(), poses[2..]);
}

#[test]
fn a_path_from_the_camera_takes_its_place_and_heading_and_keeps_its_pitch() {
    // Looks along -x and down by 30 degrees, then moves a metre in that direction.
    let q = Quat::from_rotation_y(FRAC_PI_2) * Quat::from_rotation_x(-30f32.to_radians());
    let [x, y, z, w] = q.to_array();
    let text = format!("{HEADER}0,5,1,5,{x},{y},{z},{w}\n1,4,1,5,{x},{y},{z},{w}\n");
    let path = open_csv(&text, PathOrigin::Camera);
    let camera = looking(Vec3::new(9.0, 1.6, 0.0), Vec3::new(0.0, 0.4, 1.0));
    let moments = Moments {
        frames: 0..2,
        fps: 1.0,
        scene_start_s: 0.0,
    };
    let poses = path.poses(&camera, &moments).unwrap();
    close(poses[0].translation, camera.eye);
    close(poses[1].translation, camera.eye + Vec3::Z);
    let down = 30f32.to_radians();
    for pose in &poses {
        close(
            -pose.matrix3.z_axis,
            Vec3::new(0.0, -down.sin(), down.cos()),
        );
    }
    assert_eq!(path.start(&camera).unwrap(), camera);
}

#[test]
fn a_path_and_scene_far_from_zero_give_the_poses_of_those_at_zero() {
    let text = |far: f64| {
        let row = |t: f64, x: f64| format!("{t},{},{},{far},0,0.6,0,0.8\n", far + x, far - 0.25);
        format!("{HEADER}{}{}", row(0.0, 0.5), row(1.0, 0.75))
    };
    let moments = Moments {
        frames: 0..5,
        fps: 4.0,
        scene_start_s: 0.0,
    };
    for origin in [PathOrigin::World, PathOrigin::Camera] {
        let [near, far] = [0.0, 1e7].map(|far| {
            let path = open_csv(&text(far), origin).relative_to(DVec3::splat(far));
            path.poses(&camera(), &moments).unwrap()
        });
        assert_eq!(near, far, "{origin:?}");
    }
}

#[test]
fn a_head_that_looks_straight_up_or_down_has_a_heading() {
    for (direction, up) in [(Vec3::Y, Vec3::Z), (Vec3::NEG_Y, Vec3::NEG_Z)] {
        // Both are bent away from looking along -z.
        let pose = head_pose(&Camera {
            up,
            ..looking(Vec3::ZERO, direction)
        });
        let pose = pose.as_daffine3();
        assert!(
            heading(&pose).abs() < 1e-5,
            "{direction}: {}",
            heading(&pose)
        );
    }
    let left = head_pose(&looking(Vec3::ZERO, Vec3::NEG_X));
    assert!((heading(&left.as_daffine3()) - f64::from(FRAC_PI_2)).abs() < 1e-5);
}

#[test]
fn frames_after_the_end_of_a_file_are_refused() {
    let path = open_csv(
        &format!("{HEADER}0,0,0,0,0,0,0,1\n0.5,0,0,0,0,0,0,1\n"),
        PathOrigin::Camera,
    );
    assert!(path.poses(&camera(), &Moments::first(37)).is_ok());
    let error = path.poses(&camera(), &Moments::first(38)).unwrap_err();
    let error = error.to_string();
    let expected = "expected at most 37 frames: it lasts 0.500 s, at 72 frames a second, found 38";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn an_invalid_path_file_is_refused_with_line_and_column() {
    let good = "0,0,0,0,0,0,0,1\n";
    for (text, parts) in [
        (
            String::new(),
            ["line 1", "time_s,x_m,y_m,z_m,qx,qy,qz,qw", "found ''"],
        ),
        (
            "time_s,x_m\n0,1\n".into(),
            ["line 1", "qx,qy", "'time_s,x_m'"],
        ),
        (
            HEADER.into(),
            ["line 2", "at least one row", "end of the file"],
        ),
        (
            format!("{HEADER}{good}1,nan,0,0,0,0,0,1\n"),
            ["line 3, column x_m", "finite", "'nan'"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,inf,0,1\n"),
            ["line 2, column qy", "finite", "'inf'"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,0,one\n"),
            ["line 2, column qw", "finite", "'one'"],
        ),
        (
            format!("{HEADER}0,0,,0,0,0,0,1\n"),
            ["line 2, column y_m", "finite", "''"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,0\n"),
            ["line 2, column qw", "a number", "end of the line"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,0,1,5,6\n"),
            ["line 2", "8 columns", "found 10"],
        ),
        (
            format!("{HEADER}{good}\n{good}"),
            ["line 3, column time_s", "finite", "''"],
        ),
        (
            format!("{HEADER}{good}{good}"),
            ["line 3, column time_s", "after", "before's, 0, found 0"],
        ),
        (
            format!("{HEADER}{good}-1,0,0,0,0,0,0,1\n"),
            ["line 3, column time_s", "after", "found -1"],
        ),
        (
            format!("{HEADER}1e300,0,0,0,0,0,0,1\n"),
            ["line 2, column time_s", "1000000000000", "1000"],
        ),
        (
            format!("{HEADER}0,0,2e9,0,0,0,0,1\n"),
            ["line 2, columns x_m to z_m", "1000000000 m", "2000000000"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,0,0\n"),
            ["line 2, columns qx to qw", "unit", "length 0"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,1,1\n"),
            ["line 2, columns qx to qw", "unit", "length 1.41"],
        ),
        (
            format!("{HEADER}0,0,0,0,0,0,1e200,1e200\n"),
            ["line 2, columns", "unit", "length inf"],
        ),
    ] {
        let (_folder, path) = file("path.csv", &text);
        let error = PoseTrack::read(&path).unwrap_err().to_string();
        assert!(error.contains("path.csv: line"), "{error}");
        for part in parts {
            assert!(error.contains(part), "{text:?}: no {part:?} in {error}");
        }
    }
    let (_folder, path) = file("path.csv", "");
    std::fs::write(&path, [b't', 0xff]).unwrap();
    let error = PoseTrack::read(&path).unwrap_err().to_string();
    assert!(error.contains("byte 1: expected UTF-8 text"), "{error}");
    let opened = std::fs::File::create(&path).unwrap();
    opened.set_len(table::MAX_BYTES + 1).unwrap();
    let error = PoseTrack::read(&path).unwrap_err().to_string();
    assert!(error.contains("at most 16777216 bytes"), "{error}");
}

#[test]
fn gazes_are_read_and_their_range_is_checked() {
    let (_folder, path) = file("gaze.csv", "time_s,x_deg,y_deg\n3,0,10\n4,20,-10.5\n");
    let rows = read_gazes(&path).unwrap();
    let last = GazeRow {
        time_s: 1.0,
        x_deg: 20.0,
        y_deg: -10.5,
    };
    assert_eq!((rows.len(), rows[0].time_s, rows[1]), (2, 0.0, last));
    for (row, parts) in [
        (
            "0,NaN,0",
            ["line 2, column x_deg", "finite number", "'NaN'"],
        ),
        (
            "0,0,-90",
            ["line 2, column y_deg", "less than 90 degrees", "found -90"],
        ),
    ] {
        let (_folder, path) = file("gaze.csv", &format!("time_s,x_deg,y_deg\n{row}\n"));
        let error = read_gazes(&path).unwrap_err().to_string();
        for part in parts {
            assert!(error.contains(part), "no {part:?} in {error}");
        }
    }
}
