//! `tracegen app` on a Vulkan program of our own, whose texels tell their coordinates: records equal occlusion queries in
//! every draw, each pixel shows a texel that its last record reads, and the picture is the same without the layer.

use formats::footprint::{Footprint, SamplingOptions, record_footprints};
use formats::textrace::{NO_GROUP, QuadRecord, Sample, Tables, Textrace, Tile};
use formats::texture::Filter;
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, refuse, run_ok, skipped};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const SIZE_PX: [usize; 2] = [240, 200];
/// The program's objects, in the order in which it makes their pipelines.
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
    /// What the command said.
    said: String,
}

/// Captures the last frame of the program, with its picture, and holds both against the program alone.
fn capture(folder: &Path, stereo: &str, more: &[&str]) -> Captured {
    let pictures = [folder.join("plain.raw"), folder.join("captured.raw")];
    let arguments = ["--stereo", stereo, "--frames", "3", "--picture"];
    run_ok(vulkan_program().args(arguments).arg(&pictures[0]));
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
        .args(arguments)
        .arg(&pictures[1]);
    let output = run_ok(&mut command);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
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
        said,
    }
}

/// Texel, level and layer that a pixel tells; `None` of a pixel that shows none.
fn told([x, y, level, layer]: [u8; 4]) -> Option<[u32; 4]> {
    let level = u32::from(level.checked_sub(1)?);
    assert_eq!(level % 30, 0, "no colour of a texel");
    Some([
        x.into(),
        y.into(),
        level / 30,
        (255 - u32::from(layer)) / 40,
    ])
}

/// A record of one lane, with its operands, and its draw.
#[derive(Clone, Copy)]
struct Last {
    draw: u32,
    record: QuadRecord,
    operands: Option<QuadRecord>,
}

/// All records of each pixel of an eye's picture, in the order of the trace.
fn records(trace: &Textrace, eye: Eye) -> HashMap<[usize; 2], Vec<Last>> {
    let mut found: HashMap<[usize; 2], Vec<Last>> = HashMap::new();
    let mut tile = Tile::default();
    let passes = trace.tables().passes.iter().enumerate();
    for (pass, of) in passes.filter(|(_, of)| of.eye == Some(eye)) {
        for index in 0..of.tile_count() {
            trace
                .decode_tile(pass, index as usize, &mut tile)
                .expect("a tile");
            let corner = [index % of.tiles[0], index / of.tiles[0]].map(|at| 16 * at as usize);
            for run in &tile.runs {
                let of_run = run.first as usize..(run.first + run.count) as usize;
                for (record, before) in formats::textrace::with_operands(&tile.records[of_run]) {
                    for lane in (0..4).filter(|lane| record.mask >> lane & 1 == 1) {
                        let pixel = [
                            corner[0] + 2 * usize::from(record.x) + lane % 2,
                            corner[1] + 2 * usize::from(record.y) + lane / 2,
                        ];
                        let record = QuadRecord {
                            mask: 1 << lane,
                            ..*record
                        };
                        found.entry(pixel).or_default().push(Last {
                            draw: run.draw,
                            record,
                            operands: before.copied(),
                        });
                    }
                }
            }
        }
    }
    found
}

/// What a record's lane reads, its coordinates moved by some steps of 1/2048 texel.
fn reads(tables: &Tables, last: &Last, by: [i32; 2]) -> Vec<(Sample, Footprint)> {
    let mut record = last.record;
    record.uv = [0, 1].map(|axis| record.uv[axis] + by[axis]);
    let mut found = Vec::new();
    let options = SamplingOptions::default();
    let add = |sample: &Sample, footprint| found.push((*sample, footprint));
    record_footprints(
        tables,
        last.draw,
        &record,
        last.operands.as_ref(),
        &options,
        add,
    );
    found
}

/// The pixel shows what a record reads. Coordinates are rounded to 1/2048 texel, so a texel's edge may lie on either
/// side; a level likewise.
fn explains(tables: &Tables, last: &Last, object: &str, pixel: [u8; 4]) -> bool {
    const STEPS: [i32; 3] = [0, -2, 2];
    let moves = STEPS
        .iter()
        .flat_map(|u| STEPS.iter().map(move |v| [*u, *v]));
    let mut all = moves.map(|by| reads(tables, last, by));
    match object {
        // The components are the columns of the four texels, from the lower left one on.
        "gather" => all.any(|reads| {
            reads.iter().any(|(_, f)| {
                let columns = [f.i[0], f.i[1], f.i[1], f.i[0]].map(|i| i as u8);
                columns == pixel
            })
        }),
        // Texels of a border are black.
        "border" if pixel == [0; 4] => all.any(|reads| reads.is_empty()),
        _ => {
            let Some([x, y, level, layer]) = told(pixel) else {
                return last.record.group == NO_GROUP;
            };
            all.any(|reads| {
                reads.iter().any(|(_, f)| {
                    let at = [f.i[0], f.j[0], f.level.into(), f.layer.into()];
                    at == [x, y, level, layer] && f.texels().count() == 1
                })
            })
        }
    }
}

fn object(tables: &Tables, draw: u32) -> &'static str {
    let material = &tables.draws[draw as usize].material;
    let number = material
        .strip_prefix("pipeline ")
        .expect("a pipeline's number");
    OBJECTS[number.parse::<usize>().expect("a pipeline's number")]
}

/// Holds every pixel against its records. Tells how many each object explains.
fn explain(captured: &Captured) -> HashMap<&'static str, u64> {
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
            let of_pixel = records.remove(&at).unwrap_or_default();
            let Some(top) = of_pixel.last() else {
                assert_eq!(pixel, [0; 4], "{eye} {at:?} is lit without a record");
                continue;
            };
            // What was discarded shows what lies behind.
            let primitive_of = |last: &Last| object(tables, last.draw);
            let seen = of_pixel.iter().rev().find(|last| {
                let name = primitive_of(last);
                name == "volume" || explains(tables, last, name, pixel)
            });
            let name = primitive_of(top);
            let is_discarding = |last: &&Last| primitive_of(last) == "discard";
            let above = of_pixel.iter().rev().take_while(is_discarding).count();
            let depth = seen.and_then(|seen| {
                of_pixel
                    .iter()
                    .rev()
                    .position(|last| std::ptr::eq(last, seen))
            });
            // A loop's last iteration, or a branch's only one, comes last; groups of a pair in any order.
            let same_draw = depth.is_some_and(|depth| {
                depth <= above || primitive_of(&of_pixel[of_pixel.len() - 1 - depth]) == name
            });
            if same_draw || (pixel == [0; 4] && above == of_pixel.len()) {
                *explained.entry(name).or_default() += 1;
            } else {
                let reads = reads(tables, top, [0; 2]);
                let of = wrong.entry(name).or_default();
                of.0 += 1;
                of.1 = format!("{eye} {at:?} shows {:?}, reads {reads:?}", told(pixel));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}\nexplained: {explained:?}");
    explained
}

#[test]
fn every_pixel_shows_a_texel_of_its_last_record_however_eyes_are_rendered() {
    if !has_lavapipe() {
        return;
    }
    for (stereo, rule) in [
        ("halves", "viewport halves"),
        ("targets", "a target per eye"),
        ("twice", "equal draws twice"),
        ("multiview", "multiview"),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let captured = capture(folder.path(), stereo, &[]);
        assert!(captured.said.contains(rule), "{}", captured.said);
        assert!(captured.said.contains("0 different"), "{}", captured.said);
        let left_out = "three-dimensional textures (1 draws,";
        assert!(captured.said.contains(left_out), "{}", captured.said);
        let explained = explain(&captured);
        println!("{stereo}: pixels explained: {explained:?}");
        for object in OBJECTS {
            let least = if object == "plain" { 10_000 } else { 100 };
            let found = explained.get(object).copied().unwrap_or(0);
            assert!(found >= least, "{stereo}: {object} explains {found} pixels");
        }
    }
}

#[test]
fn a_captured_program_is_replayed_like_a_scene() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let captured = capture(folder.path(), "halves", &["--encoding", "planes"]);
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

/// A capture of the program that has to fail, and leaves no trace.
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

/// What `tracegen app` records of the program, with arguments of both, into a trace of this name.
fn captured_by(folder: &Path, name: &str, options: &[&str], program_arguments: &[&str]) -> PathBuf {
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

/// Two traces have the same tables and tiles; they may tell of different commands.
fn assert_same(a: &Path, b: &Path) {
    const APART: [&str; 3] = ["meta.command_line", "meta.scene", "meta.program.views_by"];
    let output = program("replay").arg("diff").args([a, b]).output();
    let text = String::from_utf8(output.expect("replay starts").stdout).expect("text");
    let differ: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with(['<', '>']))
        .collect();
    let is_apart = |line: &&str| APART.iter().any(|name| line.starts_with(name));
    assert!(!differ.is_empty() && differ.iter().all(is_apart), "{text}");
}

#[test]
fn programs_that_fork_or_are_started_by_scripts_are_captured_alike() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frames = ["--frames", "2"];
    let plain = captured_by(folder.path(), "plain", &frames, &[]);
    let forks = captured_by(folder.path(), "forks", &frames, &["--end", "fork"]);
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
fn a_program_that_never_renders_is_ended_after_a_time_that_the_user_chooses() {
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

/// A range of frames is each of its frames, one after the other.
#[test]
fn several_frames_are_those_that_are_captured_one_by_one() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--frames", "5"];
    let all = captured_by(folder.path(), "all", &["--frames", "1..4"], &arguments);
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
        let one = captured_by(folder.path(), &text, &["--frames", &text], &arguments);
        let one = Textrace::open(&one).expect("a trace");
        let expected = counts(&one, frame);
        assert!(expected > 10_000);
        assert_eq!(counts(&all, frame), expected, "frame {frame}");
    }
}

#[test]
fn a_list_names_every_pass_and_shows_its_picture() {
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
    let pictures: Vec<&str> = html.split("data:image/png;base64,").skip(1).collect();
    assert_eq!(pictures.len(), 2, "a picture of each pass");
    assert!(
        pictures.iter().all(|data| data.len() > 2_000),
        "pictures of one colour"
    );
    assert!(list("mono", &[]).contains("no two eyes were found"));
    // Without a page nothing but the table is made.
    assert_eq!(
        std::fs::read_dir(folder.path())
            .expect("the folder")
            .count(),
        1
    );
}

#[test]
fn a_file_of_rules_tells_the_eyes_where_asked() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rules = folder.path().join("rules.toml");
    let text = "[[rule]]\npass = 0\nshows = \"left\"\n[[rule]]\npass = 1\nshows = \"right\"\n";
    std::fs::write(&rules, text).expect("a file");
    let by_file = ["--frames", "2", "--rules", rules.to_str().expect("a path")];
    let arguments = ["--stereo", "targets"];
    let told = captured_by(folder.path(), "told", &by_file, &arguments);
    let found = captured_by(folder.path(), "found", &["--frames", "2"], &arguments);
    assert_same(&told, &found);
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

/// Every module that the layer hands to the driver, and every one that the program gave.
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
        captured_by(folder.path(), stereo, &options, &["--stereo", stereo]);
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
        // As the program gave them and as they record.
        assert_eq!(valid, 2 * OBJECTS.len(), "{stereo}");
    }
}

#[test]
fn programs_without_vulkan_and_programs_that_are_not_there_are_named() {
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
