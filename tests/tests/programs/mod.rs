//! Tests of `tracegen app` on a Vulkan program of this package whose texels hold their coordinates. In every
//! draw, the number of recorded fragments equals that of an occlusion query. Each pixel shows a texel that
//! its last record reads. The picture is the same without the layer.

mod fields;
mod instances;
pub(crate) mod opengl;
mod other_stages;
pub(crate) mod pixels;
mod random;

use formats::textrace::{Tables, Textrace, Tile};
use formats::texture::Filter;
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, refuse, run_ok, skipped};
use pixels::{Last, explains_pixel, reads, records, texel_of_color};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const SIZE_PX: [usize; 2] = [240, 200];
/// The program's objects, in the order in which it creates their pipelines.
const OBJECTS: [&str; 18] = [
    "plain",
    "pair",
    "bias",
    "own-bias",
    "level",
    "own-level",
    "gradients",
    "array",
    "cube",
    "own-cube",
    "fetch",
    "discard",
    "loop",
    "branch",
    "gather",
    "volume",
    "untextured",
    "border",
];

fn vulkan_program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_vulkan_program"))
}

struct Captured {
    trace: PathBuf,
    /// Left and right picture, row by row.
    pictures: [Vec<[u8; 4]>; 2],
    /// Standard error of the command.
    message: String,
}

/// Captures the last frame of the program with its picture. Compares the pictures of the program with and
/// without the layer.
fn capture(folder: &Path, stereo: &str, more: &[&str], of_program: &[&str]) -> Captured {
    let pictures = [folder.join("plain.raw"), folder.join("captured.raw")];
    let frames: &[&str] = &["--stereo", stereo, "--frames", "3"];
    let arguments = [of_program, frames, &["--picture"]].concat();
    run_ok(vulkan_program().args(&arguments).arg(&pictures[0]));
    let trace = folder.join(format!("{stereo}.textrace"));
    let mut command = program("tracegen");
    command
        .args(["app", "--frames", "2", "--to-end", "--check"])
        .args(more)
        .arg("-o")
        .arg(&trace);
    command
        .arg("--")
        .arg(env!("CARGO_BIN_EXE_vulkan_program"))
        .args(&arguments)
        .arg(&pictures[1]);
    let output = run_ok(&mut command);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let [plain, captured] = pictures.map(|path| std::fs::read(path).expect("a picture"));
    assert!(plain == captured, "{stereo}: the layer changes the picture");
    let (left, right) = captured.split_at(captured.len() / 2);
    let pixels = |bytes: &[u8]| {
        bytes
            .chunks_exact(4)
            .map(|p| [p[0], p[1], p[2], p[3]])
            .collect()
    };
    Captured {
        trace,
        pictures: [pixels(left), pixels(right)],
        message,
    }
}

fn object(tables: &Tables, draw: u32) -> &'static str {
    let material = &tables.draws[draw as usize].material;
    let number = material.strip_prefix("pipeline ").and_then(|rest| {
        // A draw with many coordinates is divided.
        let number = rest.split(',').next()?;
        number.parse::<usize>().ok()
    });
    // The program draws its objects in order, each with a pipeline of its own.
    OBJECTS[number.expect("a pipeline's number") - 1]
}

/// Checks every pixel against its records. Returns the number of explained pixels of each object.
fn check_pixels(captured: &Captured) -> HashMap<&'static str, u64> {
    let trace = Textrace::open(&captured.trace).expect("a trace");
    let tables = trace.tables();
    for sampler in &tables.samplers {
        assert!(sampler.mag == Filter::Nearest || sampler.mag == Filter::Linear);
    }
    let mut explained: HashMap<&'static str, u64> = HashMap::new();
    let mut wrong: HashMap<&'static str, (u64, String)> = HashMap::new();
    for (eye, picture) in [Eye::Left, Eye::Right].into_iter().zip(&captured.pictures) {
        let mut records = records(&trace, eye);
        for (number, &pixel) in picture.iter().enumerate() {
            let at = [number % SIZE_PX[0], number / SIZE_PX[0]];
            let pixel_records = records.remove(&at).unwrap_or_default();
            let Some(top) = pixel_records.last() else {
                assert_eq!(pixel, [0; 4], "{eye} {at:?} is lit without a record");
                continue;
            };
            // Behind a discarded fragment, the pixel shows the fragment below.
            let primitive_of = |last: &Last| object(tables, last.draw);
            let seen = pixel_records.iter().rev().find(|last| {
                let name = primitive_of(last);
                name == "volume" || explains_pixel(tables, last, name, pixel)
            });
            let name = primitive_of(top);
            let is_discarding = |last: &&Last| primitive_of(last) == "discard";
            let above = pixel_records.iter().rev().take_while(is_discarding).count();
            let depth = seen.and_then(|seen| {
                pixel_records
                    .iter()
                    .rev()
                    .position(|last| std::ptr::eq(last, seen))
            });
            // The last iteration of a loop, or the executed branch, comes last. The groups of a pair have no
            // order.
            let same_draw = depth.is_some_and(|depth| {
                depth <= above
                    || primitive_of(&pixel_records[pixel_records.len() - 1 - depth]) == name
            });
            if same_draw || (pixel == [0; 4] && above == pixel_records.len()) {
                *explained.entry(name).or_default() += 1;
            } else {
                let reads = reads(tables, top, [0; 2]);
                let of = wrong.entry(name).or_default();
                of.0 += 1;
                of.1 = format!(
                    "{eye} {at:?} shows {:?}, reads {reads:?}",
                    texel_of_color(pixel)
                );
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}\nexplained: {explained:?}");
    explained
}

#[test]
fn every_pixel_shows_a_texel_of_its_last_record_in_every_stereo_mode() {
    if !has_lavapipe() {
        return;
    }
    for (stereo, rule, of_program) in [
        ("halves", "viewport halves", &[] as &[&str]),
        ("targets", "a target per eye", &[]),
        ("twice", "equal draws twice", &[]),
        ("multiview", "multiview", &[]),
        // Pipelines that are linked from libraries.
        ("halves", "viewport halves", &["--libraries", "0"]),
        ("multiview", "multiview", &["--libraries", "1"]),
        ("targets", "a target per eye", &["--libraries", "2"]),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let captured = capture(folder.path(), stereo, &[], of_program);
        assert!(captured.message.contains(rule), "{}", captured.message);
        assert!(
            captured.message.contains("0 different"),
            "{}",
            captured.message
        );
        let left_out = "three-dimensional textures (1 draws,";
        assert!(captured.message.contains(left_out), "{}", captured.message);
        let explained = check_pixels(&captured);
        println!("{stereo}: pixels explained: {explained:?}");
        for object in OBJECTS {
            let least = if object == "plain" { 10_000 } else { 100 };
            let found = explained.get(object).copied().unwrap_or(0);
            assert!(found >= least, "{stereo}: {object} explains {found} pixels");
        }
    }
}

#[test]
fn a_chain_of_branches_with_a_texture_each_is_recorded_in_time() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let limit = ["--timeout", "300"];
    let captured = capture(folder.path(), "halves", &limit, &["--objects", "chain"]);
    assert!(
        captured.message.contains("2 draws equal, 0 different"),
        "{}",
        captured.message
    );
    // With one object, its pipeline has the number of `plain`, whose texels are compared the same way.
    let explained = check_pixels(&captured);
    assert!(explained["plain"] > 10_000, "{explained:?}");
    // The object does not overlap itself, and it has more uv groups than a draw of a trace.
    let trace = Textrace::open(&captured.trace).expect("a trace");
    assert!(trace.tables().draws.len() > 1);
    let output = run_ok(
        program("replay")
            .arg("run")
            .arg(&captured.trace)
            .arg("--json"),
    );
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(result["result"]["lanes"], explained["plain"]);
}

#[test]
fn a_captured_program_is_replayed_like_a_scene() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let captured = capture(folder.path(), "halves", &["--encoding", "planes"], &[]);
    for command in [
        &["validate"][..],
        &["info"],
        &["run", "--order", "z2-sta"],
        &["paper"],
    ] {
        run_ok(program("replay").args(command).arg(&captured.trace));
    }
    let delta = folder.path().join("delta.textrace");
    let encode = ["convert", "--to", "textrace", "--encoding", "delta", "-o"];
    run_ok(
        program("replay")
            .args(encode)
            .arg(&delta)
            .arg(&captured.trace),
    );
    run_ok(
        program("replay")
            .arg("diff")
            .args([&captured.trace, &delta]),
    );
}

#[test]
fn the_same_program_gives_the_same_trace() {
    if !has_lavapipe() {
        return;
    }
    let traces = [0, 1].map(|_| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let trace = folder.path().join("a.textrace");
        let mut command = program("tracegen");
        command.args(["app", "--frames", "1..3", "-o"]).arg(&trace);
        command.arg("--").arg(env!("CARGO_BIN_EXE_vulkan_program"));
        run_ok(&mut command);
        std::fs::read(trace).expect("a trace")
    });
    assert!(traces[0] == traces[1]);
}

/// Runs a capture that must fail and must not leave a trace.
fn refused(options: &[&str], program_options: &[&str], expected: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    let mut command = program("tracegen");
    command.args(["app", "-o"]).arg(&trace).args(options);
    command
        .arg("--")
        .arg(env!("CARGO_BIN_EXE_vulkan_program"))
        .args(program_options);
    refuse(&mut command, expected);
    let left = std::fs::read_dir(folder.path())
        .expect("the folder")
        .count();
    assert_eq!(left, 0, "something is left of the trace");
}

#[test]
fn programs_that_end_too_early_or_never_end_a_frame_leave_no_trace() {
    if !has_lavapipe() {
        return;
    }
    let frames = ["--frames", "1..4"];
    refused(
        &frames,
        &["--end", "crash", "--frames", "9"],
        &[
            "vulkan_program: frames 1 to 3 were asked for, and it ended 2 frames",
            "signal: 6",
        ],
    );
    refused(
        &frames,
        &["--end", "early", "--frames", "9"],
        &["it ended 2 frames", "exit code 3"],
    );
    refused(
        &frames,
        &["--frames", "2"],
        &["it ended 2 frames", "exit code 0"],
    );
    refused(
        &["--frames", "1", "--frames-by", "present"],
        &[],
        &["it ended 0 frames (--frames, --frames-by)", "exit code 0"],
    );
    refused(
        &["--frames", "1", "--records", "4KiB"],
        &[],
        &[
            "expected records of 4096 bytes or less in a submission",
            "raise --records",
        ],
    );
    refused(
        &["--frames", "1", "--eyes", "targets"],
        &["--stereo", "mono"],
        &["frame 1: no two eyes were found by the rule a target per eye"],
    );
}

/// Captures the program with options of `tracegen app` and arguments of the program; returns the path of the
/// trace.
fn capture_program(
    folder: &Path,
    name: &str,
    options: &[&str],
    program_arguments: &[&str],
) -> PathBuf {
    let trace = folder.join(name).with_extension("textrace");
    let mut command = program("tracegen");
    command.args(["app", "-o"]).arg(&trace).args(options);
    command
        .arg("--")
        .arg(env!("CARGO_BIN_EXE_vulkan_program"))
        .args(program_arguments);
    run_ok(&mut command);
    trace
}

/// Checks that two traces have the same tables and tiles. Their descriptions of the command may differ.
fn assert_same(a: &Path, b: &Path) {
    const MAY_DIFFER: [&str; 3] = ["meta.command_line", "meta.scene", "meta.program.views_by"];
    let output = program("replay").arg("diff").args([a, b]).output();
    let text = String::from_utf8(output.expect("replay starts").stdout).expect("text");
    let differ: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with(['<', '>']))
        .collect();
    let may_differ = |line: &&str| MAY_DIFFER.iter().any(|name| line.starts_with(name));
    assert!(
        !differ.is_empty() && differ.iter().all(may_differ),
        "{text}"
    );
}

#[test]
fn a_check_changes_no_figure() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for stereo in ["halves", "targets", "multiview"] {
        let of_program = ["--stereo", stereo];
        let frames = ["--frames", "2"];
        let plain = capture_program(folder.path(), "plain", &frames, &of_program);
        let checked = ["--frames", "2", "--check"];
        let checked = capture_program(folder.path(), "checked", &checked, &of_program);
        assert_same(&plain, &checked);
    }
}

#[test]
fn programs_that_fork_or_are_started_by_scripts_give_the_same_trace() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frames = ["--frames", "2"];
    let plain = capture_program(folder.path(), "plain", &frames, &[]);
    let forks = capture_program(folder.path(), "forks", &frames, &["--end", "fork"]);
    assert_same(&plain, &forks);
    // The script has ended before its program renders.
    let started = folder.path().join("started.textrace");
    let script = format!("'{}' --frames 1000 &", env!("CARGO_BIN_EXE_vulkan_program"));
    let mut command = program("tracegen");
    command.args(["app", "--frames", "2", "-o"]).arg(&started);
    run_ok(command.args(["--", "sh", "-c", &script]));
    assert_same(&plain, &started);
}

#[test]
fn a_program_that_never_renders_is_ended_after_the_timeout() {
    if !has_lavapipe() {
        return;
    }
    refused(
        &["--frames", "1", "--timeout", "1"],
        &["--end", "hang"],
        &[
            "vulkan_program was ended after 1 seconds",
            "vulkan_program never used Vulkan through the layer",
        ],
    );
}

/// Compares the trace of several frames with the traces of the single frames.
#[test]
fn a_capture_of_several_frames_equals_captures_of_single_frames() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--frames", "5"];
    let all = capture_program(folder.path(), "all", &["--frames", "1..4"], &arguments);
    let all = Textrace::open(&all).expect("a trace");
    let counts = |trace: &Textrace, frame: u32| -> u64 {
        let mut tile = Tile::default();
        let mut count = 0;
        for (pass, of) in trace.tables().passes.iter().enumerate() {
            for index in (0..of.tile_count()).filter(|_| of.frame == frame) {
                trace
                    .decode_tile(pass, index as usize, &mut tile)
                    .expect("a tile");
                count += tile.records.len() as u64;
            }
        }
        count
    };
    for frame in 1..4_u32 {
        let text = frame.to_string();
        let one = capture_program(folder.path(), &text, &["--frames", &text], &arguments);
        let one = Textrace::open(&one).expect("a trace");
        let expected = counts(&one, frame);
        assert!(expected > 10_000);
        assert_eq!(counts(&all, frame), expected, "frame {frame}");
    }
}

#[test]
fn a_list_has_every_render_pass_with_its_picture() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let page = folder.path().join("list.html");
    let list = |stereo: &str, more: &[&str]| {
        let mut command = program("tracegen");
        command.args(["app", "--frames", "1", "--list"]).args(more);
        command.args([
            "--",
            env!("CARGO_BIN_EXE_vulkan_program"),
            "--stereo",
            stereo,
        ]);
        String::from_utf8(run_ok(&mut command).stdout).expect("text")
    };
    let table = list("targets", &["--list-page", page.to_str().expect("a path")]);
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "frame 1: both eyes by a target per eye");
    let [left, right] = [lines[2], lines[3]];
    assert!(
        left.contains("left eye") && right.contains("right eye"),
        "{table}"
    );
    for line in [left, right] {
        let cells: Vec<&str> = line
            .split("  ")
            .map(str::trim)
            .filter(|cell| !cell.is_empty())
            .collect();
        assert_eq!(cells[2], "240x200 R8G8B8A8_UNORM", "{table}");
        assert_eq!(cells[3], "240x200 at 0,0", "{table}");
        assert_eq!(cells[4], OBJECTS.len().to_string(), "{table}");
    }
    let html = std::fs::read_to_string(&page).expect("the page");
    let pictures = |of: &str| -> Vec<&str> {
        let texts = html.split(of).skip(1);
        let data = texts.filter_map(|text| text.split("data:image/png;base64,").nth(1));
        data.filter_map(|data| data.split('"').next()).collect()
    };
    let of_draws = pictures("<img alt=\"pixels of draw ");
    assert_eq!(of_draws.len(), 2 * OBJECTS.len(), "a picture of each draw");
    let pictures = pictures("<img alt=\"pass ");
    assert_eq!(pictures.len(), 2, "a picture of each pass");
    assert!(
        pictures.iter().all(|data| data.len() > 2_000),
        "pictures of one colour"
    );
    assert!(list("mono", &[]).contains("no two eyes were found"));
    // Without the option for a page, the command prints only the table.
    assert_eq!(
        std::fs::read_dir(folder.path())
            .expect("the folder")
            .count(),
        1
    );
}

#[test]
fn a_file_of_rules_assigns_draws_to_eyes() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rules = folder.path().join("rules.toml");
    let text = "[[rule]]\npass = 0\nshows = \"left\"\n[[rule]]\npass = 1\nshows = \"right\"\n";
    std::fs::write(&rules, text).expect("a file");
    let by_file = ["--frames", "2", "--rules", rules.to_str().expect("a path")];
    let arguments = ["--stereo", "targets"];
    let by_rules = capture_program(folder.path(), "rules", &by_file, &arguments);
    let detected = capture_program(folder.path(), "detected", &["--frames", "2"], &arguments);
    assert_same(&by_rules, &detected);
    for (text, expected) in [
        (
            "[[rule]]\nshows = \"ignored\"\n",
            "rules.toml: expected a rule that shows",
        ),
        ("[[rule]]\nshow = \"left\"\n", "unknown field `show`"),
        (
            "[[rule]]\nsize = [7, 7]\nshows = \"left\"\n",
            "no two eyes were found",
        ),
    ] {
        std::fs::write(&rules, text).expect("a file");
        refused(&by_file, &arguments, &[expected]);
    }
}

/// Validates every module of the program before and after the layer rewrites it.
#[test]
fn spirv_val_accepts_the_rewritten_modules_of_a_program() {
    if !has_lavapipe() {
        return;
    }
    if Command::new("spirv-val").arg("--version").output().is_err() {
        skipped!("spirv-val is absent");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for stereo in ["halves", "multiview"] {
        let modules = folder.path().join(stereo);
        let options = [
            "--frames",
            "1",
            "--modules",
            modules.to_str().expect("a path"),
        ];
        let arguments = ["--stereo", stereo, "--also", "vertex"];
        capture_program(folder.path(), stereo, &options, &arguments);
        let mut valid = 0;
        for entry in std::fs::read_dir(&modules).expect("the modules") {
            let path = entry.expect("an entry").path();
            run_ok(
                Command::new("spirv-val")
                    .args(["--target-env", "vulkan1.2"])
                    .arg(path),
            );
            valid += 1;
        }
        // Each module as the program passes it and as the layer rewrites it, for two stages.
        assert_eq!(valid, 4 * OBJECTS.len(), "{stereo}");
    }
}

#[test]
fn programs_without_vulkan_and_missing_programs_are_reported() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (of, expected) in [
        ("true", "true never used Vulkan through the layer"),
        ("/none/such", "cannot run /none/such"),
    ] {
        let mut command = program("tracegen");
        command
            .args(["app", "-o"])
            .arg(folder.path().join("a.textrace"));
        refuse(command.args(["--", of]), &[expected]);
    }
}
