//! Runs other programs. A signal that ends this program ends them first.

use std::collections::BTreeSet;
use std::io;
use std::process::{Command, ExitStatus};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time after a signal until a child that has not ended is left running.
const PATIENCE: Duration = Duration::from_secs(5);

struct Children {
    running: BTreeSet<u32>,
    /// The program is ending, so no child may start.
    ending: bool,
}

static CHILDREN: Mutex<Children> = Mutex::new(Children {
    running: BTreeSet::new(),
    ending: false,
});
static ONE_ENDED: Condvar = Condvar::new();

fn children() -> MutexGuard<'static, Children> {
    CHILDREN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a program to its end. Does not return if a signal ends this program, because the child's failure is
/// then not an error.
///
/// # Errors
/// The program cannot be started or waited for.
pub fn run_child(command: &mut Command) -> io::Result<ExitStatus> {
    let mut now = children();
    if now.ending {
        drop(now);
        wait_for_the_end();
    }
    let mut child = command.spawn()?;
    now.running.insert(child.id());
    drop(now);
    let status = child.wait();
    let mut now = children();
    now.running.remove(&child.id());
    ONE_ENDED.notify_all();
    if now.ending {
        drop(now);
        wait_for_the_end();
    }
    status
}

/// Blocks until the thread that received the signal ends the program.
fn wait_for_the_end() -> ! {
    loop {
        std::thread::park();
    }
}

/// Sends a signal to all children, waits for their end, and prevents the start of others.
pub(crate) fn end_with(signal: i32) {
    let mut now = children();
    now.ending = true;
    for &child in &now.running {
        send(child, signal);
    }
    let _ended = ONE_ENDED.wait_timeout_while(now, PATIENCE, |now| !now.running.is_empty());
}

#[cfg(unix)]
fn send(child: u32, signal: i32) {
    use rustix::process::{Pid, Signal, kill_process};
    let pid = i32::try_from(child).ok().and_then(Pid::from_raw);
    if let (Some(pid), Some(signal)) = (pid, Signal::from_named_raw(signal)) {
        // A child that has already ended needs no signal.
        let _gone = kill_process(pid, signal);
    }
}

#[cfg(not(unix))]
fn send(_child: u32, _signal: i32) {}
