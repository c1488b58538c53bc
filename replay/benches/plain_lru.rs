//! The yardstick of `replay run --addresses`: the simplest fast loop with the same misses. It maps a file
//! of 32-bit addresses, drops repeats of the previous line and looks each other line up in packed tags, the
//! most recently used first: 8 KiB over 128 KiB, four ways.
//!
//! `cargo bench -p replay --bench plain_lru -- FILE [LINE_BYTES]`; without a file it generates a stream.
//! `python3 -m studies addresses-speed` compares whole processes.

use memmap2::Mmap;
use std::fs::File;
use std::io::Write;
use std::time::Instant;

const WAYS: usize = 4;

/// Tags by set, the most recently used first.
struct Cache {
    tags: Vec<[u32; WAYS]>,
    mask: u32,
}

impl Cache {
    fn new(bytes: u32, line_bytes: u32) -> Self {
        let sets = bytes / line_bytes / WAYS as u32;
        Self {
            tags: vec![[u32::MAX; WAYS]; sets as usize],
            mask: sets - 1,
        }
    }

    /// Returns true for a miss.
    #[inline(always)]
    fn access(&mut self, line: u32) -> bool {
        let set = &mut self.tags[(line & self.mask) as usize];
        let [first, second, third, fourth] = *set;
        if first == line {
            return false;
        }
        if second == line {
            *set = [line, first, third, fourth];
            return false;
        }
        let miss = third != line && fourth != line;
        *set = [
            line,
            first,
            second,
            if third == line { fourth } else { third },
        ];
        miss
    }
}

/// Misses of both levels.
fn misses(words: &[[u8; 4]], line_bytes: u32) -> [u64; 2] {
    let (mut l1, mut l2) = (
        Cache::new(8 << 10, line_bytes),
        Cache::new(128 << 10, line_bytes),
    );
    let shift = line_bytes.ilog2();
    let (mut last, mut misses) = (u32::MAX, [0, 0]);
    for word in words {
        let line = u32::from_le_bytes(*word) >> shift;
        if line == last {
            continue;
        }
        last = line;
        if l1.access(line) {
            misses[0] += 1;
            misses[1] += u64::from(l2.access(line));
        }
    }
    misses
}

/// A random walk with short steps, occasional jumps and many repeats: a few million addresses.
fn made_up() -> File {
    let mut bytes = Vec::new();
    let (mut numbers, mut address) = (formats::random::Random(1), 0_u32);
    for _ in 0..4 << 20 {
        let random = (numbers.bits() >> 40) as u32;
        address = match random % 64 {
            0 => random << 4 & 0xff_ffff,
            1..24 => address.wrapping_add(random >> 6 & 0x3f) & 0xff_ffff,
            _ => address,
        };
        bytes.extend(address.to_le_bytes());
    }
    let mut file = tempfile::tempfile().expect("a temporary file");
    file.write_all(&bytes).expect("room for 16 MiB");
    file
}

fn main() {
    // Cargo adds the argument --bench.
    let mut arguments = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let file = match arguments.next() {
        Some(path) => File::open(&path).unwrap_or_else(|error| panic!("{path}: {error}")),
        None => made_up(),
    };
    let line_bytes = arguments
        .next()
        .map_or(16, |text| text.parse().expect("a line size"));
    let start = Instant::now();
    // SAFETY: nothing writes to the file while it is mapped.
    let map = unsafe { Mmap::map(&file) }.expect("the file can be mapped");
    let (words, _) = map.as_chunks::<4>();
    let [l1, l2] = misses(words, line_bytes);
    let seconds = start.elapsed().as_secs_f64();
    println!("{} accesses, {l1} L1 misses, {l2} L2 misses", words.len());
    eprintln!("{:.1} M accesses/s", words.len() as f64 / seconds / 1e6);
}
