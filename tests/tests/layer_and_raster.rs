//! The same scene through `tracegen raster` and through the layer. The plain render of `tracegen raster` is an
//! ordinary Vulkan program without recording code, and the layer records it. Both traces must sample the same
//! texels in every pixel, to the rounding of coordinates.

use formats::footprint::{SamplingOptions, record_footprints};
use formats::textrace::{Textrace, Tile, with_operands};
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, run_ok};
use std::collections::HashMap;
use std::path::Path;

const SIZE: &str = "192x160";

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

/// The reads of each pixel of an eye. `texture` maps a texture of the trace to its number and to the level that
/// its level 0 is of that texture.
fn reads(trace: &Textrace, eye: Eye, texture: impl Fn(usize) -> (usize, u32)) -> Reads {
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
                        let (number, finest) = texture(sample.texture as usize);
                        let read = (number, finest + u32::from(f.level), f.layer, f.i, f.j);
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

#[test]
fn the_layer_and_the_raster_capture_sample_the_same_texels_in_every_pixel() {
    if !has_lavapipe() {
        return;
    }
    for scene in ["atrium"] {
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
        let own_textures = &own.tables().textures;
        let mut count = 0;
        for eye in [Eye::Left, Eye::Right] {
            let expected = reads(&own, eye, |texture| (texture, 0));
            // The layer numbers images in the order in which `tracegen raster` creates them. The finest levels
            // that no view samples are not uploaded.
            let found = reads(&app, eye, |texture| {
                let of = &app.tables().textures[texture];
                let number = of.name.strip_prefix("image ").expect("an image's name");
                let number = number.split(' ').next().expect("a number");
                let number = number.parse::<usize>().expect("a number") - 1;
                let finest = (own_textures[number].size[0] / of.size[0]).ilog2();
                (number, finest)
            });
            assert_eq!(
                expected.len(),
                found.len(),
                "{scene}, {eye}: covered pixels"
            );
            // Coordinates are rounded to 1/2048 texel of the finest level, which is not the same in both traces.
            // At the edge of a texel, the neighbour may therefore be read.
            let mut differing = 0;
            for (at, reads) in &expected {
                let other = &found[at];
                differing += usize::from(reads != other);
                let levels = |of: &[Read]| of.iter().map(|r| (r.0, r.1, r.2)).collect::<Vec<_>>();
                assert_eq!(levels(reads), levels(other), "{scene}, {eye}, {at:?}");
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
        assert!(count > 100_000, "{scene}: {count} footprints");
    }
}
