//! `tracegen app`.

use super::choice::choice;
use super::failed_run::FailedRun;
use super::program_args::ProgramArgs;
use super::program_run::ProgramRun;
use super::values::parse_timeout;
use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use clap::builder::TypedValueParser;
use programs::{Cameras, Launch, SessionError};
use shell::find_program;
use spool::FramesBy;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Arguments of `tracegen app`.
#[derive(Args, Debug)]
pub struct AppArgs {
    #[command(flatten)]
    capture: ProgramArgs,
    /// Event that ends a frame.
    #[arg(long, value_parser = frames_by_parser(), value_name = "BY", default_value = "auto")]
    frames_by: FramesBy,
    /// The program uses OpenGL: run it on Mesa's zink, an OpenGL implementation on Vulkan.
    #[arg(long)]
    gl: bool,
    /// Replay a file of OpenGL calls, which `apitrace trace` records, instead of running a program. The
    /// replay renders the same frames every time.
    #[arg(long, value_name = "FILE.trace", conflicts_with_all = ["program", "gl"])]
    apitrace: Option<PathBuf>,
    /// Let the program run to its end. By default it is terminated after the last frame.
    #[arg(long)]
    to_end: bool,
    /// Timeout in seconds; a program that has not rendered the frames by then is terminated.
    #[arg(long, value_name = "SECONDS", default_value = "600", value_parser = parse_timeout)]
    timeout: Duration,
    /// The program and its arguments.
    #[arg(
        last = true,
        required_unless_present = "apitrace",
        value_name = "PROGRAM"
    )]
    program: Vec<OsString>,
}

fn frames_by_parser() -> impl TypedValueParser<Value = FramesBy> {
    choice([
        (
            "auto",
            FramesBy::Auto,
            "A present; a readback where the program has no swapchain",
        ),
        (
            "present",
            FramesBy::Present,
            "Presenting an image of a swapchain",
        ),
        (
            "readback",
            FramesBy::Readback,
            "Copying an image to a buffer",
        ),
    ])
}

/// Runs `tracegen app`.
///
/// # Errors
/// Wrong use, a program that cannot be captured, and outputs that cannot be written.
pub fn run(args: &AppArgs) -> anyhow::Result<ExitCode> {
    let eyes = args.capture.check(None)?;
    let program = args.name()?;
    args.check_program()?;
    let settings = args.capture.settings(args.frames_by)?;
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let opengl = args.gl || args.apitrace.is_some();
    let (file, arguments) = args.command();
    // A replay that is terminated prints its call stack.
    let log = args
        .apitrace
        .as_ref()
        .map(|_| launch.folder().join(REPLAY_LOG));
    let to_run = ProgramRun {
        name: &program,
        file,
        arguments,
        opengl,
        openxr: false,
        log: log.as_deref(),
        frames: args.capture.frames.clone(),
        grace: (!args.to_end).then_some(Duration::ZERO),
        timeout: args.timeout,
    };
    // The supervisor watches over the capture's folder until the end.
    let (_program, run) = to_run.start(&launch, |command| {
        launch.prepare(command, opengl);
        Ok(())
    })?;
    let mut session = to_run
        .session(&launch)
        .map_err(|error| with_replay_error(error, &run, &launch))?;
    args.capture.finish(
        &mut session,
        program.clone(),
        &settings,
        &eyes,
        Cameras::default(),
    )
}

/// Program of apitrace that replays files.
const REPLAYER: &str = "glretrace";

/// File with the standard error of the replay.
const REPLAY_LOG: &str = "replay.log";

impl AppArgs {
    /// File name of the program or of the replayed file, for messages.
    ///
    /// # Errors
    /// A file that cannot be replayed.
    fn name(&self) -> anyhow::Result<String> {
        let path = match (&self.apitrace, self.program.first()) {
            (Some(file), _) => {
                let place = || format!("cannot read {}", file.display());
                let kind = std::fs::metadata(file).with_context(place)?;
                ensure!(
                    kind.is_file(),
                    "{}: expected a file of apitrace, found no regular file",
                    file.display()
                );
                file
            }
            (None, Some(first)) => Path::new(first),
            (None, None) => bail!("expected a program, found none"),
        };
        let name = path.file_name().unwrap_or(path.as_os_str());
        Ok(name.to_string_lossy().into_owned())
    }

    /// The program that renders the frames, and its arguments.
    fn command(&self) -> (&OsStr, Vec<&OsStr>) {
        match &self.apitrace {
            Some(file) => (OsStr::new(REPLAYER), vec![file.as_os_str()]),
            None => {
                let (first, rest) = self.program.split_first().unzip();
                let rest = rest.unwrap_or_default().iter();
                let first = first.map_or(OsStr::new(""), OsString::as_os_str);
                (first, rest.map(OsString::as_os_str).collect())
            }
        }
    }

    /// Refuses a program that does not exist.
    fn check_program(&self) -> anyhow::Result<()> {
        let (name, _) = self.command();
        ensure!(
            find_program(name).is_some(),
            "cannot run {}{}: expected a program, found no such file",
            name.display(),
            match self.apitrace {
                Some(_) => ", which the package apitrace has",
                None => "",
            }
        );
        Ok(())
    }
}

/// Adds what is known about the run, and the first error of the replay of a file.
fn with_replay_error(error: SessionError, run: &FailedRun, launch: &Launch) -> anyhow::Error {
    let error = run.explain(&error);
    let log = std::fs::read(launch.folder().join(REPLAY_LOG)).unwrap_or_default();
    let log = String::from_utf8_lossy(&log);
    match log.lines().find(|line| line.contains("error")) {
        Some(line) => anyhow!("{error}; {REPLAYER}: {}", line.trim()),
        None => error,
    }
}
