//! Removes unfinished files and ends children when a signal ends the program.

use anyhow::Context;
use signal_hook::consts::{
    SIGALRM, SIGHUP, SIGINT, SIGIO, SIGPROF, SIGQUIT, SIGSYS, SIGTERM, SIGTRAP, SIGUSR1, SIGUSR2,
    SIGVTALRM, SIGXCPU, SIGXFSZ,
};
use signal_hook::iterator::Signals;
use signal_hook::low_level::{emulate_default_handler, exit};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Signals that end a process which does not handle them, without those of faults in its own code.
const ENDING: [i32; 13] = [
    SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGXCPU,
    SIGIO, SIGSYS, SIGTRAP,
];
/// SIGSTKFLT, SIGPWR and the signals of real time, which end a process on Linux as well.
const ENDING_ON_LINUX: [std::ops::RangeInclusive<i32>; 3] = [16..=16, 30..=30, 34..=64];

/// Starts a thread that removes unfinished outputs when a signal asks the process to end. It then ends the
/// process as the signal would have: shells report 130 (SIGINT), 131 (SIGQUIT), 143 (SIGTERM) or 129
/// (SIGHUP). A write beyond the limit of file sizes (`ulimit -f`) becomes an error of that write.
///
/// # Errors
/// The handler or the thread cannot be started.
pub(crate) fn discard_unfinished_on_exit() -> anyhow::Result<()> {
    // Signals ignored by `nohup` and background jobs stay ignored.
    let ignored = ignored_signals();
    // With any handler installed, a write that is too large fails with EFBIG.
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .context("cannot handle signals")?;
    let on_linux = ENDING_ON_LINUX.into_iter().flatten();
    let more = on_linux.filter(|_| cfg!(target_os = "linux"));
    let wanted = ENDING.into_iter().chain(more);
    let wanted = wanted.filter(|signal| ignored >> (*signal - 1) & 1 == 0);
    let mut signals = Signals::new(wanted).context("cannot handle signals")?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            // The first signal ends the program.
            if let Some(signal) = signals.forever().next() {
                super::children::end_with(signal);
                super::supervise::end_descendants();
                formats::container::discard_unfinished();
                // Does not return, except for signals that it does not know.
                let _unknown = emulate_default_handler(signal);
                exit(128 + signal);
            }
        })
        .context("cannot handle signals")?;
    Ok(())
}

/// Mask of the signals that the parent process ignores, signal 1 in bit 0, where the system reports it
/// (Linux).
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or_default()
}
