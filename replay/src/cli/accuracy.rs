//! `replay accuracy`: run time against error, measured.

use super::ConfigArgs;
use super::subjects::Traces;
use crate::accuracy::{VARIANTS, measure, sampled};
use crate::config::{Mode, Order, RunConfig};
use crate::files::{check_outputs, write_atomically};
use crate::report::accuracy::{AccuracyReport, SampleRow, VariantRow};
use anyhow::{Context, Result, ensure};
use shell::{Output, Progress};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Files that are written into the folder.
const FILES: [&str; 6] = [
    "accuracy.html",
    "accuracy.json",
    "variants.csv",
    "samples.csv",
    "errors.csv",
    "times.csv",
];

/// Arguments of `replay accuracy`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Everything runs one after another on one thread, so that times can be compared; they are in
times.csv and on the page, and nowhere else. errors.csv has the form of the table that reports show.

Example: replay accuracy crytek.textrace atrium.textrace -o out/accuracy"
)]
pub struct Args {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    /// Folder for tables, charts and page
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// Wrong arguments, an unreadable trace, an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let config = args.machine.resolve()?;
    ensure!(
        config.mode == Mode::Timed && config.order == RunConfig::default().order,
        "--mode and --order are varied here"
    );
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let paths: Vec<PathBuf> = FILES.iter().map(|file| args.output.join(file)).collect();
    let outputs: Vec<Output> = paths
        .iter()
        .map(|path| Output::text("--output", path))
        .collect();
    check_outputs(
        &outputs,
        args.traces
            .iter()
            .map(PathBuf::as_path)
            .chain(args.machine.file()),
    )?;
    let traces = Traces::open(&args.traces)?;
    let subjects = traces.subjects();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let steps = (subjects.len() * (VARIANTS.len() + 1)) as u64;
    let progress = Progress::new("measuring", steps, "variants");
    let (mut variants, mut samples) = (Vec::new(), Vec::new());
    for variant in &VARIANTS {
        for subject in &subjects {
            let measured = pool.install(|| measure(subject.source, config, variant));
            variants.push(VariantRow {
                scene: subject.label.clone(),
                variant,
                measured: measured.with_context(|| subject.label.clone())?,
            });
            progress.advance(1);
        }
    }
    let functional = RunConfig {
        mode: Mode::Functional,
        ..config
    };
    for subject in &subjects {
        let found = pool.install(|| sampled(subject.source, &functional, Order::MORTON));
        let found = found.with_context(|| subject.label.clone())?;
        samples.extend(found.into_iter().map(|estimate| SampleRow {
            scene: subject.label.clone(),
            estimate,
        }));
        progress.advance(1);
    }
    drop(progress);
    let report = AccuracyReport {
        config,
        variants,
        samples,
    };
    let scenes = subjects.iter().map(|subject| {
        let [width, height] = subject.source.tables().meta.hmd.eye_size_px;
        format!("{} {width}x{height}", subject.label)
    });
    let scenes = scenes.collect::<Vec<_>>().join(", ");
    write(&report, &scenes, &args.output)?;
    super::print(&format!(
        "{}\n{}\n{}",
        report.variants().text(),
        report.samples().text(),
        report.times().text()
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn write(report: &AccuracyReport, scenes: &str, folder: &Path) -> Result<()> {
    let mut errors = csv::Writer::from_writer(Vec::new());
    for error in report.errors("replay accuracy", scenes) {
        errors.serialize(error)?;
    }
    let texts = [
        report.page()?,
        report.json()? + "\n",
        report.variants().csv(),
        report.samples().csv(),
        String::from_utf8(errors.into_inner()?)?,
        report.times().csv(),
    ];
    for (file, text) in FILES.iter().zip(texts) {
        write_atomically(&folder.join(file), text.as_bytes())?;
    }
    for (study, chart) in report.charts() {
        let path = folder.join(format!("pareto-{study}.svg"));
        write_atomically(&path, chart.svg()?.as_bytes())?;
    }
    Ok(())
}
