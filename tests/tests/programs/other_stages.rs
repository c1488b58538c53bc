//! Texture reads of stages that are not recorded, and programs that end their frames in other ways.

use super::{capture_program, refused};
use formats::textrace::{Textrace, UnrecordedReads};
use parallax_tests::{has_lavapipe, program, run_ok};
use std::path::Path;

fn reads(trace: &Path) -> Vec<UnrecordedReads> {
    let trace = Textrace::open(trace).expect("a trace");
    let program = trace.tables().meta.program.clone();
    program.expect("a program's trace").unrecorded_reads
}

/// Six vertices of a floor and 36 of a box, which `--objects plain,pair` draws.
const VERTICES: u64 = 6 + 36;

#[test]
fn reads_of_vertex_and_compute_shaders_are_counted_and_named_by_every_command() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let objects = ["--objects", "plain,pair", "--also", "vertex,compute"];
    for (name, stereo, draws, libraries) in [
        ("halves", "halves", 4, &[] as &[&str]),
        ("multiview", "multiview", 2, &[]),
        ("libraries", "halves", 4, &["--libraries", "1"]),
    ] {
        let arguments = [&objects[..], &["--stereo", stereo], libraries].concat();
        let trace = capture_program(folder.path(), name, &["--frames", "1..3"], &arguments);
        let found = reads(&trace);
        let expected = |stage: &str, commands, invocations| UnrecordedReads {
            stage: stage.to_owned(),
            what: "two-dimensional textures".to_owned(),
            commands,
            indirect: 0,
            invocations,
            reads: invocations,
        };
        // Two frames; 4 x 2 workgroups of 8 x 4 invocations.
        let compute = expected("compute", 2, 2 * 8 * 32);
        let vertex = expected("vertex", 2 * draws, 2 * 2 * VERTICES);
        assert_eq!(found, [compute, vertex], "{name}");
    }
    let trace = folder.path().join("halves.textrace");
    for command in [&["info"][..], &["run"], &["validate"], &["dump"]] {
        let output = run_ok(program("replay").args(command).arg(&trace));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        for stage in ["vertex", "compute"] {
            let notice = format!("not in the trace: reads by {stage} shaders");
            assert!(text.contains(&notice), "{command:?}: {text}");
        }
    }
    let output = run_ok(program("replay").args(["run", "--json"]).arg(&trace));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let notices = result["trace"]["notices"].as_array().expect("notices");
    assert_eq!(notices.len(), 2, "{notices:?}");
}

#[test]
fn frames_whose_commands_wait_for_the_host_are_captured_like_others() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frames = ["--frames", "1..3"];
    let bytes = |also: &[&str]| {
        let trace = capture_program(folder.path(), "late", &frames, also);
        Textrace::open(&trace).expect("a trace").content_checksum()
    };
    let plain = bytes(&[]);
    let started = std::time::Instant::now();
    assert_eq!(bytes(&["--also", "late"]), plain);
    assert_eq!(bytes(&["--also", "event"]), plain);
    // Without copies to the host, other calls end the frames, and the description says so.
    let unread = bytes(&["--also", "unread"]);
    assert_eq!(bytes(&["--also", "unread,late"]), unread);
    let seconds = started.elapsed().as_secs();
    assert!(
        seconds < 60,
        "{seconds} seconds: a submission was waited for"
    );
}

#[test]
fn a_program_that_ends_before_it_uses_vulkan_is_reported_with_its_last_lines() {
    if !has_lavapipe() {
        return;
    }
    refused(
        &["--frames", "1"],
        &["--end", "before"],
        &[
            "vulkan_program never used Vulkan through the layer; it ended by signal: 6",
            "its last lines:",
            "vulkan_program: no display",
        ],
    );
}

/// `tracegen app` on the program with environment variables.
fn app(folder: &Path, variables: &[(&str, &str)]) -> std::process::Command {
    let mut command = program("tracegen");
    command
        .args(["app", "--frames", "1", "-o"])
        .arg(folder.join("a.textrace"))
        .envs(variables.iter().copied());
    command
}

#[test]
fn environments_that_would_hide_the_layer_are_overcome_or_named() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let colon = folder.path().join("a:b");
    std::fs::create_dir(&colon).expect("a folder");
    let colon = colon.to_str().expect("a path");
    let of_program = env!("CARGO_BIN_EXE_vulkan_program");
    for variable in [
        ("VK_LOADER_LAYERS_DISABLE", "~all~"),
        ("VK_LOADER_LAYERS_DISABLE", "*PARALLAX*"),
        ("VK_LOADER_DRIVERS_DISABLE", "*"),
        ("TMPDIR", colon),
    ] {
        run_ok(app(folder.path(), &[variable]).args(["--", of_program]));
    }
    // A program's own layers are found, by default in the system's folders.
    let system = Path::new("/usr/share/vulkan/explicit_layer.d");
    if system.join("VkLayer_MESA_overlay.json").exists() {
        let folders = [("VK_LAYER_PATH", system.to_str().expect("a path"))];
        for folders in [&[][..], &folders] {
            let layer = ("PROGRAM_LAYER", "VK_LAYER_MESA_overlay");
            let variables = [folders, &[layer]].concat();
            run_ok(app(folder.path(), &variables).args(["--", of_program]));
        }
    }
    let missing = [("VK_DRIVER_FILES", "/none/such.json")];
    parallax_tests::refuse(
        app(folder.path(), &missing).args(["--", of_program]),
        &["VK_DRIVER_FILES=/none/such.json: expected a Vulkan driver file"],
    );
    // The program sees none of the variables.
    let cleared = [
        "--timeout",
        "2",
        "--",
        "env",
        "-i",
        of_program,
        "--end",
        "hang",
    ];
    parallax_tests::refuse(
        app(folder.path(), &[]).args(cleared),
        &["vulkan_program ran without the environment variables of the capture"],
    );
}
