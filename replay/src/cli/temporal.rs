//! `replay temporal`: reuse of the previous frame's hits beside reuse between the eyes.

use super::outputs::{self, Outputs};
use super::reuse_args::ReuseArgs;
use crate::files;
use anyhow::{Context, Result};
use clap::Args;
use formats::raytrace::Raytrace;
use report::temporal::{FrameSchemes, TemporalReport};
use sgrt::temporal::{SequenceFrame, schemes};
use shell::Progress;
use sim::result::TraceId;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay temporal`.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("csv", outputs::csv_before_traces),
    after_help = "Examples:
  tracegen rays chess --path head --frame 0 -o f0.raytrace
  tracegen rays chess --path head --frame 1 -o f1.raytrace
  replay temporal f0.raytrace f1.raytrace"
)]
pub(super) struct TemporalArgs {
    /// Ray traces of consecutive frames of a scene at rest, in order.
    #[arg(value_name = "FILE", num_args = 2.., required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reused: ReuseArgs,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read, frames that do not belong together, or parameters that cannot be used.
pub fn run(args: &TemporalArgs) -> Result<ExitCode> {
    args.threads.start()?;
    let config = args.reused.parameters()?;
    let (rule, reuse) = (args.reused.rule()?, args.reused.reuse());
    let inputs = args.files.iter().chain(&args.reused.config);
    let prints = files::check_outputs(
        &args.outputs.list::<TemporalReport>()?,
        inputs.map(PathBuf::as_path),
    )?;
    let files: Vec<Raytrace> = (args.files.iter())
        .map(|path| Raytrace::open(path))
        .collect::<Result<_, _>>()?;
    let progress = Progress::new("reusing", files.len() as u64 - 1, "frames");
    let mut frames = Vec::new();
    let mut previous: Option<(SequenceFrame<'_>, TraceId)> = None;
    for (path, file) in args.files.iter().zip(&files) {
        let frame = SequenceFrame::load(file).with_context(|| path.display().to_string())?;
        let id = TraceId::new(path, &file.tables().meta.trace, file.content_checksum());
        if let Some((before, before_id)) = previous {
            let found = schemes(&before, &frame, &rule, reuse, &config)
                .with_context(|| format!("{} after {}", path.display(), before_id.name))?;
            frames.push(FrameSchemes {
                previous: before_id,
                trace: id.clone(),
                schemes: found,
            });
            progress.advance(1);
        }
        previous = Some((frame, id));
    }
    drop(progress);
    let report = TemporalReport::new(frames, rule.to_string(), reuse, config);
    args.outputs.write(&report, prints)?;
    Ok(ExitCode::SUCCESS)
}
