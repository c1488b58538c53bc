//! `replay reproject`: replays ray traces through a ray-tracing GPU model that reuses the left image for
//! the right one.

use super::choice::choice;
use super::outputs::{self, PageOutputs};
use super::reuse_args::ReuseArgs;
use crate::files::{self, write_atomically};
use anyhow::{Context, ensure};
use clap::Args;
use formats::raytrace::{RayKind, Raytrace};
use formats::text::name_of;
use image_error::{Picture, png};
use report::sgrt::{self as document, Entry, ReprojectReport, Thumbnails};
use report::view_rays::RayMaps;
use sgrt::compose::Reuse;
use sgrt::config::{DEFAULT_TOML, SgrtConfig};
use sgrt::hierarchy_update::HierarchyUpdate;
use sgrt::loaded::{LoadedTrace, RuleRun};
use sgrt::picture;
use sgrt::prefetch::RayPrefetching;
use sgrt::ray_kinds::OfKinds;
use sgrt::ray_sort::RaySort;
use sgrt::result::{Config, Report, SCHEMA};
use sgrt::tile_orders::{self, RayOrder, TileSequence};
use sgrt::timing::Timing;
use sgrt::variations::curve_rules;
use shell::{Output, Progress};
use sim::config::BetweenFrames;
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
  replay reproject teapot.raytrace --timing cycle --prefetch ttp
  replay reproject chess.raytrace --order z2-sta+offset
  replay reproject f0.raytrace f1.raytrace f2.raytrace --order trials --between keep
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
    /// What the units fetch ahead into their caches, with --timing cycle [default: none, or the configuration's]
    #[arg(long, value_parser = choice::<RayPrefetching>())]
    prefetch: Option<RayPrefetching>,
    /// The order in which units take the rays of a tile or of a pair of tiles [default: none, or the configuration's]
    #[arg(long, value_name = "SORT", value_parser = choice::<RaySort>())]
    sort_rays: Option<RaySort>,
    #[arg(long, help = tile_orders::help(), value_parser = str::parse::<RayOrder>)]
    order: Option<RayOrder>,
    /// Files are consecutive frames of a path, between which the caches keep, lose-N or flush their lines: lose-N
    /// empties the L1 caches, and other work fills N percent of the L2 [default: each file is a frame of its own]
    #[arg(long, value_name = "CACHES", value_parser = str::parse::<BetweenFrames>)]
    between: Option<BetweenFrames>,
    /// Only rays of these kinds: primary, shadow, reflection, refraction, ambient-occlusion, diffuse [default: all]
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = ray_kind)]
    rays: Vec<RayKind>,
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
    let config = args.parameters()?;
    if args.print_config {
        let text = match (
            args.reused.preset,
            &args.reused.config,
            args.prefetch,
            args.sort_rays,
        ) {
            (None, None, None, None) => DEFAULT_TOML.to_owned(),
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
    let mut tiles = args.tiles();
    for path in &args.files {
        entries.push(report_on(path, &args, &config, &mut tiles)?);
        progress.advance(1);
    }
    drop(progress);
    let report = ReprojectReport { entries };
    args.outputs
        .write(&report, prints, || document::page(&report.entries))?;
    Ok(ExitCode::SUCCESS)
}

impl ReprojectArgs {
    fn parameters(&self) -> anyhow::Result<SgrtConfig> {
        let mut config = self.reused.parameters()?;
        if let Some(prefetcher) = self.prefetch {
            config.cycles.prefetch.prefetcher = prefetcher;
            config.check().context("--prefetch")?;
        }
        config.tni.ray_sort = self.sort_rays.unwrap_or(config.tni.ray_sort);
        Ok(config)
    }

    fn tiles(&self) -> TileSequence {
        TileSequence::new(self.order, self.between)
    }
}

/// The kind of ray of a name.
fn ray_kind(name: &str) -> Result<RayKind, String> {
    let found = RayKind::ALL.into_iter().find(|kind| name_of(kind) == name);
    found.ok_or_else(|| {
        format!(
            "expected {}",
            RayKind::ALL.map(|kind| name_of(&kind)).join(" or ")
        )
    })
}

/// Refuses options that only one model of time supports, or only the default order of tiles.
fn check_timing(args: &ReprojectArgs) -> anyhow::Result<()> {
    ensure!(
        args.timing == Timing::ClosedForm || args.between.is_none(),
        "--between: expected --timing closed-form, found --timing {}",
        args.timing.name()
    );
    ensure!(
        args.timing == Timing::Cycle || args.prefetch.is_none(),
        "--prefetch: expected --timing cycle, found --timing {}",
        args.timing.name()
    );
    for (option, is_given) in [("--curve", args.curve), ("--sensitivity", args.sensitivity)] {
        ensure!(
            !is_given || args.timing == Timing::ClosedForm,
            "{option}: expected --timing closed-form, found --timing {}",
            args.timing.name()
        );
        ensure!(
            !is_given || (args.order.is_none() && args.between.is_none()),
            "{option}: expected neither --order nor --between, because it replays the default order of tiles"
        );
    }
    Ok(())
}

/// The maps of `replay view`: of the default rule and of the plain scheme.
///
/// # Errors
/// As [`run`].
pub(super) fn view(path: &Path) -> anyhow::Result<String> {
    let args = ReprojectArgs::default();
    let config = args.reused.parameters()?;
    let label = path.file_stem().unwrap_or_default().to_string_lossy();
    let maps = |loaded: &LoadedTrace<'_>, runs: &[RuleRun; 2]| RayMaps::new(&label, loaded, runs);
    let (entry, maps) = report_with(path, &args, &config, &mut args.tiles(), maps)?;
    let report = ReprojectReport {
        entries: vec![entry],
    };
    Ok(maps.page(&report)?)
}

fn report_on(
    path: &Path,
    args: &ReprojectArgs,
    config: &SgrtConfig,
    tiles: &mut TileSequence,
) -> anyhow::Result<Entry> {
    Ok(report_with(path, args, config, tiles, |_, _| Ok(()))?.0)
}

/// The figures of a trace, and what `of_runs` takes from its replays.
fn report_with<T>(
    path: &Path,
    args: &ReprojectArgs,
    config: &SgrtConfig,
    tiles: &mut TileSequence,
    of_runs: impl FnOnce(&LoadedTrace<'_>, &[RuleRun; 2]) -> anyhow::Result<T>,
) -> anyhow::Result<(Entry, T)> {
    let file = Raytrace::open(path)?;
    let in_file = || path.display().to_string();
    let of_kinds = OfKinds {
        source: &file,
        kinds: &args.rays,
    };
    let loaded = LoadedTrace::load(&of_kinds).with_context(in_file)?;
    let (rule, reuse) = (args.reused.rule()?, args.reused.reuse());
    let runs = loaded.run_with_plain(&rule, reuse, config, args.timing, tiles);
    let [ours, plain] = runs.with_context(in_file)?;
    let orders = tiles.report();
    tiles.advance();
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
            rays: args.rays.iter().map(name_of).collect(),
            tiles: orders,
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
        hierarchy_update: HierarchyUpdate::of(&loaded.frame().tables.bvh),
    };
    let pictures = if args.outputs.html.is_some() {
        Some(thumbnails(&loaded, &ours, &plain)?)
    } else {
        None
    };
    let seen = of_runs(&loaded, &[ours, plain])?;
    Ok((Entry { report, pictures }, seen))
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
        let entry = report_on(
            Path::new(&path),
            &args,
            &SgrtConfig::default(),
            &mut args.tiles(),
        )
        .expect("a report");
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
    fn a_prefetcher_needs_the_cycle_level_model() {
        let error = run(args(&["a", "--prefetch", "ttp"])).unwrap_err();
        let expected = "--prefetch: expected --timing cycle, found --timing closed-form";
        assert_eq!(error.to_string(), expected);
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
