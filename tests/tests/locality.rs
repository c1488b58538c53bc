//! Compares `replay locality` with plain caches whose input is written by `replay convert`, and tests its
//! outputs.

use parallax_tests::lru::Lru;
use parallax_tests::{program, refuse, root, run_ok};
use serde_json::Value;
use std::collections::HashSet;

const LINE_BYTES: u64 = 16;

/// One core, with caches so small that all kinds of misses occur.
const MACHINE: [&str; 8] = [
    "--orders", "z2-sta", "--cores", "1", "--l1", "4KiB", "--l2", "16KiB",
];

fn trace() -> std::path::PathBuf {
    root().join("traces/atrium-shadows.textrace")
}

/// The lines of the trace in replay order.
fn lines() -> Vec<u64> {
    let output = run_ok(
        program("replay")
            .args(["convert", "--to", "din", "--order", "z2-sta", "-o", "-"])
            .arg(trace()),
    );
    let text = String::from_utf8(output.stdout).expect("din is text");
    let line = |line: &str| u64::from_str_radix(&line[2..], 16).expect("an address") / LINE_BYTES;
    text.lines().map(line).collect()
}

/// A cache, with a fully associative one of the same size and an infinite one.
struct Level {
    own: Lru,
    full: Lru,
    seen: HashSet<u64>,
    /// Compulsory, capacity, conflict and avoided misses.
    counts: [u64; 4],
}

impl Level {
    fn new(lines: usize) -> Self {
        Self {
            own: Lru::new(lines / 4, 4),
            full: Lru::new(1, lines),
            seen: HashSet::new(),
            counts: [0; 4],
        }
    }

    fn access(&mut self, line: u64) -> bool {
        let (hit, full, first) = (
            self.own.access(line),
            self.full.access(line),
            self.seen.insert(line),
        );
        match (hit, full, first) {
            (false, _, true) => self.counts[0] += 1,
            (false, false, false) => self.counts[1] += 1,
            (false, true, false) => self.counts[2] += 1,
            (true, false, _) => self.counts[3] += 1,
            (true, true, _) => {}
        }
        hit
    }
}

#[test]
fn causes_of_misses_equal_those_of_plain_caches_with_din_input() {
    let output = run_ok(
        program("replay")
            .arg("locality")
            .arg(trace())
            .args(MACHINE)
            .arg("--json"),
    );
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let (mut l1, mut l2) = (Level::new(256), Level::new(1024));
    for line in lines() {
        if !l1.access(line) {
            l2.access(line);
        }
    }
    for (row, level) in json["rows"].as_array().expect("rows").iter().zip([l1, l2]) {
        let keys = ["compulsory", "capacity", "conflict", "avoided"];
        let counts = keys.map(|key| row[key].as_u64().expect("a count"));
        assert_eq!(counts, level.counts, "{}", row["stream"]);
        assert!(counts.iter().all(|&count| count > 0), "{counts:?}");
        assert_eq!(row["misses"], counts[..3].iter().sum::<u64>());
        assert_eq!(row["unique_lines"], level.seen.len());
        assert!(row["opt_misses"].as_u64() < row["fully_associative_misses"].as_u64());
    }
}

#[test]
fn addresses_converted_from_a_trace_have_its_locality() {
    let folder = tempfile::tempdir().expect("a folder");
    let addresses = folder.path().join("a.u32.gz");
    run_ok(
        program("replay")
            .args(["convert", "--to", "u32", "--order", "z2-sta", "-o"])
            .args([&addresses, &trace()]),
    );
    let json = |input: &[&std::ffi::OsStr], machine: &[&str]| -> Value {
        let mut command = program("replay");
        command.arg("locality").args(input).args(machine);
        let output = run_ok(command.arg("--json"));
        serde_json::from_slice(&output.stdout).expect("one JSON object")
    };
    let of_trace = json(&[trace().as_os_str()], &MACHINE);
    let caches = &MACHINE[4..];
    let of_file = json(&["--addresses".as_ref(), addresses.as_os_str()], caches);
    for (row, expected) in (of_file["rows"].as_array().expect("rows").iter())
        .zip(of_trace["rows"].as_array().expect("rows"))
    {
        assert_eq!(row["order"], "as-given");
        for key in [
            "accesses",
            "misses",
            "unique_lines",
            "compulsory",
            "capacity",
            "conflict",
            "opt_misses",
            "fully_associative_misses",
        ] {
            assert_eq!(row[key], expected[key], "{key} of {}", row["stream"]);
        }
    }
    let refused = |arguments: &[&str], expected: &[&str]| {
        let mut command = program("replay");
        command.args(["locality", "--addresses"]).arg(&addresses);
        refuse(command.args(arguments), expected);
    };
    refused(&["--merged"], &["--merged cannot be used with"]);
    refused(&["--cores", "2"], &["--cores cannot be used with"]);
    refused(&["x.textrace"], &["cannot be used with"]);
    let mut command = program("replay");
    command
        .arg("locality")
        .arg(trace())
        .args(["--kinds", "read"]);
    refuse(&mut command, &["--kinds: only with --addresses"]);
}

#[test]
fn outputs_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let outputs = ["1", "2"].map(|threads| {
        let at = |name: &str| folder.path().join(format!("{threads}-{name}"));
        let output = run_ok(
            program("replay")
                .arg("locality")
                .arg(trace())
                .args([
                    "--orders",
                    "morton,z2-sta",
                    "--merged",
                    "--threads",
                    threads,
                ])
                .arg("--html")
                .arg(at("page.html"))
                .arg("--csv")
                .arg(at("csv")),
        );
        let mut files = vec![output.stdout];
        for name in ["page.html", "page.json", "page.csv"] {
            files.push(std::fs::read(at(name)).expect(name));
        }
        for name in [
            "summary.csv",
            "curves.csv",
            "distances.csv",
            "working-sets.csv",
        ] {
            files.push(std::fs::read(at("csv").join(name)).expect(name));
        }
        files
    });
    assert!(outputs[0] == outputs[1]);
    let page = String::from_utf8(outputs[0][1].clone()).expect("a page");
    for text in [
        "Miss ratio by size",
        "all cores as one",
        "LRU misses over OPT",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // The counts of the exact distances add up to the number of reuses.
    let distances = String::from_utf8(outputs[0][6].clone()).expect("CSV");
    let of_row = |line: &str| -> u64 {
        let counts = line.split(',').skip(5);
        counts
            .map(|count| count.parse::<u64>().expect("a count"))
            .sum()
    };
    let rows = distances.lines().filter(|l| l.contains(",morton,l1,"));
    let json: Value = serde_json::from_slice(&outputs[0][2]).expect("JSON");
    let row = &json["rows"][0];
    let reuses =
        row["accesses"].as_u64().expect("a count") - row["unique_lines"].as_u64().expect("a count");
    assert_eq!(rows.map(of_row).sum::<u64>(), reuses);
}
