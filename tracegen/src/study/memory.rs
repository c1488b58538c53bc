//! Peak memory of the process, if the system reports it (Linux).

use std::fs;

/// Largest resident set since the start, or since [`forget_peak`].
pub fn peak_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Resets the largest resident set to the present one; returns whether the system supports it.
pub fn forget_peak() -> bool {
    fs::write("/proc/self/clear_refs", "5").is_ok()
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_seen_and_may_be_forgotten() {
        let before = peak_bytes().unwrap();
        let held = vec![1_u8; 256 << 20];
        std::hint::black_box(&held);
        let with = peak_bytes().unwrap();
        assert!(with >= 256 << 20 && with >= before, "{before} {with}");
        drop(held);
        // Other tests of the process also allocate, but much less.
        if forget_peak() {
            assert!(peak_bytes().unwrap() < with);
        }
    }
}
