//! Runs child processes. If a signal ends this program, its children are ended first.

use std::collections::BTreeMap;
use std::io;
use std::process::{Command, ExitStatus};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time between a signal and the moment when a child that is still running is given up.
const TERMINATION_TIMEOUT: Duration = Duration::from_secs(5);

struct Children {
    /// By process ID: the processes that a signal to the child must reach.
    running: BTreeMap<u32, Reach>,
    /// Set when the program is ending; no child is started from then on.
    ending: bool,
}

/// The processes that receive a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// The child.
    Child,
    /// The child and its descendants in the same process group.
    Group,
}

static CHILDREN: Mutex<Children> = Mutex::new(Children {
    running: BTreeMap::new(),
    ending: false,
});
static ONE_ENDED: Condvar = Condvar::new();

fn children() -> MutexGuard<'static, Children> {
    CHILDREN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a program to its end. If a signal ends this program, the function does not return, because the
/// child's failure is then not an error.
///
/// # Errors
/// The program cannot be started or waited for.
pub fn run_child(command: &mut Command) -> io::Result<ExitStatus> {
    let mut now = children();
    if now.ending {
        drop(now);
        wait_forever();
    }
    let mut child = command.spawn()?;
    now.running.insert(child.id(), Reach::Child);
    drop(now);
    let status = child.wait();
    let mut now = children();
    now.running.remove(&child.id());
    ONE_ENDED.notify_all();
    if now.ending {
        drop(now);
        wait_forever();
    }
    status
}

/// Result of [`run_child_until`].
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// Exit status of the program.
    pub status: ExitStatus,
    /// Whether `enough` ended the program.
    pub stopped: bool,
}

/// Interval between two checks of a running program.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs a program and its descendants until all have ended or `enough` returns true. In the second case they
/// get SIGTERM, and SIGKILL if they keep running. If a signal ends this program, the function does not
/// return.
///
/// # Errors
/// The program cannot be started or waited for.
pub fn run_child_until(
    command: &mut Command,
    mut enough: impl FnMut() -> bool,
) -> io::Result<Ended> {
    let mut now = children();
    if now.ending {
        drop(now);
        wait_forever();
    }
    // Wrapper scripts do not pass signals on, so a signal goes to the whole group.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command.spawn()?;
    let group = child.id();
    now.running.insert(group, Reach::Group);
    drop(now);
    let mut stopped: Option<Instant> = None;
    let mut status = None;
    let status = loop {
        if status.is_none() {
            status = child.try_wait()?;
        }
        if let Some(status) = status.filter(|_| !is_group_running(group)) {
            break status;
        }
        match stopped {
            None if enough() => {
                send(group, Reach::Group, TERMINATE);
                stopped = Some(Instant::now());
            }
            Some(since) if since.elapsed() > TERMINATION_TIMEOUT => {
                send(group, Reach::Group, KILL);
                break child.wait()?;
            }
            _ => std::thread::sleep(POLL_INTERVAL),
        }
    };
    let mut now = children();
    now.running.remove(&group);
    ONE_ENDED.notify_all();
    if now.ending {
        drop(now);
        wait_forever();
    }
    Ok(Ended {
        status,
        stopped: stopped.is_some(),
    })
}

/// Whether a process of the group is running. Zombies do not count.
#[cfg(target_os = "linux")]
fn is_group_running(group: u32) -> bool {
    // State, parent and group follow the name, which is in parentheses and may itself contain spaces and
    // parentheses.
    let runs = |stat: String| {
        let (_, fields) = stat.rsplit_once(')')?;
        let mut fields = fields.split_whitespace();
        let state = fields.next()?;
        let of: u32 = fields.nth(1)?.parse().ok()?;
        Some(of == group && !matches!(state, "Z" | "X"))
    };
    std::fs::read_dir("/proc").is_ok_and(|all| {
        all.flatten().any(|process| {
            let stat = std::fs::read_to_string(process.path().join("stat"));
            stat.ok().and_then(runs).unwrap_or(false)
        })
    })
}

#[cfg(not(target_os = "linux"))]
fn is_group_running(_group: u32) -> bool {
    false
}

/// Signal that a program may handle.
const TERMINATE: i32 = signal_hook::consts::SIGTERM;
/// Signal that a program cannot handle.
#[cfg(unix)]
const KILL: i32 = signal_hook::consts::SIGKILL;
#[cfg(not(unix))]
const KILL: i32 = TERMINATE;

/// The thread that received the signal ends the program.
fn wait_forever() -> ! {
    loop {
        std::thread::park();
    }
}

/// Sends a signal to all children, waits for their end, and prevents the start of others.
pub(crate) fn end_with(signal: i32) {
    let mut now = children();
    now.ending = true;
    for (&child, &reach) in &now.running {
        send(child, reach, signal);
    }
    let _ended =
        ONE_ENDED.wait_timeout_while(now, TERMINATION_TIMEOUT, |now| !now.running.is_empty());
}

#[cfg(unix)]
fn send(child: u32, reach: Reach, signal: i32) {
    use rustix::process::{Pid, Signal, kill_process, kill_process_group};
    let pid = i32::try_from(child).ok().and_then(Pid::from_raw);
    if let (Some(pid), Some(signal)) = (pid, Signal::from_named_raw(signal)) {
        // A child that has already ended needs no signal.
        let _gone = match reach {
            Reach::Child => kill_process(pid, signal),
            Reach::Group => kill_process_group(pid, signal),
        };
    }
}

#[cfg(not(unix))]
fn send(_child: u32, _reach: Reach, _signal: i32) {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn run_child_until_waits_for_descendants() {
        let folder = tempfile::tempdir().unwrap();
        let mark = folder.path().join("mark");
        let script = format!("(sleep 0.3; : > '{}') & exit 5", mark.display());
        let ended = run_child_until(&mut shell(&script), || false).unwrap();
        assert_eq!((ended.status.code(), ended.stopped), (Some(5), false));
        assert!(mark.exists());
    }

    #[test]
    fn stopping_a_program_ends_its_descendants() {
        let started = Instant::now();
        let mut child = shell("sleep 100 & sleep 100; wait");
        let ended = run_child_until(&mut child, || started.elapsed().as_millis() > 200).unwrap();
        assert!(ended.stopped && !ended.status.success());
        assert!(started.elapsed() < TERMINATION_TIMEOUT);
    }
}
