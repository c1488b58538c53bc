//! Tests of geometry in a captured trace, and of the traffic of a whole frame.

use formats::container::ChunkTag;
use formats::textrace::geometry::{GEOMETRY, LIST_INDEX, PRIMITIVE_LISTS, ViewTarget};
use formats::textrace::{Textrace, Tile};
use parallax_tests::{program, refuse, run_ok};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Captures a scene with geometry.
fn capture(folder: &Path, name: &str, scene: &[&str]) -> PathBuf {
    let path = folder.join(name).with_extension("textrace");
    let mut command = program("tracegen");
    command
        .arg("raster")
        .args(scene)
        .args(["--geometry", "--no-plain", "-o"]);
    run_ok(command.arg(&path));
    path
}

fn replayed(trace: &Path, options: &[&str]) -> Value {
    replayed_in("functional", trace, options)
}

fn replayed_in(mode: &str, trace: &Path, options: &[&str]) -> Value {
    let mut command = program("replay");
    command
        .arg("run")
        .arg(trace)
        .args(["--mode", mode, "--json"])
        .args(options);
    serde_json::from_slice(&run_ok(&mut command).stdout).expect("JSON")
}

fn client<'a>(found: &'a Value, name: &str) -> &'a Value {
    let clients = found["result"]["clients"].as_array().expect("clients");
    let of = clients.iter().find(|client| client["client"] == name);
    of.unwrap_or_else(|| panic!("{name} in {clients:?}"))
}

/// Masked and blended draws, shadow maps, moving objects, layers, a mirrored and a distant scene: every
/// primitive with records in a tile is in the tile's list, and most lists are hardly longer than the drawn
/// primitives.
#[test]
fn every_primitive_that_was_drawn_in_a_tile_is_in_its_list() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenes: [(&str, &[&str]); 5] = [
        ("shadows", &["atrium", "--shadows", "--size", "160x144"]),
        ("jungle", &["jungle", "--size", "160x144"]),
        (
            "plant",
            &[
                "plant", "--size", "96x96", "--path", "head", "--frames", "3",
            ],
        ),
        (
            "layers",
            &["atrium-plain", "--size", "128x112", "--far-field", "4px"],
        ),
        ("teapot", &["teapot", "--size", "97x61", "--hsr", "none"]),
    ];
    for (name, scene) in scenes {
        let trace = Textrace::open(&capture(folder.path(), name, scene)).expect("a trace");
        let geometry = trace.geometry().expect("geometry");
        let passes = &trace.tables().passes;
        let (mut entries, mut drawn, mut of_passes) = (0, 0, Vec::new());
        for (number, view) in geometry.views.iter().enumerate() {
            let ViewTarget::Pass(pass) = view.target else {
                continue;
            };
            of_passes.push(pass as usize);
            let lists = trace.tile_lists(number).expect("lists");
            let mut tile = Tile::default();
            for index in 0..view.tile_count() {
                trace
                    .decode_tile(pass as usize, index, &mut tile)
                    .expect("a tile");
                let list = lists.tile(index);
                for run in &tile.runs {
                    let found = list.binary_search(&run.primitive).is_ok();
                    assert!(
                        found,
                        "{name}: pass {pass} tile {index} primitive {}",
                        run.primitive
                    );
                }
                entries += list.len();
                drawn += tile.runs.len();
            }
        }
        assert_eq!(of_passes, (0..passes.len()).collect::<Vec<_>>(), "{name}");
        let mut textures = trace.tables().textures.iter();
        let is_shadowed = textures.any(|texture| texture.name == "shadow cascades");
        assert_eq!(geometry.views.len() > passes.len(), is_shadowed, "{name}");
        assert!(drawn > 1000, "{name}: {drawn}");
        if name == "teapot" {
            // Without the depth test, they differ by the primitives between the centres of pixels.
            assert!(entries < 3 * drawn, "{entries} {drawn}");
        }
    }
}

#[test]
fn both_drivers_write_the_same_geometry() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let chunks = |backend: &str| {
        let scene = [
            "atrium",
            "--size",
            "64x48",
            "--shadows",
            "--backend",
            backend,
        ];
        let trace = Textrace::open(&capture(folder.path(), backend, &scene)).expect("a trace");
        let chunk = |tag: ChunkTag| trace.container().chunk(tag).expect("a chunk").to_vec();
        [GEOMETRY, PRIMITIVE_LISTS, LIST_INDEX].map(chunk)
    };
    assert!(chunks("lavapipe") == chunks("osmesa"));
}

#[test]
fn clients_add_up_and_an_order_changes_only_the_reads_of_tiles() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = capture(
        folder.path(),
        "atrium",
        &["atrium", "--size", "160x144", "--shadows"],
    );
    let [morton, sta] = ["morton", "z2-sta"]
        .map(|order| replayed(&trace, &["--frame", "tile-based", "--order", order]));
    let plain = replayed(&trace, &["--order", "z2-sta"]);
    assert!(plain["result"].get("clients").is_none());
    assert_eq!(
        client(&sta, "texture")["read_bytes"],
        plain["result"]["external_bytes"]
    );
    for name in [
        "index",
        "vertex",
        "primitive-list",
        "colour",
        "depth",
        "composition",
    ] {
        assert_eq!(client(&morton, name), client(&sta, name), "{name}");
    }
    assert_eq!(client(&sta, "colour")["write_bytes"], 2 * 160 * 144 * 4);
    assert_eq!(client(&sta, "depth")["write_bytes"], 4 * 2048 * 2048 * 4);
    // LPDDR4 reads 32 bytes with 1.3 nJ and opens a row with 1.5 nJ; GDDR6 has other figures.
    let colour = f64::from(2 * 160 * 144 * 4);
    let energy_mj = |found: &Value| {
        client(found, "colour")["energy_mj"]
            .as_f64()
            .expect("energy")
    };
    let expected = colour / 32.0 * (1.3 + 0.5 * 1.5) * 1e-6;
    assert!((energy_mj(&sta) / expected - 1.0).abs() < 1e-9);
    let gddr6 = replayed(&trace, &["--frame", "tile-based", "--dram", "gddr6"]);
    assert!(energy_mj(&gddr6) != energy_mj(&sta));
    let written = |found: &Value| client(found, "shaded-vertex")["write_bytes"].clone();
    assert_eq!(written(&morton), written(&sta));
    let multiview = folder.path().join("multiview.toml");
    fs::write(
        &multiview,
        "order = \"z2-sta\"\n[frame]\nmultiview = true\n",
    )
    .expect("a file");
    let settings = multiview.to_str().expect("a path");
    let both = replayed(&trace, &["--config", settings]);
    let bytes = |found: &Value| {
        client(found, "vertex")["read_bytes"]
            .as_u64()
            .expect("bytes")
    };
    assert!(bytes(&both) < bytes(&sta));

    // The same figures in a sweep's columns.
    let rows = folder.path().join("rows.csv");
    let mut paper = program("replay");
    paper
        .arg("paper")
        .arg(&trace)
        .args(["--mode", "functional", "--frame", "immediate", "--csv"]);
    run_ok(paper.arg(&rows));
    let rows = fs::read_to_string(&rows).expect("rows");
    let mut lines = rows.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| {
        header
            .iter()
            .position(|key| *key == name)
            .unwrap_or_else(|| panic!("{name}"))
    };
    let places = [column("frame_machine"), column("texture_share_pct")];
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells[places[0]], "immediate");
        let share: f64 = cells[places[1]].parse().expect("a number");
        assert!(share > 0.0 && share < 100.0, "{share}");
    }
}

#[test]
fn invalid_frames_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plain = folder.path().join("plain.textrace");
    let capture = ["raster", "teapot", "--size", "32x32", "--no-plain", "-o"];
    run_ok(program("tracegen").args(capture).arg(&plain));
    for command in ["run", "paper", "report"] {
        let page = folder.path().join("page.html");
        let mut replay = program("replay");
        replay
            .arg(command)
            .arg(&plain)
            .args(["--frame", "tile-based"]);
        if command == "report" {
            replay.arg("-o").arg(&page);
        }
        refuse(&mut replay, &["--geometry"]);
        assert!(!page.exists());
    }
    refuse(
        program("replay").args(["dump", "--lists"]).arg(&plain),
        &["--geometry"],
    );
    let settings = folder.path().join("frame.toml");
    for (text, expected) in [
        (
            "line_bytes = 48",
            "frame.line_bytes: expected 32, 64 or 128, found 48",
        ),
        (
            "color_bytes = 0",
            "frame.color_bytes: expected 1 to 64, found 0",
        ),
        ("samples = 3", "frame.samples"),
        ("vertex_cache_bytes = 5000", "frame.vertex_cache_bytes"),
        ("post_transform_entries = 2", "frame.post_transform_entries"),
        ("machine = \"tiled\"", "tile-based"),
        ("colour_bytes = 4", "color_bytes"),
    ] {
        fs::write(&settings, format!("[frame]\n{text}\n")).expect("a file");
        refuse(
            program("replay")
                .arg("run")
                .arg(&plain)
                .arg("--config")
                .arg(&settings),
            &[expected],
        );
    }
}

/// All clients use the levels for all clients, and DRAM: each byte is counted once, in any mode and with
/// any levels.
#[test]
fn dram_reads_and_writes_equal_those_of_the_clients() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = capture(
        folder.path(),
        "shadows",
        &["atrium", "--shadows", "--size", "160x144"],
    );
    let config = |text: &str| {
        let path = folder.path().join("machine.toml");
        fs::write(&path, text).expect("a file");
        path.to_str().expect("UTF-8").to_owned()
    };
    let shared_l3 = config("l3 = {size_bytes = \"1MiB\", line_bytes = 64, clients = \"all\"}\n");
    for mode in ["functional", "timed"] {
        for machine in ["tile-based", "tile-based-g-buffer", "immediate"] {
            let options = ["--frame", machine, "--dram", "lpddr4"];
            let found = replayed_in(mode, &trace, &options);
            let clients = found["result"]["clients"].as_array().expect("clients");
            let sum = |key: &str| {
                clients
                    .iter()
                    .map(|c| c[key].as_u64().expect("bytes"))
                    .sum::<u64>()
            };
            let dram = &found["result"]["dram"];
            let place = format!("{mode}, {machine}");
            assert_eq!(
                dram["write_bytes"].as_u64(),
                Some(sum("write_bytes")),
                "{place}"
            );
            // A texture line of 16 bytes takes a burst of 32.
            let textures = client(&found, "texture")["read_bytes"]
                .as_u64()
                .expect("bytes");
            assert_eq!(
                dram["read_bytes"].as_u64(),
                Some(sum("read_bytes") + textures),
                "{place}"
            );
            // With an L3 for all clients: fewer reads, the same writes, and each byte of reads leaves it
            // once.
            let options = [&options[..], &["--config", &shared_l3]].concat();
            let with_l3 = replayed_in(mode, &trace, &options);
            let of_dram = |key: &str| with_l3["result"]["dram"][key].as_u64().expect("bytes");
            assert_eq!(
                Some(of_dram("write_bytes")),
                dram["write_bytes"].as_u64(),
                "{place}"
            );
            let clients = with_l3["result"]["clients"].as_array().expect("clients");
            let reads: u64 = clients
                .iter()
                .map(|c| c["read_bytes"].as_u64().expect("bytes"))
                .sum();
            assert_eq!(of_dram("read_bytes"), reads, "{place}");
            assert!(reads < sum("read_bytes"), "{place}");
        }
    }
}

/// Larger tiles have fewer list entries. Written pictures do not change.
#[test]
fn larger_tiles_have_shorter_lists_and_the_same_pictures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = capture(
        folder.path(),
        "atrium",
        &["atrium-plain", "--size", "160x144"],
    );
    let of = |tile_px: &str| replayed(&trace, &["--frame", "tile-based", "--tile-px", tile_px]);
    let entries = |found: &Value| found["result"]["geometry"]["list_entries"].as_u64();
    let [small, middle, large] = ["16", "32", "64"].map(of);
    assert!(entries(&large) < entries(&middle) && entries(&middle) < entries(&small));
    for found in [&middle, &large] {
        assert_eq!(client(found, "colour"), client(&small, "colour"));
        assert_eq!(client(found, "vertex"), client(&small, "vertex"));
    }
}

#[test]
fn a_picture_determines_the_compression_of_colour() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = folder.path().join("picture.png");
    let picture = picture.to_str().expect("UTF-8");
    let scene = ["atrium-plain", "--size", "160x144", "--image", picture];
    let trace = capture(folder.path(), "atrium", &scene);
    let plain = replayed(&trace, &["--frame", "tile-based"]);
    let packed = replayed(&trace, &["--frame", "tile-based", "--picture", picture]);
    let permille = packed["config"]["frame"]["color_compressed_permille"]
        .as_u64()
        .expect("a number");
    assert!((100..900).contains(&permille), "{permille}");
    let written = |found: &Value| {
        client(found, "colour")["write_bytes"]
            .as_u64()
            .expect("bytes")
    };
    let ratio = 1000.0 * written(&packed) as f64 / written(&plain) as f64;
    // Each tile uses whole lines.
    assert!((ratio - permille as f64).abs() < 63.0, "{ratio} {permille}");
    refuse(
        program("replay").args(["run", trace.to_str().expect("UTF-8"), "--picture", picture]),
        &["--picture: only with --frame"],
    );
}
