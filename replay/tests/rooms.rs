//! The rooms of `replay` use each other in one direction: cli, report, experiment, engine, cache.

use std::fs;
use std::path::{Path, PathBuf};

/// From the bottom up. A room may use rooms below it; those on one floor may use each other.
const FLOORS: [&[&str]; 12] = [
    &["files", "model_version", "palette", "registry", "size"],
    &["config", "memory", "order", "result"],
    &["paper", "preset", "tmu"],
    &["stream"],
    &["access"],
    &["engine"],
    &["addresses", "compare", "locality"],
    &["sgrt"],
    &["experiment"],
    &["accuracy", "techniques"],
    &["report"],
    &["cli"],
];

/// Rooms that know nothing of each other, although one stands above the other.
const STRANGERS: [(&str, &str); 3] = [
    ("sgrt", "engine"),
    ("sgrt", "stream"),
    ("experiment", "sgrt"),
];

fn source_files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            source_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Files that only tests compile, by their names.
fn is_for_tests(path: &Path) -> bool {
    let name = |part: &std::ffi::OsStr| {
        let part = part.to_string_lossy();
        [
            "tests",
            "tests.rs",
            "testing.rs",
            "synthetic.rs",
            "mutations.rs",
        ]
        .contains(&part.as_ref())
    };
    path.iter().any(name)
}

/// The rooms that a text names as `crate::room`.
fn rooms_used(text: &str) -> Vec<&str> {
    // What follows is for tests.
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let code = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| line.split("crate::").skip(1))
        .map(|rest| {
            let end = rest.find(|c: char| c != '_' && !c.is_ascii_alphanumeric());
            &rest[..end.unwrap_or(rest.len())]
        })
        .collect()
}

/// Why a room may not use another, or nothing.
fn fault(user: &str, used: &str) -> Option<&'static str> {
    let floor = |room: &str| FLOORS.iter().position(|rooms| rooms.contains(&room));
    match (floor(user), floor(used)) {
        _ if user == used => None,
        (None, _) | (_, None) => Some("a room that no floor lists"),
        (Some(user), Some(used)) if used > user => Some("a room above it"),
        _ if STRANGERS.contains(&(user, used)) => Some("a room that it should not know"),
        _ => None,
    }
}

#[test]
fn rooms_use_only_rooms_below_them() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    let mut faults = Vec::new();
    let mut checked = 0;
    for path in &files {
        let inside = path.strip_prefix(&src).unwrap();
        let room = inside.iter().next().unwrap().to_str().unwrap();
        let room = room.trim_end_matches(".rs");
        if ["lib", "main"].contains(&room) || is_for_tests(inside) {
            continue;
        }
        checked += 1;
        for used in rooms_used(&fs::read_to_string(path).unwrap()) {
            if let Some(why) = fault(room, used) {
                faults.push(format!("{} uses crate::{used}, {why}", inside.display()));
            }
        }
    }
    assert!(checked > 80, "only {checked} files found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn an_arrow_that_runs_up_is_found() {
    let text = "//! Not crate::cli.\nuse crate::report::csv;\nlet x = crate::size::f();\n#[cfg(test)]\nmod tests {\n use crate::cli::x;";
    assert_eq!(rooms_used(text), ["report", "size"]);
    assert!(fault("engine", "report").is_some());
    assert!(fault("sgrt", "engine").is_some());
    assert!(fault("report", "nowhere").is_some());
    assert_eq!(fault("report", "experiment"), None);
    assert_eq!(fault("memory", "config"), None);
}
