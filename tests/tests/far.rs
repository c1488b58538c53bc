//! Position and size of a scene change neither picture nor trace, and eyes at the same place have the same
//! view.

use formats::textrace::{Textrace, Tile};
use parallax_tests::{program, real_scene, refuse, run_ok};
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const SIZE: &str = "128x128";

/// A unit sphere whose vertices are multiples of 2^-20, so that they are exact 64-bit numbers even at 10^7.
struct Sphere {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
}

impl Sphere {
    fn new() -> Self {
        const COLUMNS: usize = 48;
        const ROWS: usize = 24;
        let snap = |x: f64| (x * f64::from(1 << 20)).round() / f64::from(1 << 20);
        let mut vertices = Vec::new();
        for row in 0..=ROWS {
            let (sine, cosine) = (PI * row as f64 / ROWS as f64).sin_cos();
            for column in 0..COLUMNS {
                let (z, x) = (2.0 * PI * column as f64 / COLUMNS as f64).sin_cos();
                vertices.push([sine * x, cosine, sine * z].map(snap));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let next = (column + 1) % COLUMNS;
                let [a, b] = [column, next].map(|c| row * COLUMNS + c);
                let (c, d) = (a + COLUMNS, b + COLUMNS);
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        Self {
            vertices,
            triangles,
        }
    }

    /// With the position in the vertices.
    fn obj(&self, at: [f64; 3], scale: f64) -> String {
        let mut obj = String::new();
        for v in &self.vertices {
            let [x, y, z] = [0, 1, 2].map(|axis| at[axis] + scale * v[axis]);
            writeln!(obj, "v {x} {y} {z}").expect("a string grows");
        }
        for [a, b, c] in self.triangles.iter().map(|t| t.map(|v| v + 1)) {
            writeln!(obj, "f {a} {b} {c}").expect("a string grows");
        }
        obj
    }

    /// With the position in the node.
    fn gltf(&self, at: [f64; 3], scale: f64) -> String {
        let positions = self.vertices.iter().flatten().map(|&v| v as f32);
        let indices = self.triangles.iter().flatten().map(|&v| v as u32);
        let bytes: Vec<u8> = (positions.flat_map(f32::to_le_bytes))
            .chain(indices.flat_map(u32::to_le_bytes))
            .collect();
        let escaped = bytes.iter().fold(String::new(), |mut text, byte| {
            write!(text, "%{byte:02x}").expect("a string grows");
            text
        });
        let [split, end] = [self.vertices.len() * 12, bytes.len()];
        serde_json::json!({
            "asset": {"version": "2.0"},
            "nodes": [{"mesh": 0, "translation": at, "scale": [scale, scale, scale]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": self.vertices.len(), "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 3 * self.triangles.len(), "type": "SCALAR"}
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": split},
                {"buffer": 0, "byteOffset": split, "byteLength": end - split}
            ],
            "buffers": [{"byteLength": end, "uri": format!("data:application/octet-stream,{escaped}")}]
        })
        .to_string()
    }
}

fn list([x, y, z]: [f64; 3]) -> String {
    format!("{x},{y},{z}")
}

/// Writes the scene, captures it from a distance of 3.25 half extents (or with the flags in `view`), and
/// returns the trace's tiles.
fn capture(folder: &Path, file: &str, text: &str, view: &[String]) -> Vec<Tile> {
    let [scene, trace] = [file, "a.textrace"].map(|name| folder.join(name));
    std::fs::write(&scene, text).expect("writable");
    run_ok(
        program("tracegen")
            .arg("raster")
            .arg(&scene)
            .args(["--size", SIZE, "--hfov", "60", "--no-plain", "-o"])
            .arg(&trace)
            .args(view),
    );
    tiles(&trace)
}

fn tiles(trace: &Path) -> Vec<Tile> {
    let trace = Textrace::open(trace).expect("a trace");
    let passes = trace.tables().passes.iter().enumerate();
    passes
        .flat_map(|(pass, of)| (0..of.tile_count() as usize).map(move |tile| (pass, tile)))
        .map(|(pass, index)| {
            let mut tile = Tile::default();
            trace.decode_tile(pass, index, &mut tile).expect("a tile");
            tile
        })
        .collect()
}

fn quads(tiles: &[Tile]) -> usize {
    tiles.iter().map(|tile| tile.records.len()).sum()
}

/// `--eye` and `--target` for a head in front of a sphere with this position and size.
fn before(at: [f64; 3], scale: f64) -> Vec<String> {
    let [x, y, z] = at;
    let eye = [x + 0.5 * scale, y + 0.25 * scale, z + 3.25 * scale];
    vec!["--eye".into(), list(eye), "--target".into(), list(at)]
}

const PLACES: [[f64; 3]; 5] = [
    [1e3, 0.0, 0.0],
    [0.0, 1e5, -1e5],
    [1e5, 1e5, 1e5],
    [-1e6, 1e6, 2e6],
    [1e7, -1e7, 1e7],
];

#[test]
fn a_sphere_has_the_same_records_from_zero_to_ten_million() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sphere = Sphere::new();
    let seen = |at, file, text: &str| capture(folder.path(), file, text, &before(at, 1.0));
    let node = |at| seen(at, "a.gltf", &sphere.gltf(at, 1.0));
    let baked = |at| seen(at, "a.obj", &sphere.obj(at, 1.0));
    let (by_node, by_vertices) = (node([0.0; 3]), baked([0.0; 3]));
    assert!(quads(&by_node) > 2000, "{}", quads(&by_node));
    assert!(by_node == by_vertices, "loaders agree");
    for at in PLACES {
        assert!(by_node == node(at), "by its node at {at:?}");
        assert!(by_vertices == baked(at), "by its vertices at {at:?}");
    }
}

#[test]
fn a_head_on_a_path_far_from_the_origin_has_the_same_records() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sphere = Sphere::new();
    let along = |at: [f64; 3]| {
        let csv = folder.path().join("path.csv");
        let pose = |time: f64, x: f64, z: f64| {
            let [x, y, z] = [at[0] + x, at[1] + 0.125, at[2] + z];
            format!("{time},{x},{y},{z},0,0,0,1\n")
        };
        let header = "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n";
        let text = [header.into(), pose(0.0, 0.0, 3.0), pose(1.0, 0.5, 2.5)].concat();
        std::fs::write(&csv, text).expect("writable");
        let mut flags: Vec<String> = ["--frames", "2", "--fps", "2", "--path-origin", "world"]
            .map(String::from)
            .to_vec();
        flags.extend(["--path".into(), csv.display().to_string()]);
        capture(folder.path(), "a.gltf", &sphere.gltf(at, 1.0), &flags)
    };
    let here = along([0.0; 3]);
    assert!(quads(&here) > 4000, "{}", quads(&here));
    for at in [PLACES[2], PLACES[4]] {
        assert!(here == along(at), "{at:?}");
    }
}

#[test]
fn a_sphere_of_any_size_has_the_same_records() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sphere = Sphere::new();
    let of = |scale: f64, text: String, name: &str, flags: &[&str]| {
        let mut view = before([0.0; 3], scale);
        // Eye distance in proportion to the radius.
        view.extend(["--ipd".into(), (64.0 * scale).to_string()]);
        view.extend(flags.iter().map(|&flag| flag.to_owned()));
        capture(folder.path(), name, &text, &view)
    };
    let node = |scale: f64| of(scale, sphere.gltf([0.0; 3], scale), "a.gltf", &[]);
    let baked = |scale: f64| of(scale, sphere.obj([0.0; 3], scale), "a.obj", &[]);
    let same = [node(1.0), baked(1.0)];
    for exponent in [-20, 20] {
        // Powers of two round like 1.
        let scale = 2f64.powi(exponent);
        assert!(same[0] == node(scale), "by its node at 2^{exponent}");
        assert!(same[1] == baked(scale), "by its vertices at 2^{exponent}");
    }
    for scale in [1e-6, 1e6] {
        for (same, other) in same.iter().zip([node(scale), baked(scale)]) {
            // A vertex may round to the next multiple of 1/256 pixel.
            let [a, b] = [quads(same), quads(&other)];
            assert!(a.abs_diff(b) * 500 <= a, "{a} quads, at {scale} {b}");
        }
    }
    // Shadow cascades are fitted in steps of 1/16 m for scenes as large as buildings, and in steps relative
    // to their size for much smaller and larger ones.
    let shadows = |exponent: i32| {
        let scale = 2f64.powi(exponent);
        of(scale, sphere.obj([0.0; 3], scale), "a.obj", &["--shadows"])
    };
    for [a, b] in [[-20, -10], [10, 20]] {
        let (a, b) = (shadows(a), shadows(b));
        assert!(a != same[1], "the lookups are recorded");
        assert!(a == b);
    }
}

#[test]
fn a_trace_far_from_the_origin_records_its_origin_and_a_camera_without_direction_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = PLACES[4];
    let flags = before(at, 1.0);
    capture(folder.path(), "a.obj", &Sphere::new().obj(at, 1.0), &flags);
    let trace = Textrace::open(&folder.path().join("a.textrace")).expect("a trace");
    let meta = &trace.tables().meta;
    assert_eq!(meta.origin_m, at);
    let [left, right] = meta.frames[0].eyes.map(|eye| eye.position);
    let middle = [0, 1, 2].map(|axis| f64::from(left[axis] + right[axis]) / 2.0);
    for (found, expected) in middle.iter().zip([0.5, 0.25, 3.25]) {
        assert!((found - expected).abs() < 1e-6, "{middle:?}");
    }
    let listed = run_ok(
        program("tracegen")
            .args(["scenes", "--json"])
            .arg(folder.path().join("a.obj")),
    );
    let listed: serde_json::Value = serde_json::from_slice(&listed.stdout).expect("JSON");
    assert_eq!(
        listed["bounds_m"][0],
        serde_json::json!(at.map(|x| x - 1.0))
    );
    refuse(
        program("tracegen")
            .arg("raster")
            .arg(folder.path().join("a.obj"))
            .args(["--eye", "1e7,2,3", "--target", "1e7,2,3", "-o"])
            .arg(folder.path().join("b.textrace")),
        &["a target away from the eye"],
    );
}

/// External bytes of a trace in an order. The caches hold the lines of a pair of tiles, but not those of a
/// picture.
fn external_bytes(trace: &Path, order: &str, caches: [&str; 4]) -> f64 {
    let [l1, l1_ways, l2, l2_ways] = caches;
    let run = run_ok(
        program("replay")
            .arg("run")
            .arg(trace)
            .args(["--order", order, "--mode", "functional", "--json"])
            .args(["--l1", l1, "--l1-ways", l1_ways])
            .args(["--l2", l2, "--l2-ways", l2_ways, "--cores", "1"]),
    );
    let run: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
    run["result"]["external_bytes"].as_f64().expect("a number")
}

/// With both eyes at the same place, pictures and records are equal, and Z2 STA needs half of Morton's
/// external bytes.
fn check_eyes_in_one_place(scene: &str, size: &str, caches: [&str; 4]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [trace, picture]: [PathBuf; 2] =
        ["a.textrace", "a.png"].map(|name| folder.path().join(name));
    run_ok(
        program("tracegen")
            .args([
                "raster",
                scene,
                "--ipd",
                "0",
                "--no-plain",
                "--size",
                size,
                "-o",
            ])
            .arg(&trace)
            .arg("--image")
            .arg(&picture),
    );
    let tiles = tiles(&trace);
    let [left, right] = [&tiles[..tiles.len() / 2], &tiles[tiles.len() / 2..]];
    assert!(quads(left) > 1000 && left == right, "records of both eyes");
    let both = image::open(&picture).expect("a picture").into_rgb8();
    let half = both.width() / 2;
    let differs = both
        .enumerate_pixels()
        .any(|(x, y, pixel)| *pixel != *both.get_pixel((x + half) % (2 * half), y));
    assert!(!differs, "pictures of both eyes");
    let [sta, morton] = ["z2-sta", "morton"].map(|order| external_bytes(&trace, order, caches));
    let percent = 100.0 * sta / morton;
    eprintln!("{scene} {size}: Z2 STA at {percent:.3} % of Morton's external bytes");
    assert!((percent - 50.0).abs() <= 0.1, "{sta} of {morton} bytes");
}

#[test]
fn eyes_at_the_same_place_have_equal_records_and_z2_sta_needs_half_of_the_bytes() {
    check_eyes_in_one_place("atrium", "128x128", ["2KiB", "16", "8KiB", "64"]);
    if let Some(scene) = real_scene("crytek-sponza/sponza.gltf") {
        let scene = scene.to_string_lossy();
        check_eyes_in_one_place(&scene, "240x270", ["8KiB", "4", "16KiB", "16"]);
    }
}
