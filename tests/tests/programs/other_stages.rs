//! Texture reads of other stages than the fragment shader, and programs that end their frames in other ways.

use super::{capture_program, refused};
use formats::textrace::{Textrace, UnrecordedReads, VertexDraw};
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, run_ok};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

fn reads(trace: &Path) -> Vec<UnrecordedReads> {
    let trace = Textrace::open(trace).expect("a trace");
    let program = trace.tables().meta.program.clone();
    program.expect("a program's trace").unrecorded_reads
}

/// Six vertices of a floor and 36 of each box, which `--objects plain,pair,discard` draws. The last one is drawn
/// twice to be recorded.
const VERTICES: [u32; 3] = [6, 36, 36];

/// Edge, levels and layers of its textures.
const EDGE: u32 = 64;
const LEVELS: i32 = 7;
const LAYERS: i32 = 4;

/// The texels of a footprint, with level and layer.
type Texels = (i32, i32, Vec<[u32; 2]>);

/// The texels of a linear filter around a point, in parts of a repeated texture, at a level.
fn filtered(uv: [f64; 2], level: i32, layer: i32) -> Texels {
    let size = (EDGE >> level) as i32;
    let [columns, rows] = uv.map(|at| {
        let first = (at * f64::from(size) - 0.5).floor() as i32;
        let mut both = [first, first + 1]
            .map(|at| at.rem_euclid(size) as u32)
            .to_vec();
        both.dedup();
        both
    });
    let row = |y: u32| columns.iter().map(move |x| [*x, y]);
    (level, layer, rows.into_iter().flat_map(row).collect())
}

/// What the vertex shader of the test program reads for a vertex: the footprints of six image instructions.
fn closed_form(vertex: u32) -> [Option<Texels>; 6] {
    let n = vertex as i32;
    let fetched = |[x, y]: [i32; 2], level: i32, layer: i32| {
        let is_level = (0..LEVELS).contains(&level) && (0..LAYERS).contains(&layer);
        let is_texel = is_level && (0..EDGE as i32 >> level).contains(&x);
        is_texel.then(|| (level, layer, vec![[x as u32, y as u32]]))
    };
    let corner = [f64::from(n % 2 + 1) / 32.0, 0.25];
    let inside = [(f64::from(n % 2) + 0.3) / 8.0, 0.3];
    [
        fetched([n % 4, 2], 0, 0),
        Some(filtered(corner, 1, n % 3)),
        fetched([n % 3 - 1, 0], n % 9, 0),
        fetched([0, 0], 1, n % 6 - 1),
        Some(filtered(
            inside,
            (n % 9 - 1).clamp(0, LEVELS - 1),
            (n % 6 - 1).clamp(0, LAYERS - 1),
        )),
        Some(filtered(corner, 0, 0)),
    ]
}

/// The first texture is the flat one, or the array.
const OF_ARRAY: [bool; 6] = [false, true, false, true, true, false];

#[test]
fn reads_of_vertex_shaders_are_recorded_exactly_and_the_others_are_counted() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let objects = [
        "--objects",
        "plain,pair,discard",
        "--also",
        "vertex,compute",
    ];
    for (name, stereo, libraries) in [
        ("halves", "halves", "0"),
        ("multiview", "multiview", "0"),
        ("libraries", "halves", "1"),
    ] {
        let options = [
            "--stereo",
            stereo,
            "--instances",
            "2",
            "--libraries",
            libraries,
        ];
        let arguments = [&objects[..], &options].concat();
        let capture = |to| capture_program(folder.path(), to, &["--frames", "1..3"], &arguments);
        let file = capture(name);
        // A draw of each object, for each eye or for both.
        let commands = if stereo == "multiview" { 3 } else { 6 };
        let of_vertices = 2 * 2 * 2 * u64::from(VERTICES.iter().sum::<u32>());
        // Two frames; 4 x 2 workgroups of 8 x 4 invocations.
        let of_compute = 2 * 8 * 32;
        let counted = |stage: &str, what: &str, commands, invocations| UnrecordedReads {
            stage: stage.to_owned(),
            what: what.to_owned(),
            commands,
            indirect: 0,
            invocations,
            reads: invocations,
        };
        let expected = [
            counted("compute", "two-dimensional textures", 2, of_compute),
            counted(
                "vertex",
                "three-dimensional textures",
                2 * commands,
                of_vertices,
            ),
        ];
        assert_eq!(reads(&file), expected, "{name}");
        let trace = Textrace::open(&file).expect("a trace");
        let again = Textrace::open(&capture("again")).expect("a trace");
        assert_eq!(trace.content_checksum(), again.content_checksum());
        assert_eq!(trace.container().version().1, 1, "{name}");
        let mut expected = Vec::new();
        for frame in 1..3 {
            for command in 0..commands as u32 {
                let (eyes, object) = match (stereo, command / 3) {
                    ("multiview", _) => (&[Eye::Left, Eye::Right][..], command),
                    (_, 0) => (&[Eye::Left][..], command),
                    _ => (&[Eye::Right][..], command - 3),
                };
                let of = |eye: &Eye| (frame, Some(*eye), command, VERTICES[object as usize]);
                expected.extend(eyes.iter().map(of));
            }
        }
        let draws = trace.vertex_reads();
        let last = |of: &VertexDraw| of.reads.last().map_or(0, |read| read.vertex);
        let found = draws.iter();
        let found: Vec<_> = found
            .map(|of| (of.frame, of.eye, of.draw, last(of) + 1))
            .collect();
        assert_eq!(found, expected, "{name}");
        for draw in draws {
            let vertices = (0..2).flat_map(|_| 0..=last(draw));
            let expected =
                vertices.flat_map(|vertex| closed_form(vertex).into_iter().zip(OF_ARRAY));
            let expected: Vec<_> = expected
                .filter_map(|(texels, array)| Some((array, texels?)))
                .collect();
            let mut found: Vec<(bool, Texels)> = Vec::new();
            draw.footprints(trace.tables(), |site, footprint| {
                let layers = trace.tables().textures[site.texture as usize].layers;
                let texels = footprint.texels().collect();
                let of = (footprint.level.into(), footprint.layer.into(), texels);
                found.push((layers > 1, of));
            });
            assert_eq!(found, expected, "{name}");
        }
    }
    let trace = folder.path().join("halves.textrace");
    for command in [&["info"][..], &["run"], &["validate"], &["dump"]] {
        let output = run_ok(program("replay").args(command).arg(&trace));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        for notice in [
            "not in the trace: reads by compute shaders of two-dimensional textures",
            "not in the trace: reads by vertex shaders of three-dimensional textures",
            // Two frames, two eyes, two instances, six instructions.
            "in no cache: reads by vertex shaders, which the trace has (12 draws, 624 vertices, 3744 reads)",
        ] {
            assert!(text.contains(notice), "{command:?}: {text}");
        }
    }
    let output = run_ok(program("replay").args(["info", "--json"]).arg(&trace));
    let info: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let mut texels = BTreeSet::new();
    for (texture, of) in (0..VERTICES[1]).flat_map(|v| OF_ARRAY.into_iter().zip(closed_form(v))) {
        let (level, layer, of) = of.unwrap_or_default();
        texels.extend(of.into_iter().map(|texel| (texture, level, layer, texel)));
    }
    let of_left = &info["vertex_reads"][0];
    let expected = [2 * 78 * 6, texels.len()];
    assert_eq!(
        [&of_left["reads"], &of_left["texels"]],
        expected.map(Value::from).each_ref()
    );
    let dump = ["dump", "--vertex-reads"];
    let output = run_ok(program("replay").args(dump).arg(&trace));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(text.lines().count(), 3744);
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
