//! Options and steps that `app` and `page` share.

use super::choice::choice;
use super::values::{encoding_parser, parse_bytes};
use anyhow::Context;
use clap::Args;
use clap::builder::TypedValueParser;
use formats::textrace::{Encoding, TextraceWriter};
use programs::list::List;
use programs::{Cameras, Check, Drained, Job, Rule, RuleFile, Session, Wanted, check, drain};
use shell::{Output, check_outputs, lasting_arguments, note, warn};
use spool::{FramesBy, Settings};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Options of a program's capture.
#[derive(Args, Debug)]
pub struct ProgramArgs {
    /// The trace to write.
    #[arg(
        short,
        long,
        value_name = "FILE.textrace",
        required_unless_present = "list"
    )]
    output: Option<PathBuf>,
    /// List the render passes of the frames as a table on stdout, and write no trace.
    #[arg(long, conflicts_with_all = ["output", "check"])]
    list: bool,
    /// Also write the list as a page with a picture of each render pass.
    #[arg(long, value_name = "PAGE.html", requires = "list")]
    list_page: Option<PathBuf>,
    /// Frames to capture, counted from 0: `10`, or `10..13` for 10, 11 and 12.
    #[arg(long, value_name = "FRAMES", default_value = "10", value_parser = parse_frames)]
    pub frames: Range<u32>,
    /// How the program renders both eyes; by default the first of these that fits.
    #[arg(long, value_parser = eyes_parser(), value_name = "RULE")]
    eyes: Option<Rule>,
    /// File of rules that assign draws to eyes, for programs that no built-in rule fits.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "eyes")]
    rules: Option<PathBuf>,
    /// Compare the number of records of every draw with an occlusion query of the driver; exit code 1 if they
    /// differ.
    #[arg(long)]
    check: bool,
    /// Has no effect: all draws are recorded.
    #[arg(long = "all-draws", hide = true)]
    _all_draws: bool,
    /// Size limit of the records of one submission. Unused memory is not allocated.
    #[arg(long, value_name = "SIZE", default_value = "768MiB", value_parser = parse_bytes)]
    records: u64,
    /// Folder for the recorded shaders, before and after the recording code is inserted.
    #[arg(long, value_name = "FOLDER")]
    modules: Option<PathBuf>,
    /// How the trace's tiles are packed.
    #[arg(long, value_parser = encoding_parser(), default_value = "delta", value_name = "NAME")]
    encoding: Encoding,
}

fn eyes_parser() -> impl TypedValueParser<Value = Rule> {
    choice([
        (
            "multiview",
            Rule::Multiview,
            "A draw is broadcast to two layers",
        ),
        ("halves", Rule::Halves, "Two viewports of one target"),
        ("targets", Rule::Targets, "A target per eye"),
        (
            "channels",
            Rule::Channels,
            "One target for both, distinguished by the colour channels that are written",
        ),
        (
            "twice",
            Rule::Twice,
            "One target for both: the same draws twice",
        ),
        ("mono", Rule::Mono, "One eye alone: the largest target"),
    ])
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

/// Prints the median times of the frames before the capture and of the captured ones.
pub fn note_frame_times(before_ms: &[f64], captured_ms: &[f64]) {
    // The first frames create textures and shaders, so they are not timed.
    let settled = before_ms.get(before_ms.len() / 2..).unwrap_or_default();
    note(&format!(
        "milliseconds per frame: {} before, {} captured",
        median(settled),
        median(captured_ms)
    ));
}

/// The median of some times as text.
fn median(times_ms: &[f64]) -> String {
    let mut sorted = times_ms.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.get(sorted.len() / 2) {
        Some(middle) => format!("{middle:.1}"),
        None => "none".to_owned(),
    }
}

impl ProgramArgs {
    /// Refuses outputs that cannot be written, and reads the rules of the eyes.
    ///
    /// # Errors
    /// An output that cannot be written, or rules that cannot be read.
    pub fn check(&self, more: Option<Output>) -> anyhow::Result<Wanted> {
        let trace = (self.output.as_deref()).map(|path| Output::binary("-o", path));
        let list = (self.list_page.as_deref()).map(|path| Output::text("--list-page", path));
        let outputs: Vec<Output> = trace.into_iter().chain(list).chain(more).collect();
        check_outputs(&outputs, [])?;
        Ok(match (&self.rules, self.eyes) {
            (Some(path), _) => Wanted::File(RuleFile::load(path)?),
            (None, Some(eyes)) => Wanted::Rule(eyes),
            (None, None) => Wanted::First,
        })
    }

    /// The trace to write, if one is.
    pub fn output(&self) -> Option<&Path> {
        self.output.as_deref()
    }

    /// Settings of the layer.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub fn settings(&self, frames_by: FramesBy) -> anyhow::Result<Settings> {
        let absolute = |folder: &PathBuf| {
            std::fs::create_dir_all(folder)
                .and_then(|()| folder.canonicalize())
                .with_context(|| format!("cannot make {}", folder.display()))
        };
        Ok(Settings {
            records: true,
            frames: [self.frames.start, self.frames.end],
            frames_by,
            occlusion: self.check || self.list,
            record_bytes: self.records,
            pictures: self.list_page.is_some(),
            modules: self.modules.as_ref().map(absolute).transpose()?,
        })
    }

    /// Writes the trace and prints a summary on stderr.
    ///
    /// # Errors
    /// A session without two eyes, or a trace that cannot be written.
    pub fn finish(
        &self,
        session: &mut Session,
        program: String,
        settings: &Settings,
        eyes: &Wanted,
        cameras: Cameras,
    ) -> anyhow::Result<ExitCode> {
        for trouble in &session.troubles {
            warn(trouble);
        }
        let frames: Vec<u32> = self.frames.clone().collect();
        let Some(output) = &self.output else {
            self.write_list(session, &program, eyes)?;
            return Ok(ExitCode::SUCCESS);
        };
        let job = Job {
            frames: &frames,
            eyes,
            frames_by: settings.frames_by,
            cameras,
            program,
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            record_bytes: settings.record_bytes,
        };
        let writer = TextraceWriter::create_growing(output)?;
        let writer = writer.with_encoding(self.encoding);
        let (writer, drained) = drain(session, &job, writer)?;
        let checked = self.check.then(|| check(session, &frames)).transpose()?;
        let bytes = writer.finish()?;
        report(session, &drained, bytes);
        Ok(match &checked {
            Some(checked) => report_check(checked),
            None => ExitCode::SUCCESS,
        })
    }
}

impl ProgramArgs {
    /// Prints the frames' passes and writes their page.
    fn write_list(
        &self,
        session: &mut Session,
        program: &str,
        wanted: &Wanted,
    ) -> anyhow::Result<()> {
        let frames = self.frames.clone();
        let lists: Result<Vec<List>, _> = frames
            .map(|frame| programs::list::list(session, frame, wanted))
            .collect();
        let lists = lists?;
        for list in &lists {
            shell::print(&format!("{}\n{}", list.eyes_text(), list.table()))?;
        }
        if let Some(path) = &self.list_page {
            shell::write_file(path, programs::list::page(program, &lists))?;
        }
        Ok(())
    }
}

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
    for notice in drained.program.notices() {
        note(&notice);
    }
    if let Some((of, fragments)) = empty_eye(drained.eye_fragments) {
        warn(&format!(
            "the {of} eye has no fragments, the other one has {fragments}; `--list-page` shows its passes. Mesa 22.3 drops triangles that \
             cross a clip edge in the second view of a multiview pass"
        ));
    }
    note(&format!("driver: {}", session.driver));
}

/// The eye without fragments, and those of the other eye.
fn empty_eye(fragments: [u64; 2]) -> Option<(&'static str, u64)> {
    match fragments {
        [0, other] if other > 0 => Some(("left", other)),
        [other, 0] if other > 0 => Some(("right", other)),
        _ => None,
    }
}

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
