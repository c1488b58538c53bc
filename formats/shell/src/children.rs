//! Programs that this one runs: a signal that ends it ends them first.

use std::collections::BTreeSet;
use std::io;
use std::process::{Command, ExitStatus};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A child that has not ended so long after a signal is left alone.
const PATIENCE: Duration = Duration::from_secs(5);

struct Children {
    running: BTreeSet<u32>,
    /// The program is ending: nothing more is started.
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

/// Runs a program to its end. Does not return when a signal ends this program: what became of the child then
/// is nobody's error.
///
/// # Errors
/// It cannot be started or waited for.
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

/// How a program that was watched ended.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// Its status.
    pub status: ExitStatus,
    /// It was asked to end before it did by itself.
    pub stopped: bool,
}

/// How often a program is looked at.
const GLANCE: Duration = Duration::from_millis(20);

/// Runs a program to its end, or until `enough` says so: then it is asked to end, and made to if it does not. Does not
/// return when a signal ends this program.
///
/// # Errors
/// It cannot be started or waited for.
pub fn run_child_until(
    command: &mut Command,
    mut enough: impl FnMut() -> bool,
) -> io::Result<Ended> {
    let mut now = children();
    if now.ending {
        drop(now);
        wait_for_the_end();
    }
    let mut child = command.spawn()?;
    now.running.insert(child.id());
    drop(now);
    let mut stopped: Option<Instant> = None;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        match stopped {
            None if enough() => {
                send(child.id(), TERMINATE);
                stopped = Some(Instant::now());
            }
            Some(since) if since.elapsed() > PATIENCE => child.kill()?,
            _ => std::thread::sleep(GLANCE),
        }
    };
    let mut now = children();
    now.running.remove(&child.id());
    ONE_ENDED.notify_all();
    if now.ending {
        drop(now);
        wait_for_the_end();
    }
    Ok(Ended {
        status,
        stopped: stopped.is_some(),
    })
}

/// The signal that asks a program to end.
const TERMINATE: i32 = signal_hook::consts::SIGTERM;

/// The thread that received the signal ends the program.
fn wait_for_the_end() -> ! {
    loop {
        std::thread::park();
    }
}

/// Sends a signal to all children and waits until they have ended. Nothing is started after it.
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
        // One that has ended by itself needs no signal.
        let _gone = kill_process(pid, signal);
    }
}

#[cfg(not(unix))]
fn send(_child: u32, _signal: i32) {}
