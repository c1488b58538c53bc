//! `replay reproject`: replays ray traces through a ray-tracing GPU model that reuses the left image for
//! the right one.

use super::choice::choice;
use super::outputs::{self, PageOutputs};
use super::reuse_args::ReuseArgs;
use crate::files::{self, write_atomically};
use anyhow::{Context, ensure};
use clap::Args;
use formats::raytrace::Raytrace;
use image_error::{Picture, png};
use report::sgrt::{self as document, Entry, ReprojectReport, Thumbnails};
use report::view_rays::RayMaps;
use sgrt::compose::Reuse;
use sgrt::config::{DEFAULT_TOML, SgrtConfig};
use sgrt::loaded::{LoadedTrace, RuleRun};
use sgrt::picture;
use sgrt::result::{Config, Report, SCHEMA};
use sgrt::timing::Timing;
use sgrt::variations::curve_rules;
use shell::{Output, Progress};
use sim::model_version::RAY_MODEL_VERSION;
use sim::paper::sgrt as paper;
use sim::result::{TOOL, TraceId, scene_name};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `replay reproject`.
#[derive(Clone, Debug, Default, Args)]
#[command(
    mut_arg("csv", outputs::csv_before_traces),
    mut_arg("html", outputs::page_alone),
    mut_arg("json", |json| json.help("Print one JSON object per file, one per line")),
    after_help = "Examples:
  replay reproject teapot.raytrace
  replay reproject teapot.raytrace --preset sgrt-paper
  replay reproject teapot.raytrace --rule none --image plain.png --json
  replay reproject teapot.raytrace --timing cycle
  replay reproject *.raytrace --html out/reprojection.html
  replay reproject chess.raytrace --curve --sensitivity --html chess.html"
)]
pub struct ReprojectArgs {
    /// Ray traces
    #[arg(value_name = "FILE", required_unless_present = "print_config")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reused: ReuseArgs,
    /// Model of the units' time
    #[arg(long, value_parser = choice::<Timing>(), default_value = "closed-form")]
    timing: Timing,
    /// Print the model parameters as TOML (the defaults with comments) and stop
    #[arg(long)]
    print_config: bool,
    /// Add a chart of cycles saved against image error, over rules and levels of reuse
    #[arg(long)]
    curve: bool,
    /// Add the sensitivity of the ratios to halving and doubling each parameter
    #[arg(long)]
    sensitivity: bool,
    #[command(flatten)]
    outputs: PageOutputs,
    /// Scene of the paper to compare with: SCENE for every trace, or LABEL=SCENE; `none` for no comparison
    /// [default: by the name of the scene]
    #[arg(long = "as", value_name = "SCENE")]
    paper_scenes: Vec<String>,
    /// Write the right image, its bad pixels in yellow and its FLIP map side by side (one input file)
    #[arg(long, value_name = "PNG")]
    image: Option<PathBuf>,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read, invalid parameters, or an output that cannot be written.
pub fn run(args: ReprojectArgs) -> anyhow::Result<ExitCode> {
    args.threads.start()?;
    let config = args.reused.parameters()?;
    if args.print_config {
        let text = match (args.reused.preset, &args.reused.config) {
            (None, None) => DEFAULT_TOML.to_owned(),
            _ => toml::to_string(&config)?,
        };
        super::print(&text)?;
        return Ok(ExitCode::SUCCESS);
    }
    ensure!(
        args.image.is_none() || args.files.len() == 1,
        "--image: expected one FILE, found {}",
        args.files.len()
    );
    check_timing(&args)?;
    // Report a wrong --as before the replays.
    paper::values("", "", &args.paper_scenes)?;
    let mut outputs = args.outputs.list::<ReprojectReport>()?;
    let image = args.image.iter();
    outputs.extend(image.map(|path| Output::binary("--image", path)));
    let inputs = args.files.iter().chain(&args.reused.config);
    let prints = files::check_outputs(&outputs, inputs.map(PathBuf::as_path))?;
    let mut entries = Vec::new();
    let progress = Progress::new("reprojecting", args.files.len() as u64, "traces");
    for path in &args.files {
        entries.push(report_on(path, &args, &config)?);
        progress.advance(1);
    }
    drop(progress);
    let report = ReprojectReport { entries };
    args.outputs
        .write(&report, prints, || document::page(&report.entries))?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses options that only the closed form supports.
fn check_timing(args: &ReprojectArgs) -> anyhow::Result<()> {
    for (option, is_given) in [("--curve", args.curve), ("--sensitivity", args.sensitivity)] {
        ensure!(
            !is_given || args.timing == Timing::ClosedForm,
            "{option}: expected --timing closed-form, found --timing {}",
            args.timing.name()
        );
    }
    Ok(())
}

/// The maps of `replay view`: of the default rule and of the plain scheme.
///
/// # Errors
/// As [`run`].
pub(super) fn view(path: &Path) -> anyhow::Result<String> {
    let file = Raytrace::open(path)?;
    let loaded = LoadedTrace::load(&file).with_context(|| path.display().to_string())?;
    let args = ReprojectArgs::default();
    let config = args.reused.parameters()?;
    let (entry, runs) = report_of(path, &file, &loaded, &args, &config)?;
    let maps = RayMaps::new(&entry.report.trace.name, &loaded, &runs)?;
    let report = ReprojectReport {
        entries: vec![entry],
    };
    Ok(maps.page(&report)?)
}

fn report_on(path: &Path, args: &ReprojectArgs, config: &SgrtConfig) -> anyhow::Result<Entry> {
    let file = Raytrace::open(path)?;
    let loaded = LoadedTrace::load(&file).with_context(|| path.display().to_string())?;
    Ok(report_of(path, &file, &loaded, args, config)?.0)
}

fn report_of(
    path: &Path,
    file: &Raytrace,
    loaded: &LoadedTrace<'_>,
    args: &ReprojectArgs,
    config: &SgrtConfig,
) -> anyhow::Result<(Entry, [RuleRun; 2])> {
    let in_file = || path.display().to_string();
    let (rule, reuse) = (args.reused.rule()?, args.reused.reuse());
    let traced = match args.timing {
        Timing::ClosedForm => None,
        Timing::Cycle => Some(loaded.traced_timing(config).with_context(in_file)?),
    };
    let runs = loaded.run_with_plain(&rule, reuse, config, traced.as_ref());
    let [ours, plain] = runs.with_context(in_file)?;
    if let Some(image) = &args.image {
        write_atomically(image, &png::encode(&triptych(&ours))?)?;
    }
    let meta = &loaded.frame().tables.meta;
    let scene = meta.trace.scene.as_str();
    let report = Report {
        schema: SCHEMA.to_owned(),
        tool: TOOL.to_owned(),
        model_version: RAY_MODEL_VERSION,
        trace: TraceId::new(path, &meta.trace, file.content_checksum()),
        scene_triangles: meta.trace.scene_triangles,
        eye_size_px: loaded.frame().size_px,
        rows: loaded.rows().summary,
        config: Config {
            rule,
            reuse,
            cache_misses: loaded.cache_misses().to_owned(),
            timing: args.timing,
            model: config.clone(),
        },
        paper: paper::values(scene, scene_name(scene), &args.paper_scenes)?,
        curve: if args.curve {
            loaded
                .curve(&curve_rules(), &Reuse::ALL, config)
                .with_context(in_file)?
        } else {
            Vec::new()
        },
        sensitivity: if args.sensitivity {
            loaded.sensitivity(&ours, config).with_context(in_file)?
        } else {
            Vec::new()
        },
        result: ours.outcome.clone(),
        plain: plain.outcome.clone(),
    };
    let pictures = if args.outputs.html.is_some() {
        Some(thumbnails(loaded, &ours, &plain)?)
    } else {
        None
    };
    Ok((Entry { report, pictures }, [ours, plain]))
}

/// The right image, its bad pixels, and its error map, side by side.
fn triptych(ours: &RuleRun) -> Picture {
    let bad = picture::bad_pixels(&ours.decisions, &ours.picture);
    Picture::side_by_side(&[&ours.picture, &bad, &ours.flip.picture()], 8)
}

fn thumbnails(loaded: &LoadedTrace, ours: &RuleRun, plain: &RuleRun) -> anyhow::Result<Thumbnails> {
    let small = |p: &Picture| png::encode(&p.shrunk_to(document::THUMBNAIL_PX));
    Ok(Thumbnails {
        left: small(&loaded.left())?,
        bad: small(&picture::bad_pixels(&ours.decisions, &ours.picture))?,
        flip: small(&ours.flip.picture())?,
        plain_bad: small(&picture::bad_pixels(&plain.decisions, &plain.picture))?,
        plain_flip: small(&plain.flip.picture())?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::arguments;
    use sgrt::testing::{View, globe, trace, wall};

    fn args(list: &[&str]) -> ReprojectArgs {
        arguments(list)
    }

    /// A small trace in its own folder.
    fn trace_file() -> (tempfile::TempDir, String) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.raytrace");
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        let bytes = trace(&scene, View::default()).to_bytes();
        std::fs::write(&path, bytes).expect("written");
        (folder, path.display().to_string())
    }

    #[test]
    fn a_trace_file_and_the_same_trace_in_memory_have_equal_results() {
        let (_folder, path) = trace_file();
        let args = args(&[&path]);
        let entry = report_on(Path::new(&path), &args, &SgrtConfig::default()).expect("a report");
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        let source = trace(&scene, View::default());
        let direct = LoadedTrace::load(&source)
            .expect("loads")
            .run(
                &args.reused.rule().expect("a rule"),
                args.reused.reuse(),
                &SgrtConfig::default(),
            )
            .expect("runs");
        assert_eq!(entry.report.result, direct.outcome);
        assert!(entry.report.result.reuse_pct > 80.0);
    }

    #[test]
    fn picture_and_page_are_the_only_files_written() {
        let (folder, path) = trace_file();
        let out = |name: &str| folder.path().join(name).display().to_string();
        let (png, html) = (out("a.png"), out("a.html"));
        run(args(&[&path, "--image", &png, "--html", &html, "--json"])).expect("runs");
        let picture = image::open(&png).expect("a picture").into_rgb8();
        assert_eq!(picture.dimensions(), (3 * 72 + 2 * 8, 40));
        assert!(
            std::fs::read_to_string(&html)
                .expect("a page")
                .contains("91.54")
        );
        assert_eq!(
            std::fs::read_dir(folder.path()).expect("a folder").count(),
            3
        );
    }

    #[test]
    fn a_damaged_trace_is_refused_and_nothing_is_written() {
        let (folder, path) = trace_file();
        let bytes = std::fs::read(&path).expect("readable");
        std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
        let html = folder.path().join("a.html");
        let error = run(args(&[&path, "--html", &html.display().to_string()])).unwrap_err();
        assert!(format!("{error:#}").contains("a.raytrace"), "{error:#}");
        assert!(!html.exists());
    }

    #[test]
    fn a_single_picture_for_several_files_is_refused() {
        let error = run(args(&["a", "b", "--image", "c.png"])).unwrap_err();
        assert_eq!(error.to_string(), "--image: expected one FILE, found 2");
    }

    #[test]
    fn invalid_parameters_are_reported_with_file_and_key() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("p.toml");
        std::fs::write(&path, "[tni]\nunits = 0\n").expect("written");
        let error = super::super::reuse_args::read_config(None, Some(&path)).unwrap_err();
        let text = format!("{error:#}");
        assert!(
            text.contains("p.toml") && text.contains("tni.units"),
            "{text}"
        );
    }
}
