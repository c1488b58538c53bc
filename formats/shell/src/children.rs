//! Runs other programs. A signal that ends this program ends them first.

use std::collections::BTreeMap;
use std::io;
use std::process::{Command, ExitStatus};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time after a signal until a child that has not ended is left running.
const PATIENCE: Duration = Duration::from_secs(5);

struct Children {
    /// Each child's number, and whom a signal to it reaches.
    running: BTreeMap<u32, Reach>,
    /// The program is ending: nothing more is started.
    ending: bool,
}

/// Whom a signal reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// The child.
    Child,
    /// The child and what it started, unless that left the child's process group.
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
    now.running.insert(child.id(), Reach::Child);
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

/// Runs a program, and what it starts in turn, to its end, or until `enough` says so: then it is asked to end, and made
/// to if it does not. Does not return when a signal ends this program.
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
        if let Some(status) = status.filter(|_| !group_lives(group)) {
            break status;
        }
        match stopped {
            None if enough() => {
                send(group, Reach::Group, TERMINATE);
                stopped = Some(Instant::now());
            }
            Some(since) if since.elapsed() > PATIENCE => {
                send(group, Reach::Group, KILL);
                break child.wait()?;
            }
            _ => std::thread::sleep(GLANCE),
        }
    };
    let mut now = children();
    now.running.remove(&group);
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

/// A process of the group is running. One that has ended and is yet to be waited for is not.
#[cfg(target_os = "linux")]
fn group_lives(group: u32) -> bool {
    // State, parent and group come after the name, which is in parentheses and may hold spaces and more of these.
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
fn group_lives(_group: u32) -> bool {
    false
}

/// The signal that asks a program to end.
const TERMINATE: i32 = signal_hook::consts::SIGTERM;
/// The signal that no program survives.
#[cfg(unix)]
const KILL: i32 = signal_hook::consts::SIGKILL;
#[cfg(not(unix))]
const KILL: i32 = TERMINATE;

/// The thread that received the signal ends the program.
fn wait_for_the_end() -> ! {
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
    let _ended = ONE_ENDED.wait_timeout_while(now, PATIENCE, |now| !now.running.is_empty());
}

#[cfg(unix)]
fn send(child: u32, reach: Reach, signal: i32) {
    use rustix::process::{Pid, Signal, kill_process, kill_process_group};
    let pid = i32::try_from(child).ok().and_then(Pid::from_raw);
    if let (Some(pid), Some(signal)) = (pid, Signal::from_named_raw(signal)) {
        // One that has ended by itself needs no signal.
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
    fn what_a_program_starts_is_part_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let mark = folder.path().join("mark");
        let script = format!("(sleep 0.3; : > '{}') & exit 5", mark.display());
        let ended = run_child_until(&mut shell(&script), || false).unwrap();
        assert_eq!((ended.status.code(), ended.stopped), (Some(5), false));
        assert!(mark.exists());
    }

    #[test]
    fn a_program_that_is_asked_to_end_ends_with_what_it_started() {
        let started = Instant::now();
        let mut child = shell("sleep 100 & sleep 100; wait");
        let ended = run_child_until(&mut child, || started.elapsed().as_millis() > 200).unwrap();
        assert!(ended.stopped && !ended.status.success());
        assert!(started.elapsed() < PATIENCE);
    }
}
