//! Ray traces from end to end: scene -> `tracegen rays` -> `.raytrace` -> `replay reproject`.

use parallax_tests::{program, real_scene, refuse, root, run_ok};
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
    for name in ["chess-rays", "teapot-rays", "chess-light"] {
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
    let primary = reproject(&golden, &["--reuse", "primary"]);
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
    assert!(
        careful["result"]["work"]["rays"].as_u64() < primary["result"]["work"]["rays"].as_u64()
    );
}

#[test]
fn the_defaults_save_energy_and_time_with_little_error_on_every_scene_of_the_paper() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for scene in ["teapot", "chess", "car", "lab", "music-box", "meadow"] {
        let path = folder.path().join(format!("{scene}.raytrace"));
        let mut command = program("tracegen");
        command.args(["rays", scene, "--size", "256x256", "-o"]);
        run_ok(command.arg(&path));
        let report = reproject(&path, &[]);
        let [energy, flip, performance] = ["relative_energy", "flip_mean", "relative_performance"]
            .map(|key| figure(&report, key));
        assert!(energy < 1.0, "{scene}: energy {energy}");
        assert!(flip < 0.01, "{scene}: FLIP {flip}");
        assert!(performance > 1.0, "{scene}: performance {performance}");
        fs::remove_file(path).expect("removable");
    }
}

#[test]
fn a_reprojection_prints_the_same_bytes_over_threads() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let [one, two] = ["1", "2"].map(|n| reproject_json(&golden, &["--threads", n]));
    assert!(one == two);
}

/// The built-in teapot with the addresses that its rays visit.
fn teapot_with_visits(folder: &tempfile::TempDir) -> std::path::PathBuf {
    let path = folder.path().join("teapot.raytrace");
    let mut command = program("tracegen");
    command.args(["rays", "teapot", "--size", "96x96", "--visits", "-o"]);
    run_ok(command.arg(&path));
    path
}

#[test]
fn the_cycle_level_model_conserves_rays_and_requests_and_is_compared_with_the_closed_form() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = teapot_with_visits(&folder);
    let closed = reproject(&path, &[]);
    let timed = reproject(&path, &["--timing", "cycle"]);
    assert_eq!(closed["config"]["timing"], "closed-form");
    assert_eq!(timed["config"]["timing"], "cycle");
    assert!(closed["result"].get("cycles").is_none());
    let cycles = &timed["result"]["cycles"];
    let count = |run: &str, name: &str| {
        let value = cycles[run][name].as_u64();
        value.unwrap_or_else(|| panic!("cycles.{run}.{name} is missing"))
    };
    for run in ["left", "right", "reference", "reprojected"] {
        assert!(count(run, "rays_entered") > 9000, "{run}");
        assert_eq!(count(run, "rays_entered"), count(run, "rays_left"), "{run}");
        assert_eq!(count(run, "requests"), count(run, "answers"), "{run}");
        let ratio = count(run, "closed_form_cycles") as f64 / count(run, "cycles") as f64;
        assert!((0.5..1.5).contains(&ratio), "{run}: {ratio}");
    }
    let reference = &timed["result"]["reference_work"];
    let visits = ["steps", "triangle_tests"].map(|name| reference[name].as_u64().expect("a count"));
    assert_eq!(count("reference", "requests"), visits[0] + visits[1]);
    assert_eq!(
        cycles["closed_form_relative_performance"],
        closed["result"]["relative_performance"]
    );
    assert_eq!(timed["result"]["flip_mean"], closed["result"]["flip_mean"]);
}

#[test]
fn the_cycle_level_model_prints_the_same_bytes_over_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = teapot_with_visits(&folder);
    let [one, two, eight] =
        ["1", "2", "8"].map(|n| reproject_json(&path, &["--timing", "cycle", "--threads", n]));
    assert!(one == two && one == eight);
}

#[test]
fn the_cycle_level_model_refuses_what_it_does_not_support() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let with = |options: &[&str]| {
        let mut command = program("replay");
        command.arg("reproject").arg(&golden);
        command.args(["--timing", "cycle"]).args(options);
        command
    };
    refuse(&mut with(&[]), &["teapot-rays.raytrace", "--visits"]);
    refuse(&mut with(&["--curve"]), &["--curve", "closed-form"]);
    refuse(
        &mut with(&["--sensitivity"]),
        &["--sensitivity", "closed-form"],
    );
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

/// Two consecutive frames of a scene along a path.
fn two_frames(folder: &tempfile::TempDir, scene: &str) -> [std::path::PathBuf; 2] {
    ["10", "11"].map(|frame| {
        let path = folder.path().join(format!("{scene}-{frame}.raytrace"));
        run_ok(
            program("tracegen")
                .args(["rays", scene, "--size", "64x48", "--visits"])
                .args(["--path", "head", "--fps", "90", "--frame", frame])
                .arg("-o")
                .arg(&path),
        );
        path
    })
}

#[test]
fn reuse_over_time_saves_more_than_reuse_between_the_eyes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frames = two_frames(&folder, "chess");
    let json = |threads: &str| {
        let output = run_ok(program("replay").arg("temporal").args(&frames).args([
            "--json",
            "--rule",
            "none",
            "--threads",
            threads,
        ]));
        output.stdout
    };
    let bytes = json("1");
    assert_eq!(bytes, json("2"));
    let report: Value = serde_json::from_slice(&bytes).expect("JSON");
    let schemes = report["frames"][0]["schemes"].as_array().expect("schemes");
    let of = |name: &str| {
        let found = schemes.iter().find(|scheme| scheme["scheme"] == name);
        let scheme = found.expect("the scheme");
        let number = |value: &Value| value.as_f64().expect("a number");
        (
            number(&scheme["reused_pct"][1]),
            number(&scheme["relative_performance"]),
        )
    };
    assert_eq!(of("full"), (0.0, 1.0));
    assert!(of("temporal").0 > of("stereo").0, "{report}");
    assert!(
        of("stereo").1 > 1.0 && of("both").1 > of("stereo").1,
        "{report}"
    );
}

#[test]
fn frames_that_do_not_belong_together_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [chess, _] = two_frames(&folder, "chess");
    let [teapot, _] = two_frames(&folder, "teapot");
    for (files, expected) in [
        (
            vec![&chess, &teapot],
            "expected those of the previous frame",
        ),
        (vec![&chess], "2 values required"),
    ] {
        refuse(program("replay").arg("temporal").args(&files), &[expected]);
    }
}
