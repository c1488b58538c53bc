#![allow(
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "a test may panic"
)]

use super::*;
use crate::textrace::{PrimitiveRun, QuadRecord};
use proptest::prelude::*;

/// A tile covered by one plane in perspective, sampled as a GPU does: exact coordinates of the four lanes,
/// rounded, and their differences.
fn perspective_tile() -> Tile {
    let at = |x: f64, y: f64| {
        let w = 1.0 + 0.004 * x - 0.009 * y;
        [
            (700_000.0 + 5000.0 * x + 300.0 * y) / w,
            (-90_000.0 - 200.0 * x + 4100.0 * y) / w,
        ]
    };
    let mut records = Vec::new();
    for (x, y) in (0u8..64).map(|m| {
        (
            m & 1 | m >> 1 & 2 | m >> 2 & 4,
            m >> 1 & 1 | m >> 2 & 2 | m >> 3 & 4,
        )
    }) {
        let lane = |i: f64, j: f64| at(f64::from(x) * 2.0 + i, f64::from(y) * 2.0 + j);
        let [o, r, d, c] = [lane(0., 0.), lane(1., 0.), lane(0., 1.), lane(1., 1.)];
        let fixed = |f: &dyn Fn(usize) -> f64| [f(0).round() as i32, f(1).round() as i32];
        records.push(QuadRecord {
            x,
            y,
            mask: 15,
            group: 0,
            uv: fixed(&|a| o[a]),
            dx: fixed(&|a| r[a] - o[a]),
            dy: fixed(&|a| d[a] - o[a]),
            cross: fixed(&|a| c[a] - d[a] - r[a] + o[a]),
        });
    }
    let run = PrimitiveRun {
        primitive: 9,
        draw: 0,
        first: 0,
        count: 64,
    };
    Tile {
        runs: vec![run],
        records,
    }
}

#[test]
fn a_plane_in_perspective_takes_a_few_bytes_per_quad() {
    let tile = perspective_tile();
    let bytes = encode(&tile);
    let bytes_per_quad = (bytes.len() - PADDING_BYTES) as f64 / 64.0;
    assert!(bytes_per_quad < 8.0, "{bytes_per_quad} bytes a quad");
    let mut out = Tile::default();
    decode(1, 64, &bytes, &mut out).unwrap();
    assert_eq!(out, tile);
}

#[test]
fn bytes_after_the_last_record_are_refused() {
    let mut bytes = encode(&perspective_tile());
    bytes.push(0);
    assert!(decode(1, 64, &bytes, &mut Tile::default()).is_err());
}

#[test]
fn padding_that_is_not_zero_is_refused() {
    let mut bytes = encode(&perspective_tile());
    *bytes.last_mut().unwrap() = 1;
    assert!(decode(1, 64, &bytes, &mut Tile::default()).is_err());
}

proptest! {
    /// The checksum detects damage; the decoder must also tolerate malicious bytes.
    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..400), runs in 0..40u32, records in 0..200u32,
    ) {
        let mut tile = Tile::default();
        if decode(runs, records, &bytes, &mut tile).is_ok() {
            prop_assert_eq!(tile.runs.len() as u32, runs);
            prop_assert_eq!(tile.records.len() as u32, records);
        }
    }

    #[test]
    fn changed_bytes_never_panic(at in 0..300usize, value in any::<u8>()) {
        let mut bytes = encode(&perspective_tile());
        if let Some(byte) = bytes.get_mut(at) {
            *byte = value;
        }
        let _ = decode(1, 64, &bytes, &mut Tile::default());
    }
}
