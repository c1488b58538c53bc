//! Helpers of the end-to-end tests: the built programs, the golden traces, the real scenes.

pub mod columns;
pub mod exercise;
pub mod figures;
pub mod lru;
pub mod repair;
pub mod traces;
pub mod writers;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::UNIX_EPOCH;

/// The workspace root.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("tests/ has a parent").to_owned()
}

/// A built program (`tracegen` or `replay`) of the same profile as the running test.
///
/// # Panics
/// The program is not built: `cargo test --workspace` builds it, `-p parallax-tests` does not.
pub fn program(name: &str) -> Command {
    let test = std::env::current_exe().expect("a running test has a path");
    let profile = test
        .ancestors()
        .find(|dir| dir.file_name().is_some_and(|f| f == "deps"))
        .and_then(Path::parent)
        .expect("test binaries live in <profile>/deps");
    let path = profile.join(name);
    assert!(
        path.exists(),
        "{} is not built: run `make test`, or `cargo build --release` first",
        path.display()
    );
    let mut command = Command::new(&path);
    command.env("PARALLAX_CACHE_DIR", texture_cache(profile));
    command.env("PARALLAX_CACHE_SIZE", "4GiB");
    // Tests compare captures with each other.
    command.env("PARALLAX_CAPTURE_CACHE_SIZE", "0");
    command
}

/// The folder in which all tests of one build keep compressed textures, which take most of the time of a small capture. A new
/// build has a new folder, so results do not depend on earlier builds.
fn texture_cache(profile: &Path) -> PathBuf {
    let file = profile
        .join("tracegen")
        .metadata()
        .expect("tracegen is built");
    let time = file.modified().expect("a file system with times");
    let time = time.duration_since(UNIX_EPOCH).expect("a time after 1970");
    let folders = profile.join("test-textures");
    let folder = folders.join(format!("{}-{}", file.len(), time.as_nanos()));
    // Another test may remove the same folder at the same time.
    for old in folders.read_dir().into_iter().flatten().flatten() {
        if old.path() != folder {
            let _ = std::fs::remove_dir_all(old.path());
        }
    }
    folder
}

/// Runs a command and returns its output.
///
/// # Panics
/// The command cannot be started or fails; the message has its standard error.
pub fn run_ok(command: &mut Command) -> Output {
    let output = command.output().expect("the program starts");
    assert!(
        output.status.success(),
        "{command:?} failed with {:?}:\n{}",
        output.status.code(),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Runs a command that must refuse its input: exit code 2, no panic, and a message with all `expected`
/// parts.
///
/// # Panics
/// The command does anything else.
pub fn refuse(command: &mut Command, expected: &[&str]) -> Output {
    let output = command.output().expect("the program starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{command:?}:\n{message}");
    assert!(!message.contains("panicked"), "{message}");
    for part in expected {
        assert!(
            message.contains(part),
            "{command:?}: no {part:?} in:\n{message}"
        );
    }
    output
}

/// Everything that a command printed: standard output, then standard error.
pub fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

/// Names of the encodings in a texture trace.
///
/// # Panics
/// `replay info` fails.
pub fn encodings(trace: &Path) -> Vec<String> {
    let info = run_ok(program("replay").args(["info", "--json"]).arg(trace)).stdout;
    let info: serde_json::Value = serde_json::from_slice(&info).expect("JSON");
    let tiles = &info["totals"]["tiles_by_encoding"];
    let tiles = tiles.as_object().expect("tiles by encoding").iter();
    tiles
        .filter(|(_, count)| **count != 0)
        .map(|(name, _)| name.clone())
        .collect()
}

/// Prints why a test is skipped. The line bypasses libtest's capture, and `scripts/test.sh` lists it at the
/// end.
#[macro_export]
macro_rules! skipped {
    ($($reason:tt)*) => {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("SKIPPED: {}\n", format_args!($($reason)*)),
        );
    };
}

/// Whether lavapipe is installed; prints a line on stderr if not.
pub fn has_lavapipe() -> bool {
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let mut files = folders
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten();
    let found = std::env::var_os("VK_DRIVER_FILES").is_some()
        || files
            .any(|file| file.is_ok_and(|f| f.file_name().to_string_lossy().starts_with("lvp_icd")));
    if !found {
        skipped!("lavapipe is absent");
    }
    found
}

/// Whether Chromium and lavapipe are installed; prints a line on stderr if not.
pub fn has_chromium() -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path).any(|folder| folder.join("chromium").is_file());
    if !found {
        skipped!("Chromium is absent");
    }
    found && has_lavapipe()
}

/// Packs the built programs into a folder as `archive` or `wheel` and returns the file; prints a line on stderr
/// where Python is absent.
///
/// # Panics
/// The programs cannot be packed.
pub fn packed(folder: &Path, kind: &str) -> Option<PathBuf> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped!("python3 is absent");
        return None;
    }
    let replay = program("replay");
    let build = Path::new(replay.get_program()).parent();
    let mut pack = Command::new("python3");
    pack.arg("-B").arg(root().join("scripts/dist.py"));
    run_ok(pack.arg(build.expect("a folder")).arg(folder).arg(kind));
    let mut files = std::fs::read_dir(folder).expect("the folder");
    Some(files.next().expect("a file").expect("an entry").path())
}

/// Folder of the real test scenes (`PARALLAX_SCENES`, or `../shared/scenes` beside the checkout). Prints a
/// line on stderr and returns `None` if the scene is absent.
pub fn real_scene(relative: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("PARALLAX_SCENES")
        .map_or_else(|| root().join("../shared/scenes"), PathBuf::from);
    let path = folder.join(relative);
    if path.exists() {
        Some(path)
    } else {
        skipped!("{} is absent (set PARALLAX_SCENES)", path.display());
        None
    }
}
