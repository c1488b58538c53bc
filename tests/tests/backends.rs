//! Compares OSMesa with lavapipe: equal fragments, refused options, and machines without the library.

use formats::textrace::{Textrace, Tile};
use parallax_tests::{program, real_scene, refuse, run_ok};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Captures a scene; `None`, with a line on stderr, if the library is absent.
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
    let message = String::from_utf8_lossy(&output.stderr);
    if message.contains("apt-get install libosmesa6") {
        parallax_tests::skipped!("libOSMesa.so.8 is absent (apt-get install libosmesa6)");
        return None;
    }
    assert!(output.status.success(), "{message}");
    Some(trace)
}

/// A sample of a lane: its position (pass, tile, quad and lane, primitive, group), and the quad's
/// coordinates.
type Sampled = ((usize, usize, [u8; 2], u32, u32, u8), [[i32; 2]; 4]);

/// The samples of a trace's lanes, in order, and the name of its driver.
fn sampled(path: &Path) -> (Vec<Sampled>, String) {
    let trace = Textrace::open(path).expect("a trace");
    let mut found = Vec::new();
    let mut tile = Tile::default();
    for (pass, of_pass) in trace.tables().passes.iter().enumerate() {
        for index in 0..of_pass.tile_count() as usize {
            trace.decode_tile(pass, index, &mut tile).expect("a tile");
            for run in &tile.runs {
                for r in &tile.records[run.first as usize..][..run.count as usize] {
                    let lanes = (0..4).filter(|lane| r.mask >> lane & 1 == 1);
                    let at = |lane| (pass, index, [r.x, r.y], lane, run.primitive, r.group);
                    found.extend(lanes.map(|lane| (at(lane), [r.uv, r.dx, r.dy, r.cross])));
                }
            }
        }
    }
    found.sort_unstable();
    (found, trace.tables().meta.driver.clone())
}

/// Fragments of both over fragments of at least one.
fn overlap(a: &[Sampled], b: &[Sampled]) -> f64 {
    let places = |of: &[Sampled]| -> HashSet<_> { of.iter().map(|(place, _)| *place).collect() };
    let (a, b) = (places(a), places(b));
    a.intersection(&b).count() as f64 / a.union(&b).count() as f64
}

/// The version of Mesa in a driver's name.
fn mesa(driver: &str) -> &str {
    let version = driver.split("Mesa ").nth(1).unwrap_or_default();
    version.split(' ').next().unwrap_or_default()
}

/// Compares OSMesa's llvmpipe with lavapipe's: every lane has bit-identical samples if both are from the
/// same version of Mesa.
fn check_llvmpipe(arguments: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(ours) = capture(folder.path(), "osmesa", "llvmpipe", arguments) else {
        return;
    };
    let (ours, driver) = sampled(&ours);
    assert!(driver.starts_with("llvmpipe"), "{driver}");
    let lavapipe = capture(folder.path(), "lavapipe", "llvmpipe", arguments);
    let (theirs, other) = sampled(&lavapipe.expect("no OSMesa in lavapipe"));
    assert!(ours.len() > 5_000, "{arguments:?}: {}", ours.len());
    if mesa(&driver) == mesa(&other) {
        let apart = ours.iter().zip(&theirs).find(|(a, b)| a != b);
        assert_eq!(apart, None, "{arguments:?}");
        assert_eq!(ours.len(), theirs.len(), "{arguments:?}");
    } else {
        eprintln!("{driver} and {other} are of two versions: coordinates are not held");
        let overlap = overlap(&ours, &theirs);
        assert!(overlap >= 0.9999, "{arguments:?}: {overlap}");
    }
}

#[test]
fn osmesa_records_are_bit_identical_to_those_of_lavapipe() {
    // A record buffer that overflows; shadow cascades. The plain picture is compared as well.
    check_llvmpipe(&["teapot", "--size", "96x80", "--record-budget", "64KiB"]);
    check_llvmpipe(&["atrium-shadows", "--size", "96x80", "--views", "left"]);
}

/// Writes a slanted floor whose texture is rotated, scaled and moved by KHR_texture_transform.
fn write_turned_floor(folder: &Path) -> PathBuf {
    let positions = [
        [-4.0, -1.0, 1.0],
        [4.0, -1.3, 1.0],
        [4.0, -0.7, -9.0],
        [-4.0, -0.9, -9.0_f32],
    ];
    let coordinates = [[0.1, 0.2], [5.3, 0.3], [5.1, 7.7], [0.4, 7.9_f32]];
    let mut bytes = Vec::new();
    let numbers = positions
        .as_flattened()
        .iter()
        .chain(coordinates.as_flattened());
    numbers.for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes.extend([0_u16, 1, 2, 0, 2, 3].map(u16::to_le_bytes).as_flattened());
    std::fs::write(folder.join("floor.bin"), &bytes).expect("a file");
    let image = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 99]));
    image.save(folder.join("floor.png")).expect("a file");
    let scene = serde_json::json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_texture_transform"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "buffers": [{ "uri": "floor.bin", "byteLength": 92 }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 12 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [-4.0, -1.3, -9.0], "max": [4.0, -0.7, 1.0] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "images": [{ "uri": "floor.png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "doubleSided": true, "pbrMetallicRoughness": { "baseColorTexture": {
            "index": 0,
            "extensions": { "KHR_texture_transform": {
                "offset": [0.37, 0.21], "rotation": 0.7, "scale": [1.3, 0.9]
            } },
        } } }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0
        }] }],
    });
    let file = folder.join("floor.gltf");
    std::fs::write(&file, scene.to_string()).expect("a file");
    file
}

#[test]
fn osmesa_records_equal_those_of_lavapipe_for_a_texture_transform() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = write_turned_floor(folder.path());
    let view = [
        "--eye",
        "0,0.5,0",
        "--target",
        "0,-0.5,-4",
        "--size",
        "128x128",
    ];
    check_llvmpipe(&[&[scene.to_str().expect("UTF-8")][..], &view].concat());
}

#[test]
fn osmesa_records_equal_those_of_lavapipe_in_a_real_scene() {
    let Some(scene) = real_scene("stk-cocoa-temple/stk-cocoa-temple.gltf") else {
        return;
    };
    // Its grass is coplanar with its ground, so the last bit decides the order of equal depths.
    check_llvmpipe(&[&scene.to_string_lossy(), "--size", "128x128"]);
}

#[test]
fn softpipe_draws_almost_the_same_fragments() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["teapot", "--size", "64x64", "--no-plain"];
    let Some(softpipe) = capture(folder.path(), "osmesa", "softpipe", &arguments) else {
        return;
    };
    // Differences from the reference are caused by its quads without cross terms.
    let mut verify = program("tracegen");
    verify.args(["verify", "teapot", "--json", "--trace"]);
    let report = run_ok(verify.arg(&softpipe)).stdout;
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    let count = |pointer: &str| report.pointer(pointer).and_then(serde_json::Value::as_u64);
    assert_eq!(
        report["uv_error_texels"]["causes"][1]["cause"], "no-cross",
        "{report:#}"
    );
    assert!(
        count("/uv_error_texels/causes/1/count") > Some(500),
        "{report:#}"
    );
    for unexplained in ["/uv_error_texels/causes/4", "/specification/causes/5"] {
        let count = count(&format!("{unexplained}/count"));
        assert_eq!(count, Some(0), "{unexplained} of {report:#}");
    }
    let (softpipe, driver) = sampled(&softpipe);
    assert!(driver.starts_with("softpipe"), "{driver}");
    let lavapipe = capture(folder.path(), "lavapipe", "softpipe", &arguments);
    let (lavapipe, _) = sampled(&lavapipe.expect("no OSMesa in lavapipe"));
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
        &["--shadows", "--shadow-format", "bc4"],
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
            &[
                flags[flags.len().saturating_sub(2)],
                "--backend lavapipe",
                "plain frames",
            ],
        );
    }
}

#[test]
fn a_missing_library_is_reported_with_its_file_and_package() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The loader takes the first file with that name, and this one is not a library.
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
    // Without a Vulkan driver, both are named.
    let mut auto = command("auto");
    auto.env("VK_DRIVER_FILES", folder.path())
        .env("VK_ICD_FILENAMES", folder.path());
    refuse(&mut auto, &["mesa-vulkan-drivers", named[0], named[1]]);
    run_ok(command("auto").arg("--no-plain"));
}
