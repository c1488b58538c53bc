//! Signals that end the program leave no unfinished file and no child behind.

use anyhow::Context;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Starts a thread that removes unfinished outputs when a signal asks the process to end, and then ends
/// it as the signal would have: shells report 130 (SIGINT), 131 (SIGQUIT), 143 (SIGTERM) or 129 (SIGHUP).
/// A write beyond the limit of file sizes (`ulimit -f`) becomes an error of that write.
///
/// # Errors
/// The system refuses the handler or the thread.
pub(crate) fn discard_unfinished_on_exit() -> anyhow::Result<()> {
    // `nohup` and background jobs ignore some signals, and so must we.
    let ignored = ignored_signals();
    // With a handler, whatever it does, the write that is too large fails with EFBIG.
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .context("cannot handle signals")?;
    let wanted = [SIGINT, SIGQUIT, SIGTERM, SIGHUP];
    let wanted = wanted
        .iter()
        .filter(|signal| ignored >> (*signal - 1) & 1 == 0);
    let mut signals = Signals::new(wanted).context("cannot handle signals")?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            for signal in signals.forever() {
                super::children::end_with(signal);
                formats::container::discard_unfinished();
                // Does not return for these four.
                let _impossible = emulate_default_handler(signal);
            }
        })
        .context("cannot handle signals")?;
    Ok(())
}

/// Mask of the signals that the parent process had ignored, signal 1 in bit 0, where the system
/// tells (Linux).
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or_default()
}
