//! The yardstick: four packed tags per set, the most recently used first, and lines from a mapped file. It
//! counts only misses, without footprints and cores, like a program that simulates one cache.

use memmap2::Mmap;
use std::fs::File;
use std::path::Path;

/// Misses of a four-way LRU cache with `sets` sets (a power of two) on a file of little-endian 32-bit line
/// numbers. Opening and mapping the file is included.
pub fn misses(path: &Path, sets: u32) -> std::io::Result<u64> {
    let file = File::open(path)?;
    // SAFETY: the file is this process's own temporary file, and nothing writes to it while it is mapped.
    let bytes = unsafe { Mmap::map(&file)? };
    let mut tags = vec![[u32::MAX; 4]; sets as usize];
    let mut misses = 0;
    for word in bytes.chunks_exact(4) {
        let line = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        let set = &mut tags[(line & (sets - 1)) as usize];
        let [first, second, third, fourth] = *set;
        if first == line {
            continue;
        }
        let found = [second, third, fourth].map(|tag| tag == line);
        misses += u64::from(!(found[0] | found[1] | found[2]));
        let third_kept = if found[0] { third } else { second };
        let fourth_kept = if found[0] | found[1] { fourth } else { third };
        *set = [line, first, third_kept, fourth_kept];
    }
    Ok(misses)
}
