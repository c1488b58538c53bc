//! The archive of `make dist`: unpacked anywhere, its programs run without the rest of the machine.

use parallax_tests::{has_lavapipe, packed, program, refuse, root, run_ok};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A program with the environment of an empty machine.
fn bare(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env_clear().env("PATH", "/usr/bin:/bin");
    command
}

#[test]
fn the_archive_is_the_same_each_time_and_runs_where_it_is_unpacked() {
    let folders = [(); 3].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let [first, second, other] = folders.each_ref().map(tempfile::TempDir::path);
    let Some(archive) = packed(first, "archive") else {
        return;
    };
    let again = packed(second, "archive").expect("the same file");
    assert_eq!(archive.file_name(), again.file_name());
    assert!(fs::read(&archive).expect("an archive") == fs::read(again).expect("an archive"));

    let place = other.join("an odd place");
    fs::create_dir(&place).expect("a folder");
    let mut unpack = Command::new("tar");
    unpack.arg("-xzf").arg(&archive).arg("--strip-components=1");
    run_ok(unpack.current_dir(&place));
    for file in [
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "README.md",
        "docs/use/install.md",
        "lib/parallax/libparallax_layer.so",
        "lib/parallax/libparallax_xr.so",
        "lib/parallax/parallax_layer.json",
        "share/bash-completion/completions/replay",
        "share/fish/vendor_completions.d/tracegen.fish",
        "share/man/man1/replay-run.1",
        "share/man/man1/tracegen-app.1",
        "share/zsh/site-functions/_replay",
    ] {
        let length = fs::metadata(place.join(file)).expect(file).len();
        assert!(length > 0, "{file}");
    }
    let licences = fs::read_to_string(place.join("LICENSE-CRATES")).expect("licences");
    for expected in ["\nclap 4.", "\nmeshopt 0.", "Arseny Kapoulkine"] {
        assert!(licences.contains(expected), "{expected}");
    }

    let golden = "traces/atrium.textrace";
    let unpacked = fs::read(place.join("share/parallax/atrium.textrace")).expect("a trace");
    assert!(unpacked == fs::read(root().join(golden)).expect("a trace"));
    let replay = |mut command: Command| {
        run_ok(command.args(["run", "--json", golden]).current_dir(root())).stdout
    };
    let installed = place.join("bin/replay");
    assert_eq!(replay(bare(&installed)), replay(program("replay")));

    let alone = other.join("tracegen");
    fs::copy(place.join("bin/tracegen"), &alone).expect("a copy");
    refuse(
        bare(&alone).args(["app", "--list", "--", "true"]),
        &["libparallax_layer.so is missing", "make install"],
    );
    if !has_lavapipe() {
        return;
    }
    let link = other.join("link");
    std::os::unix::fs::symlink(place.join("bin/tracegen"), &link).expect("a link");
    let raster = "raster atrium --size 32x32 -o atrium.textrace";
    run_ok(bare(&link).args(raster.split(' ')).current_dir(other));
    let mut app = bare(&link);
    app.args(["app", "--frames", "1", "-o", "app.textrace", "--"]);
    app.args([env!("CARGO_BIN_EXE_vulkan_program"), "--stereo", "targets"]);
    run_ok(app.current_dir(other));
    for name in ["atrium.textrace", "app.textrace"] {
        run_ok(bare(&installed).arg("run").arg(other.join(name)));
    }
}
