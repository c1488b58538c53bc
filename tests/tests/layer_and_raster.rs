//! The same scene through `tracegen raster` and through the layer. The plain render of `tracegen raster` is an
//! ordinary Vulkan program without recording code, and the layer records it. Both traces must sample the same
//! texels in every pixel, to the rounding of coordinates.

use formats::footprint::{SamplingOptions, record_footprints};
use formats::textrace::{Textrace, Tile, with_operands};
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, run_ok};
use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::path::Path;

const SIZE: &str = "192x160";

/// Scenes with opaque, masked and blended materials.
const SCENES: [&str; 8] = [
    "atrium", "teapot", "chess", "car", "lab", "plant", "meadow", "jungle",
];

/// A texel block that a pixel reads: texture, level, layer, columns and rows.
type Read = (usize, u32, u16, [u32; 2], [u32; 2]);

/// The reads of each pixel of an eye, sorted.
type Reads = HashMap<[u32; 2], Vec<Read>>;

/// A render of a scene with and without capture. Returns the command's arguments.
fn render(scene: &str, trace: &Path) -> Vec<String> {
    let tracegen = program("tracegen").get_program().to_owned();
    let tracegen = tracegen.into_string().expect("a path in UTF-8");
    let trace = trace.display().to_string();
    let arguments = ["raster", scene, "--size", SIZE, "-o", &trace];
    let arguments = arguments.into_iter().map(str::to_owned);
    [tracegen].into_iter().chain(arguments).collect()
}

/// Numbers of the passes of the plain render: the two color passes with the most fragments.
fn plain_passes(list: &str) -> [u32; 2] {
    let target = format!("{SIZE} R8G8B8A8_SRGB");
    let mut passes: Vec<(u64, u32)> = (list.lines())
        .filter(|line| line.contains(&target))
        .map(|line| {
            let fields: Vec<&str> = line.split("  ").map(str::trim).collect();
            let fields: Vec<&str> = fields.into_iter().filter(|f| !f.is_empty()).collect();
            let number = |at: usize| fields[at].parse().expect("a number in the list");
            (number(5), number(0) as u32)
        })
        .collect();
    passes.sort_unstable();
    let [.., a, b] = passes[..] else {
        panic!("expected two passes of {target} in\n{list}");
    };
    [a.1.min(b.1), a.1.max(b.1)]
}

/// The texels that each pixel of an eye reads, sorted: textures by their numbers in the trace.
fn reads(trace: &Textrace, eye: Eye) -> Reads {
    let tables = trace.tables();
    let options = SamplingOptions::default();
    let mut found = Reads::new();
    let mut tile = Tile::default();
    for (pass, of) in tables.passes.iter().enumerate() {
        for index in (0..of.tile_count()).filter(|_| of.eye == Some(eye)) {
            trace
                .decode_tile(pass, index as usize, &mut tile)
                .expect("a tile");
            let corner = [index % of.tiles[0], index / of.tiles[0]].map(|at| 16 * at);
            for run in &tile.runs {
                let of_run = run.first as usize..(run.first + run.count) as usize;
                for (record, before) in with_operands(&tile.records[of_run]) {
                    let quad = [record.x, record.y].map(|at| 2 * u32::from(at));
                    let add = |sample: &formats::textrace::Sample,
                               f: formats::footprint::Footprint| {
                        let lane = u32::from(f.lane);
                        let pixel = [
                            corner[0] + quad[0] + lane % 2,
                            corner[1] + quad[1] + lane / 2,
                        ];
                        let texture = sample.texture as usize;
                        let read = (texture, u32::from(f.level), f.layer, f.i, f.j);
                        found.entry(pixel).or_default().push(read);
                    };
                    record_footprints(tables, run.draw, record, before, &options, add);
                }
            }
        }
    }
    for of_pixel in found.values_mut() {
        of_pixel.sort_unstable();
    }
    found
}

/// The texture of one trace for each texture of another, and the level that its level 0 is: that of the same
/// format with which it shares most texels, pixel by pixel. Textures that are never read have none.
fn same_textures(
    from: (&Textrace, &Reads),
    to: (&Textrace, &Reads),
) -> HashMap<usize, (usize, u32)> {
    let size = |trace: &Textrace, read: &Read| {
        trace.tables().textures[read.0]
            .size
            .map(|edge| (edge >> read.1).max(1))
    };
    let mut shared: HashMap<usize, HashMap<usize, u64>> = HashMap::new();
    for (at, reads) in from.1 {
        for read in reads {
            let others = to.1.get(at).into_iter().flatten().filter(|other| {
                (other.2, other.3, other.4) == (read.2, read.3, read.4)
                    && size(to.0, other) == size(from.0, read)
            });
            for other in others {
                *shared
                    .entry(read.0)
                    .or_default()
                    .entry(other.0)
                    .or_default() += 1;
            }
        }
    }
    // Textures of one material often share all coordinates. Their order then distinguishes them.
    let mut pairs: Vec<(Reverse<u64>, usize, usize)> = (shared.iter())
        .flat_map(|(&texture, of)| {
            of.iter()
                .map(move |(&other, &n)| (Reverse(n), texture, other))
        })
        .collect();
    pairs.sort_unstable();
    let mut found = HashMap::new();
    let mut taken = HashSet::new();
    for (_, texture, other) in pairs {
        let [a, b] = [(from.0, texture), (to.0, other)].map(|(t, n)| &t.tables().textures[n]);
        let is_same = (a.format, a.color_space) == (b.format, b.color_space);
        if is_same && !found.contains_key(&texture) && taken.insert(other) {
            found.insert(texture, (other, (b.size[0] / a.size[0]).ilog2()));
        }
    }
    found
}

/// Reads of the textures that a map gives.
fn renamed(reads: Reads, textures: &HashMap<usize, (usize, u32)>) -> Reads {
    let rename = |read: Read| {
        let (texture, finest) = textures[&read.0];
        (texture, finest + read.1, read.2, read.3, read.4)
    };
    let of_pixel = |(at, reads): ([u32; 2], Vec<Read>)| {
        let mut reads: Vec<Read> = reads.into_iter().map(rename).collect();
        reads.sort_unstable();
        (at, reads)
    };
    reads.into_iter().map(of_pixel).collect()
}

#[test]
fn the_layer_and_the_raster_capture_sample_the_same_texels_in_every_pixel() {
    if !has_lavapipe() {
        return;
    }
    for scene in SCENES {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let [own, app] = ["own.textrace", "app.textrace"].map(|name| folder.path().join(name));
        let list = run_ok(
            program("tracegen")
                .args(["app", "--frames", "0", "--to-end", "--list", "--"])
                .args(render(scene, &own)),
        );
        let [left, right] = plain_passes(&String::from_utf8_lossy(&list.stdout));
        let rules = folder.path().join("plain.toml");
        let rule = |pass: u32, eye: &str| format!("[[rule]]\npass = {pass}\nshows = \"{eye}\"\n");
        let text = format!(
            "{}{}[[rule]]\nshows = \"ignored\"\n",
            rule(left, "left"),
            rule(right, "right")
        );
        std::fs::write(&rules, text).expect("a file of rules");
        let mut capture = program("tracegen");
        capture.args(["app", "--frames", "0", "--to-end", "--check", "--rules"]);
        capture.arg(&rules).arg("-o").arg(&app).arg("--");
        run_ok(capture.args(render(scene, &own)));
        let [own, app] = [own, app].map(|path| Textrace::open(&path).expect("a trace"));
        let mut count = 0;
        for eye in [Eye::Left, Eye::Right] {
            let expected = reads(&own, eye);
            let found = reads(&app, eye);
            // The layer's textures lack the finest levels that no view samples: they are not uploaded.
            let textures = same_textures((&app, &found), (&own, &expected));
            let found = renamed(found, &textures);
            assert_eq!(
                expected.len(),
                found.len(),
                "{scene}, {eye}: covered pixels"
            );
            // Coordinates are rounded to 1/2048 texel of the finest level, which is not the same in both traces.
            // At the edge of a texel or of a level, the neighbour may therefore be read.
            let mut differing = 0;
            for (at, reads) in &expected {
                differing += usize::from(*reads != found[at]);
            }
            println!(
                "{scene}, {eye}: {differing} of {} pixels differ",
                expected.len()
            );
            assert!(
                differing * 1000 <= expected.len(),
                "{scene}, {eye}: {differing}"
            );
            count += expected.values().map(Vec::len).sum::<usize>();
        }
        println!("{scene}: {count} footprints");
        assert!(count > 50_000, "{scene}: {count} footprints");
    }
}
