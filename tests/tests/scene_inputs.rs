//! No output replaces a file that a scene or a path refers to, even if the command does not read it.

use parallax_tests::{program, refuse, run_ok};
use std::fs;
use std::path::Path;

/// A 1x1 PNG.
const PNG: &[u8] = &[
    137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 1, 0, 0, 0, 1, 8, 2, 0,
    0, 0, 144, 119, 83, 222, 0, 0, 0, 12, 73, 68, 65, 84, 8, 215, 99, 248, 207, 192, 0, 0, 3, 1, 1,
    0, 24, 221, 141, 176, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96, 130,
];

const GLTF: &str = r#"{
  "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
  "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 1}}],
  "textures": [{"source": 0}, {"source": 1}],
  "images": [{"uri": "colour.png"}, {"uri": "normal.png"}, {"uri": "unused.png"}],
  "buffers": [{"uri": "scene.bin", "byteLength": 60}],
  "bufferViews": [{"buffer": 0, "byteLength": 60}],
  "accessors": [
    {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC2"}]
}"#;

const OBJ: &str = "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
const MTL: &str = "newmtl a\nmap_Kd colour.png\nmap_Bump normal.png\nmap_Ks unused.png\n";

const PATH: &str = "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n";

fn write_scenes(folder: &Path) {
    let numbers: [f32; 15] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 1.];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let files: [(&str, &[u8]); 8] = [
        ("scene.gltf", GLTF.as_bytes()),
        ("scene.bin", &bytes),
        ("scene.obj", OBJ.as_bytes()),
        ("scene.mtl", MTL.as_bytes()),
        ("colour.png", PNG),
        ("normal.png", PNG),
        ("unused.png", PNG),
        ("path.csv", PATH.as_bytes()),
    ];
    for (name, content) in files {
        fs::write(folder.join(name), content).expect("writable");
    }
}

/// The files of a folder, by name.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<_> = (fs::read_dir(folder).expect("a folder"))
        .map(|entry| {
            let entry = entry.expect("an entry");
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read(entry.path()).expect("readable"))
        })
        .collect();
    found.sort();
    found
}

#[test]
fn no_output_replaces_a_file_that_the_scene_or_the_path_refers_to() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_scenes(folder.path());
    let before = contents(folder.path());
    let of_scene: [(&str, &[&str]); 2] = [
        (
            "scene.gltf",
            &["scene.bin", "colour.png", "normal.png", "unused.png"],
        ),
        (
            "scene.obj",
            &["scene.mtl", "colour.png", "normal.png", "unused.png"],
        ),
    ];
    for (scene, files) in of_scene {
        for file in files.iter().chain(&["path.csv"]) {
            for (command, flags) in [
                ("raster", &["--frames", "1"][..]),
                ("rays", &[]),
                ("raster", &["--auto", "flip=0.1"]),
            ] {
                for outputs in [
                    ["-o", file, "--image", "x.png"],
                    ["-o", "x", "--image", file],
                ] {
                    let mut tracegen = program("tracegen");
                    tracegen.current_dir(folder.path());
                    tracegen.args([command, scene, "--size", "32x32", "--path", "path.csv"]);
                    tracegen.args(flags).args(outputs);
                    refuse(&mut tracegen, &["would replace the input", file]);
                }
            }
        }
        let mut verify = program("tracegen");
        verify.current_dir(folder.path());
        verify.args(["verify", scene, "--size", "32x32", "--write-reference"]);
        refuse(verify.arg(files[0]), &["would replace the input", files[0]]);
    }
    assert!(contents(folder.path()) == before, "a file has changed");
}

#[test]
fn a_study_is_measured_again_when_a_file_of_the_scene_has_changed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_scenes(folder.path());
    let study = || {
        let mut tracegen = program("tracegen");
        tracegen.current_dir(folder.path());
        tracegen.args([
            "techniques",
            "scene.gltf",
            "--only",
            "superfrustum",
            "-o",
            "study",
        ]);
        tracegen.args(["--frames", "1", "--path-frames", "1", "--repeats", "1"]);
        run_ok(&mut tracegen);
        let row = folder.path().join("study/rows/superfrustum.json");
        fs::read(row).expect("a finished row")
    };
    let first = study();
    assert!(study() == first, "a finished row is kept");
    let mut bytes = fs::read(folder.path().join("scene.bin")).expect("a buffer");
    // The second corner moves by a millimetre.
    bytes[12..16].copy_from_slice(&1.001_f32.to_le_bytes());
    fs::write(folder.path().join("scene.bin"), bytes).expect("writable");
    let with_other_buffer = study();
    assert!(
        with_other_buffer != first,
        "the row of another buffer is kept"
    );
    let mut png = PNG.to_vec();
    // Bytes after the image's end change the file, but not the picture.
    png.push(0);
    fs::write(folder.path().join("colour.png"), png).expect("writable");
    assert!(
        study() != with_other_buffer,
        "the row of another image is kept"
    );
}
