//! `replay temporal`: reuse of the previous frame's hits beside reuse between the eyes.

use super::reproject::{preset, read_config, rule_help, rule_of};
use crate::files;
use crate::report::temporal::{FrameSchemes, TemporalReport};
use crate::result::TraceId;
use crate::sgrt::compose::Reuse;
use crate::sgrt::presets::{self, Preset};
use crate::sgrt::rules::Rule;
use crate::sgrt::temporal::schemes;
use anyhow::{Context, Result, ensure};
use clap::Args;
use formats::raytrace::Raytrace;
use shell::{Output, Progress};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay temporal`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  tracegen rays chess --path head --frame 0 -o f0.raytrace
  tracegen rays chess --path head --frame 1 -o f1.raytrace
  replay temporal f0.raytrace f1.raytrace")]
pub(super) struct TemporalArgs {
    /// Ray traces of consecutive frames of a scene at rest, in order.
    #[arg(value_name = "FILE", num_args = 2.., required = true)]
    files: Vec<PathBuf>,
    #[arg(long, value_name = "NAME", help = presets::help(), value_parser = preset)]
    preset: Option<&'static Preset>,
    #[arg(long, value_name = "RULE", help = rule_help())]
    rule: Option<Rule>,
    /// Values that a reprojected pixel reuses [default: primary].
    #[arg(long, value_enum)]
    reuse: Option<Reuse>,
    /// Model parameters (TOML) that differ from the defaults.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Prints JSON (schema replay.temporal/1).
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Prints CSV: a row per frame and scheme.
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read, frames that do not belong together, or parameters that cannot be used.
pub fn run(args: &TemporalArgs) -> Result<ExitCode> {
    args.threads.start()?;
    let config = read_config(args.preset, args.config.as_deref())?;
    let rule = rule_of(args.rule.as_ref(), args.preset)?;
    let reuse = args.reuse.or(args.preset.map(|preset| preset.reuse));
    let reuse = reuse.unwrap_or_default();
    let outputs = [
        args.json.then(|| Output::result("--json")),
        args.csv.then(|| Output::result("--csv")),
    ];
    let outputs: Vec<Output> = outputs.into_iter().flatten().collect();
    let inputs = args.files.iter().chain(&args.config);
    let prints = files::check_outputs(&outputs, inputs.map(PathBuf::as_path))?;
    ensure!(
        args.files.len() > 1,
        "expected two frames or more, found {}",
        args.files.len()
    );
    let progress = Progress::new("reusing", args.files.len() as u64 - 1, "frames");
    let mut frames = Vec::new();
    let mut previous: Option<(&PathBuf, Raytrace)> = None;
    for path in &args.files {
        let file = Raytrace::open(path)?;
        if let Some((before, earlier)) = &previous {
            let found = schemes(earlier, &file, &rule, reuse, &config)
                .with_context(|| format!("{} after {}", path.display(), before.display()))?;
            let id = |path: &PathBuf, file: &Raytrace| {
                TraceId::new(path, &file.tables().meta.trace, file.content_checksum())
            };
            frames.push(FrameSchemes {
                previous: id(before, earlier),
                trace: id(path, &file),
                schemes: found,
            });
            progress.advance(1);
        }
        previous = Some((path, file));
    }
    drop(progress);
    let report = TemporalReport::new(frames, rule.to_string(), reuse, config);
    let text = if args.json {
        report.json()?
    } else if args.csv {
        report.rows().csv()
    } else {
        report.text()
    };
    if prints {
        super::print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}
