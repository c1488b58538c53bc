//! Measures this machine's read bandwidth from memory.

use crate::stages::seconds;
use std::hint::black_box;

/// Larger than the processor's caches.
const BYTES: usize = 256 << 20;

/// Sequential read bandwidth of one core in bytes per second.
pub fn bytes_per_second() -> f64 {
    let words = vec![1_u64; BYTES / 8];
    let sum = || {
        // Independent sums, so that no addition waits for another.
        let mut sums = [0_u64; 16];
        for chunk in words.chunks_exact(16) {
            for (sum, word) in sums.iter_mut().zip(chunk) {
                *sum = sum.wrapping_add(*word);
            }
        }
        black_box(sums);
    };
    BYTES as f64 / seconds(sum)
}
