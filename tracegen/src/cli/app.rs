//! `tracegen app`.

use super::choice::choice;
use super::failed_run::{FailedRun, Tail, file_of};
use super::program_args::{ProgramArgs, note_frame_times};
use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use clap::builder::TypedValueParser;
use parallax_layer::spool::FramesBy;
use programs::{Launch, Session, SessionError, Watch};
use shell::{run_child_until, warn};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

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
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,
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
    args.capture.check_outputs(None)?;
    let settings = args.capture.settings(args.frames_by)?;
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let program = args.name()?;
    let run = run_program(args, &launch, &program)?;
    let mut session = Session::of_capture(launch.folder(), &program)
        .map_err(|error| with_replay_error(error, &run, &launch))?;
    let milliseconds = |us: u64| us as f64 / 1e3;
    let wanted = args.capture.frames.clone();
    let is_complete = |frame: u32| session.frames.get(&frame).is_some_and(|frame| frame.ended);
    if !wanted.clone().all(is_complete) {
        let error = SessionError::TooFew {
            program,
            first: wanted.start,
            last: wanted.end - 1,
            counted: launch.control.counted().max(session.ended),
        };
        return Err(with_replay_error(error, &run, &launch));
    }
    let before: Vec<f64> = (session.before_us.iter().copied())
        .map(milliseconds)
        .collect();
    let captured: Vec<f64> = (session.frames.values())
        .filter(|frame| wanted.contains(&frame.frame))
        .map(|frame| milliseconds(frame.took_us))
        .collect();
    note_frame_times(&before, &captured);
    args.capture
        .finish(&mut session, program, &settings, BTreeMap::new())
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

    /// The command that renders the frames.
    fn command(&self) -> Command {
        if let Some(file) = &self.apitrace {
            let mut command = Command::new(REPLAYER);
            command.arg(file).stdout(Stdio::null());
            return command;
        }
        let (first, rest) = self.program.split_first().unzip();
        let mut command = Command::new(first.map_or(OsStr::new(""), OsString::as_os_str));
        command.args(rest.unwrap_or_default());
        command
    }
}

/// Runs the program until it has rendered its frames or ends.
fn run_program(args: &AppArgs, launch: &Launch, program: &str) -> anyhow::Result<FailedRun> {
    let mut command = args.command();
    launch.prepare(&mut command, args.gl || args.apitrace.is_some());
    let mut tail = None;
    if args.apitrace.is_some() {
        // A replay that is terminated prints its call stack.
        let log = File::create(launch.folder().join(REPLAY_LOG));
        command.stderr(log.context("cannot write the log of the replay")?);
    } else {
        tail = Some(Tail::of(&mut command).context("cannot make a pipe")?);
    }
    let mut watch = Watch::default();
    let wanted = args.capture.frames.len() as u32;
    let deadline = Instant::now() + Duration::from_secs(args.timeout);
    let mut late = false;
    let ended = run_child_until(&mut command, || {
        watch.look();
        late = Instant::now() >= deadline;
        late || (!args.to_end && launch.control.ended() >= wanted)
    });
    let ended = ended.with_context(|| {
        let name = command.get_program().to_string_lossy().into_owned();
        match args.apitrace {
            Some(_) => format!("cannot run {name}, which the package apitrace has"),
            None => format!("cannot run {name}"),
        }
    })?;
    if late {
        warn(&format!(
            "{program} was ended after {} seconds",
            args.timeout
        ));
    }
    let file = file_of(Path::new(command.get_program()));
    drop(command);
    Ok(FailedRun {
        ended,
        watch,
        lines: tail.map(|tail| tail.lines()).unwrap_or_default(),
        file,
        opengl: args.gl || args.apitrace.is_some(),
    })
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
