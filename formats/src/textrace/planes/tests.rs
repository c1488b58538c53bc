#![allow(
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "a test may panic"
)]

mod train;

use super::codes::{Code, Codes, MOST_BITS};
use super::lengths::LENGTHS;
use super::mode::{Deviation, Mode};
use super::places::ESCAPE_PLACE;
use super::plane::{Plane, Quad, tilt_of};
use super::residual::{Classes, ESCAPE_SIZES, class_bits, classify, small, symbol, width};
use super::widths::{CORRECTION, Choices, DX_AND_UV, DY_AND_CROSS, Layout};
use super::*;
use crate::textrace::{NO_GROUP, PrimitiveRun, QuadRecord, quad_morton};
use crate::varint::low_u32;
use proptest::prelude::*;

/// Coordinates in perspective in two groups, rounded as in a capture.
fn record(x: u8, y: u8, group: u8, mask: u8, bend: f64) -> QuadRecord {
    let at = |x: f64, y: f64| {
        let w = 1.0 + 0.004 * x - 0.009 * y;
        let scale = f64::from(group) * 3000.0 + 5000.0;
        [
            (700_000.0 + scale * x + 300.0 * y) / w + bend * x * x,
            (-90_000.0 - 200.0 * x + 4100.0 * y) / w,
        ]
    };
    let lane = |i: f64, j: f64| at(f64::from(x) * 2.0 + i, f64::from(y) * 2.0 + j);
    let [o, r, d, c] = [lane(0., 0.), lane(1., 0.), lane(0., 1.), lane(1., 1.)];
    let fixed = |f: &dyn Fn(usize) -> f64| [f(0).round() as i32, f(1).round() as i32];
    QuadRecord {
        x,
        y,
        mask,
        group,
        uv: fixed(&|a| o[a]),
        dx: fixed(&|a| r[a] - o[a]),
        dy: fixed(&|a| d[a] - o[a]),
        cross: fixed(&|a| c[a] - d[a] - r[a] + o[a]),
    }
}

/// A tile covered by one primitive, with a record for each quad and group.
fn covered(groups: u8, bend: f64) -> Tile {
    let mut records: Vec<QuadRecord> = (0..64u8)
        .flat_map(|at| (0..groups).map(move |group| record(at % 8, at / 8, group, 15, bend)))
        .collect();
    records.sort_by_key(|r| (quad_morton(r.x, r.y), r.group));
    let run = PrimitiveRun {
        primitive: u32::MAX - 1,
        draw: 7,
        first: 0,
        count: records.len() as u32,
    };
    Tile {
        runs: vec![run],
        records,
    }
}

fn decoded(tile: &Tile, bytes: &[u8]) -> Option<Tile> {
    let (runs, records) = (tile.runs.len() as u32, tile.records.len() as u32);
    let mut out = Tile::default();
    decode(runs, records, bytes, &mut out).ok().map(|_| out)
}

fn bytes_per_record(tile: &Tile) -> f64 {
    let bytes = encode(tile);
    assert_eq!(decoded(tile, &bytes).as_ref(), Some(tile));
    bytes.len() as f64 / tile.records.len() as f64
}

#[test]
fn a_plane_in_perspective_takes_less_than_two_bytes_per_quad() {
    let bytes = bytes_per_record(&covered(1, 0.0));
    assert!(bytes < 1.6, "{bytes} bytes per record");
}

#[test]
fn a_second_group_of_the_same_quads_takes_no_bits_for_places() {
    let bytes = bytes_per_record(&covered(2, 0.0));
    assert!(bytes < 1.5, "{bytes} bytes per record");
}

#[test]
fn a_curved_surface_is_predicted() {
    let bytes = bytes_per_record(&covered(1, 0.5));
    assert!(bytes < 4.0, "{bytes} bytes per record");
}

#[test]
fn numbers_at_the_ends_of_their_range_are_decoded() {
    let extremes = [i32::MIN, i32::MAX, 0, -1];
    let mut tile = Tile::default();
    for (number, group) in [(0, 0), (1, NO_GROUP)] {
        let first = tile.records.len() as u32;
        for at in 0..64usize {
            let pick = |salt: usize| [extremes[(at + salt) % 4], extremes[(at / 4 + salt) % 4]];
            tile.records.push(QuadRecord {
                x: (at % 8) as u8,
                y: (at / 8) as u8,
                mask: (at % 15 + 1) as u8,
                group,
                uv: pick(0),
                dx: pick(1),
                dy: pick(2),
                cross: pick(3),
            });
        }
        tile.records[first as usize..].sort_by_key(|r| quad_morton(r.x, r.y));
        tile.runs.push(PrimitiveRun {
            primitive: number * (u32::MAX - 1),
            draw: number * (u32::MAX - 1),
            first,
            count: 64,
        });
    }
    assert_eq!(decoded(&tile, &encode(&tile)), Some(tile));
}

#[test]
fn cut_or_longer_bytes_are_refused() {
    let tile = covered(2, 1.0);
    let mut bytes = encode(&tile);
    for length in 0..bytes.len() {
        assert!(decoded(&tile, &bytes[..length]).is_none(), "{length} bytes");
    }
    bytes.push(0);
    assert!(decoded(&tile, &bytes).is_none());
}

#[test]
fn counts_that_differ_from_the_index_are_refused() {
    let tile = covered(1, 0.0);
    let bytes = encode(&tile);
    for (runs, records) in [(1, 63), (1, 65), (2, 64), (0, 64), (u32::MAX, u32::MAX)] {
        let mut out = Tile::default();
        let refused = decode(runs, records, &bytes, &mut out).is_err();
        assert!(refused, "{runs} runs of {records}");
        assert!(
            out.records.len() <= bytes.len() * 8 + 8,
            "bounded by the bytes"
        );
    }
}

#[test]
fn every_code_is_complete_and_has_an_escape_if_symbols_are_missing() {
    for (number, lengths) in LENGTHS.iter().enumerate() {
        let lengths: Vec<u32> = lengths.chars().map(|c| c.to_digit(16).unwrap()).collect();
        let used = lengths.iter().filter(|length| **length > 0);
        let sum: u32 = used.map(|length| 1 << (MOST_BITS - length)).sum();
        assert_eq!(sum, 1 << MOST_BITS, "code {number}");
        let escape = match lengths.len() as u32 - 1 {
            111 => Some(ESCAPE_PLACE),
            ESCAPE_SIZES => Some(ESCAPE_SIZES),
            // For widths, the escape is the widest.
            last @ (511 | 1023 | 2047) => Some(last),
            _ => None,
        };
        match escape {
            Some(escape) => assert!(lengths[escape as usize] > 0, "code {number}"),
            None => assert!(!lengths.contains(&0), "code {number}"),
        }
    }
}

#[test]
fn the_documented_lengths_equal_those_of_the_code() {
    let text = include_str!("../../../../FORMAT.md");
    let (_, text) = text.split_once("### Code lengths of encoding 3\n").unwrap();
    let block = text.split("```\n").nth(1).unwrap();
    let documented = block.lines().map(|line| line.split_once(' ').unwrap().1);
    assert!(documented.eq(LENGTHS));
}

#[test]
fn symbols_are_decoded_from_their_bits() {
    let codes = Codes::get();
    for family in [&codes.place, &codes.sizes] {
        for (context, code) in family.codes.iter().enumerate() {
            for symbol in 0..=ESCAPE_SIZES {
                if let Some((bits, length)) = code.encode(symbol) {
                    let noise = u64::from(bits) | 0xffff << length;
                    assert_eq!(family.decode(context, noise), (symbol, length));
                    assert_eq!(code.decode(noise), (symbol, length));
                }
            }
        }
    }
}

#[test]
fn small_pairs_are_decoded_from_class_and_index() {
    for u in -2..=2i32 {
        for v in -2..=2i32 {
            let (class, index) = classify([u, v]);
            let expected = match u.unsigned_abs() + v.unsigned_abs() {
                sum @ 0..=1 => sum,
                2 if u != 0 && v != 0 => 2,
                _ => 3,
            };
            assert_eq!(class, expected);
            assert!(index < 1 << class_bits(class));
            assert_eq!(small(class, index).map(i32::from), [u, v]);
        }
    }
    assert_eq!(classify([0, -3]).0, 4);
    assert_eq!(classify([i32::MIN, 0]).0, 4);
}

#[test]
fn four_pairs_are_decoded_from_their_symbol_and_bits() {
    for each in 0..ESCAPE_SIZES {
        let of = [each % 5, each / 5 % 5, each / 25 % 5, each / 125];
        assert_eq!(symbol(of), each);
        let classes = Classes::of_symbol(each);
        assert_eq!(classes.wide(), of.map(|class| u32::from(class == 4)));
        assert_eq!(classes.is_special(), of.contains(&4));
        assert!(!classes.is_escape());
        assert_eq!(classes.bits(), of.map(class_bits).iter().sum::<u32>());
        let bits = u64::from(each).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut used = 0;
        let one_by_one = of.map(|class| {
            let found = small(class, low_u32(bits >> used) & 255);
            used += class_bits(class);
            found.map(i32::from)
        });
        assert_eq!(classes.small_pairs(bits), one_by_one);
    }
    assert!(Classes::of_symbol(ESCAPE_SIZES).is_escape());
    assert!(Classes::of_symbol(ESCAPE_SIZES).is_special());
}

#[test]
fn a_quad_without_its_second_group_makes_a_run_irregular() {
    let mut tile = covered(2, 0.0);
    let first = tile.runs[0];
    let mut second = covered(2, 0.0).records;
    // In one case the second group occurs alone, in the other the first one.
    second.remove(20);
    second.remove(41);
    tile.runs[0].primitive = 3;
    tile.runs.push(PrimitiveRun {
        first: first.count,
        count: second.len() as u32,
        ..first
    });
    tile.records.extend(second);
    assert_eq!(decoded(&tile, &encode(&tile)), Some(tile));
}

#[test]
fn a_plane_passes_through_its_quad() {
    let quad = record(3, 5, 0, 15, 0.0);
    let quad = [quad.uv, quad.dx, quad.dy, quad.cross];
    // In the quad's own frame, by the closed form of w around it.
    let w = 1.0 + 0.004 * 6.0 - 0.009 * 10.0;
    let tilt = [0.004 / w, -0.009 / w];
    let plane = Plane::through(quad_morton(3, 5), &quad, tilt);
    let found = plane.predict(quad_morton(3, 5));
    assert_eq!(found[..3], quad[..3]);
    for (found, exact) in found[3].iter().zip(quad[3]) {
        assert!(found.abs_diff(exact) <= 1, "{found} for {exact}");
    }
    let far = record(7, 7, 0, 15, 0.0);
    let found = plane.predict(quad_morton(7, 7));
    // dx and dy are rounded to a half, 8 pixels away.
    assert!(
        found[0][0].abs_diff(far.uv[0]) < 16,
        "{found:?} for {far:?}"
    );
}

#[test]
fn the_tilt_is_estimated_from_a_quad() {
    // Far from the expected tilt, but with a large cross.
    let [p, q] = [0.02, -0.03];
    let [dx, dy] = [[9000, -4000], [1500, 8000]];
    let estimate = |axis: usize| -f64::from(dx[axis]) * q - f64::from(dy[axis]) * p;
    let cross = [0, 1].map(|axis| (estimate(axis) / (1.0 + p + q)).round() as i32);
    let found = tilt_of(&[[0; 2], dx, dy, cross], [0.0; 2]);
    for (found, exact) in found.iter().zip([p, q]) {
        assert!(
            (f64::from(*found) - exact).abs() < 1e-3,
            "{found}, not {exact}"
        );
    }
    // The squares of such numbers exceed f32, but the slopes must stay finite.
    let largest = [[i32::MAX, i32::MIN], [i32::MIN, i32::MAX]];
    let [one, other] = largest;
    let found = tilt_of(&[one, one, other, other], [0.5, -0.5]);
    assert!(found.iter().all(|slope| slope.abs() <= 1.0), "{found:?}");
}

/// Compares every symbol of a code with the encoder's choice.
fn chosen_is_best<const N: usize>(
    code: &Code,
    layout: Layout<N>,
    choices: &Choices<N>,
    pairs: [[i32; 2]; N],
) {
    let chosen = choices.choose(&pairs);
    let fewest = (0..layout.symbols() as u32).filter_map(|symbol| {
        let (_, length) = code.encode(symbol)?;
        let widths = layout.widths(symbol);
        let holds = widths
            .iter()
            .zip(&pairs)
            .all(|(bits, pair)| width(*pair) <= *bits);
        holds.then(|| length + 2 * widths.iter().sum::<u32>())
    });
    assert_eq!(Some(chosen.bits), fewest.min(), "{pairs:?}");
    assert_eq!(chosen.widths, layout.widths(chosen.symbol));
}

fn quad() -> impl Strategy<Value = Quad> {
    let number = prop_oneof![-300..300i32, any::<i32>()];
    prop::array::uniform4(prop::array::uniform2(number))
}

proptest! {
    /// The checksum detects damage; the decoder must also tolerate malicious bytes.
    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..400), runs in 0..40u32, records in 0..2000u32,
    ) {
        let mut tile = Tile::default();
        if decode(runs, records, &bytes, &mut tile).is_ok() {
            prop_assert_eq!(tile.runs.len() as u32, runs);
            prop_assert_eq!(tile.records.len() as u32, records);
        }
        prop_assert!(tile.records.len() <= bytes.len() * 8 + 8);
    }

    #[test]
    fn changed_bytes_never_panic(at in 0..200usize, value in any::<u8>()) {
        let tile = covered(2, 0.5);
        let mut bytes = encode(&tile);
        if let Some(byte) = bytes.get_mut(at) {
            *byte = value;
        }
        decoded(&tile, &bytes);
    }

    #[test]
    fn widths_are_coded_in_the_fewest_bits(shifts in prop::array::uniform4(0..32u32), bits in any::<i32>()) {
        let codes = Codes::get();
        let choices = codes.choices();
        let [a, b, c, d] = shifts.map(|shift| [bits >> shift, !(bits >> shift) / 2]);
        chosen_is_best(&codes.first, DX_AND_UV, &choices.first, [a, b]);
        for (code, choices) in codes.rest.codes.iter().zip(&choices.rest) {
            chosen_is_best(code, DY_AND_CROSS, choices, [c, d]);
        }
        // The range of a correction.
        let within = |[u, v]: [i32; 2], bits: u32| [u >> (32 - bits), v >> (32 - bits)];
        let correction = [within(a, 5), within(b, 9), within(c, 9), within(d, 16)];
        chosen_is_best(&codes.correction, CORRECTION, &choices.correction, correction);
    }

    #[test]
    fn deviations_are_decoded_in_every_mode(quads in prop::collection::vec((0..8u8, 0..8u8, quad()), 1..9)) {
        for mode in Mode::ALL {
            let mut written = Deviation::start(mode, 2, 3);
            let mut read = written;
            for (x, y, quad) in &quads {
                let residual = written.write(*x, *y, quad);
                prop_assert_eq!(read.read(*x, *y, &residual), *quad);
            }
        }
    }
}
