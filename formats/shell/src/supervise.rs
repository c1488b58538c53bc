//! Runs programs so that no process that they start outlives this program, however it ends.
//!
//! A program is started by a supervisor: this program again, as the hidden subcommand `supervise`. Descendants
//! that lose their parent become children of the supervisor, so it finds those in other sessions as well. It
//! ends all of them on request or when this program ends, and in the second case removes the program's folder.
//! SIGKILL of this program is such an end.

use super::children::{
    OnSignal, POLL_INTERVAL, TERMINATE, TERMINATION_TIMEOUT, forget, send, start, wait_if_ending,
};
use anyhow::Context;
use formats::container::AtomicFile;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitCode, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// File in a program's folder that asks the supervisor to end the program.
const END: &str = "supervisor-end";
/// File in a program's folder with the status of a program whose processes have all ended.
const ENDED: &str = "supervisor-ended";

/// Exit code that stands for a program that cannot be started, as in shells.
const NOT_STARTED: i32 = 127;

/// A running program with all processes that it started. They end when it is dropped.
#[derive(Debug)]
pub struct Program {
    supervisor: Child,
    folder: PathBuf,
    ended: Option<ExitStatus>,
}

impl Program {
    /// Starts a program. `folder` is of this program alone, and is removed with it; `prepare` sets arguments,
    /// environment and streams.
    ///
    /// # Errors
    /// The supervisor cannot be started.
    pub fn start(
        folder: &Path,
        program: &OsStr,
        prepare: impl FnOnce(&mut Command),
    ) -> io::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .args(["supervise", "--parent", &std::process::id().to_string()])
            .arg("--folder")
            .arg(folder)
            .arg("--")
            .arg(program);
        prepare(&mut command);
        // A signal to the group of this program must leave the supervisor alive.
        let supervisor = start(command.process_group(0), OnSignal::Terminate)?;
        Ok(Self {
            supervisor,
            folder: folder.to_owned(),
            ended: None,
        })
    }

    /// Standard input and output of the program, where `prepare` made pipes of them.
    pub fn take_pipes(&mut self) -> (Option<ChildStdin>, Option<ChildStdout>) {
        (self.supervisor.stdin.take(), self.supervisor.stdout.take())
    }

    /// The program's status, once it and all processes that it started have ended. If a signal ends this
    /// program, the function does not return.
    ///
    /// # Errors
    /// The supervisor cannot be waited for.
    pub fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        wait_if_ending();
        if self.ended.is_none() {
            let supervisor = self.supervisor.try_wait()?;
            // The file appears before the supervisor ends.
            let status = fs::read_to_string(self.folder.join(ENDED)).ok();
            let status = status.and_then(|text| text.parse().ok());
            self.ended = status.map(ExitStatus::from_raw).or(supervisor);
        }
        Ok(self.ended)
    }

    /// Waits for the end of all processes for at most a time.
    ///
    /// # Errors
    /// The supervisor cannot be waited for.
    pub fn wait(&mut self, at_most: Duration) -> io::Result<Option<ExitStatus>> {
        let start = Instant::now();
        loop {
            let ended = self.ended()?;
            if ended.is_some() || start.elapsed() >= at_most {
                return Ok(ended);
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Ends all processes: by SIGTERM, and by SIGKILL if they keep running. The supervisor goes on watching
    /// over the folder.
    ///
    /// # Errors
    /// The folder cannot be written, or the supervisor cannot be waited for.
    pub fn end(&mut self) -> io::Result<ExitStatus> {
        if let Some(status) = self.ended()? {
            return Ok(status);
        }
        fs::write(self.folder.join(END), "")?;
        match self.wait(6 * TERMINATION_TIMEOUT)? {
            Some(status) => Ok(status),
            None => Err(io::Error::other("the program's processes do not end")),
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // The supervisor ends what is still running.
        send(self.supervisor.id(), TERMINATE);
        let _status = self.supervisor.wait();
        forget(&self.supervisor);
    }
}

/// Arguments of the supervisor.
#[derive(clap::Args, Clone, Debug)]
pub struct SuperviseArgs {
    /// Process whose end ends the program
    #[arg(long)]
    parent: u32,
    /// Folder of the program
    #[arg(long)]
    folder: PathBuf,
    /// The program and its arguments
    #[arg(last = true, required = true)]
    program: Vec<OsString>,
}

impl SuperviseArgs {
    /// Runs the program and waits for the end of the parent or of this process.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        // A name of its own keeps the supervisor alive where all processes named as this program are killed.
        let _unnamed = fs::write("/proc/self/comm", "supervisor");
        SUPERVISES.store(true, Ordering::Relaxed);
        #[cfg(target_os = "linux")]
        rustix::process::set_child_subreaper(Some(rustix::process::getpid()))
            .context("cannot supervise a program")?;
        let status = match self.start_program() {
            Ok(program) => self.watch(program),
            Err(error) => {
                super::message::error(&format!("{error:#}"));
                NOT_STARTED << 8
            }
        };
        if self.has_parent() {
            // A folder that is gone belongs to a parent that is ending.
            let _unwritten =
                AtomicFile::write_whole(&self.folder.join(ENDED), status.to_string().as_bytes());
        }
        while self.has_parent() {
            std::thread::sleep(POLL_INTERVAL);
        }
        remove(&self.folder);
        Ok(ExitCode::SUCCESS)
    }

    fn start_program(&self) -> anyhow::Result<u32> {
        let (name, arguments) = self.program.split_first().context("no program")?;
        let mut command = Command::new(name);
        command.args(arguments).process_group(0);
        #[cfg(target_os = "linux")]
        // SAFETY: the function makes one system call, which neither allocates nor takes a lock.
        unsafe {
            command.pre_exec(|| {
                let kill = rustix::process::Signal::KILL;
                Ok(rustix::process::set_parent_process_death_signal(Some(
                    kill,
                ))?)
            });
        }
        let child = command.spawn();
        let child = child.with_context(|| format!("cannot run {}", name.display()))?;
        Ok(child.id())
    }

    /// Whether the process that started this one is running.
    fn has_parent(&self) -> bool {
        let parent = rustix::process::getppid().map(|pid| pid.as_raw_nonzero().get());
        parent.is_some_and(|parent| u32::try_from(parent) == Ok(self.parent))
    }

    /// Waits until all descendants have ended, and ends them if the parent asks or has ended. Returns the status
    /// of the program.
    fn watch(&self, program: u32) -> i32 {
        use rustix::process::{WaitOptions, wait};
        let mut status = 0;
        let mut asked: Option<Instant> = None;
        loop {
            match wait(WaitOptions::NOHANG) {
                Ok(Some((pid, of))) => {
                    if u32::try_from(pid.as_raw_nonzero().get()) == Ok(program) {
                        status = of.as_raw();
                    }
                    continue;
                }
                Ok(None) => {}
                // No child is left.
                Err(_) => return status,
            }
            if !self.has_parent() {
                signal_descendants(KILL);
            } else if let Some(since) = asked {
                if since.elapsed() > TERMINATION_TIMEOUT {
                    signal_descendants(KILL);
                }
            } else if self.folder.join(END).exists() {
                asked = Some(Instant::now());
                signal_descendants(TERMINATE);
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

/// Signal that a program cannot handle.
const KILL: i32 = signal_hook::consts::SIGKILL;

/// Whether this process is a supervisor.
static SUPERVISES: AtomicBool = AtomicBool::new(false);

/// Ends the descendants of a supervisor, which a signal is ending.
pub(crate) fn end_descendants() {
    if !SUPERVISES.load(Ordering::Relaxed) {
        return;
    }
    let start = Instant::now();
    signal_descendants(TERMINATE);
    while start.elapsed() < TERMINATION_TIMEOUT && has_children() {
        // The parent waits for this process for the same time.
        if start.elapsed() > TERMINATION_TIMEOUT / 2 {
            signal_descendants(KILL);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Whether this process has children, after those that have ended were removed. Descendants of a supervisor
/// have become its children before their parent can be removed, so without a child it has no descendant. A
/// search of `/proc` alone can miss one, because processes start and end meanwhile.
fn has_children() -> bool {
    use rustix::process::{WaitOptions, wait};
    loop {
        match wait(WaitOptions::NOHANG) {
            Ok(Some(_)) => {}
            Ok(None) => return true,
            Err(_) => return false,
        }
    }
}

/// Sends a signal to all descendants of this process that a search finds.
fn signal_descendants(signal: i32) {
    let mut parents = Vec::new();
    for process in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let pid = process
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok());
        let stat = fs::read_to_string(process.path().join("stat")).unwrap_or_default();
        if let (Some(pid), Some(parent)) = (pid, parent_of(&stat)) {
            parents.push((pid, parent));
        }
    }
    let mut family = vec![std::process::id()];
    let mut at = 0;
    while let Some(&process) = family.get(at) {
        let children = parents.iter().filter(|(_, parent)| *parent == process);
        family.extend(children.map(|(pid, _): &(u32, u32)| *pid));
        at += 1;
    }
    for process in &family[1..] {
        send(*process, signal);
    }
}

/// The parent of a process, from its `/proc/PID/stat`. A zombie counts: while its other threads end, it still
/// has children.
fn parent_of(stat: &str) -> Option<u32> {
    // State and parent follow the name, which is in parentheses and may itself contain spaces and parentheses.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace();
    let _state = fields.next()?;
    fields.next()?.parse().ok()
}

/// Removes a folder; processes that are just ending may still write into it.
fn remove(folder: &Path) {
    for _ in 0..50 {
        if fs::remove_dir_all(folder).is_ok() || !folder.exists() {
            return;
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

#[cfg(test)]
mod tests {
    use super::parent_of;

    #[test]
    fn the_parent_is_read_behind_any_name() {
        assert_eq!(parent_of("12 (sh) S 3 12 12 0"), Some(3));
        assert_eq!(parent_of("12 (a) Z 9 (b c) R 7 1"), Some(7));
        assert_eq!(parent_of("12 (sh) Z 3 12 12 0"), Some(3));
        assert_eq!(parent_of(""), None);
    }
}
