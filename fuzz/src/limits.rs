//! Limits for one input: a second of processor time and a gigabyte of memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Duration;

/// Limit on processor time; wall-clock time would include other processes.
pub const MOST_TIME: Duration = Duration::from_secs(1);

/// Limit on additional memory in bytes.
pub const MOST_BYTES: usize = 1 << 30;

static LIVE_BYTES: AtomicUsize = AtomicUsize::new(0);
static PEAK_BYTES: AtomicUsize = AtomicUsize::new(0);

/// Counts the bytes that are allocated.
pub struct Counting;

fn count(bytes: usize) {
    let live = LIVE_BYTES.fetch_add(bytes, Relaxed).wrapping_add(bytes);
    PEAK_BYTES.fetch_max(live, Relaxed);
}

// SAFETY: every call is forwarded to the system's allocator; only counters are added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps `alloc_zeroed`'s contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        LIVE_BYTES.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps `realloc`'s contract.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        LIVE_BYTES.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps `dealloc`'s contract.
        unsafe { System.dealloc(block, layout) }
    }
}

/// Resources used by an input.
#[derive(Clone, Copy, Debug, Default)]
pub struct Taken {
    /// Processor time of the calling thread; zero on systems that do not report it.
    pub time: Duration,
    /// Peak memory in bytes, counted if [`Counting`] is the allocator.
    pub bytes: usize,
}

/// Runs `work` and returns the resources it used.
///
/// # Errors
/// It used more than [`MOST_TIME`] or [`MOST_BYTES`].
pub fn held(work: impl FnOnce()) -> Result<Taken, String> {
    let before = LIVE_BYTES.load(Relaxed);
    PEAK_BYTES.store(before, Relaxed);
    let start = processor_time();
    work();
    let taken = Taken {
        time: processor_time().saturating_sub(start),
        bytes: PEAK_BYTES.load(Relaxed).saturating_sub(before),
    };
    if taken.time > MOST_TIME || taken.bytes > MOST_BYTES {
        return Err(format!(
            "expected at most {MOST_TIME:?} and {MOST_BYTES} bytes, found {taken:?}"
        ));
    }
    Ok(taken)
}

/// Runs parallel loops on the calling thread, so that its time includes all work.
pub fn run_on_this_thread_alone() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    // Fails if there is already a pool, which then stays.
    let _there = pool.use_current_thread().build_global();
}

/// Processor time of this thread (Linux).
fn processor_time() -> Duration {
    #[cfg(target_os = "linux")]
    {
        let mut time = libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        // SAFETY: the pointer is to a local `timespec`.
        if unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) } == 0 {
            return Duration::new(time.tv_sec as u64, time.tv_nsec as u32);
        }
    }
    Duration::ZERO
}
