//! Ray traces from end to end: scene -> `tracegen rays` -> `.raytrace` -> `replay reproject`.

use parallax_tests::{program, real_scene, root, run_ok};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn reproject_json(path: &Path, options: &[&str]) -> Vec<u8> {
    let mut command = program("replay");
    command.arg("reproject").arg(path).arg("--json");
    run_ok(command.args(options)).stdout
}

fn reproject(path: &Path, options: &[&str]) -> Value {
    serde_json::from_slice(&reproject_json(path, options)).expect("JSON")
}

fn figure(report: &Value, name: &str) -> f64 {
    report["result"][name]
        .as_f64()
        .unwrap_or_else(|| panic!("result.{name} is missing in {report}"))
}

#[test]
fn golden_ray_traces_are_reproduced_by_their_recipes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["chess-rays", "teapot-rays"] {
        let golden = root().join("traces").join(name);
        let recipe = fs::read_to_string(golden.with_extension("recipe")).expect("recipe");
        let expected = fs::read(golden.with_extension("raytrace")).expect("golden trace");
        for threads in ["1", "2"] {
            let path = folder.path().join("again.raytrace");
            let mut command = program("tracegen");
            command.args(recipe.split_whitespace()).arg("-o").arg(&path);
            run_ok(command.args(["--threads", threads]));
            assert!(
                fs::read(&path).expect("trace") == expected,
                "{name} differs with {threads} threads"
            );
        }
    }
}

#[test]
fn a_reprojection_saves_work_and_reports_its_error() {
    let golden = root().join("traces/chess-rays.raytrace");
    let careful = reproject(&golden, &[]);
    let plain = reproject(&golden, &["--rule", "none"]);
    assert_eq!(careful["schema"], "replay.reproject/3");
    for report in [&careful, &plain] {
        assert!(figure(report, "relative_performance") > 1.0);
        assert!(figure(report, "relative_energy") > 0.0);
        assert!(figure(report, "tni_cycles") > 0.0);
        assert!(figure(report, "srp_cycles") > 0.0);
        assert!(figure(report, "psnr_db") > 20.0);
    }
    assert!(figure(&plain, "reuse_pct") > figure(&careful, "reuse_pct"));
    assert!(figure(&plain, "wrong_object_pct") >= figure(&careful, "wrong_object_pct"));
    // In such a small picture silhouettes are many of the pixels; the target of 0.01 is for real sizes.
    assert!(figure(&plain, "flip_mean") > 2.0 * figure(&careful, "flip_mean"));
    assert!(figure(&careful, "flip_mean") < 0.02);
}

#[test]
fn a_reprojection_prints_the_same_bytes_over_threads() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let [one, two] = ["1", "2"].map(|n| reproject_json(&golden, &["--threads", n]));
    assert!(one == two);
}

#[test]
fn crytek_sponza_reprojects_with_little_error() {
    let Some(scene) = real_scene("crytek-sponza/sponza.gltf") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sponza.raytrace");
    let mut command = program("tracegen");
    command.arg("rays").arg(scene).arg("-o").arg(&path);
    run_ok(command.args(["--size", "512x512"]));
    let report = reproject(&path, &[]);
    assert!(figure(&report, "flip_mean") < 0.01, "{report}");
    assert!(figure(&report, "reuse_pct") > 50.0, "{report}");
}
