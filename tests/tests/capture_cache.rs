//! The cache of captures, and frames that are stored once.

use parallax_tests::{program, run_ok};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A scene of one textured square, copied beside its texture.
const TRIANGLE: &str = "v -3 -3 -3\nv 3 -3 -3\nv 3 3 -3\nv -3 3 -3\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, line: &str) -> Command {
        let mut command = program("tracegen");
        command
            .args(line.split(' '))
            .current_dir(self.0.path())
            .env("PARALLAX_CACHE_DIR", self.path("cache"))
            .env("PARALLAX_CAPTURE_CACHE_SIZE", "64MiB");
        command
    }

    /// Runs a capture. Returns what it printed, and whether it came from the cache.
    fn run(&self, line: &str) -> (String, bool) {
        let output = run_ok(&mut self.command(line));
        let note = String::from_utf8_lossy(&output.stderr).contains("from the cache of captures");
        (String::from_utf8_lossy(&output.stdout).into_owned(), note)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect("an output")
    }
}

fn entries(folder: &Folder) -> Vec<PathBuf> {
    let found = fs::read_dir(folder.path("cache").join("captures"));
    let found = found.map(|entries| entries.flatten().map(|entry| entry.path()).collect());
    found.unwrap_or_default()
}

#[test]
fn the_same_recipe_is_captured_once_and_gives_the_same_outputs_and_result() {
    let folder = Folder::new();
    for line in [
        "raster teapot --size 64x64 --image NAME.png -o NAME.textrace",
        "rays teapot --size 32x32 --image NAME.png -o NAME.raytrace",
    ] {
        let kind = if line.starts_with("raster") {
            "textrace"
        } else {
            "raytrace"
        };
        let run = |name: &str, more: &str| folder.run(&(line.replace("NAME", name) + more));
        let (said, cached) = run("first", "");
        assert!(!cached && !said.is_empty());
        // Neither the names of outputs nor threads are part of the recipe.
        let (again, cached) = run("second", " --threads 1 -q");
        assert!(!cached, "-q prints no figures about the run");
        assert_eq!(again, said);
        let (again, cached) = run("third", "");
        assert!(cached);
        assert_eq!(again, said);
        let (_, cached) = run("fresh", " --no-cache");
        assert!(!cached);
        for name in ["second", "third", "fresh"] {
            for extension in [kind, "png"] {
                let file = |name: &str| folder.bytes(&format!("{name}.{extension}"));
                assert!(file(name) == file("first"), "{name}.{extension}");
            }
        }
        // Another setting, or another set of outputs, is another recipe.
        assert!(!run("other", " --ipd 70").1);
        let alone = line
            .replace(" --image NAME.png", "")
            .replace("NAME", "alone");
        assert!(!folder.run(&alone).1);
        assert!(folder.run(&alone).1);
    }
    assert_eq!(entries(&folder).len(), 6);
}

#[test]
fn a_changed_input_a_damaged_entry_and_another_driver_setting_are_captured_anew() {
    let folder = Folder::new();
    let scene = folder.path("scene.obj");
    let write = |text: &str| fs::write(&scene, text).expect("writable");
    let line = "raster scene.obj --size 32x32 --eye 0,0,0 --target 0,0,-1 -o a.textrace";
    let older = |path: &Path| {
        let time = std::time::SystemTime::now() - std::time::Duration::from_secs(100);
        let file = fs::File::options().write(true).open(path).expect("a file");
        file.set_modified(time).expect("a file's time");
    };
    write(TRIANGLE);
    older(&scene);
    let (said, cached) = folder.run(line);
    assert!(!cached);
    assert!(folder.run(line).1);
    // Other content of the same size, then the first content with another time and inode.
    write(&TRIANGLE.replace("v 3 3 -3", "v 3 2 -3"));
    older(&scene);
    let (changed, cached) = folder.run(line);
    assert!(!cached && changed != said);
    fs::remove_file(&scene).expect("a file");
    write(&TRIANGLE.replace("v 3 3 -3", "v 3 2 -3"));
    let (same, cached) = folder.run(line);
    assert!(cached && same == changed, "the content is the same");
    // The same words in another folder name another file.
    fs::create_dir(folder.path("sub")).expect("a folder");
    fs::copy(&scene, folder.path("sub/scene.obj")).expect("a copy");
    let elsewhere = run_ok(folder.command(line).current_dir(folder.path("sub")));
    assert!(!String::from_utf8_lossy(&elsewhere.stderr).contains("from the cache of captures"));
    // The entry of the other folder has replaced the first one.
    assert!(!folder.run(line).1);
    assert!(folder.run(line).1);
    let good = folder.bytes("a.textrace");
    let entry = entries(&folder).remove(0);
    let whole = fs::read(&entry).expect("an entry");
    for at in [3, 20, 30, 45, 60, whole.len() / 2, whole.len() - 1] {
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        fs::write(&entry, damaged).expect("writable");
        assert!(!folder.run(line).1, "byte {at}");
        assert!(folder.bytes("a.textrace") == good);
    }
    fs::write(&entry, &whole[..whole.len() - 5]).expect("writable");
    assert!(!folder.run(line).1, "cut");
    assert!(folder.run(line).1);
    let other = run_ok(folder.command(line).env("GALLIVM_PERF", "no_rho_approx"));
    assert!(!String::from_utf8_lossy(&other.stderr).contains("from the cache of captures"));
}

#[test]
fn captures_at_the_same_time_share_the_cache_and_a_hit_replaces_no_input() {
    let folder = Folder::new();
    let line = |name: &str| format!("raster teapot --size 48x48 --no-plain -o {name}.textrace");
    let children: Vec<_> = ["a", "b", "c"]
        .map(|name| folder.command(&line(name)).spawn().expect("it starts"))
        .into();
    for mut child in children {
        assert!(child.wait().expect("it ends").success());
    }
    assert!(folder.run(&line("d")).1);
    for name in ["b", "c", "d"] {
        assert!(folder.bytes(&format!("{name}.textrace")) == folder.bytes("a.textrace"));
    }
    assert_eq!(entries(&folder).len(), 1);
    fs::create_dir(folder.path("taken")).expect("a folder");
    let refused = folder
        .command(&line("d").replace("d.textrace", "taken"))
        .output();
    assert_eq!(refused.expect("it starts").status.code(), Some(2));
}

#[test]
fn equal_frames_are_stored_once_and_replay_as_if_they_were_not() {
    let folder = Folder::new();
    // The pose is the same at all times.
    fs::write(
        folder.path("still.csv"),
        "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n",
    )
    .expect("writable");
    let capture = |frames: u32| {
        let name = format!("{frames}.textrace");
        folder.run(&format!(
            "raster atrium --size 480x540 --path still.csv --frames {frames} --no-plain -o {name}"
        ));
        folder.bytes(&name).len()
    };
    let [one, twelve] = [1, 12].map(capture);
    assert!(
        twelve as f64 <= 1.1 * one as f64,
        "{twelve} bytes of 12 frames, {one} of one"
    );
    let info = |name: &str| {
        let output = run_ok(program("replay").arg("info").arg(folder.path(name)));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    assert!(info("12.textrace").contains("tiles share the bytes of earlier ones"));
    assert!(!info("1.textrace").contains("share"));
    run_ok(
        program("replay")
            .arg("validate")
            .arg(folder.path("12.textrace")),
    );
    // Every frame after a flush counts the same.
    let bytes = |name: &str| {
        let output = run_ok(
            program("replay")
                .args([
                    "run",
                    "--mode",
                    "functional",
                    "--between-frames",
                    "flush",
                    "--json",
                ])
                .arg(folder.path(name)),
        );
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        value["traces"][0]["result"]["external_bytes"]
            .as_u64()
            .or_else(|| {
                value
                    .pointer("/result/external_bytes")
                    .and_then(|of| of.as_u64())
            })
            .unwrap_or_else(|| panic!("{value}"))
    };
    assert_eq!(bytes("12.textrace"), 12 * bytes("1.textrace"));
}
