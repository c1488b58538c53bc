//! Checks that the modules of `replay` depend on each other in one direction, and that the saved cases of
//! property tests belong to a module.

use std::fs;
use std::path::{Path, PathBuf};

/// Crates, and their modules by layer from the bottom up. A module may use modules of lower layers and of its own layer.
const CRATES: [(&str, &[&[&str]]); 2] = [
    (
        "sim",
        &[
            // `choices` is the macro of `registry`.
            &[
                "choices",
                "model_version",
                "palette",
                "registry",
                "size",
                "sums",
            ],
            &["config", "memory", "order", "result"],
            &["paper", "preset", "tmu"],
            &["stream"],
            &["access"],
            &["engine"],
            &["addresses", "line_list"],
        ],
    ),
    (
        "studies",
        &[
            &["compare"],
            &["experiment"],
            &["accuracy", "orders_study", "sampling", "techniques"],
        ],
    ),
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

/// Whether a file is compiled only for tests, by its name.
fn is_for_tests(path: &Path) -> bool {
    let name = |part: &std::ffi::OsStr| {
        let part = part.to_string_lossy();
        ["schemas.rs", "tests", "tests.rs", "testing.rs"].contains(&part.as_ref())
    };
    path.iter().any(name)
}

/// The modules that a text names as `crate::module`.
fn rooms_used(text: &str) -> Vec<&str> {
    // The tests at the end of a file are not checked.
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

/// Reason why a module may not use another of the same crate, if any.
fn fault(floors: &[&[&str]], user: &str, used: &str) -> Option<&'static str> {
    let floor = |room: &str| floors.iter().position(|rooms| rooms.contains(&room));
    match (floor(user), floor(used)) {
        _ if user == used => None,
        (None, _) | (_, None) => Some("a module that no layer lists"),
        (Some(user), Some(used)) if used > user => Some("a module of a higher layer"),
        _ => None,
    }
}

#[test]
fn modules_use_only_modules_of_lower_layers() {
    let mut faults = Vec::new();
    let mut checked = 0;
    for (name, floors) in CRATES {
        let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(name).join("src");
        let mut files = Vec::new();
        source_files(&src, &mut files);
        for path in &files {
            let inside = path.strip_prefix(&src).unwrap();
            let room = inside.iter().next().unwrap().to_str().unwrap();
            let room = room.trim_end_matches(".rs");
            if room == "lib" || is_for_tests(inside) {
                continue;
            }
            checked += 1;
            for used in rooms_used(&fs::read_to_string(path).unwrap()) {
                // Tests publish the schemas.
                if used == "schemas" {
                    continue;
                }
                if let Some(why) = fault(floors, room, used) {
                    let file = inside.display();
                    faults.push(format!("{name}: {file} uses crate::{used}, {why}"));
                }
            }
        }
    }
    assert!(checked > 80, "only {checked} files found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_use_of_a_higher_layer_is_found() {
    let text = "//! Not crate::cli.\nuse crate::report::csv;\nlet x = crate::size::f();\n#[cfg(test)]\nmod tests {\n use crate::cli::x;";
    assert_eq!(rooms_used(text), ["report", "size"]);
    let [(_, sim), (_, studies)] = CRATES;
    assert!(fault(sim, "memory", "engine").is_some());
    assert!(fault(sim, "engine", "nowhere").is_some());
    assert_eq!(fault(sim, "memory", "config"), None);
    assert!(fault(studies, "compare", "accuracy").is_some());
}

/// Property tests read `proptest-regressions/ROOM/FILE.txt` for `src/ROOM/FILE.rs`.
#[test]
fn every_saved_case_belongs_to_a_source_file() {
    let replay = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut checked = 0;
    for root in ["report", "sim"].map(|name| replay.join(name)) {
        let saved = root.join("proptest-regressions");
        let mut folders = vec![saved.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let of = path.strip_prefix(&saved).unwrap().with_extension("rs");
                let source = root.join("src").join(&of);
                assert!(source.exists(), "{}: no such test", source.display());
                checked += 1;
            }
        }
    }
    assert!(checked > 1);
}
