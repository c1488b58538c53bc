//! `replay accuracy`: measures run time against error.

use super::ConfigArgs;
use super::addresses::two_levels_only;
use super::subjects::Traces;
use crate::files::{check_outputs, write_atomically};
use anyhow::{Context, Result, anyhow, ensure};
use formats::raytrace::Raytrace;
use report::accuracy::{AccuracyReport, Measured};
use report::document::Document;
use serde::Deserialize;
use sgrt::frame::RaySource;
use shell::{Output, Progress};
use sim::config::RunConfig;
use sim::model_version::RAY_MODEL_VERSION;
use sim::result::scene_name;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use studies::accuracy::{Inputs, Rays, Replays, STUDIES, TraversalRow};
use studies::techniques::Folder;

/// Names of the files in the output folder.
const FILES: [&str; 5] = [
    "accuracy.html",
    "accuracy.json",
    "choices.csv",
    "errors.csv",
    "times.csv",
];

/// Arguments of `replay accuracy`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "All measurements run one after another on one thread. The times are that thread's processor time, so they can be
compared. They are in times.csv and on the page, and nowhere else. errors.csv has the same form as the table of errors on reports.

Examples:
  replay accuracy crytek.textrace atrium.textrace -o out/accuracy
  replay accuracy crytek.textrace --truth crytek-reference.textrace --rays crytek.raytrace -o out/accuracy"
)]
pub struct Args {
    /// Texture traces; traces of several frames are used only to measure samples of frames
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    /// Reference trace for the views of a TRACE (`tracegen verify --write-reference`)
    #[arg(long, value_name = "TRACE")]
    truth: Vec<PathBuf>,
    /// Capture of the views of a TRACE by another driver, compared with --truth
    #[arg(long, value_name = "TRACE")]
    capture: Vec<PathBuf>,
    /// Capture time of the traces: a CSV file with the columns `trace` (file name without extension) and
    /// `seconds`
    #[arg(long, value_name = "CSV")]
    seconds: Option<PathBuf>,
    /// Ray traces, to measure reprojection rules
    #[arg(long, value_name = "RAYTRACE")]
    rays: Vec<PathBuf>,
    /// Folders written by `tracegen techniques`
    #[arg(long, value_name = "DIR")]
    techniques: Vec<PathBuf>,
    /// Precision of the ray traversal (JSON written by `tracegen precision`)
    #[arg(long, value_name = "JSON")]
    traversal: Option<PathBuf>,
    /// Folder for tables, charts and the page
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    shell::Threads::default().start()?;
    let config = args.machine.resolve()?;
    ensure!(
        config.is_looping() && config.order == RunConfig::default().order,
        "--mode and --order are varied here"
    );
    two_levels_only(&config, "accuracy")?;
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let paths: Vec<PathBuf> = FILES.iter().map(|file| args.output.join(file)).collect();
    let outputs: Vec<Output> = paths
        .iter()
        .map(|path| Output::text("--output", path))
        .collect();
    let traces = args.traces.iter().chain(&args.truth).chain(&args.capture);
    let files = traces.chain(&args.rays).chain(&args.seconds);
    let files = files.chain(&args.traversal).map(PathBuf::as_path);
    check_outputs(&outputs, files.chain(args.machine.file()))?;

    let [traces, truths, captures] =
        [&args.traces, &args.truth, &args.capture].map(|paths| Traces::open(paths));
    let (traces, truths, captures) = (traces?, truths?, captures?);
    let rays = args.rays.iter().map(|path| Raytrace::open(path));
    let rays = rays.collect::<Result<Vec<_>, _>>()?;
    let folders = args.techniques.iter().map(|path| Folder::open(path));
    let folders = folders.collect::<Result<Vec<_>, _>>()?;
    let traversal = args.traversal.as_deref().map(read_traversal).transpose()?;
    let seconds = args.seconds.as_deref().map(read_seconds).transpose()?;
    let named = |source: &dyn RaySource| scene_name(&source.tables().meta.trace.scene).to_owned();
    let inputs = Inputs {
        config,
        subjects: traces.subjects_by_file(),
        truths: truths.subjects_by_file(),
        captures: captures.subjects_by_file(),
        seconds: seconds.unwrap_or_default(),
        rays: rays
            .iter()
            .map(|source| Rays {
                label: named(source),
                source,
            })
            .collect(),
        techniques: &folders,
        traversal: traversal.unwrap_or_default(),
        replays: Replays::default(),
    };
    let report = measured(&inputs)?;
    let size = |scene: &str| {
        let subject = inputs.subjects.iter().chain(&inputs.truths);
        let of = |hmd: &formats::view::Hmd| hmd.eye_size_px;
        let texture = subject
            .filter(|s| s.label == scene || scene_name(&s.source.tables().meta.scene) == scene)
            .map(|s| of(&s.source.tables().meta.hmd));
        let ray = inputs.rays.iter().filter(|r| r.label == scene);
        let ray = ray.map(|r| of(&r.source.tables().meta.trace.hmd));
        match texture.chain(ray).next() {
            Some([width, height]) => format!("{scene} {width}x{height}"),
            None => scene.to_owned(),
        }
    };
    write(&report, &size, &args.output)?;
    super::print(&report.text(report::table::Style::Terminal))?;
    Ok(ExitCode::SUCCESS)
}

/// Runs every study that has inputs.
fn measured(inputs: &Inputs<'_>) -> Result<AccuracyReport> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let progress = Progress::new("measuring", STUDIES.len() as u64, "studies");
    let mut studies = Vec::new();
    for study in STUDIES {
        let choices = pool.install(|| (study.measure)(inputs));
        let choices = choices.map_err(|error| anyhow!(error).context(study.title))?;
        progress.advance(1);
        if !choices.is_empty() {
            studies.push(Measured { study, choices });
        }
    }
    Ok(AccuracyReport {
        config: inputs.config,
        ray_model_version: (!inputs.rays.is_empty()).then_some(RAY_MODEL_VERSION),
        studies,
    })
}

/// The file that `tracegen precision` writes.
#[derive(Deserialize)]
struct TraversalFile {
    schema: String,
    rows: Vec<TraversalRow>,
}

const TRAVERSAL_SCHEMA: &str = "tracegen.precision/1";

fn read_traversal(path: &Path) -> Result<Vec<TraversalRow>> {
    let name = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(name)?;
    let file: TraversalFile = serde_json::from_str(&text).with_context(name)?;
    ensure!(
        file.schema == TRAVERSAL_SCHEMA,
        "{}: schema: expected {TRAVERSAL_SCHEMA}, found {}",
        name(),
        file.schema
    );
    Ok(file.rows)
}

fn read_seconds(path: &Path) -> Result<Vec<(String, f64)>> {
    let name = || path.display().to_string();
    let mut lines = csv::Reader::from_path(path).with_context(name)?;
    lines
        .deserialize()
        .map(|line| line.with_context(name))
        .collect()
}

fn write(report: &AccuracyReport, size: &dyn Fn(&str) -> String, folder: &Path) -> Result<()> {
    let mut errors = csv::Writer::from_writer(Vec::new());
    for error in report.errors("replay accuracy", size) {
        errors.serialize(error)?;
    }
    let texts = [
        report.page()?,
        report.json()? + "\n",
        report.csv(),
        String::from_utf8(errors.into_inner()?)?,
        report.times_csv(),
    ];
    for (file, text) in FILES.iter().zip(texts) {
        write_atomically(&folder.join(file), text.as_bytes())?;
    }
    for measured in &report.studies {
        if let Some(chart) = measured.chart() {
            let path = folder.join(format!("pareto-{}.svg", measured.study.key));
            write_atomically(&path, chart.svg()?.as_bytes())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::{arguments, file_of};
    use sim::stream::testing::Synthetic;

    fn run_on(folder: &Path, traversal: &str) -> Result<ExitCode> {
        let trace = Synthetic::one_layer([48, 48], 120).generate();
        let at = |name: &str| folder.join(name).display().to_string();
        std::fs::copy(file_of(&trace).path(), at("a.textrace"))?;
        std::fs::write(at("p.json"), traversal)?;
        let traces = [at("a.textrace"), "--traversal".to_owned(), at("p.json")];
        let output = ["-o".to_owned(), at("out")];
        run(&arguments(traces.into_iter().chain(output)))
    }

    const ROWS: &str = r#"{"schema": "tracegen.precision/1", "rows": [
        {"arithmetic": "single precision", "at_m": 1e5, "wrong_pct": 0.3, "distance_ppm": 9.0, "time_ratio": 0.9}]}"#;

    #[test]
    fn every_file_is_written_and_results_have_no_times() {
        let folder = tempfile::tempdir().unwrap();
        run_on(folder.path(), ROWS).unwrap();
        let read =
            |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        let [page, json, choices, errors, times] = FILES.map(read);
        assert!(page.contains("Precision of the ray traversal"), "{page}");
        assert!(json.contains(AccuracyReport::SCHEMA));
        assert!(choices.contains("a sphere at 1e5 m"), "{choices}");
        assert!(errors.contains("a 48x48"), "{errors}");
        assert!(times.contains("single precision"), "{times}");
        assert!(!json.contains("time_ratio") && !choices.contains("time_ratio"));
        assert!(read("pareto-lod.svg").contains("<svg"));
    }

    #[test]
    fn a_file_of_another_schema_is_refused_with_the_schemas_name() {
        let folder = tempfile::tempdir().unwrap();
        let text = ROWS.replace("precision/1", "precision/9");
        let error = run_on(folder.path(), &text).unwrap_err().to_string();
        assert!(
            error.contains("p.json: schema: expected tracegen.precision/1, found"),
            "{error}"
        );
    }
}
