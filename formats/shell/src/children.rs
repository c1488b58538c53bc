//! Child processes. If a signal ends this program, its children are ended first.

use std::collections::BTreeMap;
use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time between a signal and the moment when a child that is still running is given up.
pub(crate) const TERMINATION_TIMEOUT: Duration = Duration::from_secs(5);

/// Interval between two checks of a running process.
pub(crate) const POLL_INTERVAL: Duration = Duration::from_millis(20);

struct Children {
    /// By process ID: what a signal to this program does to them.
    running: BTreeMap<u32, OnSignal>,
    /// Set when the program is ending; no child is started from then on.
    ending: bool,
}

/// What a child gets when this program gets a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnSignal {
    /// The same signal.
    Forward,
    /// SIGTERM.
    Terminate,
}

static CHILDREN: Mutex<Children> = Mutex::new(Children {
    running: BTreeMap::new(),
    ending: false,
});

fn children() -> MutexGuard<'static, Children> {
    CHILDREN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a child. If a signal is ending this program, the function does not return.
pub(crate) fn start(command: &mut Command, on_signal: OnSignal) -> io::Result<Child> {
    let mut now = unless_ending();
    let child = command.spawn()?;
    now.running.insert(child.id(), on_signal);
    Ok(child)
}

/// Removes a child that has ended. If a signal is ending this program, the function does not return, because
/// the child's end is then not an error.
pub(crate) fn forget(child: &Child) {
    unless_ending().running.remove(&child.id());
}

/// The children. If a signal is ending this program, the function does not return: the thread that received
/// the signal ends the program.
pub(crate) fn wait_if_ending() {
    drop(unless_ending());
}

fn unless_ending() -> MutexGuard<'static, Children> {
    let now = children();
    if now.ending {
        drop(now);
        loop {
            std::thread::park();
        }
    }
    now
}

/// Runs a program to its end. If a signal ends this program, the function does not return.
///
/// # Errors
/// The program cannot be started or waited for.
pub fn run_child(command: &mut Command) -> io::Result<ExitStatus> {
    let mut child = start(command, OnSignal::Forward)?;
    let status = child.wait();
    forget(&child);
    status
}

/// Sends a signal to all children, waits for their end, and prevents the start of others.
pub(crate) fn end_with(signal: i32) {
    let mut now = children();
    now.ending = true;
    let running = std::mem::take(&mut now.running);
    drop(now);
    for (&child, on_signal) in &running {
        match on_signal {
            OnSignal::Forward => send(child, signal),
            OnSignal::Terminate => send(child, TERMINATE),
        }
    }
    let deadline = Instant::now() + TERMINATION_TIMEOUT;
    while running.keys().any(|&child| is_running(child)) && Instant::now() < deadline {
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Signal that a program may handle.
pub(crate) const TERMINATE: i32 = signal_hook::consts::SIGTERM;

/// Sends a signal to a process, which may have ended.
#[cfg(unix)]
pub(crate) fn send(process: u32, signal: i32) {
    use rustix::process::{Pid, Signal, kill_process};
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    if let (Some(pid), Some(signal)) = (pid, Signal::from_named_raw(signal)) {
        let _gone = kill_process(pid, signal);
    }
}

/// Whether a child is running. The thread that started it may or may not have waited for it.
#[cfg(unix)]
fn is_running(child: u32) -> bool {
    use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
    let Some(pid) = i32::try_from(child).ok().and_then(Pid::from_raw) else {
        return false;
    };
    let seen = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    matches!(waitid(WaitId::Pid(pid), seen), Ok(None))
}

#[cfg(not(unix))]
pub(crate) fn send(_process: u32, _signal: i32) {}

#[cfg(not(unix))]
fn is_running(_child: u32) -> bool {
    false
}
