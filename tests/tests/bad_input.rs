//! Bad input: exit code 2, one clear message, no panic, no file under the final name.

use parallax_tests::{program, refuse, root};
use std::fs;
use std::path::Path;

fn damaged(folder: &Path, change: impl FnOnce(&mut Vec<u8>)) -> std::path::PathBuf {
    let mut bytes = fs::read(root().join("traces/atrium-shadows.textrace")).expect("golden trace");
    change(&mut bytes);
    let path = folder.join("damaged.textrace");
    fs::write(&path, bytes).expect("temporary file");
    path
}

/// Flags that `replay run` refuses for a golden trace.
fn refuse_run(flags: &[&str], expected: &[&str]) {
    let trace = root().join("traces/atrium-shadows.textrace");
    let mut command = program("replay");
    refuse(command.arg("run").arg(&trace).args(flags), expected);
}

#[test]
fn a_missing_trace_is_named() {
    refuse(
        program("replay").args(["run", "no-such.textrace"]),
        &["no-such.textrace"],
    );
}

#[test]
fn a_truncated_trace_is_refused_by_every_reader() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for keep in [0, 7, 63, 1000] {
        let path = damaged(folder.path(), |bytes| bytes.truncate(keep));
        for subcommand in ["run", "info", "dump", "paper"] {
            refuse(
                program("replay").arg(subcommand).arg(&path),
                &["damaged.textrace"],
            );
        }
    }
}

#[test]
fn a_flipped_bit_in_the_quads_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = damaged(folder.path(), |bytes| {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
    });
    refuse(
        program("replay").arg("run").arg(&path),
        &["damaged.textrace"],
    );
}

#[test]
fn a_text_file_is_not_a_trace() {
    refuse(
        program("replay").arg("run").arg(root().join("Cargo.toml")),
        &["Cargo.toml"],
    );
}

#[test]
fn a_cache_whose_number_of_sets_is_not_a_power_of_two_is_refused() {
    let expected = ["L1", "power-of-two number of sets", "144"];
    refuse_run(&["--l1", "9KiB"], &expected);
}

#[test]
fn caches_that_exceed_the_memory_are_refused() {
    let trace = root().join("traces/atrium-shadows.textrace");
    let huge = ["--l1-ways", "255", "--l1", "65280MiB", "--cores", "64"];
    for command in ["run", "locality"] {
        let mut replay = program("replay");
        replay.arg(command).arg(&trace).args(huge);
        refuse(&mut replay, &["L1 cache", "at most 16777216 lines"]);
    }
    let mut locality = program("replay");
    locality.arg("locality").arg(&trace).args(["--l2", "32MiB"]);
    let expected = ["at most 2097152 for locality", "found 2098176"];
    refuse(&mut locality, &expected);
}

#[test]
fn an_unknown_order_is_refused_with_the_list_of_known_orders() {
    refuse_run(&["--order", "zz"], &["zz", "z2-sta"]);
}

#[test]
fn an_unknown_key_in_a_sweep_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let experiment = folder.path().join("experiment.toml");
    fs::write(&experiment, "no_such_key = 1\n").expect("temporary file");
    refuse(
        program("replay").arg("sweep").arg(&experiment),
        &["experiment.toml", "no_such_key"],
    );
}

#[test]
fn a_missing_scene_leaves_no_trace_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (subcommand, out) in [("raster", "out.textrace"), ("rays", "out.raytrace")] {
        refuse(
            program("tracegen")
                .args([subcommand, "no-such.gltf", "-o"])
                .arg(folder.path().join(out)),
            &["no-such.gltf"],
        );
        let left = fs::read_dir(folder.path()).expect("folder").count();
        assert_eq!(left, 0, "{subcommand} left something behind");
    }
}

/// A scene that cannot be captured; the message has the parts, and no file is left.
fn refuse_scene(text: &str, expected: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("scene.gltf");
    fs::write(&scene, text).expect("temporary file");
    let out = folder.path().join("out.textrace");
    let mut command = program("tracegen");
    refuse(
        command.arg("raster").arg(&scene).arg("-o").arg(&out),
        expected,
    );
    assert!(!out.exists());
}

#[test]
fn a_scene_with_a_missing_texture_names_it() {
    refuse_scene(include_str!("data/missing-texture.gltf"), &["no-such.png"]);
}

#[test]
fn a_scene_with_a_nan_position_names_the_place() {
    refuse_scene(
        include_str!("data/nan-position.gltf"),
        &["scene.gltf", "NaN"],
    );
}

#[test]
fn a_path_with_a_nan_pose_is_refused_by_every_command_with_a_path() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("path.csv");
    let header = "time_s,x_m,y_m,z_m,qx,qy,qz,qw";
    fs::write(
        &path,
        format!("{header}\n0,0,0,0,0,0,0,1\n1,0,NaN,0,0,0,0,1\n"),
    )
    .expect("a file");
    for (subcommand, out) in [("raster", "out.textrace"), ("rays", "out.raytrace")] {
        refuse(
            program("tracegen")
                .args([subcommand, "teapot", "--path"])
                .arg(&path)
                .arg("-o")
                .arg(folder.path().join(out)),
            &["path.csv: line 3, column y_m: expected a finite number, found 'NaN'"],
        );
    }
    fs::write(
        &path,
        format!("{header}\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n"),
    )
    .expect("a file");
    refuse(
        program("tracegen")
            .args(["raster", "teapot", "--frames", "100", "-o"])
            .arg(folder.path().join("out.textrace"))
            .arg("--path")
            .arg(&path),
        &["path.csv", "at most 73 frames", "found 100 frames"],
    );
    let left = fs::read_dir(folder.path()).expect("folder").count();
    assert_eq!(left, 1, "something was left behind");
}

#[test]
fn culling_options_that_do_not_fit_the_display_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out.textrace");
    let wide: &[&str] = &["--hfov", "100", "--cant", "42"];
    let cases: [(&[&str], &[&str], &[&str]); 6] = [
        (
            &["--cull", "superfrustum"],
            wide,
            &["below 179 degrees", "184.0 degrees"],
        ),
        (
            &["--cull", "conical-superfrustum"],
            wide,
            &["below 179 degrees"],
        ),
        (
            &["--cull", "octree"],
            &[],
            &["octree", "per-eye, superfrustum"],
        ),
        (
            &["--lens-radius", "-1"],
            &[],
            &["--lens-radius", "radius above 0", "-1"],
        ),
        (
            &["--lens-center", "0.1"],
            &[],
            &["--lens-center", "two tangents", "'0.1'"],
        ),
        (
            &["--lens-center", "nan,0"],
            &[],
            &["--lens-center", "centre x and y", "NaN"],
        ),
    ];
    for (technique, display, message) in cases {
        refuse(
            (program("tracegen").args(["raster", "teapot", "--size", "32x32"]))
                .args(technique)
                .args(display)
                .arg("-o")
                .arg(&out),
            message,
        );
        assert!(!out.exists(), "{technique:?}");
    }
}

#[test]
fn a_damaged_ray_trace_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bytes = fs::read(root().join("traces/teapot-rays.raytrace")).expect("golden trace");
    let path = folder.path().join("damaged.raytrace");
    for keep in [0, 7, 63, 1000, bytes.len() - 1] {
        fs::write(&path, &bytes[..keep]).expect("temporary file");
        refuse(
            program("replay").arg("reproject").arg(&path),
            &["damaged.raytrace"],
        );
    }
    let mut flipped = bytes.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 0x10;
    fs::write(&path, flipped).expect("temporary file");
    refuse(
        program("replay").arg("reproject").arg(&path),
        &["damaged.raytrace"],
    );
    let texture_trace = root().join("traces/atrium.textrace");
    refuse(
        program("replay").arg("reproject").arg(texture_trace),
        &["atrium.textrace"],
    );
    refuse(
        program("replay")
            .arg("reproject")
            .arg(root().join("traces/teapot-rays.raytrace"))
            .args(["--rule", "depht=0.02"]),
        &["depht"],
    );
}
