//! Every field of samplers and image views that decides addresses: the footprints and the bytes of a full-screen draw
//! that differs in this field follow from arithmetic.
//!
//! The picture has 64x64 pixels, the texture 64x64 texels of 4 bytes, and a line 16 bytes, so a row of level 0 is 16
//! lines. A draw of 4096 fragments that covers the texture once reads 4096 texels, 16384 bytes.

use formats::footprint::{SamplingOptions, record_footprints};
use formats::layout::{Layout, LayoutConfig};
use formats::textrace::{Textrace, Tile, with_operands};
use parallax_tests::{has_lavapipe, program, run_ok};
use serde_json::Value;
use std::collections::HashSet;
use std::path::Path;

const LINE_BYTES: u64 = 16;

/// Field, footprints and bytes. Sums of bytes are by level or by kind of line.
const FIELDS: &[(&str, u64, u64)] = &[
    ("base", 4096, 16384),
    // 32 columns and rows; with a linear filter also those around them, of which one wraps: 10 lines of 34 rows.
    ("mag-nearest", 4096, 8 * 32 * 16),
    ("mag-linear", 4096, 10 * 34 * 16),
    // Every second row, or all.
    ("min-nearest", 4096, 8192),
    ("min-linear", 4096, 16384),
    // Three texels per pixel: level of detail 1.56.
    ("mip-nearest", 4096, 1024),
    ("mip-linear", 8192, 4096 + 1024),
    // Columns 32 to 79: of those from 64 on, a repeated texture reads 4 lines more.
    ("wrap-repeat", 4096, 12 * 64 * 16),
    ("wrap-mirrored", 4096, 8 * 64 * 16),
    ("wrap-clamp", 4096, 64 * 16),
    // 43 columns of pixels are within the texture.
    ("wrap-border", 43 * 64, 8 * 64 * 16),
    ("wrap-mirror-once-before", 4096, 8 * 64 * 16),
    ("wrap-mirror-once-after", 4096, 64 * 16),
    ("wrap-v", 4096, 8 * 16),
    ("lod-bias", 4096, 4096),
    ("lod-bias-negative", 4096, 8 * 16 * 16),
    ("min-lod", 4096, 256),
    // Every fourth column and row of level 1.
    ("max-lod", 4096, 8 * 8 * 16),
    // Magnified, so nearest: every second row.
    ("max-lod-zero", 4096, 8192),
    // Every fourth row of level 0, every second one of level 1.
    ("max-lod-quarter", 8192, 16 * 16 * 16 + 8 * 16 * 16),
    // Eight texels by one per pixel: levels 3 and 4, or all of level 0 in eight footprints, or levels 2 and 3 in two.
    ("aniso-off", 2 * 4096, 256 + 64),
    ("aniso-16", 8 * 4096, 16384),
    ("aniso-2", 2 * 2 * 4096, 1024 + 256),
    ("aniso-nearest", 8 * 4096, 16384),
    ("aniso-flat", 8 * 4096, 16384),
    ("aniso-bias", 8 * 2 * 4096, 4096 + 1024),
    ("aniso-own-bias", 8 * 2 * 4096, 4096 + 1024),
    ("aniso-level", 4096, 16384),
    ("aniso-gradients", 8 * 4096, 16384),
    ("aniso-gather", 4096, 16384),
    // 33 rows of each of two layers, of which one is the first or the last. A layer has 21844 bytes, so layer 1
    // starts in the middle of a line, and each of its two runs of rows has a line more.
    ("aniso-array", 8 * 4096, 2 * 33 * 16 * 16 + 2 * 16),
    ("aniso-cube", 8 * 4096, 16384),
    ("aniso-mixed", 8 * 4096 + 2 * 4096, 16384 + 256 + 64),
    ("unnormalized", 4096, 8 * 32 * 16),
    // Columns 31 to 63, and 0 where the face repeats.
    ("cube", 4096, 9 * 33 * 16),
    ("cube-seams", 4096, 10 * 34 * 16),
    ("view-level", 4096, 1024),
    ("view-levels", 4096, 1024),
    ("view-layer", 4096, 16384 + 16),
    ("view-swizzle", 2 * 4096, 16384),
    // The same texels through two views, then others.
    ("views-of-levels", 2 * 4096, 4096),
    ("views-of-formats", 2 * 4096, 16384),
    ("views-of-layers", 2 * 4096, 16384 + 16),
    ("views-apart", 2 * 4096, 2 * 16384 + 16),
    ("immutable", 8 * 4096, 16384),
    ("pushed", 8 * 4096, 16384),
    ("pushed-immutable", 8 * 4096, 16384),
];

/// Captures a frame for each of the fields.
fn capture(fields: &[&str], trace: &Path) {
    let mut command = program("tracegen");
    command
        .args(["app", "--eyes", "mono", "--check", "--frames"])
        .arg(format!("0..{}", fields.len()))
        .arg("-o")
        .arg(trace);
    command
        .args(["--", env!("CARGO_BIN_EXE_vulkan_program"), "--fields"])
        .arg(fields.join(","));
    let said = String::from_utf8_lossy(&run_ok(&mut command).stderr).into_owned();
    assert!(said.contains("0 different"), "{said}");
    assert!(!said.contains("not in the trace"), "{said}");
}

/// Footprints and bytes of each frame by the reference.
fn counted(trace: &Textrace, sampling: &SamplingOptions) -> Vec<(u64, u64)> {
    let tables = trace.tables();
    let layout = Layout::new(&tables.textures, &LayoutConfig::default()).expect("a layout");
    let frames = tables.meta.frames.len();
    let mut found = vec![(0, HashSet::new()); frames];
    let mut tile = Tile::default();
    for (number, pass) in tables.passes.iter().enumerate() {
        let (footprints, lines) = &mut found[pass.frame as usize];
        for index in 0..pass.tile_count() {
            let decoded = trace.decode_tile(number, index as usize, &mut tile);
            decoded.expect("a tile");
            for run in &tile.runs {
                let of_run = run.first as usize..(run.first + run.count) as usize;
                for (record, before) in with_operands(&tile.records[of_run]) {
                    record_footprints(tables, run.draw, record, before, sampling, |sample, f| {
                        *footprints += 1;
                        for texel in f.texels() {
                            let (layer, level) = (f.layer.into(), f.level.into());
                            let at = layout.address(sample.texture, layer, level, texel);
                            lines.insert(at.expect("an address") / LINE_BYTES);
                        }
                    });
                }
            }
        }
    }
    let bytes =
        |(footprints, lines): &(u64, HashSet<u64>)| (*footprints, lines.len() as u64 * LINE_BYTES);
    found.iter().map(bytes).collect()
}

/// Footprints and bytes of all frames by `replay run`.
fn replayed(trace: &Path, flags: &[&str]) -> (u64, u64) {
    let mut command = program("replay");
    command.arg("run").arg(trace);
    command.args(["--mode", "functional", "--json"]).args(flags);
    let result: Value = serde_json::from_slice(&run_ok(&mut command).stdout).expect("JSON");
    let number = |key: &str| result["result"][key].as_u64().expect("a count");
    (number("footprints"), number("unique_lines") * LINE_BYTES)
}

#[test]
fn every_field_of_samplers_and_views_decides_addresses_as_arithmetic_says() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("fields.textrace");
    let names: Vec<&str> = FIELDS.iter().map(|(name, _, _)| *name).collect();
    capture(&names, &path);
    let trace = Textrace::open(&path).expect("a trace");
    // Version 5 is version 3 with equal tiles stored once.
    assert_eq!(trace.container().version(), (5, 0));
    let found = counted(&trace, &SamplingOptions::default());
    let wrong: Vec<String> = FIELDS
        .iter()
        .zip(&found)
        .filter(|((_, footprints, bytes), found)| (*footprints, *bytes) != **found)
        .map(|((name, footprints, bytes), found)| {
            format!("{name}: expected {footprints} footprints and {bytes} bytes, found {found:?}")
        })
        .collect();
    assert!(
        wrong.is_empty() && found.len() == FIELDS.len(),
        "{wrong:#?}"
    );
    run_ok(program("replay").arg("validate").arg(&path));
    let footprints: u64 = FIELDS.iter().map(|(_, footprints, _)| footprints).sum();
    assert_eq!(replayed(&path, &[]).0, footprints);
    // The replay's own anisotropy is instead of the recorded ones.
    let isotropic = SamplingOptions {
        max_anisotropy: Some(1),
        ..SamplingOptions::default()
    };
    let without: u64 = counted(&trace, &isotropic).iter().map(|(n, _)| n).sum();
    assert!(without < footprints);
    assert_eq!(replayed(&path, &["--max-anisotropy", "1"]).0, without);
}

#[test]
fn traces_of_isotropic_samplers_are_version_2_and_the_fast_replay_counts_the_same() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("field.textrace");
    for (name, version) in [
        ("base", 2),
        ("view-level", 2),
        ("views-apart", 2),
        ("views-of-levels", 3),
        ("aniso-mixed", 3),
    ] {
        capture(&[name], &path);
        let trace = Textrace::open(&path).expect("a trace");
        assert_eq!(trace.container().version(), (version, 0), "{name}");
        let all = FIELDS.iter().find(|(other, _, _)| *other == name);
        let &(_, footprints, bytes) = all.expect("a field");
        // Without other views of the image, each layer is a texture of its own, which starts at a line's start.
        let bytes = if name == "views-apart" {
            bytes - LINE_BYTES
        } else {
            bytes
        };
        assert_eq!(replayed(&path, &[]), (footprints, bytes), "{name}");
    }
}
