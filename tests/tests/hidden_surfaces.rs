//! Hidden-surface removal on captured scenes, compared with pixels counted from the trace's records, and on
//! scenes with a known depth complexity.

use formats::textrace::{PassKind, Textrace, Tile};
use parallax_tests::repair::Parts;
use parallax_tests::{program, real_scene, refuse, root, run_ok};
use serde_json::Value;
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Width and height of an eye's picture.
const SIZE_PX: [u64; 2] = [160, 180];

/// Captures a scene with its picture next to the trace.
fn capture_as(scene: &str, folder: &Path, hsr: &str) -> PathBuf {
    let trace = folder.join(format!("{hsr}.textrace"));
    let size = format!("{}x{}", SIZE_PX[0], SIZE_PX[1]);
    let mut command = program("tracegen");
    command.args(["raster", scene, "--no-plain", "--hsr", hsr]);
    command.args(["--size", &size, "-o"]).arg(&trace);
    run_ok(command.arg("--image").arg(trace.with_extension("png")));
    trace
}

fn capture(scene: &str, folder: &Path) -> PathBuf {
    capture_as(scene, folder, "early-z")
}

/// The counts of a replay.
fn replayed(trace: &Path, hsr: &str) -> Value {
    let mut command = program("replay");
    command.arg("run").arg(trace);
    let mode = ["--mode", "functional", "--json", "--hsr", hsr];
    let json = run_ok(command.args(mode)).stdout;
    let json: Value = serde_json::from_slice(&json).expect("JSON");
    json["result"].clone()
}

/// Fragments shaded by a replay.
fn fragments(trace: &Path, hsr: &str) -> u64 {
    replayed(trace, hsr)["lanes"].as_u64().expect("a count")
}

/// Pixels covered by opaque draws, and fragments of the other draws.
fn counted(path: &Path) -> (u64, u64) {
    let trace = Textrace::open(path).expect("a trace");
    let tables = trace.tables();
    let surfaces = tables.meta.surfaces.as_ref().expect("written by captures");
    let ranges = &surfaces.not_opaque;
    let opaque = |draw: u32| {
        !ranges
            .iter()
            .any(|[first, count]| (*first..first + count).contains(&draw))
    };
    let (mut covered, mut others) = (HashSet::new(), HashSet::new());
    let mut tile = Tile::default();
    for (pass, of_pass) in tables.passes.iter().enumerate() {
        assert_eq!(of_pass.kind, PassKind::Main);
        for index in 0..of_pass.tile_count() as usize {
            trace.decode_tile(pass, index, &mut tile).expect("a tile");
            for run in &tile.runs {
                for record in &tile.records[run.first as usize..][..run.count as usize] {
                    for lane in (0..4).filter(|lane| record.mask & (1 << lane) != 0) {
                        let pixel = (pass, index, record.x, record.y, lane);
                        if opaque(run.draw) {
                            covered.insert(pixel);
                        } else {
                            others.insert((pixel, run.primitive));
                        }
                    }
                }
            }
        }
    }
    (covered.len() as u64, others.len() as u64)
}

#[test]
fn deferred_shading_shades_each_pixel_of_opaque_draws_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture("atrium-plain", folder.path());
    let (covered, others) = counted(&trace);
    assert_eq!(others, 0, "the scene is opaque");
    let (early, deferred) = (fragments(&trace, "early-z"), fragments(&trace, "deferred"));
    assert_eq!(deferred, covered, "overdraw 1");
    assert!(early > deferred, "{early} {deferred}");
}

#[test]
fn deferred_shading_of_a_real_scene_shades_only_visible_fragments() {
    let Some(scene) = real_scene("crytek-sponza/sponza.gltf") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture(scene.to_str().expect("UTF-8"), folder.path());
    let (covered, others) = counted(&trace);
    let (early, deferred) = (fragments(&trace, "early-z"), fragments(&trace, "deferred"));
    assert!(covered <= deferred && deferred <= covered + others);
    assert!(early > deferred, "{early} {deferred}");
    eprintln!("fragments {early}, deferred {deferred}, opaque pixels {covered}");
}

#[test]
fn removals_that_need_data_missing_in_the_trace_are_refused() {
    let golden = root().join("traces/atrium.textrace");
    let folder = tempfile::tempdir().expect("a folder");
    let old = folder.path().join("old.textrace");
    let mut parts = Parts::of(&fs::read(&golden).expect("a trace"));
    parts.edit(b"META", |meta| {
        let surfaces = meta.as_object_mut().expect("an object").remove("surfaces");
        assert!(surfaces.is_some());
    });
    fs::write(&old, parts.sealed()).expect("a trace");
    let run = |trace: &Path, hsr: &str, expected: &str| {
        let mut command = program("replay");
        refuse(
            command.arg("run").arg(trace).args(["--hsr", hsr]),
            &[expected],
        );
    };
    run(&old, "deferred", "does not record which draws are opaque");
    run(&golden, "none", "capture with --hsr none");
}

/// Walls across the whole view at some distances, in drawing order.
fn walls(folder: &Path, distances_m: &[f32]) -> PathBuf {
    let mut text = String::new();
    for (number, z) in distances_m.iter().enumerate() {
        text += &format!("o wall{number}\n");
        for [x, y] in [[-1, -1], [1, -1], [1, 1], [-1, 1]] {
            text += &format!("v {} {} {}\n", 100 * x, 100 * y, -z);
        }
        text += "f -4 -3 -2 -1\n";
    }
    let path = folder.join("walls.obj");
    fs::write(&path, text).expect("a scene");
    path
}

#[test]
fn walls_behind_each_other_are_counted_as_the_removal_determines() {
    let pixels = 2 * SIZE_PX[0] * SIZE_PX[1];
    // Number of walls that are in front of all walls drawn before them.
    for (distances_m, nearer) in [([5.0, 7.0, 9.0], 1), ([9.0, 5.0, 7.0], 2)] {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = walls(folder.path(), &distances_m);
        let captured = |hsr: &str| {
            let trace = folder.path().join(format!("{hsr}.textrace"));
            let mut command = program("tracegen");
            command.arg("raster").arg(&scene).args(["--hsr", hsr]);
            command.args(["--eye", "0,0,0", "--target", "0,0,-1"]);
            let size = format!("{}x{}", SIZE_PX[0], SIZE_PX[1]);
            run_ok(command.args(["--size", &size, "-o"]).arg(&trace));
            trace
        };
        let (none, early) = (captured("none"), captured("early-z"));
        assert_eq!(fragments(&none, "none"), 3 * pixels);
        assert_eq!(fragments(&early, "early-z"), nearer * pixels);
        assert_eq!(fragments(&early, "deferred"), pixels);
    }
}

#[test]
fn each_stronger_removal_leaves_fewer_quads_and_bytes_and_the_same_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let [all, tested] =
        ["none", "early-z"].map(|hsr| capture_as("atrium-plain", folder.path(), hsr));
    let picture = |trace: &Path| fs::read(trace.with_extension("png")).expect("a picture");
    assert!(picture(&all) == picture(&tested));
    let results = [
        replayed(&all, "none"),
        replayed(&tested, "early-z"),
        replayed(&tested, "deferred"),
    ];
    for key in ["quads", "lanes", "external_bytes"] {
        let [none, early, deferred] =
            (results.each_ref()).map(|result| result[key].as_u64().expect("a count"));
        assert!(
            none > early && early > deferred,
            "{key} {none} {early} {deferred}"
        );
    }
    for hsr in ["early-z", "deferred"] {
        let mut command = program("replay");
        command.arg("run").arg(&all).args(["--hsr", hsr]);
        refuse(
            &mut command,
            &["holds no depths", "without --hsr none", hsr],
        );
    }
}

#[test]
fn a_capture_of_every_fragment_refuses_techniques_that_skip_fragments_by_depth() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("none.textrace");
    for (flags, expected) in [
        (["--far-field", "2"], "found --far-field"),
        (["--auto", "flip=0.01"], "found --auto"),
    ] {
        let mut command = program("tracegen");
        command
            .args(["raster", "teapot", "--hsr", "none", "-o"])
            .arg(&trace);
        refuse(command.args(flags), &["--hsr none", expected]);
    }
    assert!(!trace.exists());
}
