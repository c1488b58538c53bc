//! Large pages for the trees' memory.

/// Smallest array worth a page of 2 MB.
const LEAST_BYTES: usize = 4 << 20;

/// Moves a large array to memory for which the system is asked to use large pages. Incoherent rays
/// of a scene beyond the cache otherwise miss the translation buffer at almost every node.
pub(super) fn in_large_pages<T: Copy>(from: Vec<T>) -> Vec<T> {
    if size_of_val(from.as_slice()) < LEAST_BYTES {
        return from;
    }
    let mut to = Vec::with_capacity(from.len());
    advise(&mut to);
    to.extend_from_slice(&from);
    to
}

/// Asks for large pages in the unused memory of an array. A system that refuses costs only speed.
#[cfg(target_os = "linux")]
fn advise<T>(array: &mut Vec<T>) {
    use rustix::mm::{Advice, madvise};
    let page_bytes = rustix::param::page_size();
    let unused = array.spare_capacity_mut();
    let bytes = size_of_val(unused);
    let start = unused.as_mut_ptr().cast::<u8>();
    let skipped = start.align_offset(page_bytes);
    if let Some(length) = bytes.checked_sub(skipped) {
        // SAFETY: the range lies within the array's memory, whose content this advice keeps.
        let _ = unsafe {
            madvise(
                start.add(skipped).cast(),
                length & !(page_bytes - 1),
                Advice::LinuxHugepage,
            )
        };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_: &mut Vec<T>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_and_small_arrays_keep_their_content() {
        for length in [
            0,
            3,
            LEAST_BYTES / 4 - 1,
            LEAST_BYTES / 4,
            LEAST_BYTES / 2 + 7,
        ] {
            let array: Vec<u32> = (0..length as u32).collect();
            assert!(in_large_pages(array.clone()) == array, "{length}");
        }
    }
}
