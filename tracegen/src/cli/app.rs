//! `tracegen app`.

use super::raster::{TileEncoding, parse_bytes};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use formats::textrace::TextraceWriter;
use parallax_layer::inject::RAW_BYTES;
use parallax_layer::spool::{FramesBy, Settings};
use programs::{Check, Drained, Job, Launch, Rule, Session, SessionError, check, drain};
use shell::{Ended, Output, check_outputs, lasting_arguments, note, run_child_until, warn};
use std::ffi::OsString;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

/// Arguments of `tracegen app`.
#[derive(Args, Debug)]
pub struct AppArgs {
    /// The trace to write.
    #[arg(short, long, value_name = "FILE.textrace")]
    output: PathBuf,
    /// Frames to capture, counted from 0: `10`, or `10..13` for 10, 11 and 12.
    #[arg(long, value_name = "FRAMES", default_value = "10", value_parser = parse_frames)]
    frames: Range<u32>,
    /// What ends a frame.
    #[arg(long, value_enum, value_name = "BY", default_value_t = FrameEnd::Auto)]
    frames_by: FrameEnd,
    /// How the program renders for two eyes; by default the first of these that fits.
    #[arg(long, value_enum, value_name = "RULE")]
    eyes: Option<Eyes>,
    /// The program uses OpenGL: run it on Mesa's zink, which is OpenGL on Vulkan.
    #[arg(long)]
    gl: bool,
    /// Let the program run to its end. By default it is asked to end after the last frame.
    #[arg(long)]
    to_end: bool,
    /// Hold the records of every draw against an occlusion query of the driver; exit with 1 where they differ.
    #[arg(long)]
    check: bool,
    /// Memory for the records of one submission. What is not used takes none.
    #[arg(long, value_name = "SIZE", default_value = "768MiB", value_parser = parse_bytes)]
    records: u64,
    /// Seconds after which a program that has not rendered the frames is ended.
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,
    /// How the trace's tiles are packed.
    #[arg(long, value_enum, default_value_t = TileEncoding::Delta, value_name = "NAME")]
    encoding: TileEncoding,
    /// The program and its arguments.
    #[arg(last = true, required = true, value_name = "PROGRAM")]
    program: Vec<OsString>,
}

/// `--frames-by`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FrameEnd {
    /// A present; a readback where the program has no swapchain.
    Auto,
    /// Presenting an image of a swapchain.
    Present,
    /// Copying an image to a buffer that the program reads.
    Readback,
}

/// `--eyes`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Eyes {
    /// A draw is broadcast to two layers.
    Multiview,
    /// Two viewports of one target.
    Halves,
    /// A target per eye.
    Targets,
    /// One target for both, told apart by the colour channels that are written.
    Channels,
    /// One target for both: the same draws twice.
    Twice,
    /// One eye alone: the largest target.
    Mono,
}

impl Eyes {
    fn rule(self) -> Rule {
        match self {
            Self::Multiview => Rule::Multiview,
            Self::Halves => Rule::Halves,
            Self::Targets => Rule::Targets,
            Self::Channels => Rule::Channels,
            Self::Twice => Rule::Twice,
            Self::Mono => Rule::Mono,
        }
    }
}

/// A frame, or a range of frames without its end.
fn parse_frames(text: &str) -> Result<Range<u32>, String> {
    let number = |text: &str| text.parse::<u32>().map_err(|_| text.to_owned());
    let range = match text.split_once("..") {
        Some((first, end)) => number(first).and_then(|first| Ok(first..number(end)?)),
        None => number(text).map(|frame| frame..frame.saturating_add(1)),
    };
    let range = range.map_err(|found| format!("expected 10 or 10..13, found {found:?}"))?;
    if range.is_empty() {
        return Err(format!("expected at least one frame, found {text}"));
    }
    Ok(range)
}

/// Runs `tracegen app`.
///
/// # Errors
/// Wrong use, a program that cannot be captured, and outputs that cannot be written.
pub fn run(args: &AppArgs) -> anyhow::Result<ExitCode> {
    check_outputs(&[Output::binary("-o", &args.output)], [])?;
    let capacity = (args.records / RAW_BYTES).clamp(1, u64::from(u32::MAX)) as u32;
    let settings = Settings {
        records: true,
        frames: [args.frames.start, args.frames.end],
        frames_by: args.frames_by.into(),
        occlusion: args.check,
        capacity,
    };
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let program = program_name(&args.program);
    let ended = run_program(args, &launch, &program)?;
    let mut session = Session::of_capture(launch.folder(), &program)?;
    for trouble in &session.troubles {
        warn(trouble);
    }
    let frames = ended_frames(args, &session, &program, &ended, launch.control.counted())?;
    let job = Job {
        frames: &frames,
        eyes: args.eyes.map(Eyes::rule),
        frames_by: settings.frames_by,
        program,
        tool: super::tool(),
        command_line: lasting_arguments(std::env::args_os().skip(1)),
        capacity: capacity.into(),
    };
    let writer = TextraceWriter::create_growing(&args.output)?;
    let writer = writer.with_encoding(args.encoding.encoding());
    let (writer, drained) = drain(&mut session, &job, writer)?;
    let checked = args.check.then(|| check(&mut session, &frames));
    let checked = checked.transpose()?;
    let bytes = writer.finish()?;
    report(&session, &drained, bytes);
    Ok(match &checked {
        Some(checked) => report_check(checked),
        None => ExitCode::SUCCESS,
    })
}

impl From<FrameEnd> for FramesBy {
    fn from(end: FrameEnd) -> Self {
        match end {
            FrameEnd::Auto => Self::Auto,
            FrameEnd::Present => Self::Present,
            FrameEnd::Readback => Self::Readback,
        }
    }
}

/// Name of a program in messages: its file's.
fn program_name(program: &[OsString]) -> String {
    let path = program
        .first()
        .map_or(Path::new(""), |first| Path::new(first));
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Runs the program until it has rendered its frames, or ends.
fn run_program(args: &AppArgs, launch: &Launch, program: &str) -> anyhow::Result<Ended> {
    let Some((first, rest)) = args.program.split_first() else {
        bail!("expected a program, found none");
    };
    let mut command = Command::new(first);
    command.args(rest);
    launch.prepare(&mut command, args.gl);
    let wanted = args.frames.end - args.frames.start;
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

/// The frames that were asked for, if the program rendered all of them to their end.
fn ended_frames(
    args: &AppArgs,
    session: &Session,
    program: &str,
    ended: &Ended,
    counted: u32,
) -> anyhow::Result<Vec<u32>> {
    let frames: Vec<u32> = args.frames.clone().collect();
    let complete = |frame: &u32| session.frames.get(frame).is_some_and(|frame| frame.ended);
    if frames.iter().all(complete) {
        return Ok(frames);
    }
    let how = match (ended.stopped, ended.status.code()) {
        (true, _) => "it was asked to end".to_owned(),
        (false, Some(code)) => format!("it ended with exit code {code}"),
        (false, None) => format!("it ended by {}", ended.status),
    };
    Err(SessionError::TooFew {
        program: program.to_owned(),
        first: args.frames.start,
        last: args.frames.end - 1,
        counted,
        ended: how,
    }
    .into())
}

/// What was captured, on stderr.
fn report(session: &Session, drained: &Drained, bytes: u64) {
    let [width, height] = drained.size_px;
    let frames = match drained.frames {
        1 => "1 frame".to_owned(),
        frames => format!("{frames} frames"),
    };
    let eyes = drained.rule.map_or("", Rule::name);
    note(&format!(
        "{frames} of {width}x{height} px per eye by {eyes}: {} draws, {} textures",
        drained.draws, drained.textures
    ));
    let counts = &drained.counts;
    note(&format!(
        "{} quads, {} fragments, {} records; {:.1} MB",
        counts.quads,
        counts.fragments,
        counts.records,
        bytes as f64 / 1e6
    ));
    if counts.not_finite > 0 {
        note(&format!(
            "left out: {} records whose coordinates are no numbers",
            counts.not_finite
        ));
    }
    for left_out in &drained.left_out {
        note(&format!(
            "not in the trace, or less exactly: {} ({} draws, {} fragments)",
            left_out.what, left_out.draws, left_out.fragments
        ));
    }
    note(&format!("driver: {}", session.driver));
}

/// What occlusion queries say, on stderr.
fn report_check(checked: &Check) -> ExitCode {
    note(&format!(
        "occlusion queries: {} draws equal, {} different",
        checked.equal, checked.different
    ));
    for (why, draws) in &checked.apart {
        note(&format!("not compared: {why} ({draws} draws)"));
    }
    match checked.first {
        None => ExitCode::SUCCESS,
        Some(first) => {
            warn(&format!(
                "frame {}, draw {}: {} fragments recorded, {} counted",
                first.frame, first.draw, first.recorded, first.counted
            ));
            ExitCode::from(1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_one_or_a_range_without_its_end() {
        assert_eq!(parse_frames("7"), Ok(7..8));
        assert_eq!(parse_frames("10..13"), Ok(10..13));
        for text in ["", "a", "3..", "5..5", "-1"] {
            assert!(parse_frames(text).is_err(), "{text}");
        }
    }
}
