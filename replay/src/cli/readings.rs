//! `replay readings`: the SGRT paper's figure 3 under every reading of what it measures.

use super::outputs::{self, PageOutputs};
use super::reuse_args::read_config;
use crate::files;
use anyhow::{Context, Result, ensure};
use clap::Args;
use formats::raytrace::Raytrace;
use report::readings::{ReadingsReport, SceneReadings};
use sgrt::loaded::LoadedTrace;
use sgrt::presets::SGRT_PAPER;
use shell::Progress;
use sim::paper::sgrt as paper;
use sim::result::{TraceId, scene_name};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay readings`.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("csv", outputs::csv_before_traces),
    mut_arg("html", outputs::page_alone),
    after_help = "Examples:
  replay readings teapot.raytrace chess.raytrace car.raytrace
  replay readings *.raytrace --calibrate teapot,chess,car --html readings.html"
)]
pub(super) struct ReadingsArgs {
    /// Ray traces.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Scenes that the closest reading is chosen by, comma-separated; the other scenes judge it [default: every second
    /// one of those beside a scene of the paper].
    #[arg(long, value_name = "LABELS", value_delimiter = ',')]
    calibrate: Option<Vec<String>>,
    /// Model parameters (TOML) that differ from those of `replay reproject --preset sgrt-paper`.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Scene of the paper to set beside: SCENE for every trace, or LABEL=SCENE; `none` for none
    /// [default: the scene that a built-in one of the paper's stands for].
    #[arg(long = "as", value_name = "SCENE")]
    paper_scenes: Vec<String>,
    #[command(flatten)]
    outputs: PageOutputs,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read, parameters that cannot be used, an output that cannot be written.
pub fn run(args: &ReadingsArgs) -> Result<ExitCode> {
    args.threads.start()?;
    let config = read_config(Some(&SGRT_PAPER), args.config.as_deref())?;
    // A wrong --as is refused before the work.
    paper::values("", "", &args.paper_scenes)?;
    let inputs = args.files.iter().chain(&args.config);
    let outputs = args.outputs.list::<ReadingsReport>()?;
    let prints = files::check_outputs(&outputs, inputs.map(PathBuf::as_path))?;
    let progress = Progress::new("reading", args.files.len() as u64, "traces");
    let mut scenes = Vec::new();
    for path in &args.files {
        let file = Raytrace::open(path)?;
        let in_file = || path.display().to_string();
        let loaded = LoadedTrace::load(&file).with_context(in_file)?;
        let meta = &loaded.frame().tables.meta;
        let label = scene_name(&meta.trace.scene).to_owned();
        scenes.push(SceneReadings {
            trace: TraceId::new(path, &meta.trace, file.content_checksum()),
            eye_size_px: loaded.frame().size_px,
            paper: paper::values(&meta.trace.scene, &label, &args.paper_scenes)?,
            calibrates: false,
            readings: loaded.readings(&config).with_context(in_file)?,
            label,
        });
        progress.advance(1);
    }
    drop(progress);
    mark_calibration(&mut scenes, args.calibrate.as_deref())?;
    let report = ReadingsReport::new(scenes, config);
    args.outputs.write(&report, prints, || report.page())?;
    Ok(ExitCode::SUCCESS)
}

/// Marks the scenes that the closest reading is chosen by.
fn mark_calibration(scenes: &mut [SceneReadings], labels: Option<&[String]>) -> Result<()> {
    let Some(labels) = labels else {
        let beside_paper = scenes.iter_mut().filter(|scene| scene.paper.is_some());
        beside_paper
            .step_by(2)
            .for_each(|scene| scene.calibrates = true);
        return Ok(());
    };
    for label in labels {
        let known: Vec<&str> = scenes.iter().map(|s| s.label.as_str()).collect();
        let known = known.join(", ");
        let mut of_label: Vec<&mut SceneReadings> = scenes
            .iter_mut()
            .filter(|scene| scene.label == *label)
            .collect();
        ensure!(
            !of_label.is_empty(),
            "--calibrate: expected labels of {known}, found '{label}'"
        );
        ensure!(
            of_label.iter().all(|scene| scene.paper.is_some()),
            "--calibrate {label}: expected a scene beside one of the paper (see --as)"
        );
        of_label
            .iter_mut()
            .for_each(|scene| scene.calibrates = true);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::arguments;
    use sgrt::testing::{View, globe, trace, wall};
    use std::path::Path;

    fn run_with(list: &[&str]) -> Result<ExitCode> {
        run(&arguments(list))
    }

    fn trace_file(folder: &Path) -> String {
        let path = folder.join("a.raytrace");
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        std::fs::write(&path, trace(&scene, View::default()).to_bytes()).expect("written");
        path.display().to_string()
    }

    #[test]
    fn a_page_names_every_reading_and_the_papers_figures() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = trace_file(folder.path());
        let page = folder.path().join("r.html");
        let html = page.display().to_string();
        run_with(&[&file, "--as", "teapot", "--html", &html, "--csv"]).expect("runs");
        let page = std::fs::read_to_string(page).expect("a page");
        assert!(
            page.contains("1.64") && page.contains("whole-row"),
            "{page}"
        );
    }

    #[test]
    fn labels_to_calibrate_on_must_exist_and_have_published_figures() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = trace_file(folder.path());
        let error = |list: &[&str]| format!("{:#}", run_with(list).unwrap_err());
        let unknown = error(&[&file, "--calibrate", "teapot"]);
        assert!(
            unknown.contains("expected labels of synthetic, found 'teapot'"),
            "{unknown}"
        );
        let unpublished = error(&[&file, "--calibrate", "synthetic"]);
        assert!(
            unpublished.contains("--calibrate synthetic"),
            "{unpublished}"
        );
    }
}
