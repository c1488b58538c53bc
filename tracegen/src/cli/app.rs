//! `tracegen app`.

use super::choice::choice;
use super::program_args::ProgramArgs;
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::TypedValueParser;
use parallax_layer::spool::FramesBy;
use programs::{Launch, Session, SessionError};
use shell::{Ended, run_child_until, warn};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};
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
    /// Let the program run to its end. By default it is terminated after the last frame.
    #[arg(long)]
    to_end: bool,
    /// Timeout in seconds; a program that has not rendered the frames by then is terminated.
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,
    /// The program and its arguments.
    #[arg(last = true, required = true, value_name = "PROGRAM")]
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
    let program = program_name(&args.program);
    let ended = run_program(args, &launch, &program)?;
    let mut session = Session::of_capture(launch.folder(), &program)?;
    let wanted = args.capture.frames.clone();
    let is_complete = |frame: u32| session.frames.get(&frame).is_some_and(|frame| frame.ended);
    if !wanted.clone().all(is_complete) {
        let error = SessionError::TooFew {
            program,
            first: wanted.start,
            last: wanted.end - 1,
            counted: launch.control.counted(),
            ended: how_it_ended(&ended),
        };
        return Err(error.into());
    }
    args.capture
        .finish(&mut session, program, &settings, BTreeMap::new())
}

/// Name of a program in messages: its file name.
fn program_name(program: &[OsString]) -> String {
    let path = program
        .first()
        .map_or(Path::new(""), |first| Path::new(first));
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Runs the program until it has rendered its frames or ends.
fn run_program(args: &AppArgs, launch: &Launch, program: &str) -> anyhow::Result<Ended> {
    let Some((first, rest)) = args.program.split_first() else {
        bail!("expected a program, found none");
    };
    let mut command = Command::new(first);
    command.args(rest);
    launch.prepare(&mut command, args.gl);
    let wanted = args.capture.frames.len() as u32;
    let deadline = Instant::now() + Duration::from_secs(args.timeout);
    let mut late = false;
    let ended = run_child_until(&mut command, || {
        late = Instant::now() >= deadline;
        late || (!args.to_end && launch.control.ended() >= wanted)
    });
    let ended = ended.with_context(|| format!("cannot run {}", first.to_string_lossy()))?;
    if late {
        warn(&format!(
            "{program} was ended after {} seconds",
            args.timeout
        ));
    }
    Ok(ended)
}

fn how_it_ended(ended: &Ended) -> String {
    match (ended.stopped, ended.status.code()) {
        (true, _) => "it was asked to end".to_owned(),
        (false, Some(code)) => format!("it ended with exit code {code}"),
        (false, None) => format!("it ended by {}", ended.status),
    }
}
