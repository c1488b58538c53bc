//! A small generated folder of techniques: pictures, traces and a manifest.

use super::manifest::{Frame, ManifestRow};
use image_error::{Picture, png};
use serde_json::{Value, json};
use sim::stream::testing::Synthetic;
use sim::stream::testing::file_of;
use std::fs;
use std::path::Path;

/// Pixels of an eye's picture.
pub const SIZE_PX: [u32; 2] = [64, 48];

/// A row with frames 0, 1, ... that take as long as the baseline's.
pub fn row(technique: &str, frames: u32) -> ManifestRow {
    ManifestRow {
        technique: technique.into(),
        title: technique.into(),
        settings: Value::Null,
        parts: vec![technique.into()],
        lossless: true,
        frames: (0..frames).map(|number| frame(technique, number)).collect(),
        peak_memory_bytes: None,
        texture_bytes: None,
        trace: None,
        trace_checksum: None,
        trace_frames: Vec::new(),
    }
}

fn frame(technique: &str, number: u32) -> Frame {
    serde_json::from_value(frame_json(technique, number)).expect("a frame")
}

fn frame_json(technique: &str, number: u32) -> Value {
    let image = |eye: &str| format!("images/{technique}/{number:04}-{eye}.png");
    json!({
        "frame": number, "cull_tests": 1000, "cull_s": 1e-4, "false_negatives": 0, "false_positives": 3,
        "draws": 80, "draw_calls": 40, "state_changes": 7, "vertices": 9000, "triangles": 3000,
        "quads": 900, "fragments": 3072, "bytes_uploaded": 4096,
        "frame_s": [1.0, 1.0, 1.0], "baseline_s": [1.0, 1.0, 1.0],
        "stages_s": { "cull": 1e-4, "render": 0.9 },
        "images": [image("left"), image("right")],
        "predicted": {},
    })
}

/// The manifest of [`folder`]: the baseline, a lossless technique that halves tests and time, and a
/// lossy one that is grey in a corner of every other frame.
pub fn manifest() -> Value {
    let rows = [
        ("per-eye", 1.0, true),
        ("superfrustum", 0.5, true),
        ("grey", 0.8, false),
    ];
    let rows: Vec<Value> = rows
        .into_iter()
        .map(|(technique, time, lossless)| {
            let frames = (0..3).map(|number| {
                let mut frame = frame_json(technique, number);
                frame["frame_s"] = json!([time, 1.1 * time, 0.9 * time]);
                frame["baseline_s"] = json!([1.0, 1.1, 0.9]);
                frame["cull_tests"] = json!((1000.0 * time) as u64);
                frame
            });
            json!({
                "technique": technique, "title": technique, "settings": { "culling": technique }, "parts": [technique],
                "lossless": lossless, "frames": frames.collect::<Vec<_>>(),
                "peak_memory_bytes": 1_000_000, "trace": format!("traces/{technique}.textrace"), "trace_frames": [0],
            })
        })
        .collect();
    let fov = json!({ "left": 1.0, "right": 1.0, "up": 1.0, "down": 1.0 });
    let lens = json!({ "center": [0.0, 0.0], "radius": 1.0 });
    json!({
        "schema": "tracegen.techniques/1", "tool": "tracegen 0.1.0", "scene": "plant", "scene_triangles": 30000,
        "instances": 300, "camera": "default", "path": "head", "frames": [0, 1, 2], "fps": 72.0, "size_px": SIZE_PX,
        "hmd": { "name": "custom", "source": "unverified", "eye_size_px": SIZE_PX, "fov": [fov, fov], "ipd_m": 0.064, "cant_deg": 0.0 },
        "lens": [lens, lens], "pixels_per_degree": 4.0, "adapter": "llvmpipe", "driver": "Mesa", "software_driver": true,
        "baseline": "per-eye", "rows": rows,
    })
}

/// A picture that depends on the frame number.
fn picture(number: u32) -> Picture {
    let mut picture = Picture::filled(SIZE_PX, [0; 3]);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = (i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]);
        let checks = (x / 8 + y / 8 + number) % 2;
        *pixel = [(2 * x) as u8, (4 * y) as u8, 60 + 120 * checks as u8];
    }
    picture
}

/// Writes the folder.
pub fn folder(path: &Path) {
    write(path, &manifest());
}

/// Writes a folder with this manifest and the files that [`manifest`] names.
pub fn write(path: &Path, manifest: &Value) {
    for technique in ["per-eye", "superfrustum", "grey"] {
        let images = path.join("images").join(technique);
        fs::create_dir_all(&images).expect("a folder");
        for number in 0..3 {
            let mut picture = picture(number);
            if technique == "grey" && number % 2 == 1 {
                for (i, pixel) in picture.pixels.iter_mut().enumerate() {
                    let (x, y) = (i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]);
                    if (24..40).contains(&x) && (16..32).contains(&y) {
                        *pixel = [128; 3];
                    }
                }
            }
            let bytes = png::encode(&picture).expect("a picture");
            for eye in ["left", "right"] {
                let file = images.join(format!("{number:04}-{eye}.png"));
                fs::write(file, &bytes).expect("a file");
            }
        }
        let trace = Synthetic {
            layers: if technique == "grey" { 1 } else { 2 },
            ..Synthetic::one_layer(SIZE_PX, 16)
        };
        let file = path
            .join("traces")
            .join(technique)
            .with_extension("textrace");
        fs::create_dir_all(path.join("traces")).expect("a folder");
        fs::copy(file_of(&trace.generate()).path(), file).expect("a file");
    }
    let text = serde_json::to_string_pretty(manifest).expect("JSON");
    fs::write(path.join("manifest.json"), text).expect("a file");
}
