//! The cache of prepared textures has no effect on traces and pictures.

use parallax_tests::{program, run_ok};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A capture of the teapot in its own folder.
struct Capture {
    folder: tempfile::TempDir,
}

impl Capture {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, name: &str, cache: &Path, flags: &[&str]) -> Command {
        let mut command = program("tracegen");
        command
            .args(["raster", "teapot", "--size", "64x64", "-o"])
            .arg(self.path(&format!("{name}.textrace")))
            .arg("--image")
            .arg(self.path(&format!("{name}.png")))
            .args(flags)
            .env("PARALLAX_CACHE_DIR", cache)
            .env("PARALLAX_CACHE_SIZE", "64MiB");
        command
    }

    /// Captures and returns the summary line about textures.
    fn run(&self, name: &str, cache: &Path, flags: &[&str]) -> String {
        let output = run_ok(&mut self.command(name, cache, flags));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let line = text.lines().find(|line| line.contains("ready in"));
        line.unwrap_or_else(|| panic!("no summary in {text}"))
            .to_owned()
    }

    fn bytes(&self, name: &str) -> [Vec<u8>; 2] {
        ["textrace", "png"].map(|extension| {
            fs::read(self.path(&format!("{name}.{extension}"))).expect("an output")
        })
    }
}

fn entries(cache: &Path) -> Vec<PathBuf> {
    let folder = fs::read_dir(cache.join("textures"));
    let mut found: Vec<PathBuf> = folder
        .map(|entries| entries.flatten().map(|e| e.path()).collect())
        .unwrap_or_default();
    found.sort();
    found
}

#[test]
fn trace_and_picture_are_the_same_without_with_an_empty_and_with_a_full_cache() {
    let capture = Capture::new();
    let cache = capture.path("cache");
    let without = capture.run("without", &cache, &["--no-cache"]);
    assert!(
        without.contains(" 4 compressed, 0 from the cache"),
        "{without}"
    );
    assert!(!cache.exists(), "--no-cache writes nothing");

    let first = capture.run("first", &cache, &[]);
    assert!(first.contains(" 4 compressed, 0 from the cache"), "{first}");
    assert_eq!(entries(&cache).len(), 4);
    let second = capture.run("second", &cache, &[]);
    assert!(
        second.contains(" 0 compressed, 4 from the cache"),
        "{second}"
    );

    // Damage: one entry with a flipped bit, one truncated, one empty.
    let kept = entries(&cache);
    let whole: Vec<Vec<u8>> = kept
        .iter()
        .map(|e| fs::read(e).expect("an entry"))
        .collect();
    let mut flipped = whole[0].clone();
    flipped[1000] ^= 4;
    fs::write(&kept[0], &flipped).expect("writable");
    fs::write(&kept[1], &whole[1][..whole[1].len() / 2]).expect("writable");
    fs::write(&kept[2], []).expect("writable");
    let damaged = capture.run("damaged", &cache, &[]);
    assert!(
        damaged.contains(" 3 compressed, 1 from the cache"),
        "{damaged}"
    );
    for (entry, bytes) in kept.iter().zip(&whole) {
        assert_eq!(&fs::read(entry).expect("an entry"), bytes, "replaced");
    }

    // An invalid cache: its folder is a file.
    let file = capture.path("file");
    fs::write(&file, "in the way").expect("writable");
    let unusable = capture.run("unusable", &file, &[]);
    assert!(
        unusable.contains(" 4 compressed, 0 from the cache"),
        "{unusable}"
    );

    let expected = capture.bytes("without");
    for name in ["first", "second", "damaged", "unusable"] {
        assert!(capture.bytes(name) == expected, "{name} differs");
    }
}

#[test]
fn captures_at_the_same_time_share_a_cache() {
    let capture = Capture::new();
    let cache = capture.path("cache");
    let running: Vec<_> = ["a", "b", "c"]
        .map(|name| {
            let mut command = capture.command(name, &cache, &["--no-plain"]);
            (name, command.spawn().expect("the program starts"))
        })
        .into();
    for (name, mut child) in running {
        assert!(child.wait().expect("it ends").success(), "{name}");
        assert!(capture.bytes(name) == capture.bytes("a"), "{name} differs");
    }
    assert_eq!(entries(&cache).len(), 4, "{:?}", entries(&cache));
}

#[test]
fn a_size_that_cannot_be_read_is_refused() {
    let capture = Capture::new();
    let mut command = capture.command("a", &capture.path("cache"), &[]);
    let output = command.env("PARALLAX_CACHE_SIZE", "2 apples").output();
    let output = output.expect("the program starts");
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("PARALLAX_CACHE_SIZE"), "{error}");
}
