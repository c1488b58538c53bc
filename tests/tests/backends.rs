//! OSMesa beside lavapipe: the same fragments, what it refuses, and a machine without it.

use formats::textrace::{Textrace, Tile};
use parallax_tests::{program, refuse, run_ok};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Captures a scene; `None`, with a line on stderr that says so, where the library is absent.
fn capture(folder: &Path, backend: &str, driver: &str, arguments: &[&str]) -> Option<PathBuf> {
    let trace = folder.join(format!("{backend}-{driver}.textrace"));
    let mut command = program("tracegen");
    command
        .arg("raster")
        .args(arguments)
        .args(["--backend", backend, "-o"])
        .arg(&trace);
    let output = command
        .env("GALLIUM_DRIVER", driver)
        .output()
        .expect("the program starts");
    let told = String::from_utf8_lossy(&output.stderr);
    if told.contains("apt-get install libosmesa6") {
        eprintln!("SKIPPED: libOSMesa.so.8 is absent (apt-get install libosmesa6)");
        return None;
    }
    assert!(output.status.success(), "{told}");
    Some(trace)
}

/// A fragment: pass, tile, quad and lane, primitive.
type Fragment = (usize, usize, [u8; 2], u32, u32);

/// Fragments of a trace, and the name of its driver.
fn fragments(path: &Path) -> (HashSet<Fragment>, String) {
    let trace = Textrace::open(path).expect("a trace");
    let mut found = HashSet::new();
    let mut tile = Tile::default();
    for (pass, of_pass) in trace.tables().passes.iter().enumerate() {
        for index in 0..of_pass.tile_count() as usize {
            trace.decode_tile(pass, index, &mut tile).expect("a tile");
            for run in &tile.runs {
                for record in &tile.records[run.first as usize..][..run.count as usize] {
                    let lanes = (0..4).filter(|lane| record.mask >> lane & 1 == 1);
                    let at = [record.x, record.y];
                    found.extend(lanes.map(|lane| (pass, index, at, lane, run.primitive)));
                }
            }
        }
    }
    (found, trace.tables().meta.driver.clone())
}

/// Fragments of both over fragments of either.
fn overlap(a: &HashSet<Fragment>, b: &HashSet<Fragment>) -> f64 {
    a.intersection(b).count() as f64 / a.union(b).count() as f64
}

#[test]
fn osmesa_draws_the_fragments_that_lavapipe_draws() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // A record buffer that overflows; shadow cascades. The plain picture is compared as well.
    for (scene, rest) in [
        ("teapot", ["--record-budget", "64KiB"]),
        ("atrium-shadows", ["--views", "left"]),
    ] {
        let arguments = [&[scene, "--size", "96x80"], &rest[..]].concat();
        let Some(ours) = capture(folder.path(), "osmesa", "llvmpipe", &arguments) else {
            return;
        };
        let (ours, driver) = fragments(&ours);
        assert!(
            driver.starts_with("llvmpipe") && driver.contains("Mesa"),
            "{driver}"
        );
        let lavapipe = capture(folder.path(), "lavapipe", "llvmpipe", &arguments);
        let (theirs, _) = fragments(&lavapipe.expect("no OSMesa in lavapipe"));
        assert!(ours.len() > 5_000, "{scene}: {}", ours.len());
        let overlap = overlap(&ours, &theirs);
        assert!(overlap >= 0.9995, "{scene}: {overlap}");
    }
}

#[test]
fn softpipe_draws_almost_the_same_fragments() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["teapot", "--size", "64x64", "--no-plain"];
    let Some(softpipe) = capture(folder.path(), "osmesa", "softpipe", &arguments) else {
        return;
    };
    let (softpipe, driver) = fragments(&softpipe);
    assert!(driver.starts_with("softpipe"), "{driver}");
    let lavapipe = capture(folder.path(), "lavapipe", "softpipe", &arguments);
    let (lavapipe, _) = fragments(&lavapipe.expect("no OSMesa in lavapipe"));
    let overlap = overlap(&softpipe, &lavapipe);
    assert!(overlap >= 0.995, "{overlap}");
}

#[test]
fn osmesa_refuses_techniques() {
    for flags in [
        &["--multiview"][..],
        &["--occlusion"],
        &["--hidden-area-mask"],
        &["--far-field", "5"],
        &["--foveate", "rings"],
        &["--auto", "pixels=2"],
    ] {
        let mut command = program("tracegen");
        command.args([
            "raster",
            "teapot",
            "--backend",
            "osmesa",
            "-o",
            "never.textrace",
        ]);
        refuse(
            command.args(flags),
            &[flags[0], "--backend lavapipe", "plain frames"],
        );
    }
}

#[test]
fn without_the_library_its_file_and_package_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The loader takes the first file of the name, and this one is none.
    std::fs::write(folder.path().join("libOSMesa.so.8"), "").expect("a file");
    let command = |backend: &str| {
        let mut command = program("tracegen");
        command.args(["raster", "teapot", "--size", "16x16", "--backend", backend]);
        command.arg("-o").arg(folder.path().join("trace.textrace"));
        command.env("LD_LIBRARY_PATH", folder.path());
        command
    };
    let named = ["libOSMesa.so.8", "apt-get install libosmesa6"];
    refuse(&mut command("osmesa"), &named);
    // Where there is no Vulkan driver either, both are named.
    let mut auto = command("auto");
    auto.env("VK_DRIVER_FILES", folder.path())
        .env("VK_ICD_FILENAMES", folder.path());
    refuse(&mut auto, &["mesa-vulkan-drivers", named[0], named[1]]);
    run_ok(command("auto").arg("--no-plain"));
}
