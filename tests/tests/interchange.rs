//! `replay convert` writes traces for other simulators, and `replay run --addresses` reads theirs.
//! Independent readers must find the counts of `replay run` on the same trace.

use formats::textrace::Encoding;
use parallax_tests::lru::Lru;
use parallax_tests::{program, refuse, root, run_ok, traces};
use serde_json::Value;
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const LINE_BYTES: u64 = 16;

/// Addresses of a din text: `LABEL HEXADDR` per line, label 0 for reads.
fn parse_din(text: &str) -> Vec<u64> {
    text.lines()
        .map(|line| {
            let (label, address) = line.split_once(' ').expect("two fields");
            assert_eq!(label, "0", "every access is a read");
            u64::from_str_radix(address, 16).expect("a hexadecimal address")
        })
        .collect()
}

fn convert(granularity: &str) -> Vec<u64> {
    let trace = root().join("traces/atrium-shadows.textrace");
    let output = run_ok(
        program("replay")
            .args([
                "convert",
                "--to",
                "din",
                "--granularity",
                granularity,
                "--order",
                "morton",
                "-o",
                "-",
            ])
            .arg(trace),
    );
    parse_din(&String::from_utf8(output.stdout).expect("din is text"))
}

fn run(options: &[&str]) -> Value {
    let trace = root().join("traces/atrium-shadows.textrace");
    let output = run_ok(
        program("replay")
            .arg("run")
            .arg(trace)
            .args(["--order", "morton", "--json"])
            .args(options),
    );
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// Misses of a set-associative LRU cache.
fn lru_misses(addresses: &[u64], size_bytes: u64, ways: usize) -> u64 {
    let mut cache = Lru::new((size_bytes / LINE_BYTES) as usize / ways, ways);
    let lines = addresses.iter().map(|a| a / LINE_BYTES);
    lines.filter(|line| !cache.access(*line)).count() as u64
}

#[test]
fn din_accesses_and_distinct_lines_agree_with_run() {
    let addresses = convert("line");
    let result = &run(&["--mode", "functional"])["result"];
    assert_eq!(result["l1"]["line_lookups"], addresses.len() as u64);
    let distinct: HashSet<u64> = addresses.iter().map(|a| a / LINE_BYTES).collect();
    assert_eq!(result["unique_lines"], distinct.len() as u64);
}

#[test]
fn texel_addresses_touch_the_same_lines() {
    let by_line: HashSet<u64> = convert("line").iter().map(|a| a / LINE_BYTES).collect();
    let by_texel: HashSet<u64> = convert("texel").iter().map(|a| a / LINE_BYTES).collect();
    assert!(by_line == by_texel);
}

#[test]
fn a_plain_lru_cache_with_din_input_has_the_misses_of_run() {
    let addresses = convert("line");
    for (l1_kib, ways) in [(8, 4_usize), (16, 4), (8, 1), (4, 8)] {
        let result = &run(&[
            "--mode",
            "functional",
            "--cores",
            "1",
            "--l1",
            &format!("{l1_kib}KiB"),
            "--l1-ways",
            &ways.to_string(),
        ])["result"];
        assert_eq!(
            result["l1"]["line_misses"],
            lru_misses(&addresses, l1_kib * 1024, ways),
            "{l1_kib} KiB, {ways} ways"
        );
    }
}

/// Misses of both levels, look-ups and distinct lines of a result of `run`, with a trace or with
/// `--addresses`.
fn figures(result: &Value) -> [u64; 4] {
    let number = |value: &Value| value.as_u64().expect("a count");
    let point = result["points"].get(0);
    let levels = point.unwrap_or(&result["result"]);
    let unique = point.map_or(
        &result["result"]["unique_lines"],
        |_| &result["accesses"]["unique_lines"],
    );
    [
        number(&levels["l1"]["line_misses"]),
        number(&levels["l2"]["line_misses"]),
        number(&levels["l1"]["line_lookups"]),
        number(unique),
    ]
}

fn golden(name: &str) -> PathBuf {
    root().join(format!("traces/{name}.textrace"))
}

/// Runs `replay run` on a trace with one core, without latencies.
fn run_trace(name: &str, options: &[&str]) -> Value {
    let alone = ["--mode", "functional", "--cores", "1", "--json"];
    let output = run_ok(
        program("replay")
            .arg("run")
            .arg(golden(name))
            .args(alone)
            .args(options),
    );
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn convert_to(name: &str, form: &str, file: &Path, options: &[&str]) {
    run_ok(
        program("replay")
            .arg("convert")
            .arg(golden(name))
            .args(["--to", form, "-o"])
            .arg(file)
            .args(options),
    );
}

fn run_addresses(file: &Path, options: &[&str]) -> Value {
    let output = run_ok(
        program("replay")
            .args(["run", "--json", "--addresses"])
            .arg(file)
            .args(options),
    );
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn every_form_and_compression_has_the_figures_of_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let caches = ["--l1", "8KiB", "--l2", "32KiB"];
    let expected = figures(&run_trace("atrium-shadows", &caches));
    assert!(expected[1] > expected[3], "some lines are fetched again");
    for form in ["u32", "u64", "din", "gem5"] {
        for end in ["", ".gz", ".zst"] {
            let file = folder.path().join(format!("a.{form}{end}"));
            convert_to("atrium-shadows", form, &file, &[]);
            let result = run_addresses(&file, &caches);
            assert_eq!(figures(&result), expected, "{form}{end}");
            // From a pipe, and without an informative name.
            let piped = run_ok(
                program("replay")
                    .args(["run", "--json", "--addresses", "-", "--address-form", form])
                    .args(caches)
                    .stdin(fs::File::open(&file).expect("it was written")),
            );
            let piped: Value = serde_json::from_slice(&piped.stdout).expect("JSON");
            assert_eq!(piped["points"], result["points"], "{form}{end}");
            assert_eq!(piped["accesses"], result["accesses"], "{form}{end}");
        }
    }
}

#[test]
fn golden_traces_have_the_same_counts_as_traces_and_as_addresses() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, options) in [
        ("atrium", &["--order", "z2-sta"][..]),
        (
            "atrium",
            &["--line", "64", "--replacement", "fifo", "--l1", "4KiB"],
        ),
        ("jungle", &["--ways", "8", "--l2", "64KiB"]),
        (
            "jungle",
            &["--replacement", "random", "--seed", "9", "--l2", "64KiB"],
        ),
        (
            "atrium-shadows",
            &["--replacement", "tree-plru", "--l1-ways", "2"],
        ),
    ] {
        let file = folder.path().join("a.u32.zst");
        let of_order = if options[0] == "--order" {
            options
        } else {
            &[]
        };
        let line = if options[0] == "--line" {
            &options[..2]
        } else {
            &[]
        };
        convert_to(name, "u32", &file, &[of_order, line].concat());
        let of_caches = if options[0] == "--order" {
            &[]
        } else {
            options
        };
        let result = run_addresses(&file, of_caches);
        assert_eq!(
            figures(&result),
            figures(&run_trace(name, options)),
            "{name} {options:?}"
        );
    }
}

#[test]
fn several_caches_in_one_pass_have_the_same_counts_as_each_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.u64");
    convert_to("jungle", "u64", &file, &["--order", "z2-sta"]);
    let caches = ["4/16", "8/16", "8/128", "16/64", "1/1024"];
    let all = run_addresses(&file, &["--caches", &caches.join(",")]);
    for (index, sizes) in caches.iter().enumerate() {
        let alone = run_addresses(&file, &["--caches", sizes]);
        assert_eq!(all["points"][index], alone["points"][0], "{sizes}");
    }
}

/// Runs the reader in `tests/independent/`; `None`, with a line on stderr, if there is no Python.
fn independently(form: &str, file: &Path) -> Option<Vec<(String, u64, u64)>> {
    let script = root().join("tests/independent/addresses.py");
    let Ok(output) = Command::new("python3")
        .arg(script)
        .arg(form)
        .arg(file)
        .output()
    else {
        parallax_tests::skipped!("python3 is absent");
        return None;
    };
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{form}: {error}");
    let text = String::from_utf8(output.stdout).expect("text");
    let access = |line: &str| {
        let mut fields = line.split(' ');
        let kind = fields.next()?.to_owned();
        Some((
            kind,
            fields.next()?.parse().ok()?,
            fields.next()?.parse().ok()?,
        ))
    };
    Some(
        text.lines()
            .map(|line| access(line).expect("three fields"))
            .collect(),
    )
}

/// Converts a generated trace to a file named after the form.
fn convert_made(trace: &Path, folder: &Path, form: &str, options: &[&str]) -> PathBuf {
    let file = folder.join(form);
    let to = form.trim_end_matches(".gz");
    let mut command = program("replay");
    command.args(["convert", "--to", to]).args(options);
    run_ok(command.arg("-o").arg(&file).arg(trace));
    file
}

#[test]
fn every_form_is_read_independently() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("t.textrace");
    fs::write(&trace, traces::texture_trace(Encoding::Delta, 5)).expect("room");
    let din = fs::read_to_string(convert_made(&trace, folder.path(), "din", &[]));
    let addresses = parse_din(&din.expect("it was written"));
    assert!(addresses.len() > 100, "{} accesses", addresses.len());
    for form in [
        "u32",
        "u64.gz",
        "din",
        "gem5",
        "gem5.gz",
        "ramulator",
        "ramulator-o3",
        "champsim",
    ] {
        let file = convert_made(&trace, folder.path(), form, &[]);
        let form = form.trim_end_matches(".gz");
        let Some(read) = independently(form, &file) else {
            return;
        };
        assert!(
            read.iter().map(|a| a.1).eq(addresses.iter().copied()),
            "{form}"
        );
        let size = if form == "gem5" { LINE_BYTES } else { 0 };
        assert!(read.iter().all(|a| a.0 == "read" && a.2 == size), "{form}");
    }
}

#[test]
fn rays_are_converted_to_addresses_of_every_form() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("r.raytrace");
    fs::write(&trace, traces::ray_trace(1, true, 7)).expect("room");
    let write = |form| convert_made(&trace, folder.path(), form, &["--granularity", "texel"]);
    let din = write("din");
    let Some(expected) = independently("din", &din) else {
        return;
    };
    assert!(!expected.is_empty());
    for form in ["u64", "gem5", "champsim", "ramulator"] {
        let read = independently(form, &write(form)).expect("Python is there");
        assert!(
            read.iter().map(|a| a.1).eq(expected.iter().map(|a| a.1)),
            "{form}"
        );
        assert!(
            form != "gem5" || read.iter().all(|a| a.2 > 1),
            "sizes of nodes and triangles"
        );
    }
}

/// Output of one of the system's compressors, if installed.
fn piped_through(tool: &str, options: &[&str], input: &Path) -> Option<Vec<u8>> {
    let file = fs::File::open(input).expect("it was written");
    let Ok(output) = Command::new(tool).args(options).stdin(file).output() else {
        parallax_tests::skipped!("{tool} is absent");
        return None;
    };
    assert!(output.status.success(), "{tool}");
    Some(output.stdout)
}

#[test]
fn gzip_and_zstd_of_the_system_read_and_write_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = folder.path().join("a.u32");
    convert_to("atrium-shadows", "u32", &plain, &[]);
    let bytes = fs::read(&plain).expect("it was written");
    let expected = run_addresses(&plain, &[]);
    for (tool, end, level) in [("gzip", "gz", "-9"), ("zstd", "zst", "-7")] {
        let ours = folder.path().join(format!("ours.{end}"));
        convert_to("atrium-shadows", "u32", &ours, &[]);
        let Some(unpacked) = piped_through(tool, &["-dc"], &ours) else {
            continue;
        };
        assert!(unpacked == bytes, "{tool} reads ours");
        let theirs = folder.path().join(format!("theirs.u32.{end}"));
        let packed = piped_through(tool, &["-c", level], &plain).expect("it was there before");
        fs::write(&theirs, packed).expect("room");
        assert_eq!(
            run_addresses(&theirs, &[])["points"],
            expected["points"],
            "{tool}"
        );
    }
}

#[test]
fn accesses_of_two_lines_and_writes_are_counted_as_documented() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.din");
    // A read of two lines, a write to the second one, a fetch elsewhere, a read without size at the end of
    // a line.
    fs::write(&file, "r 1c 8\nw 20 4\ni 1000 4\n0 3f\n").expect("room");
    let result = run_addresses(&file, &["--line", "32"]);
    let of = &result["accesses"];
    assert_eq!(
        (&of["reads"], &of["writes"], &of["fetches"]),
        (&2.into(), &1.into(), &1.into())
    );
    assert_eq!(
        (&of["line_lookups"], &of["unique_lines"]),
        (&5.into(), &3.into())
    );
    let point = &result["points"][0];
    let misses = |kind: &str| point[kind]["l1_line_misses"].as_u64();
    assert_eq!(
        ["reads", "writes", "fetches"].map(misses),
        [Some(2), Some(0), Some(1)]
    );
    let result = run_addresses(&file, &["--line", "32", "--kinds", "write"]);
    assert_eq!(result["points"][0]["l1"]["line_misses"], 1);
    assert_eq!(result["accesses"]["left_out"], 3);
}

#[test]
fn input_without_addresses_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("room");
        path
    };
    let plain = at("good.u32", &[1; 400]);
    let packed = folder.path().join("good.u32.zst");
    convert_to("atrium-shadows", "u32", &packed, &[]);
    let packed = fs::read(packed).expect("it was written");
    let cases: Vec<(PathBuf, &[&str], &[&str])> = vec![
        (
            at("odd.u32", &[0; 10]),
            &[],
            &["odd.u32", "access 3 at byte 8", "expected 4 bytes, found 2"],
        ),
        (
            at("a.din", b"0 10\n0 zz\n"),
            &[],
            &["a.din", "line 2", "hexadecimal", "found \"0 zz\""],
        ),
        (
            at("cut.zst", &packed[..packed.len() / 2]),
            &["--address-form", "u32"],
            &["cut.zst", "(zstd)"],
        ),
        (
            at("cut.gz", &[0x1f, 0x8b, 8, 0]),
            &[],
            &["cut.gz", "(gzip)", "found the end"],
        ),
        (
            at("cut.gem5", b"gem5\x20\x0a"),
            &[],
            &["header", "a message of 32 bytes, found the end"],
        ),
        (
            at("large.gem5", b"gem5\xff\xff\xff\xff\x0f"),
            &[],
            &["at most", "found 4294967295"],
        ),
        (
            at("empty.u32", b""),
            &[],
            &["empty.u32", "expected at least one access, found none"],
        ),
        (
            at("empty", b""),
            &[],
            &["expected din text", "found nothing"],
        ),
        (at("unknown", &[7; 64]), &[], &["--address-form"]),
        (golden("atrium"), &[], &["--address-form"]),
        (folder.path().to_owned(), &[], &["found a folder"]),
        (PathBuf::from("/dev/zero"), &[], &["found a device"]),
        (folder.path().join("none"), &[], &["cannot open"]),
        (plain.clone(), &["--l1", "1000"], &["L1"]),
        (plain.clone(), &["--caches", "8-16"], &["--caches"]),
        (plain.clone(), &["--kinds", "fetch"], &["--kinds"]),
        (
            plain.clone(),
            &["--csv", "--json"],
            &["cannot be used with"],
        ),
    ];
    for (path, options, expected) in cases {
        let mut command = program("replay");
        refuse(
            command.args(["run", "--addresses"]).arg(path).args(options),
            expected,
        );
    }
}

#[test]
fn options_of_traces_are_refused_with_addresses() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = folder.path().join("good.u32");
    fs::write(&plain, [1; 400]).expect("room");
    let of_traces: [&[&str]; 24] = [
        &["x.textrace"],
        &["--order", "morton"],
        &["--mode", "timed"],
        &["--cores", "2"],
        &["--assign", "static"],
        &["--hsr", "deferred"],
        &["--filter", "nearest"],
        &["--lod", "exact"],
        &["--lod-bias", "1"],
        &["--helper-lanes"],
        &["--texel-format", "bc7"],
        &["--block-order", "morton"],
        &["--shadow-map-order", "morton"],
        &["--base-align", "64"],
        &["--texture-order", "table"],
        &["--l2-cycles", "1"],
        &["--memory-cycles", "1"],
        &["--loop-cycles", "1"],
        &["--tmu-threads", "1"],
        &["--retry-footprints", "1"],
        &["--fetches-per-trip", "1"],
        &["--allocation", "on-miss"],
        &["--compare-modes"],
        &["--tiles", "--json"],
    ];
    for options in of_traces {
        let mut command = program("replay");
        command
            .args(["run", "--addresses"])
            .arg(&plain)
            .args(options);
        refuse(&mut command, &["cannot be used with"]);
    }
}

#[test]
fn a_row_of_csv_has_the_figures_of_json() {
    let run = |form: &str| {
        let mut command = program("replay");
        run_ok(command.arg("run").arg(golden("atrium")).arg(form)).stdout
    };
    let json: Value = serde_json::from_slice(&run("--json")).expect("JSON");
    let csv = run("--csv");
    let mut reader = csv::Reader::from_reader(csv.as_slice());
    let rows: Vec<HashMap<String, String>> = reader
        .deserialize()
        .map(|row| row.expect("a row"))
        .collect();
    let [row] = &rows[..] else {
        panic!("{} rows", rows.len());
    };
    assert_eq!(json["trace"]["checksum"], row["checksum"].as_str());
    for key in ["external_bytes", "cycles"] {
        assert_eq!(row[key], json["result"][key].to_string(), "{key}");
    }
    assert_eq!(row["l2_size_bytes"], "131072");
}

#[test]
fn options_of_addresses_are_refused_with_traces() {
    let of_addresses: [&[&str]; 3] = [
        &["--kinds", "read"],
        &["--address-form", "u32"],
        &["--caches", "8/128"],
    ];
    for options in of_addresses {
        let mut command = program("replay");
        refuse(
            command.arg("run").arg(golden("atrium")).args(options),
            &["--addresses"],
        );
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let contents = |name: &str, form: &str| {
        let file = folder.path().join(name);
        convert_to("atrium-shadows", form, &file, &[]);
        fs::read(file).expect("it was written")
    };
    for (form, end) in [("gem5", ""), ("u64", ".gz"), ("din", ".zst")] {
        let [first, second] = ["a", "b"].map(|name| contents(&format!("{name}{end}"), form));
        assert!(first == second, "{form}{end}");
    }
}
