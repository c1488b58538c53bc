//! Thousands of changed traces with correct checksums. Each is refused or read, and every valid one can be
//! replayed. None may panic, take ten seconds or use a gigabyte.
//!
//! `MUTATIONS=100000 MUTATIONS_FROM=5000 cargo test --release --workspace --test e2e mutations::` tries
//! more and different ones.

use parallax_tests::exercise::exercise;
use parallax_tests::repair::{Parts, repair_header};
use parallax_tests::traces::{self, Random};
use std::alloc::{GlobalAlloc, Layout as Block, System};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Number of cases over all traces, unless `MUTATIONS` sets it.
const CASES: u64 = 5000;
const MOST_TIME: Duration = Duration::from_secs(10);
const MOST_BYTES: usize = 1 << 30;

/// Counts the allocated bytes and their maximum.
struct Counting;

static LIVE_BYTES: AtomicUsize = AtomicUsize::new(0);
static PEAK_BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is forwarded to the system's allocator; only counters are added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, block: Block) -> *mut u8 {
        let live = LIVE_BYTES.fetch_add(block.size(), Ordering::Relaxed) + block.size();
        PEAK_BYTES.fetch_max(live, Ordering::Relaxed);
        // SAFETY: the caller meets the contract, which is the same.
        unsafe { System.alloc(block) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, block: Block) {
        LIVE_BYTES.fetch_sub(block.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, block) }
    }

    unsafe fn alloc_zeroed(&self, block: Block) -> *mut u8 {
        let live = LIVE_BYTES.fetch_add(block.size(), Ordering::Relaxed) + block.size();
        PEAK_BYTES.fetch_max(live, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(block) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Numbers at the limits of arithmetic and checks.
const EXTREMES: [u64; 14] = [
    0,
    1,
    2,
    15,
    127,
    128,
    255,
    65535,
    65536,
    (1 << 31) - 1,
    1 << 31,
    u32::MAX as u64,
    1 << 32,
    u64::MAX,
];

/// Replacements of numbers and other values in JSON.
const JSON_VALUES: [&str; 18] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e-30",
    "1e30",
    "3.4e38",
    "1e300",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "null",
    "[]",
    "{}",
    "\"\"",
];

/// Changes a trace in one of many ways; the text describes the change.
fn mutate(bytes: &[u8], other: &[u8], random: &mut Random) -> (Vec<u8>, String) {
    let mut parts = Parts::of(bytes);
    let way = random.below(10);
    let what = match way {
        0 | 1 => flip_bytes(&mut parts, random),
        2 => set_integer(&mut parts, random),
        3 | 4 => edit_json(&mut parts, random),
        5 => splice(&mut parts, &mut Parts::of(other), random),
        6 | 7 => edit_tile(&mut parts, random),
        8 => move_chunks(&mut parts, random),
        _ => return edit_container(bytes, random),
    };
    (parts.sealed(), what)
}

fn pick<'a>(parts: &'a mut Parts, random: &mut Random) -> &'a mut ([u8; 4], Vec<u8>) {
    let chunk = random.below(parts.chunks.len() as u32) as usize;
    &mut parts.chunks[chunk]
}

fn name(tag: [u8; 4]) -> String {
    tag.escape_ascii().to_string()
}

fn flip_bytes(parts: &mut Parts, random: &mut Random) -> String {
    let (tag, chunk) = pick(parts, random);
    let what = format!("bytes of {}", name(*tag));
    for _ in 0..1 + random.below(3) {
        let at = random.below(chunk.len().max(1) as u32) as usize;
        if let Some(byte) = chunk.get_mut(at) {
            *byte ^= 1 << random.below(8);
        }
    }
    parts.repair_tiles();
    what
}

fn set_integer(parts: &mut Parts, random: &mut Random) -> String {
    let (tag, chunk) = pick(parts, random);
    let size = 1usize << random.below(4);
    let value = EXTREMES[random.below(EXTREMES.len() as u32) as usize];
    let places = (chunk.len() / size).max(1) as u32;
    // Fields of tables may be at odd positions.
    let at = random.below(places) as usize * size + random.below(2) as usize * 2;
    if let Some(field) = chunk.get_mut(at..at + size) {
        field.copy_from_slice(&value.to_le_bytes()[..size]);
    }
    let what = format!("{value} in {size} bytes at {at} of {}", name(*tag));
    if random.below(4) > 0 {
        parts.repair_tiles();
    }
    what
}

/// Positions of the values in a JSON text: numbers, strings that are not keys, brackets.
fn json_values(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        match bytes[at] {
            b'"' => {
                at += 1;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += 1 + usize::from(bytes[at] == b'\\');
                }
                at += 1;
                if bytes.get(at) != Some(&b':') {
                    found.push((start, at.min(bytes.len())));
                }
            }
            b'-' | b'0'..=b'9' | b't' | b'f' => {
                while at < bytes.len() && !b",]}".contains(&bytes[at]) {
                    at += 1;
                }
                found.push((start, at));
            }
            b'[' | b'{' => {
                let close = bytes[at..].iter().position(|b| b"]}".contains(b));
                found.extend(close.map(|length| (start, start + length + 1)));
                at += 1;
            }
            _ => at += 1,
        }
    }
    found
}

fn edit_json(parts: &mut Parts, random: &mut Random) -> String {
    let tags: Vec<[u8; 4]> = parts
        .chunks
        .iter()
        .filter(|(_, chunk)| chunk.starts_with(b"{") || chunk.starts_with(b"["))
        .map(|(tag, _)| *tag)
        .collect();
    let tag = tags[random.below(tags.len() as u32) as usize];
    let text = String::from_utf8(parts.chunk(&tag).clone()).expect("JSON is UTF-8");
    let values = json_values(&text);
    let (start, end) = values[random.below(values.len() as u32) as usize];
    let new = match random.below(4) {
        // Another value from the same text often has the right type.
        0 => {
            let (start, end) = values[random.below(values.len() as u32) as usize];
            &text[start..end]
        }
        _ => JSON_VALUES[random.below(JSON_VALUES.len() as u32) as usize],
    };
    let what = format!("{} of {} becomes {new}", &text[start..end], name(tag));
    *parts.chunk(&tag) = format!("{}{new}{}", &text[..start], &text[end..]).into_bytes();
    what
}

/// Copies a piece of another trace's chunk into the chunk with the same tag.
fn splice(parts: &mut Parts, other: &mut Parts, random: &mut Random) -> String {
    let (tag, _) = *pick(parts, random);
    let donor = other.chunk(&tag).clone();
    let mut range = |length: usize| {
        let start = random.below(length as u32 + 1) as usize;
        let end = start + random.below((length - start).min(64) as u32 + 1) as usize;
        start..end
    };
    let from = range(donor.len());
    let to = range(parts.chunk(&tag).len());
    let what = format!("{from:?} of another {} in place of {to:?}", name(tag));
    parts.chunk(&tag).splice(to, donor[from].iter().copied());
    parts.repair_tiles();
    what
}

/// Truncates, extends or swaps tiles and updates the index.
fn edit_tile(parts: &mut Parts, random: &mut Random) -> String {
    let family = random.below(parts.family_count() as u32) as usize;
    let mut tiles = parts.tiles_of(family);
    let full: Vec<usize> = (0..tiles.len()).filter(|i| !tiles[*i].is_empty()).collect();
    let index = full[random.below(full.len() as u32) as usize];
    let tile = &mut tiles[index];
    let at = random.below(tile.len() as u32) as usize;
    let what = match random.below(5) {
        0 => {
            tile.truncate(at);
            format!("tile {index} cut to {at} bytes")
        }
        1 => {
            tile.insert(at, random.bits() as u8);
            format!("a byte more in tile {index} at {at}")
        }
        2 => {
            tile.remove(at);
            format!("a byte less in tile {index} at {at}")
        }
        3 => {
            // A number of maximum length, or longer.
            let length = 1 + random.below(11) as usize;
            let end = tile.len().min(at + length);
            tile[at..end].fill(0xff);
            format!("{length} bytes of ones in tile {index} at {at}")
        }
        _ => {
            let with = full[random.below(full.len() as u32) as usize];
            tiles.swap(index, with);
            format!("tiles {index} and {with} swapped")
        }
    };
    parts.set_tiles_of(family, &tiles);
    what
}

fn move_chunks(parts: &mut Parts, random: &mut Random) -> String {
    let count = parts.chunks.len() as u32;
    let [a, b] = [0; 2].map(|_| random.below(count) as usize);
    match random.below(4) {
        0 => {
            let (tag, _) = parts.chunks.remove(a);
            format!("{} left out", name(tag))
        }
        1 => {
            parts.chunks.swap(a, b);
            format!("chunks {a} and {b} swapped")
        }
        2 => {
            let bytes = parts.chunks[b].1.clone();
            parts.chunks[a].1 = bytes;
            format!("chunk {b} as chunk {a}")
        }
        _ => {
            let (tag, chunk) = &mut parts.chunks[a];
            chunk.truncate(random.below(chunk.len() as u32 + 1) as usize);
            format!("{} cut to {} bytes", name(*tag), chunk.len())
        }
    }
}

/// Changes header and directory.
fn edit_container(bytes: &[u8], random: &mut Random) -> (Vec<u8>, String) {
    let mut bytes = bytes.to_vec();
    let directory = bytes.len() - 24 * 7;
    let at = match random.below(2) {
        0 => random.below(48) as usize,
        _ => directory + random.below(24 * 7) as usize,
    };
    let what = match random.below(3) {
        0 => {
            bytes[at] ^= 1 << random.below(8);
            format!("a bit of byte {at}")
        }
        1 => {
            let value = EXTREMES[random.below(EXTREMES.len() as u32) as usize];
            let end = (at + 8).min(bytes.len());
            bytes[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            format!("{value} at byte {at}")
        }
        _ => {
            bytes.truncate(random.below(bytes.len() as u32) as usize);
            format!("cut to {} bytes", bytes.len())
        }
    };
    repair_header(&mut bytes);
    (bytes, what)
}

#[test]
fn changed_traces_with_valid_checksums_neither_panic_nor_hang_nor_fill_memory() {
    let seeds = traces::all();
    let number = |name| std::env::var(name).ok().and_then(|n| n.parse().ok());
    let (first, cases) = (
        number("MUTATIONS_FROM").unwrap_or(0),
        number("MUTATIONS").unwrap_or(CASES),
    );
    let (mut valid, mut slowest, mut largest) = (0u64, Duration::ZERO, 0);
    for case in first..first + cases {
        let (seed, _, bytes) = &seeds[(case % seeds.len() as u64) as usize];
        let other = &seeds[((case / 7) % seeds.len() as u64) as usize].2;
        let mut random = Random(case);
        let (changed, what) = mutate(bytes, other, &mut random);
        let place = format!("case {case} ({seed}): {what}");
        let before = LIVE_BYTES.load(Ordering::Relaxed);
        PEAK_BYTES.store(before, Ordering::Relaxed);
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| exercise(changed)));
        let time = start.elapsed();
        let bytes = PEAK_BYTES.load(Ordering::Relaxed).saturating_sub(before);
        match outcome {
            Ok(is_valid) => valid += u64::from(is_valid),
            Err(_) => panic!("panicked: {place}"),
        }
        assert!(time < MOST_TIME, "{time:?}: {place}");
        assert!(bytes < MOST_BYTES, "{bytes} bytes: {place}");
        slowest = slowest.max(time);
        largest = largest.max(bytes);
    }
    println!("{cases} cases, {valid} valid; slowest {slowest:?}, most {largest} bytes at once");
    // Many changes leave a valid file, so code behind the checks is also tested.
    assert!(valid > cases / 20, "{valid} of {cases} are valid");
}
