//! The yardstick: four packed tags a set, the one used last in front; lines from a mapped file. No
//! footprints, no cores, no counts but misses: what a program that only simulates one cache does.

use memmap2::Mmap;
use std::fs::File;
use std::path::Path;

/// Misses of a four-way LRU cache of so many sets (a power of two) on a file of little-endian 32-bit
/// line numbers, opened and mapped here.
pub fn misses(path: &Path, sets: u32) -> std::io::Result<u64> {
    let file = File::open(path)?;
    // SAFETY: the file is this process's own temporary one, and nobody writes to it while it is mapped.
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
