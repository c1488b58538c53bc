//! Processor time of this process. In contrast to wall time, other programs hardly affect it.

use std::fs;
use std::time::Duration;

/// Sum over all threads, if the system reports it (Linux).
pub fn time() -> Option<Duration> {
    let mut nanoseconds = 0_u64;
    for thread in fs::read_dir("/proc/self/task").ok()? {
        // A thread may end meanwhile.
        let Ok(text) = fs::read_to_string(thread.ok()?.path().join("schedstat")) else {
            continue;
        };
        nanoseconds += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn what_a_thread_works_counts_and_what_it_sleeps_does_not() {
        let Some(before) = time() else {
            println!("skipped: the system does not tell processor time");
            return;
        };
        let start = Instant::now();
        let mut sum = 0_u64;
        while start.elapsed() < Duration::from_millis(40) {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        let worked = time().map(|now| now.saturating_sub(before));
        // Other threads may run at the same time, on this machine and in this process.
        assert!(worked > Some(Duration::from_millis(2)), "{worked:?}");
    }
}
