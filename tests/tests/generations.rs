//! Two generations of Mesa capture the same records.
//!
//! `PARALLAX_SECOND_VK_DRIVER` names the Vulkan driver file (ICD, JSON) of a second Mesa version. Without
//! it, the tests print a line and pass. Libraries are first searched next to the driver's own.

use formats::textrace::{Tables, Textrace, Tile};
use parallax_tests::{program, real_scene, run_ok};
use std::path::{Path, PathBuf};

/// The variable that names the second driver's file.
const VARIABLE: &str = "PARALLAX_SECOND_VK_DRIVER";

/// A driver's file, and the folder of its library.
struct Driver {
    file: PathBuf,
    libraries: PathBuf,
}

/// The second driver; `None`, with a line on stderr, if none is named.
fn second() -> Option<Driver> {
    let Some(file) = std::env::var_os(VARIABLE).map(PathBuf::from) else {
        parallax_tests::skipped!("no second generation of Mesa: {VARIABLE} is not set");
        return None;
    };
    let text = std::fs::read_to_string(&file)
        .unwrap_or_else(|e| panic!("{VARIABLE}={}: {e}", file.display()));
    let driver: serde_json::Value =
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let library = (driver.pointer("/ICD/library_path").and_then(|l| l.as_str()))
        .unwrap_or_else(|| panic!("{}: expected ICD.library_path, found none", file.display()));
    let library = file.parent().unwrap_or(Path::new(".")).join(library);
    let libraries = library.parent().unwrap_or(Path::new(".")).to_owned();
    Some(Driver { file, libraries })
}

/// Captures a scene with the installed driver or another one.
fn capture(folder: &Path, scene: &str, driver: Option<&Driver>) -> Textrace {
    let trace = folder.join(if driver.is_some() { "second" } else { "first" });
    let trace = trace.with_extension("textrace");
    let mut command = program("tracegen");
    command.args(["raster", scene, "--size", "128x144", "--no-plain", "-o"]);
    command.arg(&trace);
    if let Some(driver) = driver {
        command
            .env("VK_DRIVER_FILES", &driver.file)
            .env("VK_ICD_FILENAMES", &driver.file)
            .env("LD_LIBRARY_PATH", &driver.libraries);
    }
    run_ok(&mut command);
    Textrace::open(&trace).expect("a trace")
}

/// A trace's tables without its description.
fn without_meta(tables: &Tables) -> Tables {
    Tables {
        meta: Default::default(),
        ..tables.clone()
    }
}

fn check_same_records(scene: &str, second: &Driver) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let first = capture(folder.path(), scene, None);
    let second = capture(folder.path(), scene, Some(second));
    let drivers = [&first, &second].map(|trace| trace.tables().meta.driver.clone());
    assert_ne!(drivers[0], drivers[1], "{scene}: two drivers");
    let [a, b] = [&first, &second].map(|trace| without_meta(trace.tables()));
    assert_eq!(a, b, "{scene}: tables of {drivers:?}");
    let mut records = 0;
    let mut tiles = [Tile::default(), Tile::default()];
    for (pass, of_pass) in a.passes.iter().enumerate() {
        for tile in 0..of_pass.tile_count() as usize {
            for (trace, into) in [&first, &second].iter().zip(&mut tiles) {
                trace.decode_tile(pass, tile, into).expect("a tile");
            }
            let [a, b] = &tiles;
            assert_eq!(a, b, "{scene}: pass {pass} tile {tile} of {drivers:?}");
            records += a.records.len();
        }
    }
    assert!(records > 5_000, "{scene}: {records} records");
    println!("{scene}: {records} records alike through {drivers:?}");
}

#[test]
fn two_generations_of_mesa_capture_the_same_records() {
    let Some(second) = second() else { return };
    // Shadow maps; masked and instanced foliage.
    check_same_records("atrium-shadows", &second);
    check_same_records("jungle", &second);
    for scene in [
        "crytek-sponza/sponza.gltf",
        "stk-cocoa-temple/stk-cocoa-temple.gltf",
    ] {
        if let Some(scene) = real_scene(scene) {
            check_same_records(&scene.to_string_lossy(), &second);
        }
    }
}
