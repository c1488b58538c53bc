//! FORMAT.md against the code: sizes, header and index offsets, and the delta encoding, decoded
//! here once more from nothing but the text.

use crate::container::{CHUNK_ALIGNMENT_BYTES, DIRECTORY_ENTRY_BYTES, HEADER_BYTES};
use crate::raytrace::RAY_INDEX_ENTRY_BYTES;
use crate::textrace::{
    self, Encoding, INDEX_ENTRY_BYTES, PrimitiveRun, QuadRecord, Textrace, TextraceWriter, Tile,
    encode_tile_as, tables,
};
use proptest::prelude::*;
use std::collections::HashMap;

const FORMAT: &str = include_str!("../../FORMAT.md");

/// Rows of the first table below a heading, cells trimmed.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, after) = FORMAT
        .split_once(&format!("\n{heading}\n"))
        .expect("the heading is there");
    after
        .lines()
        .skip_while(|line| !line.starts_with('|'))
        .take_while(|line| line.starts_with('|'))
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

/// Size of a structure from its table of offset, type and field; offsets must have no gaps.
fn size(heading: &str) -> usize {
    let mut end = 0;
    for row in table(heading) {
        assert_eq!(row[0], end.to_string(), "{heading}: {row:?}");
        end += match row[1] {
            "u8" | "i8" => 1,
            "u16" => 2,
            "u32" | "u8[4]" => 4,
            "u64" | "u8[8]" => 8,
            other => panic!("{heading}: type {other}"),
        };
    }
    end
}

#[test]
fn documented_sizes_are_the_codes() {
    let code = HashMap::from([
        ("header", HEADER_BYTES),
        ("directory entry", DIRECTORY_ENTRY_BYTES),
        ("chunk alignment", CHUNK_ALIGNMENT_BYTES as usize),
        ("texture without name", tables::TEXTURE_BYTES),
        ("sampler", tables::SAMPLER_BYTES),
        ("draw without name and groups", tables::DRAW_BYTES),
        ("uv group without samples", tables::GROUP_BYTES),
        ("sample", tables::SAMPLE_BYTES),
        ("pass", tables::PASS_BYTES),
        ("tile index entry", INDEX_ENTRY_BYTES),
        ("raw run", textrace::RAW_RUN_BYTES),
        ("raw record", textrace::RAW_RECORD_BYTES),
        ("delta padding", textrace::DELTA_PADDING_BYTES),
        ("ray tile index entry", RAY_INDEX_ENTRY_BYTES),
        (
            "ray triangle",
            crate::raytrace::tables::TRIANGLE_ENTRY_BYTES,
        ),
    ]);
    let rows = table("## Sizes");
    assert_eq!(rows.len(), code.len());
    for row in rows {
        assert_eq!(row[1], code[row[0]].to_string(), "{}", row[0]);
    }
}

#[test]
fn documented_fields_add_up() {
    assert_eq!(size("### Header"), HEADER_BYTES);
    assert_eq!(size("### Directory entry"), DIRECTORY_ENTRY_BYTES);
    assert_eq!(size("### Texture"), tables::TEXTURE_BYTES);
    assert_eq!(size("### Sampler"), tables::SAMPLER_BYTES);
    assert_eq!(size("### Draw"), tables::DRAW_BYTES);
    assert_eq!(size("### Pass"), tables::PASS_BYTES);
    assert_eq!(size("### Tile index entry"), INDEX_ENTRY_BYTES);
}

#[test]
fn chunks_come_in_the_documented_order() {
    let bytes = TextraceWriter::in_memory(&textrace::tests::tables())
        .unwrap()
        .into_bytes()
        .unwrap();
    let trace = Textrace::from_bytes(bytes).unwrap();
    let tags = trace
        .container()
        .directory()
        .iter()
        .map(|entry| format!("`{}`", entry.tag));
    let documented = table("## .textrace")
        .into_iter()
        .map(|row| row[0].to_owned());
    assert_eq!(tags.collect::<Vec<_>>(), documented.collect::<Vec<_>>());
}

/// A second decoder of the delta encoding, written from FORMAT.md alone, one bit at a time.
struct Plain<'a> {
    bytes: &'a [u8],
    bit: usize,
}

#[derive(Clone, Copy, Default)]
struct Context {
    last: QuadRecord,
    sx: [i32; 2],
    sy: [i32; 2],
}

impl Plain<'_> {
    fn bits(&mut self, count: u32) -> u32 {
        let mut value = 0;
        for index in 0..count {
            let byte = u32::from(self.bytes[self.bit / 8]);
            value |= (byte >> (self.bit % 8) & 1) << index;
            self.bit += 1;
        }
        value
    }

    fn number(&mut self) -> u64 {
        let (mut value, mut shift) = (0u64, 0);
        loop {
            let byte = u64::from(self.bits(8));
            value |= (byte & 127) << shift;
            shift += 7;
            if byte < 128 {
                return value;
            }
        }
    }

    fn residuals(&mut self, code: u32) -> [i32; 2] {
        const WIDTHS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 18, 24, 32];
        [0, 1].map(|_| {
            let stored = self.bits(WIDTHS[code as usize]);
            let half = (stored >> 1) as i32;
            if stored & 1 == 1 { !half } else { half }
        })
    }
}

fn decode(runs: u32, bytes: &[u8]) -> Tile {
    let mut input = Plain { bytes, bit: 0 };
    let mut tile = Tile::default();
    let (mut next, mut draw, mut first) = (0, 0, 0);
    for _ in 0..runs {
        let head = input.number();
        let primitive = (next + head / 2) as u32;
        if head % 2 == 1 {
            draw = input.number() as u32;
        }
        let count = input.number() as u32 + 1;
        tile.runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count,
        });
        next = u64::from(primitive) + 1;
        first += count;
    }
    let start: [u8; 16] = std::array::from_fn(|group| group as u8);
    let (mut contexts, mut follows, mut group) = ([Context::default(); 16], start, 0u8);
    let mut draw = 0;
    for run in tile.runs.clone() {
        if run.draw != draw {
            (contexts, follows, group, draw) = ([Context::default(); 16], start, 0, run.draw);
        }
        let mut morton = 0;
        let mut seen = [false; 16];
        for _ in 0..run.count {
            let codes = [0; 4].map(|_| input.bits(4));
            let mut step = input.bits(3);
            let mask = input.bits(4) as u8;
            let expected = input.bits(1) == 1;
            if step == 7 {
                step = input.bits(6);
            }
            let now = if expected {
                follows[group as usize]
            } else {
                input.bits(4) as u8
            };
            follows[group as usize] = now;
            group = now;
            morton += step;
            let every_other = |m: u32| (m & 1 | m >> 1 & 2 | m >> 2 & 4) as u8;
            let (x, y) = (every_other(morton), every_other(morton >> 1));
            let context = &mut contexts[group as usize];
            let last = context.last;
            let r = i32::from(x) - i32::from(last.x);
            let d = i32::from(y) - i32::from(last.y);
            let left = codes.map(|code| input.residuals(code));
            let mut record = QuadRecord {
                x,
                y,
                mask,
                group,
                ..QuadRecord::default()
            };
            #[allow(clippy::needless_range_loop, reason = "the text says: u and v alike")]
            for a in 0..2 {
                let mul = i32::wrapping_mul;
                let sum = |terms: &[i32]| terms.iter().fold(0i32, |s, t| s.wrapping_add(*t));
                let cross = last.cross[a];
                let along = |n: i32, from: i32, to: i32| {
                    let bend = if n == 0 {
                        0
                    } else {
                        to.wrapping_sub(from) >> 1
                    };
                    mul(n, from.wrapping_add(to)).wrapping_sub(bend)
                };
                let dx = sum(&[
                    last.dx[a],
                    mul(r, context.sx[a]),
                    mul(2 * d, cross),
                    left[0][a],
                ]);
                let dy = sum(&[
                    last.dy[a],
                    mul(d, context.sy[a]),
                    mul(2 * r, cross),
                    left[1][a],
                ]);
                let dx_there = dx.wrapping_sub(mul(2 * d, cross));
                let dy_here = last.dy[a].wrapping_add(mul(2 * r, cross));
                record.dx[a] = dx;
                record.dy[a] = dy;
                record.cross[a] = cross.wrapping_add(left[2][a]);
                let (right, down) = (along(r, last.dx[a], dx_there), along(d, dy_here, dy));
                record.uv[a] = sum(&[last.uv[a], right, down, left[3][a]]);
                if seen[group as usize] && r.abs() == 1 {
                    context.sx[a] = mul(r, dx_there.wrapping_sub(last.dx[a]));
                }
                if seen[group as usize] && d.abs() == 1 {
                    context.sy[a] = mul(d, dy.wrapping_sub(dy_here));
                }
            }
            context.last = record;
            seen[group as usize] = true;
            tile.records.push(record);
        }
    }
    tile
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_decoder_written_from_the_text_reads_the_delta_encoding(tile in textrace::tests::tile()) {
        let encoded = encode_tile_as(Encoding::Delta, &textrace::tests::tables(), &tile).unwrap();
        prop_assert_eq!(decode(tile.runs.len() as u32, encoded.bytes()), tile);
    }
}
