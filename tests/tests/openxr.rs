//! Tests of `tracegen xr` on an OpenXR program of this package, in which each eye shows 256x256 texels, and on `hello_xr`
//! where it is installed. Where the system has no OpenXR loader, the program opens the runtime itself, and says so.

use crate::programs::opengl::has_zink;
use crate::programs::pixels::records;
use formats::textrace::{Textrace, TraceMeta};
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, refuse, run_ok, skipped};
use std::path::Path;
use std::process::{Command, Output};

/// Texture samples of each eye: a texel for each pixel.
const SAMPLES: usize = 256 * 256;

fn tracegen(options: &[&str], trace: &Path, program_options: &[&str]) -> Command {
    let mut command = program("tracegen");
    command
        .arg("xr")
        .args(options)
        .arg("-o")
        .arg(trace)
        .arg("--");
    command
        .arg(env!("CARGO_BIN_EXE_xr_program"))
        .args(program_options);
    command
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Samples of an eye, and the number of its pixels.
fn samples(trace: &Textrace, eye: Eye) -> [usize; 2] {
    let pixels = records(trace, eye);
    [pixels.values().map(Vec::len).sum(), pixels.len()]
}

#[test]
fn every_texel_of_both_eyes_is_recorded_in_every_layout() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (layout, enable, compared) in [
        ("separate", "1", 2),
        ("separate", "2", 2),
        ("layers", "2", 2),
        ("multiview", "2", 1),
        ("side", "2", 2),
        ("msaa", "2", 0),
        ("target", "2", 4),
        ("blit", "2", 2),
    ] {
        let trace = folder.path().join(format!("{layout}{enable}.textrace"));
        let options = ["--frames", "1..3", "--check"];
        let mut command = tracegen(&options, &trace, &["--layout", layout, "--enable", enable]);
        let said = message(&run_ok(&mut command));
        assert!(
            said.contains("2 frames of 256x256 px per eye by the images of xrEndFrame"),
            "{layout}: {said}"
        );
        let equal = format!("{} draws equal, 0 different", 2 * compared);
        assert!(said.contains(&equal), "{layout}: {said}");
        // The pass that fills the shown image is no eye.
        assert_eq!(
            said.contains("post-processing (4 draws, 262144 fragments)"),
            layout == "target",
            "{said}"
        );
        let trace = Textrace::open(&trace).expect("a trace");
        for eye in [Eye::Left, Eye::Right] {
            // Two frames, in which each pixel is drawn once. With several samples, the pixels of the diagonal belong to
            // both triangles of the square.
            let diagonal = if layout == "msaa" { 256 } else { 0 };
            let expected = [2 * (SAMPLES + diagonal), SAMPLES];
            assert_eq!(samples(&trace, eye), expected, "{layout} {eye}");
        }
        let of = trace.tables().meta.program.clone().expect("a program");
        assert!(of.cameras_known && of.frames_by == "xrEndFrame", "{of:?}");
    }
}

#[test]
fn two_runs_give_the_same_bytes() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    let bytes = [0, 1].map(|_| {
        let options = ["--frames", "2..4", "--path", "head", "--hmd", "index"];
        run_ok(&mut tracegen(&options, &trace, &["--layout", "layers"]));
        std::fs::read(&trace).expect("a trace")
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn wrong_calls_get_the_right_errors() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (trace, file) = (
        folder.path().join("a.textrace"),
        folder.path().join("number"),
    );
    let name = file.display().to_string();
    // The program draws nothing, so there is no trace.
    let output = tracegen(&["--frames", "9"], &trace, &["--wrong", &name])
        .output()
        .expect("tracegen starts");
    let said = message(&output);
    assert!(said.contains("it ended with exit code 0"), "{said}");
    let checks: u32 = std::fs::read_to_string(file)
        .expect("the number of checks")
        .parse()
        .expect("a number");
    assert!(checks >= 150, "{checks}");
    println!("{checks} calls answered as specified");
}

/// Numbers of a JSON array.
fn numbers(value: &serde_json::Value) -> Vec<f64> {
    let all = value.as_array().expect("an array").iter();
    all.map(|number| number.as_f64().expect("a number"))
        .collect()
}

fn assert_close(what: &str, found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= 1e-6, "{what}: {a} and {b}");
    }
}

#[test]
fn eyes_are_those_of_a_scene_with_the_same_display_and_reach_the_program_and_the_trace() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [trace, raster, file] =
        ["a.textrace", "raster.textrace", "eyes"].map(|name| folder.path().join(name));
    let meta =
        |path: &Path| -> TraceMeta { Textrace::open(path).expect("a trace").tables().meta.clone() };
    // Symmetric; asymmetric; canted, with two unlike eyes.
    for hmd in ["symmetric-100", "rift-cv1", "quest3", "index", "pimax-8k"] {
        let name = file.display().to_string();
        let options = [
            "--frames",
            "0",
            "--hmd",
            hmd,
            "--head",
            "0.3,1.7,-2",
            "--space",
            "stage",
        ];
        let of_program = ["--eyes", &name, "--space", "stage"];
        run_ok(&mut tracegen(&options, &trace, &of_program));
        let camera = [
            "--eye",
            "0.3,1.7,-2",
            "--target",
            "0.3,1.7,-3",
            "--no-plain",
        ];
        let mut command = program("tracegen");
        command
            .args(["raster", "atrium", "--size", "64x72", "--hmd", hmd])
            .args(camera);
        run_ok(command.arg("-o").arg(&raster));
        let (shown, scene) = (meta(&trace), meta(&raster));
        assert_eq!(shown.hmd.name, hmd);
        let text = std::fs::read_to_string(&file).expect("the eyes of the program");
        let given: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        for eye in 0..2 {
            let (a, b) = (&shown.frames[0].eyes[eye], &scene.frames[0].eyes[eye]);
            assert_close(
                hmd,
                a.world_to_eye.as_flattened(),
                b.world_to_eye.as_flattened(),
            );
            assert_close(hmd, &a.position, &b.position);
            let (f, g) = (shown.hmd.fov[eye], scene.hmd.fov[eye]);
            let tangents = [g.left, g.right, g.up, g.down];
            assert_close(hmd, &[f.left, f.right, f.up, f.down], &tangents);
            // What the program read back from the runtime.
            let angles = numbers(&given[eye]["angles"]);
            let signs = [-1.0, 1.0, 1.0, -1.0];
            let read: Vec<f32> = angles
                .iter()
                .zip(signs)
                .map(|(a, sign)| (sign * a.tan()) as f32)
                .collect();
            assert_close(hmd, &read, &tangents);
            let position = numbers(&given[eye]["position"]);
            // Bit for bit in the trace.
            let position: Vec<f32> = position.iter().map(|at| *at as f32).collect();
            assert_eq!(position, a.position, "{hmd}");
        }
    }
}

#[test]
fn a_capture_needs_no_clean_end_of_the_program() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    for end in ["clean", "crash", "ignore"] {
        run_ok(&mut tracegen(&["--frames", "1"], &trace, &["--end", end]));
        let trace = Textrace::open(&trace).expect("a trace");
        assert_eq!(samples(&trace, Eye::Left), [SAMPLES; 2], "{end}");
    }
    std::fs::remove_file(&trace).expect("the trace");
    let mut command = tracegen(&["--frames", "1"], &trace, &["--empty"]);
    refuse(
        &mut command,
        &["frames 1 to 1 were asked for, and it ended 0 frames"],
    );
    assert!(!trace.exists());
}

#[test]
fn without_a_runtime_the_command_to_use_is_named() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = program("tracegen");
    command
        .args(["app", "--frames", "1", "-o"])
        .arg(folder.path().join("a.textrace"))
        .arg("--");
    command.args([
        "sh",
        "-c",
        "echo Error [GENERAL | xrCreateInstance | OpenXR-Loader] >&2; exit 1",
    ]);
    refuse(&mut command, &["run it with `tracegen xr`"]);
}

#[test]
fn hello_xr_is_captured_unmodified() {
    if !has_lavapipe() {
        return;
    }
    if !Path::new("/usr/bin/hello_xr").exists() {
        skipped!("hello_xr is absent (Debian's package libopenxr-utils)");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Without a display, the command starts an X server; that of a program needs a package.
    let has_x_server = Path::new("/usr/bin/Xorg").exists() || std::env::var_os("DISPLAY").is_some();
    let mut apis = vec!["Vulkan", "Vulkan2"];
    match has_x_server && has_zink(folder.path()) {
        true => apis.push("OpenGL"),
        false => {
            skipped!("no hello_xr on OpenGL: Xorg or zink is absent");
        }
    }
    let mut fragments = Vec::new();
    for graphics in apis {
        let bytes = [0, 1].map(|run| {
            let trace = folder.path().join(format!("{graphics}{run}.textrace"));
            let mut command = program("tracegen");
            command
                .args(["xr", "--frames", "3", "--check", "-o"])
                .arg(&trace);
            command.args(["--", "hello_xr", "-g", graphics]);
            let said = message(&run_ok(&mut command));
            assert!(said.contains("by the images of xrEndFrame"), "{said}");
            assert!(said.contains(" draws equal, 0 different"), "{said}");
            trace
        });
        let [first, second] = bytes.map(|trace| Textrace::open(&trace).expect("a trace"));
        assert!(
            first.tables().meta.frames == second.tables().meta.frames,
            "{graphics}"
        );
        fragments.push([Eye::Left, Eye::Right].map(|eye| samples(&first, eye)[1]));
        let of = first.tables().meta.program.clone().expect("a program");
        assert!(
            of.cameras_known && of.views_by == "the images of xrEndFrame",
            "{of:?}"
        );
    } // All three show the same cubes. OpenGL rounds edges otherwise, because its rows count from the bottom.
    for of in &fragments {
        let differences = [0, 1].map(|eye: usize| of[eye].abs_diff(fragments[0][eye]));
        assert!(differences.iter().all(|d| *d <= 100), "{fragments:?}");
    }
}
