//! Golden traces: compares the output of `replay` for each of them with the committed JSON, byte for byte.
//! `UPDATE_GOLDEN=1` rewrites the JSON; review the diff.
//!
//! `traces/golden.digests` and `traces/golden-rays.digests` have the model version and a digest of the counts of every golden result. If
//! counts of an unchanged trace change, the model version must change, too: otherwise `UPDATE_GOLDEN` does
//! not rewrite the digest.

use formats::container::{ChunkTag, Container};
use parallax_tests::{has_lavapipe, program, root, run_ok};
use replay::model_version::{MODEL_VERSION, RAY_MODEL_VERSION};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Options of each golden result, with the name of its file.
const TEXTRACE_RUNS: &[(&str, &[&str])] = &[
    ("morton-timed", &["--order", "morton", "--mode", "timed"]),
    ("z2-lrta-timed", &["--order", "z2-lrta", "--mode", "timed"]),
    ("z2-sta-timed", &["--order", "z2-sta", "--mode", "timed"]),
    (
        "z2-sta-merge-functional",
        &["--order", "z2-sta-merge", "--mode", "functional"],
    ),
    (
        "scanline-functional",
        &["--order", "scanline", "--mode", "functional"],
    ),
    (
        "zig-zag-functional-16k",
        &[
            "--order",
            "zig-zag",
            "--mode",
            "functional",
            "--l1",
            "16KiB",
            "--l2",
            "256KiB",
        ],
    ),
    (
        "z2-sta-first-miss",
        &["--order", "z2-sta", "--tmu", "first-miss"],
    ),
    (
        "hilbert-functional",
        &["--order", "hilbert", "--mode", "functional"],
    ),
    (
        "random-functional",
        &["--order", "random", "--mode", "functional"],
    ),
];

/// The same for ray traces.
const RAYTRACE_RUNS: &[(&str, &[&str])] = &[
    ("rows-on-chip", &[]),
    (
        "strict",
        &[
            "--preset",
            "sgrt-paper",
            "--reuse",
            "primary",
            "--rule",
            "depth+row+object+opaque+triangles",
        ],
    ),
    (
        "plain",
        &[
            "--preset",
            "sgrt-paper",
            "--reuse",
            "primary",
            "--rule",
            "none",
        ],
    ),
    (
        "shadows-reused",
        &[
            "--preset",
            "sgrt-paper",
            "--reuse",
            "shadow",
            "--rule",
            "row+triangle",
        ],
    ),
];

fn golden_traces(extension: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(root().join("traces"))
        .expect("traces/ exists")
        .map(|entry| entry.expect("traces/ is readable").path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .collect();
    found.sort();
    found
}

fn compare(golden: &Path, actual: &[u8]) {
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::create_dir_all(golden.parent().expect("a golden file has a folder")).expect("folder");
        fs::write(golden, actual).expect("golden file is writable");
        return;
    }
    let expected = fs::read(golden)
        .unwrap_or_else(|e| panic!("{}: {e}; UPDATE_GOLDEN=1 writes it", golden.display()));
    assert!(
        expected == actual,
        "{} differs; got:\n{}",
        golden.display(),
        String::from_utf8_lossy(actual)
    );
}

/// Replays every golden trace of a kind with each set of options; digests the counts.
fn replay_all(
    extension: &str,
    at_least: usize,
    subcommand: &str,
    runs: &[(&str, &[&str])],
    digests: &mut Digests,
) {
    let traces = golden_traces(extension);
    assert!(
        traces.len() >= at_least,
        "golden traces are missing: {traces:?}"
    );
    for trace in traces {
        let stem = trace.file_stem().expect("a name").to_string_lossy();
        for (name, options) in runs {
            let mut command = program("replay");
            command.arg(subcommand).arg(&trace).args(*options);
            let output = run_ok(command.arg("--json"));
            let result = without_errors(&output.stdout);
            digests.add(format!("{stem}/{name}"), &result);
            compare(
                &trace.with_extension("golden").join(format!("{name}.json")),
                &result,
            );
        }
    }
}

/// The trace and the counts of a golden result.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Digest {
    /// Checksum of the trace's content.
    trace: String,
    /// Hash of the counts.
    counts: String,
}

/// The digests of all golden results of one model version.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Digests {
    model_version: u32,
    /// By `TRACE/OPTIONS`.
    results: BTreeMap<String, Digest>,
}

/// Keys of a result that are not counts.
const NO_COUNTS: [&str; 6] = [
    "schema",
    "tool",
    "model_version",
    "trace",
    "config",
    "errors",
];

/// Figures that results have gained since the last model version. They follow from figures that they already had.
const ADDED_FIGURES: [&str; 1] = ["relative_energy_bounds"];

/// 64-bit FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

impl Digests {
    fn new(model_version: u32) -> Self {
        Self {
            model_version,
            results: BTreeMap::new(),
        }
    }

    fn add(&mut self, name: String, result: &[u8]) {
        let mut result: Value = serde_json::from_slice(result).expect("JSON");
        let trace = result["trace"]["checksum"].as_str();
        let trace = trace.expect("the trace's checksum").to_owned();
        let object = result.as_object_mut().expect("an object");
        object.retain(|key, _| !NO_COUNTS.contains(&key.as_str()));
        for run in ["result", "plain"] {
            if let Some(figures) = object.get_mut(run).and_then(Value::as_object_mut) {
                figures.retain(|key, _| !ADDED_FIGURES.contains(&key.as_str()));
            }
        }
        result.sort_all_objects();
        let counts = format!("{:016x}", hash(result.to_string().as_bytes()));
        self.results.insert(name, Digest { trace, counts });
    }

    /// The file's text.
    fn text(&self) -> String {
        let mut text = format!(
            "# Model version (replay/sim/src/model_version.rs), then for each golden result: name, trace, counts.\n{}\n",
            self.model_version
        );
        for (name, Digest { trace, counts }) in &self.results {
            text += &format!("{name} {trace} {counts}\n");
        }
        text
    }

    fn parse(text: &str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let version = lines.next().and_then(|line| line.parse().ok());
        let mut digests = Self::new(version.expect("a model version"));
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            let [name, trace, counts] = words[..] else {
                panic!("expected a name, a trace and counts, found `{line}`");
            };
            let [trace, counts] = [trace, counts].map(str::to_owned);
            digests
                .results
                .insert(name.to_owned(), Digest { trace, counts });
        }
        digests
    }

    /// Results of the same trace whose counts differ from the earlier ones of this model version.
    fn changed_since<'a>(&'a self, before: &Self) -> Vec<&'a str> {
        if self.model_version > before.model_version {
            return Vec::new();
        }
        let changed = |(name, digest): &(&String, &Digest)| {
            let of_before = before.results.get(*name);
            of_before.is_some_and(|old| old.trace == digest.trace && old.counts != digest.counts)
        };
        let names = self.results.iter().filter(changed);
        names.map(|(name, _)| name.as_str()).collect()
    }
}

/// Removes the known errors of the figures, which were measured separately and come last.
fn without_errors(json: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(json);
    match text.split_once(",\n  \"errors\": [") {
        Some((results, _)) => format!("{results}\n}}\n").into_bytes(),
        None => json.to_vec(),
    }
}

/// Compares digests with those of a file, which may change only with the model version.
fn check_digests(digests: &Digests, file: &str, history: &str) {
    let path = root().join("traces").join(file);
    let version = digests.model_version;
    if let Ok(text) = fs::read_to_string(&path) {
        let before = Digests::parse(&text);
        assert!(
            before.model_version <= version,
            "{}: expected a model version up to {version}, found {}",
            path.display(),
            before.model_version
        );
        let changed = digests.changed_since(&before);
        assert!(
            changed.is_empty(),
            "counts changed under model version {version}: {}; add a line to {history} in \
             replay/sim/src/model_version.rs, then UPDATE_GOLDEN=1",
            changed.join(", ")
        );
    }
    compare(&path, digests.text().as_bytes());
}

#[test]
fn every_golden_trace_replays_to_its_golden_result() {
    let mut digests = Digests::new(MODEL_VERSION);
    replay_all("textrace", 4, "run", TEXTRACE_RUNS, &mut digests);
    check_digests(&digests, "golden.digests", "TEXTURE_HISTORY");
}

#[test]
fn every_golden_ray_trace_replays_to_its_golden_result() {
    let mut digests = Digests::new(RAY_MODEL_VERSION);
    replay_all("raytrace", 2, "reproject", RAYTRACE_RUNS, &mut digests);
    check_digests(&digests, "golden-rays.digests", "RAY_HISTORY");
}

/// All orders of `replay orders`, functional and, without what is slow, timed.
#[test]
fn each_golden_trace_has_its_golden_row_for_each_order() {
    for trace in golden_traces("textrace") {
        for (name, options) in [
            ("orders-functional", &["--caches", "8/64,16/256"][..]),
            ("orders-timed", &["--caches", "8/64", "--mode", "timed"]),
        ] {
            let mut command = program("replay");
            command.arg("orders").arg(&trace).args(options);
            let output = run_ok(command.args(["--csv", "-"]));
            let folder = trace.with_extension("golden");
            compare(&folder.join(format!("{name}.csv")), &output.stdout);
        }
    }
}

#[test]
fn changed_counts_need_another_model_version() {
    let of = |model_version, checksum: &str, misses: u32| {
        let mut digests = Digests::new(model_version);
        let result = format!(
            r#"{{"tool":"a","model_version":{model_version},"trace":{{"checksum":"{checksum}"}},"result":{{"misses":{misses}}}}}"#
        );
        digests.add("atrium/morton".to_owned(), result.as_bytes());
        digests
    };
    let before = of(3, "0badcafe", 7);
    assert_eq!(Digests::parse(&before.text()), before);
    let changed = |now: Digests| now.changed_since(&before).len();
    assert_eq!(changed(of(3, "0badcafe", 8)), 1);
    assert_eq!(changed(of(2, "0badcafe", 8)), 1, "not an older one");
    assert_eq!(changed(of(4, "0badcafe", 8)), 0, "a new version");
    assert_eq!(changed(of(3, "0badcafe", 7)), 0, "the same counts");
    assert_eq!(changed(of(3, "00000000", 8)), 0, "another trace");
}

#[test]
fn golden_traces_together_stay_below_ten_megabytes() {
    let bytes: u64 = ["textrace", "raytrace"]
        .into_iter()
        .flat_map(golden_traces)
        .map(|path| fs::metadata(path).expect("a trace has a size").len())
        .sum();
    assert!(bytes < 10_000_000, "{bytes} bytes of golden traces");
}

#[test]
fn every_golden_trace_is_valid_and_has_its_recipe() {
    for trace in golden_traces("textrace")
        .into_iter()
        .chain(golden_traces("raytrace"))
    {
        run_ok(program("replay").arg("validate").arg(&trace));
        let recipe = trace.with_extension("recipe");
        assert!(recipe.exists(), "{} is missing", recipe.display());
    }
}

/// The driver that captured a trace; none for rays, which no driver traces.
fn driver(bytes: &[u8]) -> Value {
    let container = Container::from_bytes(bytes.to_vec()).expect("a trace");
    let meta = container.chunk(ChunkTag(*b"META")).expect("a description");
    let mut meta: Value = serde_json::from_slice(meta).expect("JSON");
    meta["driver"].take()
}

#[test]
fn golden_traces_are_made_again_to_the_byte_where_the_driver_is_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    for extension in ["textrace", "raytrace"] {
        if extension == "textrace" && !has_lavapipe() {
            continue;
        }
        for golden in golden_traces(extension) {
            let recipe = fs::read_to_string(golden.with_extension("recipe")).expect("a recipe");
            let made = folder.path().join(golden.file_name().expect("a name"));
            let mut words = recipe.split_whitespace();
            let mut command = program("tracegen");
            command.args(words.next()).arg("-o").arg(&made).args(words);
            // The program of a recipe lies beside tracegen.
            let own = PathBuf::from(command.get_program());
            let mut paths = vec![own.parent().expect("a folder").to_owned()];
            paths.extend(std::env::split_paths(
                &std::env::var_os("PATH").expect("PATH"),
            ));
            command.env("PATH", std::env::join_paths(paths).expect("a list"));
            run_ok(&mut command);
            let [expected, found] = [&golden, &made].map(|path| fs::read(path).expect("a trace"));
            let drivers = [driver(&expected), driver(&found)];
            if drivers[0] == drivers[1] {
                assert!(
                    expected == found,
                    "{} differs from what its recipe makes; scripts/golden.sh makes it again",
                    golden.display()
                );
            } else {
                println!("SKIPPED: golden traces were captured by {}", drivers[0]);
            }
        }
    }
}
