//! Hidden-surface removal on captured scenes, against pixels counted from the trace's records.

use formats::textrace::{PassKind, Textrace, Tile};
use parallax_tests::{program, real_scene, refuse, root, run_ok};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

fn capture(scene: &str, folder: &Path) -> PathBuf {
    let trace = folder.join("trace.textrace");
    let arguments = ["--size", "160x180", "--no-plain", "-o"];
    run_ok(
        program("tracegen")
            .args(["raster", scene])
            .args(arguments)
            .arg(&trace),
    );
    trace
}

/// Fragments that a replay shades.
fn fragments(trace: &Path, hsr: &str) -> u64 {
    let mut command = program("replay");
    command.arg("run").arg(trace);
    let mode = ["--mode", "functional", "--json", "--hsr", hsr];
    let json = run_ok(command.args(mode)).stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    json["result"]["lanes"].as_u64().expect("a count")
}

/// Pixels that opaque draws cover, and fragments of the other draws.
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
fn deferred_shading_of_a_real_scene_leaves_what_is_seen() {
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
fn what_a_trace_does_not_hold_is_refused() {
    let golden = root().join("traces/atrium.textrace");
    let run = |hsr: &str, expected: &str| {
        let mut command = program("replay");
        refuse(
            command.arg("run").arg(&golden).args(["--hsr", hsr]),
            &[expected],
        );
    };
    run("deferred", "does not tell which draws are opaque");
    run("none", "captured with the depth test");
}
