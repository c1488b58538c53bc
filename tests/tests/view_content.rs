//! What `replay view` says of lines, against plain counts of the accesses that `replay convert` lists: lines of tiles and
//! parts, texels that are read, and the content of the L2.

use crate::view::{digits, numbers, run, trace, view};
use formats::Trace;
use formats::layout::{Layout, LayoutConfig};
use parallax_tests::lru::Lru;
use parallax_tests::{program, run_ok};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const LINE_BYTES: u64 = 16;

/// An access of a footprint to a line.
#[derive(Clone, Copy)]
struct Access {
    line: u64,
    pass: u64,
    tile: u64,
    draw: u64,
    texture: u64,
    level: u64,
}

/// The accesses of a trace in an order on one core.
fn accesses(trace: &Path, order: &str) -> Vec<Access> {
    let mut command = program("replay");
    command.arg("convert").arg(trace);
    let output = run_ok(command.args(["--to", "csv", "--order", order, "--cores", "1"]));
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("names").split(',').collect();
    let columns = ["address", "pass", "tile", "draw", "texture", "level"];
    let places = columns.map(|name| names.iter().position(|n| *n == name).expect(name));
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(hex) => u64::from_str_radix(hex, 16).expect("an address"),
        None => text.parse().expect("a number"),
    };
    let access = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [address, pass, tile, draw, texture, level] = places.map(|at| number(cells[at]));
        let line = address / LINE_BYTES;
        Access {
            line,
            pass,
            tile,
            draw,
            texture,
            level,
        }
    };
    lines.map(access).collect()
}

/// The different lines of the accesses by a key.
fn lines_by<K: Ord>(all: &[Access], key: impl Fn(&Access) -> K) -> BTreeMap<K, BTreeSet<u64>> {
    let mut out: BTreeMap<K, BTreeSet<u64>> = BTreeMap::new();
    for of in all {
        out.entry(key(of)).or_default().insert(of.line);
    }
    out
}

/// By tile, counts of a list of distances and counts.
fn by_tile(list: &Value) -> BTreeMap<u64, u64> {
    let mut tile = 0;
    let pairs = numbers(list);
    let pair = |pair: &[u64]| {
        tile += pair[0];
        (tile, pair[1])
    };
    pairs.chunks(2).map(pair).collect()
}

#[test]
fn lines_of_tiles_and_parts_and_texels_read_equal_plain_counts() {
    let file = trace("atrium-shadows.textrace");
    let data = view(&file, &["--orders", "morton"]);
    let all = accesses(&file, "morton");
    let eyes = lines_by(&all, |of| of.pass);
    let both: BTreeSet<u64> = eyes[&0].intersection(&eyes[&1]).copied().collect();
    let passes = data["frames"][0]["passes"].as_array().expect("passes");
    assert_eq!(passes.len(), 2, "a pass for each eye");
    let tiles = lines_by(&all, |of| (of.pass, of.tile));
    let count = |tiles: Option<&BTreeSet<u64>>| tiles.map_or(0, |lines| lines.len() as u64);
    for (number, pass) in (0..).zip(passes) {
        for (tile, (lines, shared)) in (0..).zip(
            numbers(&pass["lines"])
                .into_iter()
                .zip(numbers(&pass["shared_lines"])),
        ) {
            let expected = tiles.get(&(number, tile));
            assert_eq!(lines, count(expected));
            assert_eq!(
                shared,
                expected.map_or(0, |of| of.intersection(&both).count() as u64)
            );
        }
        for (list, part) in [
            ("textures", (|of| of.texture) as fn(&Access) -> u64),
            ("levels", |of| of.level),
        ] {
            let expected = lines_by(&all, |of| (of.pass, part(of), of.tile));
            let mut sum = 0;
            for of_part in pass[list].as_array().expect("parts") {
                let part = of_part[0].as_u64().expect("a number");
                for (tile, lines) in by_tile(&of_part[1]) {
                    assert_eq!(lines, count(expected.get(&(number, part, tile))), "{list}");
                    sum += lines;
                }
            }
            let of_pass = expected.iter().filter(|(key, _)| key.0 == number);
            assert_eq!(
                sum,
                of_pass.map(|(_, lines)| lines.len() as u64).sum::<u64>()
            );
        }
    }
    for (kind, part) in [
        ("mip level", (|of| of.level) as fn(&Access) -> u64),
        ("texture", |of| of.texture),
        ("draw", |of| of.draw),
    ] {
        let expected = lines_by(&all, part);
        let kinds = data["parts"].as_array().expect("parts").iter();
        let found = kinds.filter(|of| of["kind"] == kind);
        for of in found {
            let lists = ["lines", "shared_lines"].map(|key| numbers(&of[key]));
            for (part, (lines, shared)) in (0..).zip(lists[0].iter().zip(&lists[1])) {
                let expected = expected.get(&part);
                assert_eq!(*lines, count(expected), "{kind} {part}");
                let both = expected.map_or(0, |of| of.intersection(&both).count() as u64);
                assert_eq!(*shared, both, "{kind} {part}");
            }
        }
    }

    // Texels: each block of every line that is read.
    let Trace::Texture(opened) = Trace::open(&file).expect("a trace") else {
        panic!("a texture trace")
    };
    let layout =
        Layout::new(&opened.tables().textures, &LayoutConfig::default()).expect("a layout");
    for (kind, part) in [
        ("texture", (|of| of.texture) as fn(&Access) -> u64),
        ("draw", |of| of.draw),
    ] {
        let expected = lines_by(&all, |of| (part(of), of.texture, of.level));
        let mut maps = 0;
        for (part, list) in (0..).zip(data["reads"][kind].as_array().expect("parts")) {
            for map in list.as_array().expect("maps") {
                let [texture, level, lines] =
                    [0, 1, 3].map(|at| map[at].as_u64().expect("a number"));
                let expected = &expected[&(part, texture, level)];
                assert_eq!(lines, expected.len() as u64);
                // Of a shadow map every block would be counted for every draw, which takes minutes.
                if kind == "texture" || numbers(&map[4])[1] < 1 << 20 {
                    check_map(map, &layout, expected, [texture, level]);
                }
                maps += 1;
            }
        }
        assert_eq!(maps, expected.len(), "{kind}");
    }
}

/// The blocks of the lines, counted by cell.
fn check_map(map: &Value, layout: &Layout, lines: &BTreeSet<u64>, [texture, level]: [u64; 2]) {
    let of = &layout.textures()[texture as usize];
    let size = of.levels[level as usize].size;
    let blocks = [0, 1].map(|axis| size[axis].div_ceil(of.block.texels[axis]));
    let cells = [0, 1].map(|axis| map[5][axis].as_u64().expect("cells") as u32);
    assert_eq!(cells, blocks.map(|blocks| blocks.min(32)));
    let cell = |[x, y]: [u32; 2]| {
        let place = |axis: usize, at: u32| at * cells[axis] / blocks[axis];
        (place(1, y) * cells[0] + place(0, x)) as usize
    };
    let mut counts = vec![[0_u64; 2]; (cells[0] * cells[1]) as usize];
    let all = (0..of.layers).flat_map(|layer| (0..blocks[1]).map(move |y| (layer, y)));
    for ((layer, y), x) in all.flat_map(|row| (0..blocks[0]).map(move |x| (row, x))) {
        let texel = [x * of.block.texels[0], y * of.block.texels[1]];
        let address = layout.address(texture as u32, layer, level as u32, texel);
        let line = address.expect("a block") / LINE_BYTES;
        let [read, all] = &mut counts[cell([x, y])];
        *read += u64::from(lines.contains(&line));
        *all += 1;
    }
    let sum = |which: usize| counts.iter().map(|of| of[which]).sum::<u64>();
    assert_eq!(numbers(&map[4]), [sum(0), sum(1)]);
    let runs = numbers(&map[6]);
    let shares = runs
        .chunks(2)
        .flat_map(|run| std::iter::repeat_n(run[0], run[1] as usize));
    let expected = counts.iter().map(|[read, all]| share(*read, *all));
    assert!(shares.eq(expected), "texture {texture}, level {level}");
}

/// Sevenths, rounded down; 0 only for none, 7 only for all.
fn share(part: u64, all: u64) -> u64 {
    match part {
        0 => 0,
        _ => (7 * part / all).clamp(1, 7),
    }
}

/// The last share of each tile in a packed list of changes.
fn last_shares(list: &Value) -> Vec<u64> {
    let (mut out, mut step, mut now) = (Vec::new(), 0, 0);
    for digit in digits(list) {
        let (place, share) = (digit / 8, digit % 8);
        if share == now {
            step += 8 * (place + 1);
        } else {
            step += place + 1;
            now = share;
        }
        if step > 64 {
            out.push(now);
            (step, now) = (0, 0);
        }
    }
    assert_eq!(step, 0, "the last tile has no end");
    out
}

#[test]
fn the_content_of_the_l2_at_the_end_equals_that_of_plain_lru_caches() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let machine = folder.path().join("machine.toml");
    // One core without latencies accesses the caches in the order of the accesses.
    std::fs::write(
        &machine,
        "cores = 1\nmemory_cycles = 0\n[[level]]\nsize_bytes = \"1KiB\"\n[[level]]\nsize_bytes = \"16KiB\"\nhit_cycles = 0\n",
    )
    .expect("a file");
    let machine = ["--config", machine.to_str().expect("a name")];
    let file = trace("atrium-shadows.textrace");
    for order in ["zig-zag", "hilbert"] {
        let data = view(&file, &[machine[0], machine[1], "--orders", order]);
        let all = accesses(&file, order);
        let (mut l1, mut l2, mut misses) = (Lru::new(16, 4), Lru::new(256, 4), 0_u64);
        for of in &all {
            misses += u64::from(!l1.access(of.line) && !l2.access(of.line));
        }
        let result = run(&file, &[machine[0], machine[1], "--order", order]);
        assert_eq!(result["l2"]["line_misses"], misses);
        let there: BTreeSet<u64> = l2.sets.into_iter().flatten().collect();
        assert_eq!(data["l2_lines"], 1024);

        let eyes = lines_by(&all, |of| of.pass);
        let of_eyes = |line: &u64| [0, 1].map(|eye| eyes[&eye].contains(line));
        let owners = [[true, false], [false, true], [true, true], [false, false]];
        for (owner, list) in owners.iter().zip(
            data["frames"][0]["l2"][0]["lines"]
                .as_array()
                .expect("lists"),
        ) {
            let list = numbers(list);
            assert_eq!(list.len(), 65);
            let expected = there.iter().filter(|line| of_eyes(line) == *owner).count();
            assert_eq!(list[64], expected as u64, "{order}: {owner:?}");
        }
        let tiles = lines_by(&all, |of| (of.pass, of.tile));
        let passes = data["frames"][0]["passes"].as_array().expect("passes");
        for (number, pass) in (0..).zip(passes) {
            let shares = last_shares(&pass["runs"][0]["in_l2"]);
            assert_eq!(shares.len(), numbers(&pass["footprints"]).len());
            for (tile, found) in (0..).zip(shares) {
                let expected = tiles.get(&(number, tile)).map_or(0, |lines| {
                    share(
                        lines.intersection(&there).count() as u64,
                        lines.len() as u64,
                    )
                });
                assert_eq!(found, expected, "{order}: pass {number}, tile {tile}");
            }
        }
    }
}
