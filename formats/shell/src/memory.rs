//! Ends the program with a message and exit code 2 if an allocation fails.
//!
//! Rust's collections abort if memory is exhausted, and some libraries panic. The allocator records a
//! failed allocation, so that the handler of SIGABRT and the panic hook can distinguish it from a failed
//! assertion.

use anyhow::Context;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Size of the last failed allocation in bytes; 0 if none has failed.
static FAILED_BYTES: AtomicUsize = AtomicUsize::new(0);

/// Memory that the standard library's panic hook may need.
const HOOK_BYTES: usize = 1 << 20;

/// The system's allocator, with failures recorded.
#[derive(Clone, Copy, Debug)]
pub struct Allocator;

fn record_failure(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        FAILED_BYTES.store(bytes, Ordering::Relaxed);
    }
    pointer
}

// SAFETY: every call is forwarded to the system's allocator.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        record_failure(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        record_failure(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`.
        record_failure(unsafe { System.realloc(pointer, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Turns an abort or a panic caused by exhausted memory into a message and exit code 2. Others are
/// unchanged.
///
/// # Errors
/// The handler cannot be installed.
#[cfg(unix)]
pub(crate) fn explain_aborts() -> anyhow::Result<()> {
    // SAFETY: the handler does not allocate and takes no lock. It formats a number on its own stack, writes
    // it to a descriptor and exits.
    let registered = unsafe {
        signal_hook::low_level::register(signal_hook::consts::SIGABRT, || {
            let bytes = FAILED_BYTES.load(Ordering::Relaxed);
            if bytes > 0 {
                report_and_exit(bytes);
            }
        })
    };
    registered.context("cannot handle signals")?;
    let default_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        // An earlier failure may have been handled, so check whether memory is exhausted now. The default hook allocates
        // under a lock, and would wait for itself if that failed.
        let bytes = FAILED_BYTES.load(Ordering::Relaxed).max(HOOK_BYTES);
        if Vec::<u8>::new().try_reserve_exact(bytes).is_err() {
            report_and_exit(bytes);
        }
        default_hook(info);
    }));
    Ok(())
}

/// Prints the message and ends the program without an allocation.
#[cfg(unix)]
fn report_and_exit(bytes: usize) {
    let mut text = [0; 160];
    let left = write_message(&mut text, bytes);
    let length = text.len() - left;
    let _untold = rustix::io::write(std::io::stderr(), &text[..length]);
    signal_hook::low_level::exit(super::message::USAGE.into());
}

/// Does nothing on systems without signals.
#[cfg(not(unix))]
pub(crate) fn explain_aborts() -> anyhow::Result<()> {
    Ok(())
}

/// Writes the message into `text` and returns the number of unused bytes.
#[cfg(unix)]
fn write_message(text: &mut [u8], bytes: usize) -> usize {
    use std::io::Write;
    let mut rest = text;
    let _fits = writeln!(
        rest,
        "error: not enough memory: an allocation of {bytes} bytes failed (the machine's memory, or ulimit -v)"
    );
    rest.len()
}

#[cfg(all(test, unix))]
mod tests {
    #[test]
    fn the_largest_number_fits_the_message() {
        let mut text = [0; 160];
        let left = super::write_message(&mut text, usize::MAX);
        let text = std::str::from_utf8(&text[..160 - left]).unwrap();
        assert!(text.contains("18446744073709551615 bytes") && text.ends_with("ulimit -v)\n"));
    }
}
