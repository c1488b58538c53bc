//! Runs a program under the layer until its frames are captured.

use super::failed_run::{Ended, FailedRun, Tail};
use super::program_args::note_frame_times;
use anyhow::Context;
use programs::{Launch, Session, SessionError, Watch};
use shell::{Program, find_program, warn};
use std::ffi::OsStr;
use std::fs::File;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Interval between two looks at the program's frames.
const FRAME_INTERVAL: Duration = Duration::from_millis(20);

/// A program to run.
pub struct ProgramRun<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// The program and its arguments.
    pub file: &'a OsStr,
    pub arguments: Vec<&'a OsStr>,
    /// Whether it runs on OpenGL on Vulkan.
    pub opengl: bool,
    /// Whether it runs with an OpenXR runtime.
    pub openxr: bool,
    /// File for its standard error; without one, it is passed on.
    pub log: Option<&'a Path>,
    /// Requested frames.
    pub frames: Range<u32>,
    /// Time after the last frame until it is terminated; `None` if it may go on.
    pub grace: Option<Duration>,
    /// Timeout for all frames.
    pub timeout: Duration,
}

impl ProgramRun<'_> {
    /// Runs the program until it has rendered its frames or ends. `prepare` sets its environment.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn start(
        &self,
        launch: &Launch,
        prepare: impl FnOnce(&mut Command) -> std::io::Result<()>,
    ) -> anyhow::Result<(Program, FailedRun)> {
        let log = self.log.map(File::create).transpose();
        let log = log.context("cannot write the log of the replay")?;
        let (mut tail, mut prepared, mut display) = (None, Ok(()), false);
        let started = Program::start(launch.folder(), self.file, |command: &mut Command| {
            command.args(&self.arguments);
            prepared = prepare(command);
            display = names_display(command);
            if self.openxr {
                // Samples of OpenXR end with their standard input.
                command.stdin(Stdio::piped());
            }
            match log {
                Some(log) => drop(command.stdout(Stdio::null()).stderr(log)),
                None => tail = Some(Tail::of(command)),
            }
        });
        let mut running = started.with_context(|| format!("cannot run {}", self.file.display()))?;
        let _open_input = running.take_pipes();
        prepared.context("cannot set up the capture")?;
        let tail = tail.transpose().context("cannot make a pipe")?;
        let mut watch = Watch::default();
        let start = Instant::now();
        let mut done = None;
        let (status, stopped) = loop {
            watch.look();
            if let Some(status) = running.wait(FRAME_INTERVAL)? {
                break (status, false);
            }
            let late = start.elapsed() >= self.timeout;
            if done.is_none() && launch.control.ended() >= self.frames.len() as u32 {
                done = Some(Instant::now());
            }
            let over = done
                .zip(self.grace)
                .is_some_and(|(done, grace)| done.elapsed() >= grace);
            if late || over {
                if late && done.is_none() {
                    let seconds = self.timeout.as_secs_f64();
                    warn(&format!("{} was ended after {seconds} seconds", self.name));
                }
                break (running.end()?, true);
            }
        };
        let run = FailedRun {
            ended: Ended { status, stopped },
            watch,
            lines: tail.map(|tail| tail.lines()).unwrap_or_default(),
            file: find_program(self.file).unwrap_or_default(),
            opengl: self.opengl,
            openxr: self.openxr,
            display,
        };
        Ok((running, run))
    }

    /// The session with all requested frames; prints their times.
    ///
    /// # Errors
    /// The files cannot be read, or frames are missing.
    pub fn session(&self, launch: &Launch) -> Result<Session, SessionError> {
        let session = Session::of_capture(launch.folder(), self.name)?;
        let wanted = self.frames.clone();
        let is_complete = |frame: u32| session.frames.get(&frame).is_some_and(|frame| frame.ended);
        if !wanted.clone().all(is_complete) {
            return Err(SessionError::TooFew {
                program: self.name.to_owned(),
                first: wanted.start,
                last: wanted.end - 1,
                counted: launch.control.counted().max(session.ended),
            });
        }
        let milliseconds = |us: u64| us as f64 / 1e3;
        let before: Vec<f64> = (session.before_us.iter().copied())
            .map(milliseconds)
            .collect();
        let captured: Vec<f64> = (session.frames.values())
            .filter(|frame| wanted.contains(&frame.frame))
            .map(|frame| milliseconds(frame.took_us))
            .collect();
        note_frame_times(&before, &captured);
        Ok(session)
    }
}

/// Whether a program's environment names an X server or a compositor.
fn names_display(command: &Command) -> bool {
    ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| {
        let mut set = command.get_envs().filter(|(key, _)| key == name);
        let value = match set.next() {
            Some((_, value)) => value.map(OsStr::to_owned),
            None => std::env::var_os(name),
        };
        value.is_some_and(|value| !value.is_empty())
    })
}
