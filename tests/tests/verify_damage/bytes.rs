//! Damages of bytes: container, chunks and indices.

use super::damages::{Damage, of_bytes, of_file};
use parallax_tests::repair::{Parts, repair_header};

/// Bytes of an entry of the tile index, and of the list index.
const ENTRY_BYTES: [usize; 2] = [32, 36];

fn put_u32(parts: &mut Parts, tag: &[u8; 4], at: usize, change: impl Fn(u32) -> u32) {
    let bytes: [u8; 4] = parts.chunk(tag)[at..at + 4].try_into().expect("four bytes");
    let value = change(u32::from_le_bytes(bytes));
    parts.put(tag, at, &value.to_le_bytes());
}

pub fn of_container() -> Vec<Damage> {
    let mut all = Vec::new();
    for (field, at) in [
        ("header: magic", 0),
        ("header: major version", 8),
        ("header: kind", 12),
        ("header: reserved", 14),
        ("header: offset of the directory", 16),
        ("header: size of the file", 24),
        ("header: entries", 32),
        ("header: reserved", 40),
    ] {
        all.push(of_file(
            field,
            "+ 1, with a correct checksum",
            move |bytes| {
                bytes[at] = bytes[at].wrapping_add(1);
                repair_header(bytes);
            },
        ));
    }
    for (field, at) in [
        ("header: checksum", 44),
        ("header: checksum of the directory", 36),
    ] {
        all.push(of_file(field, "a bit", move |bytes| bytes[at] ^= 1));
    }
    all.push(of_file(
        "header: minor version",
        "0, with a correct checksum",
        |bytes| {
            bytes[10] = 0;
            repair_header(bytes);
        },
    ));
    for tag in [
        b"META", b"TEXS", b"SMPS", b"DRAW", b"PASS", b"TILE", b"TIDX", b"GEOM", b"PLST", b"PLIX",
    ] {
        let field = format!("chunk {}", String::from_utf8_lossy(tag));
        all.push(of_file(&field, "a bit, without a checksum", move |bytes| {
            let directory = u64::from_le_bytes(bytes[16..24].try_into().expect("eight bytes"));
            let mut entries = bytes[directory as usize..].chunks_exact(24);
            let entry = entries.find(|entry| entry[..4] == *tag).expect("a chunk");
            let number =
                |at: usize| u64::from_le_bytes(entry[at..at + 8].try_into().expect("eight bytes"));
            let middle = (number(8) + number(16) / 2) as usize;
            bytes[middle] ^= 4;
        }));
        all.push(of_bytes(&field, "its last byte less", move |parts| {
            parts.chunk(tag).pop();
        }));
    }
    all.push(of_bytes("directory", "two chunks exchanged", |parts| {
        parts.chunks.swap(1, 2)
    }));
    all.push(of_bytes("directory", "no list index", |parts| {
        parts.chunks.retain(|(tag, _)| tag != b"PLIX");
    }));
    all.push(of_file("file", "its last byte less", |bytes| {
        bytes.pop();
    }));
    all
}

pub fn of_indices() -> Vec<Damage> {
    let mut all = Vec::new();
    let fields = [
        ("offset", 0),
        ("size", 8),
        ("checksum", 12),
        ("records", 16),
        ("runs", 20),
        ("encoding", 24),
    ];
    for (field, at) in fields {
        all.push(of_bytes(
            &format!("tile index: {field}"),
            "+ 1",
            move |parts| {
                let entry = touched(parts);
                put_u32(parts, b"TIDX", entry + at, |value| value.wrapping_add(1));
            },
        ));
    }
    all.push(of_bytes("tile index", "a tile without records", |parts| {
        let at = touched(parts);
        parts.chunk(b"TIDX")[at..at + 24].fill(0);
    }));
    all.push(of_bytes("tile index", "two entries exchanged", |parts| {
        let at = touched(parts);
        parts.chunk(b"TIDX")[at..at + 2 * ENTRY_BYTES[0]].rotate_left(ENTRY_BYTES[0]);
    }));
    let fields = [
        ("frame", 0),
        ("kind", 4),
        ("number", 8),
        ("width", 12),
        ("height", 16),
        ("offset", 20),
        ("size", 28),
        ("checksum", 32),
    ];
    for (field, at) in fields {
        all.push(of_bytes(
            &format!("list index: {field}"),
            "+ 1",
            move |parts| {
                let last = parts.chunk(b"PLIX").len() - ENTRY_BYTES[1];
                put_u32(parts, b"PLIX", last + at, |value| value.wrapping_add(1));
            },
        ));
    }
    all.push(of_bytes("list index", "two entries exchanged", |parts| {
        parts.chunk(b"PLIX")[..2 * ENTRY_BYTES[1]].rotate_left(ENTRY_BYTES[1]);
    }));
    all.push(of_bytes("list index", "one entry less", |parts| {
        let index = parts.chunk(b"PLIX");
        index.truncate(index.len() - ENTRY_BYTES[1]);
    }));
    all
}

/// Position in the index of a tile with records, whose next tile has some, too.
fn touched(parts: &mut Parts) -> usize {
    let index = parts.chunk(b"TIDX");
    let has_records = |at: usize| index[at + 16..at + 20].iter().any(|byte| *byte > 0);
    let mut entries = (0..index.len() - ENTRY_BYTES[0]).step_by(ENTRY_BYTES[0]);
    let found = entries.find(|at| has_records(*at) && has_records(at + ENTRY_BYTES[0]));
    found.expect("a tile")
}

pub fn of_table_bytes() -> Vec<Damage> {
    let mut all = Vec::new();
    for (field, at, by) in [
        ("pass: frame", 0, 1),
        ("pass: number of a layer", 6, 1),
        ("pass: width", 8, 16),
        ("pass: height", 12, 16),
        ("pass: tile columns", 16, 1),
        ("pass: tile rows", 20, 1),
    ] {
        all.push(of_bytes(field, &format!("+ {by}"), move |parts| {
            put_u32(parts, b"PASS", 4 + at, |value| value + by);
        }));
    }
    for (field, at, by) in [
        ("draw: first primitive", 0, 1),
        ("draw: primitives", 4, u32::MAX),
        ("draw: primitives", 4, 1),
    ] {
        let what = if by == 1 {
            "the last one's + 1"
        } else {
            "the last one's - 1"
        };
        all.push(of_bytes(field, what, move |parts| {
            let draw = last_draw(parts.chunk(b"DRAW"));
            put_u32(parts, b"DRAW", draw + at, |value| value.wrapping_add(by));
        }));
    }
    all.push(of_bytes("draw table", "one less", |parts| {
        let draw = last_draw(parts.chunk(b"DRAW"));
        parts.chunk(b"DRAW").truncate(draw);
        put_u32(parts, b"DRAW", 0, |count| count - 1);
    }));
    all.push(of_bytes("texture: reserved byte", "1", |parts| {
        parts.put(b"TEXS", 4 + 19, &[1])
    }));
    all.push(of_bytes("mesh: vertices", "- 1", |parts| {
        put_u32(parts, b"GEOM", 4, |vertices| vertices - 1);
    }));
    all.push(of_bytes("mesh: index", "a byte of one", |parts| {
        let index = parts.chunk(b"GEOM")[4 + 12];
        parts.put(b"GEOM", 4 + 12, &[index ^ 2]);
    }));
    all.push(of_bytes("draw: mesh", "beyond the table", |parts| {
        let last = parts.chunk(b"GEOM").len() - 4;
        put_u32(parts, b"GEOM", last, |_| 1 << 20);
    }));
    all.push(of_bytes(
        "lists",
        "the last byte + 1, with correct checksums",
        |parts| {
            let lists = parts.chunk(b"PLST");
            let last = lists.len() - 1;
            lists[last] += 1;
            parts.repair_tiles();
        },
    ));
    type Change = fn(&mut serde_json::Value);
    let meta: [(&str, &str, Change); 4] = [
        ("META: hmd.eye_size_px", "+ 16", |meta| {
            meta["hmd"]["eye_size_px"][0] = 112.into()
        }),
        ("META: frames[].frame", "1 for 0", |meta| {
            meta["frames"][0]["frame"] = 1.into()
        }),
        ("META: frames", "one more", |meta| {
            let mut next = meta["frames"][0].clone();
            next["frame"] = 1.into();
            meta["frames"].as_array_mut().expect("frames").push(next);
        }),
        ("META: hmd.ipd_m", "absent", |meta| {
            meta["hmd"]
                .as_object_mut()
                .expect("an object")
                .remove("ipd_m");
        }),
    ];
    for (field, what, change) in meta {
        all.push(of_bytes(field, what, move |parts| {
            parts.edit(b"META", change)
        }));
    }
    all
}

/// Position of the last draw in the table.
fn last_draw(draws: &[u8]) -> usize {
    let number = |at: usize| usize::from(u16::from_le_bytes([draws[at], draws[at + 1]]));
    let count = u32::from_le_bytes(draws[..4].try_into().expect("a count"));
    let mut at = 4;
    for _ in 1..count {
        let groups = number(at + 8);
        at += 12 + number(at + 10);
        for _ in 0..groups {
            at += 10 + 10 * number(at + 8);
        }
    }
    at
}
