//! Tests of `tracegen verify`: a capture agrees with the reference, a changed trace does not.

use formats::textrace::{Textrace, TextraceWriter, Tile};
use parallax_tests::{program, real_scene, refuse, root, run_ok};
use serde_json::Value;
use std::path::Path;

const SMALL: [&str; 2] = ["--size", "96x112"];

/// The report of a correct capture.
fn verify(arguments: &[&str]) -> Value {
    verify_expecting(0, arguments)
}

/// The report of a capture, with the exit code of the verdict.
fn verify_expecting(code: i32, arguments: &[&str]) -> Value {
    let mut command = program("tracegen");
    command.arg("verify").args(arguments).arg("--json");
    let output = command.output().expect("the program starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{errors}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["schema"], "tracegen.verify/1");
    report
}

fn number(report: &Value, pointer: &str) -> f64 {
    report
        .pointer(pointer)
        .and_then(Value::as_f64)
        .unwrap_or_else(|| panic!("no {pointer} in {report:#}"))
}

fn path(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// Checks that every coordinate and every footprint that differs has a cause.
fn check_causes(report: &Value) {
    assert_eq!(report["failures"], serde_json::json!([]), "{report:#}");
    for place in ["uv_error_texels", "capture_precision", "specification"] {
        let causes = report[place]["causes"].as_array().expect("causes");
        let last = causes.last().expect("a cause");
        assert_eq!(last["cause"], "unexplained", "{place}");
        assert_eq!(number(last, "/count"), 0.0, "{place}: {report:#}");
        let all: f64 = causes.iter().map(|c| number(c, "/count")).sum();
        let expected = match place {
            "uv_error_texels" => number(report, "/uv_error_texels/coordinates"),
            _ => number(&report[place], "/other_levels") + number(&report[place], "/other_texels"),
        };
        assert_eq!(all, expected, "{place}");
    }
}

#[test]
fn a_capture_agrees_with_the_reference_and_so_does_the_reference() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let reference = folder.path().join("reference.textrace");
    let [flag, size] = SMALL;
    let report = verify(&[
        "atrium",
        flag,
        size,
        "--colour",
        "--write-reference",
        path(&reference),
    ]);
    assert!(number(&report, "/coverage/iou") > 0.999, "{report:#}");
    assert_eq!(number(&report, "/coverage/recorded_twice"), 0.0);
    let differences = report["coverage"]["differences"]
        .as_array()
        .expect("classes");
    let unexplained = differences
        .iter()
        .find(|d| d["class"] == "unexplained")
        .expect("a class");
    assert_eq!(
        number(unexplained, "/only_capture") + number(unexplained, "/only_reference"),
        0.0
    );
    assert!(
        number(&report, "/uv_error_texels/mean") < 0.01,
        "{report:#}"
    );
    let colour = report["colour"].as_array().expect("colours");
    assert!(colour.len() >= 2, "{report:#}");
    for of_texture in colour {
        assert!(
            number(of_texture, "/within_1_255_share") > 0.995,
            "{of_texture:#}"
        );
        // Larger errors have their cause; with the driver's decoding there are none.
        assert_eq!(number(of_texture, "/beyond_unexplained"), 0.0);
        assert!(
            number(of_texture, "/max_as_driver") < 0.5 / 255.0,
            "{of_texture:#}"
        );
    }
    check_causes(&report);
    // The reference's own trace has exactly its fragments, except for the rounding of coordinates.
    let own = verify(&["atrium", "--trace", path(&reference)]);
    assert_eq!(number(&own, "/coverage/iou"), 1.0);
    assert_eq!(own["size_px"], report["size_px"]);
    assert!(number(&own, "/uv_error_texels/max") < 0.002, "{own:#}");
    run_ok(program("replay").arg("validate").arg(&reference));
}

#[test]
fn a_sample_of_tiles_does_not_depend_on_the_threads() {
    let [flag, size] = SMALL;
    let of = |threads| {
        verify(&[
            "teapot",
            flag,
            size,
            "--tiles",
            "30",
            "--seed",
            "5",
            "--threads",
            threads,
        ])
    };
    let one = of("1");
    assert_eq!(one, of("2"));
    assert_eq!(
        (&one["tiles"]["verified"], &one["tiles"]["of"]),
        (&30.into(), &84.into())
    );
}

#[test]
fn missing_moved_and_invented_records_are_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("atrium.textrace");
    let [flag, size] = SMALL;
    run_ok(
        program("tracegen")
            .args(["raster", "atrium", "--no-plain", flag, size, "-o"])
            .arg(&file),
    );
    let honest = verify(&["atrium", "--trace", path(&file)]);
    let changed = folder.path().join("changed.textrace");
    change(&file, &changed, |tile| {
        // A lane of the first record is removed, and the next record's coordinates are moved by a texel.
        let [first, second, ..] = tile.records.as_mut_slice() else {
            return;
        };
        if first.mask.count_ones() > 1 && first.group == second.group {
            first.mask &= first.mask - 1;
            second.uv[0] += formats::textrace::SUBTEXELS;
        }
    });
    let lying = verify_expecting(1, &["atrium", "--trace", path(&changed)]);
    let missing = |report| number(report, "/coverage/only_reference");
    assert!(missing(&lying) > missing(&honest) + 10.0, "{lying:#}");
    let unexplained = lying["coverage"]["differences"]
        .as_array()
        .expect("classes")
        .last()
        .expect("classes");
    assert_eq!(unexplained["class"], "unexplained");
    assert!(number(unexplained, "/only_reference") > 5.0, "{lying:#}");
    assert!(number(&lying, "/uv_error_texels/max") > 0.9, "{lying:#}");
    let differ = |report| number(report, "/capture_precision/footprints_differ_share");
    assert!(differ(&lying) > differ(&honest));
}

/// Copies a trace with changed tiles.
fn change(from: &Path, to: &Path, change: impl Fn(&mut Tile)) {
    let trace = Textrace::open(from).expect("a trace");
    let mut writer = TextraceWriter::create(to, trace.tables()).expect("a file");
    for (pass, info) in trace.tables().passes.iter().enumerate() {
        for number in 0..info.tile_count() as usize {
            let mut tile = Tile::default();
            trace.decode_tile(pass, number, &mut tile).expect("a tile");
            change(&mut tile);
            writer.write_tile(pass, number, &tile).expect("a tile");
        }
    }
    writer.finish().expect("a file");
}

#[test]
fn traces_that_cannot_be_verified_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let golden = root().join("traces/atrium.textrace");
    let other = folder.path().join("other.textrace");
    let refused = |arguments: &[&str], expected: &[&str]| {
        refuse(program("tracegen").arg("verify").args(arguments), expected);
    };
    refused(
        &["teapot", "--trace", path(&golden)],
        &["another scene", "draws"],
    );
    refused(&["atrium", "--trace", path(&other)], &["other.textrace"]);
    refused(
        &["atrium", "--trace", path(&golden), "--size", "64x64"],
        &["--size", "--trace"],
    );
    refused(
        &["atrium", "--tiles", "0"],
        &["--tiles", "'all' or a number"],
    );
    refused(
        &["atrium", "--tiles", "3", "--write-reference", path(&other)],
        &["--write-reference", "--tiles all"],
    );
    let layered = folder.path().join("layered.textrace");
    run_ok(
        program("tracegen")
            .args([
                "raster",
                "atrium",
                "--no-plain",
                "--size",
                "64x64",
                "--foveate",
                "multi-resolution",
                "-o",
            ])
            .arg(&layered),
    );
    refused(
        &["atrium", "--trace", path(&layered)],
        &["pass 0", "layer of a technique"],
    );
    assert!(!other.exists());
}

#[test]
fn triangles_that_drivers_clip_at_the_border_are_explained() {
    // There, a triangle of 190 px in length is clipped to one of 0.02 px in height.
    let Some(scene) = real_scene("stk-cocoa-temple/stk-cocoa-temple.gltf") else {
        return;
    };
    check_causes(&verify(&[path(&scene), "--size", "512x512"]));
}
