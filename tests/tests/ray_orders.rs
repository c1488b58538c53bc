//! Compares the DRAM bytes of `replay reproject --order` with plain caches that replay the output of `replay convert`,
//! and tests refusals of orders for rays.

use parallax_tests::lru::Lru;
use parallax_tests::{program, refuse, root, run_ok};
use serde_json::Value;
use std::path::{Path, PathBuf};

const UNITS: usize = 4;
const LINE_BYTES: u64 = 64;
const WIDTH: usize = 88;

/// A trace whose right and lower tiles are narrower than the others.
fn capture(folder: &Path) -> PathBuf {
    let path = folder.join("chess.raytrace");
    let size = format!("{WIDTH}x56");
    let words = ["rays", "chess", "--visits", "--size", &size, "-o"];
    run_ok(program("tracegen").args(words).arg(&path));
    path
}

/// Bytes that the L2 fetches, by the caches of this file.
fn plain_bytes(trace: &Path, order: Option<&str>) -> u64 {
    let mut convert = program("replay");
    convert
        .args(["convert", "--to", "csv", "--line", "64"])
        .arg(trace);
    if let Some(order) = order {
        convert.args(["--order", order]);
    }
    let text = String::from_utf8(run_ok(&mut convert).stdout).expect("text");
    let mut l1: Vec<Lru> = (0..2 * UNITS).map(|_| Lru::new(64, 4)).collect();
    let mut l2 = Lru::new(256, 8);
    let mut misses = 0;
    for row in text.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let address = u64::from_str_radix(&cells[0][2..], 16).expect("an address");
        let number = |at: usize| cells[at].parse::<usize>().expect("a number");
        let (x, y) = (number(4), number(5));
        let tile_width = (WIDTH - x / 16 * 16).min(16);
        let unit = (y % 16 * tile_width + x % 16) % UNITS;
        let cache = 2 * unit + usize::from(cells[9] == "triangle");
        let line = address / LINE_BYTES;
        misses += u64::from(!l1[cache].access(line) && !l2.access(line));
    }
    misses * LINE_BYTES
}

/// Any order of a batch's rays reads the same lines, so caches that keep all lines fetch the same bytes.
#[test]
fn sorted_rays_fetch_other_lines_only_from_caches_that_lose_some() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("chess.raytrace");
    let words = "rays chess --all-columns --bounces 2 --size 48x40 -o";
    run_ok(program("tracegen").args(words.split(' ')).arg(&trace));
    let sorts = ["none", "generation", "direction", "origin", "treelet"];
    let bytes = |l2_bytes: u32, eyes: &str| {
        let config = folder.path().join("caches.toml");
        let caches = "[cache]\nnode_l1_bytes = 4096\ntriangle_l1_bytes = 4096\nl2_bytes";
        std::fs::write(&config, format!("{caches} = {l2_bytes}\n")).expect("written");
        let config = config.to_str().expect("text");
        sorts.map(|sort| {
            let words = ["--config", config, "--order", eyes, "--sort-rays", sort];
            dram(&reprojected(&words, &[&trace])[0])
        })
    };
    for eyes in ["z2-lrta", "z2-sta"] {
        let [none, others @ ..] = bytes(1 << 24, eyes);
        assert_eq!(others, [none; 4], "{eyes}");
        let mut small = bytes(1 << 14, eyes);
        small.sort_unstable();
        assert!(small.windows(2).all(|two| two[0] < two[1]), "{small:?}");
    }
    let plain = folder.path().join("plain.raytrace");
    let words = "rays chess --visits --size 48x40 -o";
    run_ok(program("tracegen").args(words.split(' ')).arg(&plain));
    let words = ["reproject", "--sort-rays", "origin"];
    let timed = ["reproject", "--sort-rays", "treelet", "--timing", "cycle"];
    refuse(
        program("replay").args(timed).arg(&trace),
        &["run to their end, found treelet"],
    );
    refuse(
        program("replay").args(words).arg(&plain),
        &[
            "tni.ray_sort (origin)",
            "--all-columns",
            "found a trace without",
        ],
    );
}

fn reprojected(arguments: &[&str], traces: &[&Path]) -> Vec<Value> {
    let mut command = program("replay");
    command
        .args(["reproject", "--json"])
        .args(arguments)
        .args(traces);
    let text = String::from_utf8(run_ok(&mut command).stdout).expect("text");
    let values = serde_json::Deserializer::from_str(&text).into_iter();
    values.map(|value| value.expect("JSON")).collect()
}

fn dram(report: &Value) -> u64 {
    let bytes = &report["result"]["reference_dram"]["hierarchy_bytes"];
    bytes.as_u64().expect("a number")
}

#[test]
fn bytes_equal_those_of_plain_caches_that_replay_the_converted_addresses() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture(folder.path());
    let mut all = Vec::new();
    for order in [
        "morton",
        "z2-lrta",
        "zig-zag+sta+offset",
        "hilbert+halves",
        "adaptive+lrta+row-lines",
    ] {
        let reports = reprojected(&["--order", order], &[&trace]);
        assert_eq!(
            dram(&reports[0]),
            plain_bytes(&trace, Some(order)),
            "{order}"
        );
        assert_eq!(reports[0]["config"]["tiles"]["order"], order);
        all.push(dram(&reports[0]));
    }
    all.sort_unstable();
    all.dedup();
    assert!(all.len() > 3, "orders differ: {all:?}");
    // Without an order: tiles row by row, left and right in turn. `convert` writes the left eye first.
    let usual = dram(&reprojected(&[], &[&trace])[0]);
    assert_eq!(usual, plain_bytes(&trace, Some("scanline+lrta")));
    assert_eq!(
        plain_bytes(&trace, None),
        plain_bytes(&trace, Some("scanline"))
    );
}

#[test]
fn frames_of_a_path_hit_lines_of_the_frame_before() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture(folder.path());
    let run = |between, order| {
        let words = ["--between", between, "--order", order];
        let reports = reprojected(&words, &[&trace, &trace]);
        [dram(&reports[0]), dram(&reports[1])]
    };
    let [kept, lost, flushed] = ["keep", "lose-50", "flush"].map(|of| run(of, "morton"));
    assert_eq!(flushed[0], flushed[1]);
    assert!(
        kept[1] < lost[1] && lost[1] < flushed[1],
        "{kept:?} {lost:?} {flushed:?}"
    );
    // Every other frame backwards.
    let turned = run("flush", "morton+boustro");
    assert!(turned[0] == flushed[0] && turned[1] != flushed[1]);
}

/// On equal frames, the rule must come to the order that fetches least, and each run may have its own.
#[test]
fn the_rule_finds_the_best_order_of_equal_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture(folder.path());
    let frames = [trace.as_path(); 8];
    for (between, rays) in [
        ("flush", "primary"),
        ("keep", "primary"),
        ("keep", "shadow,diffuse"),
    ] {
        let run = |order, threads| {
            let words = [
                "--between",
                between,
                "--rays",
                rays,
                "--order",
                order,
                "--threads",
                threads,
            ];
            reprojected(&words, &frames)
        };
        let last = |reports: &[Value]| dram(&reports[7]);
        let least = ["morton", "z2-lrta", "z2-sta"].map(|order| last(&run(order, "2")));
        let least = least.into_iter().min().expect("three");
        let chosen = run("trials", "2");
        let found = last(&chosen);
        assert!(
            found * 1000 <= least * 1005,
            "{between} {rays}: {found} {least}"
        );
        let choices = |reports: &[Value]| -> Vec<Value> {
            reports
                .iter()
                .map(|of| of["config"]["tiles"].clone())
                .collect()
        };
        assert_eq!(choices(&chosen), choices(&run("trials", "1")));
        assert_eq!(chosen[1]["config"]["tiles"]["tried"][0], "z2-lrta");
        // Both eyes in full, and with reprojection.
        let starts = &chosen[0]["config"]["tiles"]["chosen"];
        assert_eq!([&starts[0], &starts[1]], ["z2-sta", "z2-lrta"]);
    }
}

#[test]
fn an_assignment_gives_whole_tiles_to_units_and_all_models_trace_all_rays() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = capture(folder.path());
    let rays = |report: &Value| report["result"]["reference_work"]["rays"].as_u64();
    let usual = &reprojected(&[], &[&trace])[0];
    for order in ["morton+sta+runs", "morton+affinity", "hilbert+halves"] {
        let report = &reprojected(&["--order", order, "--timing", "cycle"], &[&trace])[0];
        assert_eq!(rays(report), rays(usual), "{order}");
        let cycles = &report["result"]["cycles"]["reference"];
        assert_eq!(cycles["rays_left"].as_u64(), rays(usual), "{order}");
    }
}

#[test]
fn orders_that_rays_cannot_have_are_refused() {
    let golden = |name: &str| root().join("traces").join(name);
    let light = golden("chess-light.raytrace");
    let reproject = |words: &[&str], path: &Path| {
        let mut command = program("replay");
        command.arg("reproject").args(words).arg(path);
        command
    };
    let merge = "sv, lrta, sta or halves";
    for (words, expected) in [
        (vec!["--order", "spiral"], "morton"),
        (
            vec!["--order", "morton+sta+lrta"],
            "one way to combine the eyes",
        ),
        (vec!["--order", "z2-sta-merge"], merge),
        (vec!["--order", "morton", "--curve"], "--curve"),
        (vec!["--between", "half"], "keep, flush"),
        (vec!["--between", "keep", "--timing", "cycle"], "--between"),
        (vec!["--rays", "light"], "ambient-occlusion"),
    ] {
        refuse(&mut reproject(&words, &light), &[expected]);
    }
    // A trace without visits, an empty file, a texture trace, and frames of different sizes.
    let order = ["--order", "morton"];
    let teapot = golden("teapot-rays.raytrace");
    refuse(&mut reproject(&order, &teapot), &["--order", "--visits"]);
    let folder = tempfile::tempdir().expect("a folder");
    let empty = folder.path().join("empty.raytrace");
    std::fs::write(&empty, "").expect("written");
    refuse(&mut reproject(&order, &empty), &["empty.raytrace"]);
    refuse(
        &mut reproject(&order, &golden("atrium.textrace")),
        &["atrium.textrace"],
    );
    let other = capture(folder.path());
    let mut sizes = reproject(&["--between", "keep", "--order", "morton"], &light);
    refuse(sizes.arg(&other), &["expected frames of 2x2 tiles"]);
    let mut convert = program("replay");
    convert.args(["convert", "--to", "din", "--order", "morton+merge"]);
    refuse(convert.arg(&light), &[merge]);
}
