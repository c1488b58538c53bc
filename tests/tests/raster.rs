//! Tests of `tracegen raster`: counts in its summary, passes of moving scenes, skipped geometry, and
//! refusals.

use formats::textrace::{Textrace, Tile};
use formats::texture::TexelFormat;
use parallax_tests::{program, refuse, run_ok, said};
use std::fs;
use std::path::Path;
use std::process::Command;

fn raster(options: &[&str], trace: &Path) -> Command {
    let mut command = program("tracegen");
    command.arg("raster").args(options).arg("-o").arg(trace);
    command
}

/// Everything that the command says.
fn summary(options: &[&str]) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = run_ok(&mut raster(options, &folder.path().join("a.textrace")));
    said(&output)
}

/// The number before ` draws` in the line that starts with a stage's name.
fn draws(summary: &str, stage: &str) -> Option<u64> {
    let line = summary.lines().find(|line| line.starts_with(stage))?;
    let before = line.split(" draws").next()?;
    before.split(' ').next_back()?.parse().ok()
}

/// The number before a word, anywhere in the summary.
fn count(summary: &str, word: &str) -> u64 {
    let before = summary.split(word).next().expect("a text");
    let number = before.split(' ').next_back().expect("a word");
    number
        .parse()
        .unwrap_or_else(|_| panic!("{word}: {summary}"))
}

#[test]
fn each_stage_counts_its_own_draws() {
    let scene = ["atrium-shadows", "--size", "64x64"];
    let with_plain = summary(&scene);
    let without = summary(&[&scene[..], &["--no-plain"]].concat());
    for stage in ["shadow maps", "with capture"] {
        let counts = [&with_plain, &without].map(|summary| draws(summary, stage));
        assert!(counts[0] > Some(0), "{stage}: {with_plain}");
        assert_eq!(counts[0], counts[1], "{stage}: {with_plain}\n{without}");
    }
    assert_eq!(
        draws(&with_plain, "plain render"),
        draws(&with_plain, "with capture"),
        "{with_plain}"
    );
    assert_eq!(draws(&without, "plain render"), None, "{without}");
}

/// Records are of coordinates, so a capture without pictures needs no texels but those of alpha tests.
#[test]
fn a_capture_without_pictures_prepares_the_texels_of_alpha_tests_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for scene in ["atrium", "jungle"] {
        let trace = |name: &str, flags: &[&str]| {
            let file = folder.path().join(name).with_extension("textrace");
            let options = [&[scene, "--size", "64x64"], flags].concat();
            let text = said(&run_ok(&mut raster(&options, &file)));
            let trace = Textrace::open(&file).expect("a trace");
            (
                trace.content_checksum(),
                trace.tables().textures.clone(),
                text,
            )
        };
        let with_plain = trace("plain", &[]);
        let without = trace("without", &["--no-plain"]);
        let all = trace("all", &["--no-plain", "--no-skip", "images"]);
        for other in [&without, &all] {
            assert_eq!(
                (with_plain.0, &with_plain.1),
                (other.0, &other.1),
                "{scene}"
            );
        }
        let skips = "that no alpha test reads skipped";
        assert!(without.2.contains(skips), "{}", without.2);
        assert!(![&with_plain, &all].iter().any(|of| of.2.contains(skips)));
    }
}

#[test]
fn smaller_shadow_maps_only_take_shadow_away_and_stand_in_the_trace() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let capture = |name: &str| {
        let [trace, picture] =
            ["textrace", "png"].map(|ending| folder.path().join(name).with_extension(ending));
        let options = [
            "atrium-shadows",
            "--size",
            "160x128",
            "--shadow-format",
            name,
            "--shade",
        ];
        run_ok(raster(&options, &trace).arg("--image").arg(&picture));
        let read = Textrace::open(&trace).expect("a trace");
        let mut textures = read.tables().textures.clone();
        let maps = textures.pop().expect("shadow maps");
        let picture = image::open(picture)
            .expect("a picture")
            .into_rgb8()
            .into_raw();
        let verify = ["verify", "atrium-shadows", "--tiles", "2", "--trace"];
        run_ok(program("tracegen").args(verify).arg(&trace));
        let decoded = |(pass, number)| {
            let mut tile = Tile::default();
            read.decode_tile(pass, number, &mut tile).expect("a tile");
            tile
        };
        let of_pass = |pass: usize| (0..20).map(move |number| (pass, number));
        let tiles: Vec<Tile> = (0..2).flat_map(of_pass).map(decoded).collect();
        (maps.format, picture, textures, tiles)
    };
    let (format, exact, textures, tiles) = capture("r32f");
    assert_eq!(format, TexelFormat::R32f);
    for (name, expected) in [("d16", TexelFormat::D16), ("bc4", TexelFormat::Bc4)] {
        let (format, picture, others, same_tiles) = capture(name);
        assert_eq!(format, expected);
        assert!(others == textures && same_tiles == tiles, "{name}");
        assert!(
            picture
                .iter()
                .zip(&exact)
                .all(|(found, exact)| found >= exact),
            "{name}"
        );
        assert!(name == "d16" || picture != exact);
    }
}

#[test]
fn smaller_shadow_maps_are_refused_where_there_are_none() {
    let never = Path::new("never.textrace");
    let maps = "a scene with shadow maps";
    let bc4 = ["teapot", "--size", "32x32", "--shadow-format", "bc4"];
    refuse(&mut raster(&bc4, never), &["teapot", maps, "--shadows"]);
    refuse(
        program("tracegen").args(["shadows", "teapot"]),
        &["teapot", maps, "--shadows"],
    );
    for (other, value) in [("--technique", "per-eye"), ("--auto", "pixels=2")] {
        let options = [&bc4[..], &["--shadows", other, value]].concat();
        refuse(&mut raster(&options, never), &["--shadow-format", other]);
    }
}

#[test]
fn passes_of_a_moving_scene_are_planned_from_the_positions_of_its_draws_in_each_frame() {
    // The hall's cranes move. With passes planned from draws at rest, these paths have frames with other
    // layers.
    for (camera, path, split) in [
        ("pumps", "walk", "least-work:4px"),
        ("walkway", "walk", "least-work:2px"),
        ("default", "head", "least-work:4px"),
    ] {
        let options = ["--camera", camera, "--path", path, "--far-field", split];
        let few = [
            "plant", "--fps", "0.2", "--frames", "12", "--size", "128x128",
        ];
        summary(&[&few[..], &options, &["--no-plain"]].concat());
    }
}

#[test]
fn hidden_area_meshes_and_culling_by_distance_skip_the_given_geometry() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("mesh.json");
    // The lower left half of the left picture, nothing of the right one.
    let half =
        r#"{"schema": "parallax.hidden-area/1", "left": [[[0, 0], [1, 0], [0, 1]]], "right": []}"#;
    fs::write(&mesh, half).expect("a file");
    let mesh = mesh.to_string_lossy().into_owned();
    let scene = ["atrium", "--size", "64x64", "--no-plain"];
    let fragments = |options: &[&str]| {
        let summary = summary(&[&scene[..], options].concat());
        (
            count(&summary, " fragments"),
            draws(&summary, "with capture"),
        )
    };
    let (all, all_draws) = fragments(&[]);
    let (half, _) = fragments(&["--hidden-area-mesh", &mesh]);
    assert!(
        (0.6..0.9).contains(&(half as f64 / all as f64)),
        "{half} of {all}"
    );
    let (near, near_draws) = fragments(&["--cull-distance", "4"]);
    assert!(near < all && near_draws < all_draws, "{near} of {all}");
    let (large, large_draws) = fragments(&["--cull-px", "12"]);
    assert!(large <= all && large_draws < all_draws, "{large} of {all}");
}

#[test]
fn invalid_hidden_area_meshes_and_distances_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).expect("a file");
        path.to_string_lossy().into_owned()
    };
    let all = r#"{"schema": "parallax.hidden-area/1", "left": [[[-9, -9], [9, -9], [0, 9]]], "right": []}"#;
    let far = r#"{"schema": "parallax.hidden-area/1", "left": [[[0, 0], [1e9, 0], [0, 1]]], "right": []}"#;
    let refused: [(&str, String, &str); 6] = [
        (
            "--hidden-area-mesh",
            file("all", all),
            "leaves something to see",
        ),
        (
            "--hidden-area-mesh",
            file("far", far),
            "coordinates from -16 to 16",
        ),
        ("--hidden-area-mesh", file("text", "triangles"), "text"),
        ("--hidden-area-mesh", file("none", "{}"), "none"),
        (
            "--cull-distance",
            "-1".into(),
            "cull distance: expected more than 0 metres",
        ),
        ("--cull-px", "nan".into(), "cull"),
    ];
    for (flag, value, expected) in refused {
        let value = format!("{flag}={value}");
        let mut command = raster(&["teapot", "--size", "32x32", &value], &trace);
        let output = command.output().expect("the program starts");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{value}: {error}");
        assert!(error.contains(expected), "{value}: {error}");
        assert!(!trace.exists(), "{value}");
    }
}
