//! End-to-end tests of animated scenes: the trace of each pose equals the trace of a static file with
//! the posed vertices.

use formats::Trace;
use formats::raytrace::{RayTile, UpdateMethod};
use formats::textrace::{Textrace, Tile};
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, refuse, run_ok};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// Corners of a board of two stacked quads, and their texture coordinates.
const CORNERS: [[f32; 3]; 6] = [
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 2.0, 0.0],
    [1.0, 2.0, 0.0],
];
const INDICES: [u16; 12] = [0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5];

/// Displacements of the board's morph target.
const TARGET: [[f32; 3]; 6] = [[0.0, 0.0, 0.5]; 6];

/// Weight of the upper joint per corner: it grows with the height of the row.
const WEIGHTS: [[f32; 4]; 6] = [
    [1.0, 0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0],
    [0.5, 0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
];

/// Builder of a glTF file.
struct File {
    json: Value,
    bytes: Vec<u8>,
}

impl File {
    /// Three boards side by side, each with its own node and mesh, a textured material and a camera.
    fn new(positions: [&[[f32; 3]; 6]; 3]) -> Self {
        let mut file = Self {
            json: json!({
                "asset": {"version": "2.0"},
                "scenes": [{"nodes": [0, 1, 2, 3]}],
                "nodes": [
                    {"mesh": 0}, {"mesh": 1}, {"mesh": 2},
                    {"name": "front", "camera": 0, "translation": [0, 1, 6]}
                ],
                "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.125, "zfar": 64}}],
                "materials": [{"name": "cloth", "doubleSided": true,
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}],
                "textures": [{"source": 0}],
                "images": [{"uri": "cloth.png"}],
                "accessors": [], "bufferViews": [], "meshes": []
            }),
            bytes: Vec::new(),
        };
        let uv: [[f32; 2]; 6] = CORNERS.map(|[x, y, _]| [x, y]);
        let uv = file.floats("VEC2", &uv);
        let indices: Vec<u8> = INDICES.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = file.accessor(&indices, 5123, "SCALAR", INDICES.len());
        for corners in positions {
            let position = file.floats("VEC3", corners);
            let mesh = json!({"primitives": [{"attributes": {"POSITION": position, "TEXCOORD_0": uv},
                "indices": indices, "material": 0}]});
            file.push("meshes", mesh);
        }
        file
    }

    fn push(&mut self, table: &str, row: Value) -> usize {
        let rows = self.json[table].as_array_mut().expect("a table");
        rows.push(row);
        rows.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], kind: u32, of: &str, count: usize) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        let view = self.push("bufferViews", view);
        let accessor =
            json!({"bufferView": view, "componentType": kind, "type": of, "count": count});
        self.push("accessors", accessor)
    }

    fn floats<const N: usize>(&mut self, of: &str, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values
            .as_flattened()
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        self.accessor(&bytes, 5126, of, values.len())
    }

    fn write(mut self, folder: &Path, name: &str) -> String {
        let escaped: String = self.bytes.iter().map(|b| format!("%{b:02x}")).collect();
        let uri = format!("data:application/octet-stream,{escaped}");
        self.json["buffers"] = json!([{"uri": uri, "byteLength": self.bytes.len()}]);
        let cloth = image::RgbImage::from_fn(64, 64, |x, y| {
            image::Rgb([(x * 4) as u8, (y * 4) as u8, ((x ^ y) * 4) as u8])
        });
        cloth.save(folder.join("cloth.png")).expect("writable");
        let file = folder.join(name);
        fs::write(&file, self.json.to_string()).expect("writable");
        file.to_str().expect("a path of Unicode").to_owned()
    }
}

/// The time of the last key, seconds. All values in between are sums of few powers of two, so that
/// every evaluation of them is exact.
const END_S: f32 = 1.0;

/// A board on a moving node, a skinned one and a morphed one, all moving at a constant rate.
fn animated(folder: &Path) -> String {
    let mut file = File::new([&CORNERS; 3]);
    let [lower, upper] = [4, 5];
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, lower]);
    file.push(
        "nodes",
        json!({"translation": [0, 0, 0], "children": [upper]}),
    );
    file.push("nodes", json!({"translation": [0, 0, 0]}));
    file.json["nodes"][1]["skin"] = json!(0);
    // The joints place a skinned mesh.
    file.json["nodes"][1]["translation"] = json!([9, 9, 9]);
    let joints = file.accessor(&[0, 1, 0, 0].repeat(6), 5121, "VEC4", 6);
    let weights = file.floats("VEC4", &WEIGHTS);
    let attributes = &mut file.json["meshes"][1]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (joints.into(), weights.into());
    file.json["skins"] = json!([{"joints": [lower, upper]}]);
    let target = file.floats("VEC3", &TARGET);
    file.json["meshes"][2]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    let input = file.floats("SCALAR", &[[0.0], [END_S]]);
    let outputs = [
        (
            0,
            "translation",
            file.floats("VEC3", &[[-2.0, 0.0, 0.0], [-2.0, 1.0, 0.0]]),
        ),
        (
            upper,
            "translation",
            file.floats("VEC3", &[[0.0; 3], [1.0, 0.0, 1.0]]),
        ),
        (2, "weights", file.floats("SCALAR", &[[0.0], [4.0]])),
    ];
    let samplers: Vec<Value> = outputs
        .iter()
        .map(|(.., output)| json!({"input": input, "output": output}))
        .collect();
    let channels: Vec<Value> = (outputs.iter().enumerate())
        .map(|(i, (node, path, _))| json!({"sampler": i, "target": {"node": node, "path": path}}))
        .collect();
    file.json["animations"] = json!([{"name": "wave", "samplers": samplers, "channels": channels}]);
    file.write(folder, "animated.gltf")
}

/// The boards as they are at a time.
fn baked(folder: &Path, time_s: f32) -> String {
    let mut corners = [CORNERS; 3];
    for vertex in 0..CORNERS.len() {
        let follows = WEIGHTS[vertex][1] * time_s;
        corners[1][vertex][0] += follows;
        corners[1][vertex][2] += follows;
        corners[2][vertex][2] += TARGET[vertex][2] * 4.0 * time_s;
    }
    let [first, second, third] = &corners;
    let mut file = File::new([first, second, third]);
    file.json["nodes"][0]["translation"] = json!([-2.0, time_s, 0.0]);
    file.write(folder, &format!("baked-{time_s}.gltf"))
}

fn capture(folder: &Path, command: &str, scene: &str, flags: &[&str]) -> Trace {
    let trace = folder.join("trace");
    let mut capture = program("tracegen");
    capture
        .args([command, scene, "--size", "96x64"])
        .args(flags);
    run_ok(capture.arg("-o").arg(&trace));
    Trace::open(&trace).expect("a trace")
}

fn content(folder: &Path, command: &str, scene: &str, flags: &[&str]) -> u32 {
    capture(folder, command, scene, flags).content_checksum()
}

#[test]
fn a_pose_has_the_trace_of_a_static_file_in_that_pose() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let scene = animated(folder);
    for command in ["raster", "rays"] {
        let of = |scene: &str, flags: &[&str]| content(folder, command, scene, flags);
        let times = [0.0, 0.25, 0.5, 1.0].map(|time_s: f32| {
            let text = time_s.to_string();
            let found = of(&scene, &["--time", &text]);
            assert_eq!(
                found,
                of(&baked(folder, time_s), &[]),
                "{command} at {time_s} s"
            );
            found
        });
        let mut different = times.to_vec();
        different.sort_unstable();
        different.dedup();
        assert_eq!(different.len(), times.len(), "{command}");
        // Time 0 is the default, and the animation repeats after its end.
        assert_eq!(of(&scene, &[]), times[0]);
        assert_eq!(of(&scene, &["--time", "3.25"]), times[1]);
        for threads in ["1", "2", "5"] {
            let flags = ["--time", "0.5", "--threads", threads];
            assert_eq!(of(&scene, &flags), times[2], "{command}, {threads} threads");
        }
        let at_rest = of(&scene, &["--animation", "none", "--time", "0.5"]);
        assert!(!times.contains(&at_rest), "node 0 rests elsewhere");
    }
}

/// Flags with the scene's time.
fn at_time<'a>(flags: &[&'a str], seconds: &'a str) -> Vec<&'a str> {
    [flags, &["--time", seconds]].concat()
}

#[test]
fn scene_time_advances_per_frame() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let (scene, there) = (animated(folder), baked(folder, 0.5));
    let flags = ["--fps", "4", "--frames", "2"];
    let moving = capture(folder, "raster", &scene, &at_time(&flags, "0.25"));
    let still = capture(folder, "raster", &there, &flags);
    let (Trace::Texture(moving), Trace::Texture(still)) = (moving, still) else {
        panic!("texture traces");
    };
    let passes = &moving.tables().passes;
    assert_eq!(
        passes.iter().map(|p| p.frame).collect::<Vec<_>>(),
        [0, 0, 1, 1]
    );
    let tile = |trace: &Textrace, pass: usize, number: usize| {
        let mut tile = Tile::default();
        trace.decode_tile(pass, number, &mut tile).expect("a tile");
        format!("{tile:?}")
    };
    let tiles = |trace: &Textrace, pass: usize| -> Vec<String> {
        let count = trace.tables().passes[pass].tile_count();
        (0..count as usize)
            .map(|number| tile(trace, pass, number))
            .collect()
    };
    for pass in [0, 1] {
        assert!(
            tiles(&moving, pass) != tiles(&still, pass),
            "0.25 s is not 0.5 s"
        );
    }
    for pass in [2, 3] {
        assert!(
            tiles(&moving, pass) == tiles(&still, pass),
            "frame 1 is at 0.5 s"
        );
    }
    let flags = ["--fps", "4", "--frame", "1"];
    let moving = content(folder, "rays", &scene, &at_time(&flags, "0.25"));
    assert_eq!(moving, content(folder, "rays", &there, &flags));
}

/// The hits of a refitted tree are those of a rebuilt one, on a scene with a moving node, a skin and a morph target.
#[test]
fn a_refitted_tree_has_the_hits_of_a_rebuilt_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let scene = animated(folder);
    let picture = folder.join("picture.png");
    let traced = |frame: &str, flags: &[&str]| {
        let picture = picture.to_str().expect("a name");
        let ours = [
            "--fps",
            "8",
            "--geometry",
            "--frame",
            frame,
            "--image",
            picture,
        ];
        let flags = [flags, &ours].concat();
        let Trace::Ray(trace) = capture(folder, "rays", &scene, &flags) else {
            panic!("a ray trace");
        };
        let mut tile = RayTile::default();
        let mut hits = Vec::new();
        for eye in [Eye::Left, Eye::Right] {
            for number in 0..trace.tables().tile_count() {
                trace.decode_tile(eye, number, &mut tile).expect("a tile");
                hits.push(format!("{:?}", tile.pixels));
            }
        }
        let pixels = fs::read(picture).expect("a picture");
        (
            hits,
            pixels,
            trace.tables().bvh.update,
            trace.container().version(),
        )
    };
    for flags in [
        &["--bvh", "bvh2"][..],
        &["--bvh", "cwbvh8"],
        &["--instances"],
    ] {
        for frame in ["0", "1", "5"] {
            let with = |how| traced(frame, &[flags, &["--bvh-update", how]].concat());
            let (plain, refit, rebuild) = (traced(frame, flags), with("refit"), with("rebuild"));
            assert!(
                plain.0 == refit.0 && plain.1 == refit.1,
                "{flags:?}, frame {frame}"
            );
            assert!(
                plain.0 == rebuild.0 && plain.1 == rebuild.1,
                "{flags:?}, frame {frame}"
            );
            assert_eq!((plain.2, refit.3, rebuild.3), (None, (1, 6), (1, 6)));
            let [refit, rebuild] = [refit.2, rebuild.2].map(|update| update.expect("an update"));
            assert_eq!(rebuild.method, UpdateMethod::Rebuild);
            let is_build = frame == "0";
            let method = if is_build {
                UpdateMethod::Rebuild
            } else {
                UpdateMethod::Refit
            };
            assert_eq!(refit.method, method);
            assert!(0 < refit.triangles_written && refit.nodes <= rebuild.nodes);
        }
    }
}

#[test]
fn an_update_needs_a_scene_that_moves() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = animated(folder.path());
    let output = folder.path().join("trace").display().to_string();
    let still = [&scene, "--animation", "none"];
    for (words, found) in [(&["chess"][..], "chess"), (&still, "animated.gltf")] {
        let mut tracegen = program("tracegen");
        tracegen.arg("rays").args(words);
        refuse(
            tracegen.args(["--bvh-update", "refit", "-o", &output]),
            &["--bvh-update: expected a scene that moves, found", found],
        );
    }
    refuse(
        program("tracegen").args(["rays", &scene, "--bvh-update", "keep", "-o", &output]),
        &["--bvh-update", "rebuild", "refit"],
    );
}

#[test]
fn shadows_and_named_techniques_follow_the_animation() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let (scene, there) = (animated(folder), baked(folder, 0.5));
    for flags in [&["--shadows", "--occlusion"], &["--technique", "per-eye"]] {
        let moving = content(folder, "raster", &scene, &at_time(flags, "0.5"));
        assert_eq!(
            moving,
            content(folder, "raster", &there, flags),
            "{flags:?}"
        );
    }
}

#[test]
fn a_capture_of_a_pose_is_verified() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = animated(folder.path());
    run_ok(program("tracegen").args(["verify", &scene, "--size", "96x64", "--time", "0.5"]));
}

#[test]
fn wrong_times_animations_and_cameras_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = animated(folder.path());
    let output = folder.path().join("trace").display().to_string();
    for command in ["raster", "rays", "techniques"] {
        let refuse = |flags: &[&str], parts: &[&str]| {
            let mut tracegen = program("tracegen");
            refuse(
                tracegen.args([command, &scene, "-o", &output]).args(flags),
                parts,
            );
        };
        refuse(
            &["--time", "-1"],
            &["expected 0 to 31536000 seconds, found '-1'"],
        );
        refuse(
            &["--time", "soon"],
            &["expected 0 to 31536000 seconds, found 'soon'"],
        );
        refuse(
            &["--animation", "wafe"],
            &[
                "animated.gltf: animations: expected one of wave, a number below 1",
                "did you mean 'wave'?",
            ],
        );
        refuse(
            &["--camera", "frnot"],
            &["no camera 'frnot': expected one of front; did you mean 'front'?"],
        );
    }
    refuse(
        program("tracegen").args(["rays", "teapot", "--animation", "wave", "-o", &output]),
        &["scene 'teapot': expected a glTF file with animations, found animation 'wave'"],
    );
}

#[test]
fn animations_are_listed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = animated(folder.path());
    let text = run_ok(program("tracegen").args(["scenes", &scene])).stdout;
    let text = String::from_utf8(text).expect("text");
    assert!(text.contains("animations\n  wave\n"), "{text}");
    let json = run_ok(program("tracegen").args(["scenes", &scene, "--json"])).stdout;
    let json: Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!(json["animations"], json!(["wave"]));
}
