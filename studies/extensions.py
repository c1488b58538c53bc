"""What each kind of extension costs: files and lines that a person edits, each shown by adding a small one to a copy of the sources.

The copy is compiled, and each extension is used once, so that an entry proves that nothing else has to be edited. About six minutes. `--count` counts only.
"""

import re
import shutil

from .common import CARGO, ROOT, Failed, execute

OPTIONS = {"--count": dict(action="store_true", help="count files and lines without compiling")}

SIM, SGRT, CAPTURE = "replay/sim/src", "replay/sgrt/src", "tracegen"


def row(path, after, text):
    """An edit: lines to insert below the first line that matches."""
    return path, re.compile(after, re.M), text


# What is added; the files that may be edited besides new ones; new files; edits; words of a command that uses it.
EXTENSIONS = [
    ("tile order", 1, {f"{SIM}/order/curve/example.rs": '''//! Columns from the left.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Columns from the left.
#[derive(Debug)]
pub(crate) struct Example;

impl Path for Example {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        (0..columns).flat_map(|x| (0..rows).map(move |y| [x, y])).collect()
    }

    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(4).deciding_in(1)
    }
}
'''}, [
        row(f"{SIM}/order/curve/mod.rs", r"^mod band;$", "mod example;"),
        row(f"{SIM}/order/curve/mod.rs", r"^    RANDOM = ", '    EXAMPLE = row("example", GREY, CurveSize::NONE, "Columns from the left", &example::Example);'),
    ], "replay run {trace} --order example --mode functional"),
    ("replacement policy", 1, {f"{SIM}/memory/policy/example.rs": '''//! Evicts the first way.

use super::Policy;

pub(super) struct Example;

impl Policy for Example {
    fn fill(&mut self, _set: u32, _way: u32, _line: u32) {}

    fn victim(&mut self, _set: u32) -> u32 {
        0
    }
}
'''}, [
        row(f"{SIM}/memory/policy/mod.rs", r"^mod any_cache;$", "mod example;"),
        row(f"{SIM}/memory/policy/mod.rs", r"^    SHIP = ", '    EXAMPLE = row("example", "The first way", ANY_WAYS, |g| by(example::Example, g));'),
    ], "replay run {trace} --replacement example --mode functional"),
    ("prefetcher", 1, {f"{SIM}/memory/prefetch/example.rs": '''//! Fetches the line before each miss.

use super::{Demand, Prefetcher};

pub(super) struct Example;

impl Prefetcher for Example {
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>) {
        if demand == Demand::Miss {
            lines.extend(line.checked_sub(1));
        }
    }
}
'''}, [
        row(f"{SIM}/memory/prefetch/mod.rs", r"^mod aligned_block;$", "mod example;"),
        row(f"{SIM}/memory/prefetch/mod.rs", r"^    TILE_AHEAD = ", '    EXAMPLE = row("example", "The line before each miss", ANY_LINES, 1, |_| Box::new(example::Example));'),
    ], "replay run {trace} --prefetch example --mode functional"),
    ("rule of error detection", 1, {f"{SGRT}/rules/example.rs": '''//! `example`: rejects arrivals of the sky.

use super::{RuleKind, Test};
use crate::frame::Sample;
use crate::place::RightSample;
use crate::reads::Reads;

/// The sky has no object.
pub static RULE: RuleKind = RuleKind {
    name: "example",
    title: "it is the sky",
    help: "the left ray hit nothing",
    takes_share: false,
    reads: Reads::NOTHING,
    test: Some(|_, _, _| Box::new(Example)),
    retests: None,
};

struct Example;

impl Test for Example {
    fn rejects(&self, _: RightSample, hit: &Sample) -> bool {
        hit.is_sky()
    }
}
'''}, [
        row(f"{SGRT}/rules/mod.rs", r"^mod depth;$", "mod example;"),
        row(f"{SGRT}/rules/mod.rs", r"^    &shadow_edge::RULE,$", "    &example::RULE,"),
    ], "replay reproject {rays} --rule example"),
    ("culling method", 2, {f"{CAPTURE}/visibility/src/culling/example.rs": '''//! Culls nothing.

use super::{CullInput, Volumes};
use crate::rig::TooWide;

/// All of space.
pub(super) fn volumes(_: &CullInput<'_>) -> Result<Volumes, TooWide> {
    Ok(Volumes::Everything)
}
'''}, [
        row(f"{CAPTURE}/visibility/src/culling/mod.rs", r"^mod conical;$", "mod example;"),
        row(f"{CAPTURE}/visibility/src/culling/mod.rs", r"^    ROUND_ROBIN +=", '    EXAMPLE = row("example", "Example", true, "Every draw", example::volumes);'),
    ], "tracegen raster teapot --size 64x64 --cull example -o {out}"),
    ("column", 1, {}, [
        row("replay/report/src/memory_columns.rs", r"^    columns_of::<MemoryResult>", '        .real("example_lines", "example", "lines", 0, |r| r.invalidated_lines)'),
    ], "replay run {trace} --csv"),
    ("cache level", 0, {}, [], "replay run {trace} --level 64KiB --level 1MiB --mode functional"),
    ("client of memory", 2, {}, [
        row(f"{SIM}/memory/access.rs", r"^    Composition = ", '    Example = "example", "An example.";'),
        row(f"{SIM}/access/mod.rs", r"^        self.buffers.start_frame", "        self.traffic.read(Client::Example, 0, 64);"),
    ], "replay run {geometry} --frame tile-based --mode functional"),
    ("setting", 2, {}, [
        row(f"{SIM}/config/tmu.rs", r"^    pub struct TmuConfig", "        /// An example. Not used.\n        pub example_cycles: u32 = 1, in 0..=9;"),
    ], "replay run {trace} --config {config} --mode functional"),
    ("display", 2, {}, [
        row("tracegen/scene/src/hmd/presets.rs", r"with square pixels are this.*\n    \},$", '    Preset { name: "example", eye_size_px: [64, 64], cant_deg: 0.0, fov: Fov::SymmetricDeg(90.0), source: "an example" },'),
        row("docs/use/displays.md", r"^\| `dk2`", "| `example` | 64x64 | 1 | 1 | 1 | 1 | 0 | an example |"),
    ], "tracegen raster teapot --hmd example -o {out}"),
    ("built-in scene", 2, {"tracegen/scenes/data/example.scene": "mesh floor here\n"}, [
        row("tracegen/scenes/src/lib.rs", r"^pub const BUILTINS", '    builtin("example", 2, &["default"], "a square", include_str!("../data/example.scene"), Code::NONE),'),
        row("tracegen/scenes/src/texture_synth.rs", r"^const SOURCE_TEXT", '    include_str!("../data/example.scene"),'),
    ], "tracegen raster example --size 64x64 -o {out}"),
    ("stress sweep", 2, {}, [
        row("lab/src/stress/sweeps/mod.rs", r"^pub const SWEEPS", '    sweep("example", "An example.", [1.0, 1.0], None, textures::sizes),'),
    ], "tracegen stress --only example -o {folder}"),
    ("study", 2, {"studies/example.py": '"""An example."""\n\n\ndef run(study):\n    study.write("example", "", ["a"], [[1]])\n'}, [], "study example"),
    ("study of accuracy", 2, {"replay/studies/src/accuracy/example.rs": '''//! An example: one choice without figures.

use super::inputs::Inputs;
use super::study::{Choice, Study, StudyError};

pub(super) const EXAMPLE: Study = Study {
    key: "example",
    title: "An example",
    about: "An example.",
    time: "none",
    reference: "itself",
    recommended: "itself",
    reason: "there is no other",
    figures: &[],
    measure: measured,
};

fn measured(_: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    Ok(Vec::new())
}
'''}, [
        row("replay/studies/src/accuracy/mod.rs", r"^mod captures;$", "mod example;"),
        row("replay/studies/src/accuracy/mod.rs", r"^    captures::CAPTURE,$", "    example::EXAMPLE,"),
    ], ""),
    ("section of a page", 2, {}, [
        row("replay/report/src/locality/page.rs", r"^        let mut page = Page::default", "        page.add(\"Example\", html! { p { \"An example.\" } });"),
    ], "replay locality {trace} --html {page}"),
    ("foveation mode", 4, {"tracegen/techniques/src/foveation/example.rs": '''//! An example: the picture as it is.

use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};

/// One layer, the picture.
pub(crate) fn patches(picture: &EyePicture) -> EyePatches {
    EyePatches {
        patches: vec![Patch::whole(picture, None)],
        is_picture: true,
        rate_px: f64::from(picture.size_px[0] * picture.size_px[1]),
    }
}
'''}, [
        row("tracegen/techniques/src/settings.rs", r"^    RadialDensity,$", "    /// An example.\n    Example,"),
        row("tracegen/techniques/src/foveation/mod.rs", r"^pub\(crate\) mod acuity;$", "pub(crate) mod example;"),
        row("tracegen/techniques/src/foveation/mod.rs", r"^pub static MODES", '''    Mode {
        kind: FoveationKind::Example,
        name: "example",
        technique: "example",
        title: "Example",
        help: "The picture as it is",
        rates_of: Some("nothing"),
        follows_gaze: false,
        patches: |picture, _| example::patches(picture),
    },'''),
    ], "tracegen raster teapot --size 64x64 --foveate=example -o {out}"),
]


def lines(text):
    return sum(bool(line.strip()) for line in text.splitlines())


def add(folder, new, edits):
    """Adds one extension to the copy."""
    for name, text in new.items():
        (folder / name).write_text(text)
    for name, after, text in edits:
        source = (folder / name).read_text()
        found = after.search(source)
        if not found:
            raise Failed(f"{name}: no line matches {after.pattern}")
        end = source.index("\n", found.end()) + 1
        (folder / name).write_text(source[:end] + text + "\n" + source[end:])


def copy(folder):
    """The tracked files, as they are."""
    names = execute("git ls-files -z", folder=ROOT).out.split("\0")
    for name in filter(None, names):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def use(study, folder, words):
    """Uses an extension once, with the programs of the copy."""
    program, *rest = words.split()
    if program == "study":
        execute("python3 -m studies", *rest, "--results", study.work / "results", folder=folder)
        return
    config = study.work / "example.toml"
    config.write_text("tmu.example_cycles = 2\n")
    places = {"trace": "traces/atrium.textrace", "geometry": "traces/atrium-geometry.textrace", "rays": "traces/chess.raytrace",
              "out": study.work / "a.textrace", "folder": study.work / "stress", "page": study.work / "a.html", "config": config}
    execute(study.work / "target/release" / program, *(word.format(**places) for word in rest), folder=folder)


def run(study):
    folder = study.work / "copy"
    copy(folder)
    rows = []
    for what, limit, new, edits, _ in EXTENSIONS:
        add(folder, new, edits)
        edited = {name for name, _, _ in edits}
        if len(edited) > limit:
            raise Failed(f"{what}: expected at most {limit} edited files, found {len(edited)}")
        rows.append([what, len(new), sum(map(lines, new.values())), len(edited), sum(lines(text) for _, _, text in edits), " ".join(sorted(edited))])
    if study.options.count:
        return
    execute(f"{CARGO} build --release --locked -p tracegen -p replay", folder=folder, CARGO_TARGET_DIR=str(study.work / "target"))
    for what, *_, words in EXTENSIONS:
        study.say(what)
        if words:
            use(study, folder, words)
    study.write("extensions", "", "extension | new files | their lines | edited files | lines added | edited", rows)
