//! `replay techniques`: compares rendering techniques from the measurements of `tracegen techniques`.

use super::ConfigArgs;
use super::order_arg::parse_orders;
use super::outputs::PageOutputs;
use super::subjects::Traces;
use crate::files;
use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use report::picture::EmbeddedPicture;
use report::techniques::{Scene, TechniquesReport};
use shell::Progress;
use sim::config::{Mode, Order, RunConfig};
use sim::result::scene_name;
use sim::stream::TileSource;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use studies::experiment::{self, Plan, ResultRow, frame_count};
use studies::techniques::{
    CacheFigures, Difference, Folder, Measured, Measures, PictureFigures, Sharing, Timing,
    differences, picture_figures, sharing,
};

/// Arguments of `replay techniques`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay techniques out/plant
  replay techniques out/plant --json
  replay techniques out/plant out/atrium out/jungle --html out/techniques.html
  replay techniques out/plant --orders all --l1 16KiB --csv rows.csv")]
pub struct Args {
    /// Folders that `tracegen techniques` wrote
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Orders to replay with and without each technique, comma-separated, or `all`
    #[arg(
        long,
        value_name = "ORDERS",
        default_value = "morton,z2-lrta,z2-sta,z2-sta-merge"
    )]
    orders: String,
    #[command(flatten)]
    outputs: PageOutputs,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// An invalid folder, an unreadable picture or trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let config = args.machine.resolve_over(RunConfig {
        mode: Mode::Functional,
        order: Order::Z2_STA,
        ..RunConfig::default()
    })?;
    let folders = args.folders.iter().map(|path| Folder::open(path));
    let folders = folders.collect::<Result<Vec<_>, _>>()?;
    check_once(&args.folders)?;
    let prints = check_outputs(args, &folders)?;
    let mut orders = parse_orders(&args.orders)?;
    for order in [Order::MORTON, config.order] {
        if !orders.contains(&order) {
            orders.push(order);
        }
    }

    let pictures = compare_pictures(&folders)?;
    let traces = FolderTraces::open(&folders)?;
    let caches = traces.replay(&config, &orders)?;
    let scenes = labels(&folders);
    let mut measures = Vec::new();
    for (index, folder) in folders.iter().enumerate() {
        let mut rows = Vec::new();
        for (row, pictures) in pictures[index].iter().enumerate() {
            rows.push(measured(
                folder,
                row,
                &scenes[index],
                pictures,
                &caches[index][row],
            )?);
        }
        let mut scene = Measures {
            scene: &scenes[index],
            rows,
        };
        scene.mark_dominated();
        measures.push(scene);
    }
    let report = TechniquesReport {
        scenes: &measures,
        manifests: folders.iter().map(|f| &f.manifest).collect(),
        config,
        orders,
    };
    let mut embedded_pictures = Vec::new();
    if args.outputs.html.is_some() {
        for (index, (folder, figures)) in folders.iter().zip(&pictures).enumerate() {
            let differences = differences(folder, figures, &traces.of_rows(index, folder))?;
            embedded_pictures.push(embedded(folder, differences)?);
        }
    }
    args.outputs
        .write(&report, prints, || report.page(&embedded_pictures))?;
    Ok(ExitCode::SUCCESS)
}

/// Fails if the same folder is given twice, even under different names.
fn check_once(folders: &[PathBuf]) -> Result<()> {
    let place = |folder: &Path| folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    for (index, folder) in folders.iter().enumerate() {
        let before = folders[..index]
            .iter()
            .find(|other| place(other) == place(folder));
        if let Some(other) = before {
            bail!(
                "{}: the same folder as {}",
                folder.display(),
                other.display()
            );
        }
    }
    Ok(())
}

/// Checks the outputs against all files in the folders; returns true if standard output is free for the
/// result.
fn check_outputs(args: &Args, folders: &[Folder]) -> Result<bool> {
    let mut inputs: Vec<PathBuf> = args.machine.file().map(PathBuf::from).into_iter().collect();
    for folder in folders {
        inputs.extend(folder.files()?);
    }
    let outputs = args.outputs.list::<TechniquesReport>()?;
    files::check_outputs(&outputs, inputs.iter().map(PathBuf::as_path))
}

/// Scene names of the folders; folders of the same scene get their own names in addition.
fn labels(folders: &[Folder]) -> Vec<String> {
    let scene = |folder: &Folder| scene_name(&folder.manifest.scene).to_owned();
    let scenes: Vec<String> = folders.iter().map(scene).collect();
    let label = |(index, name): (usize, &String)| {
        if scenes.iter().filter(|other| *other == name).count() == 1 {
            name.clone()
        } else {
            format!("{name} ({})", folders[index].name())
        }
    };
    scenes.iter().enumerate().map(label).collect()
}

fn compare_pictures(folders: &[Folder]) -> Result<Vec<Vec<PictureFigures>>> {
    let count = |folder: &Folder| 2 * folder.manifest.frames.len() * folder.manifest.rows.len();
    let all: usize = folders.iter().map(count).sum();
    let progress = Progress::new("comparing", all as u64, "pictures");
    let figures = folders.iter().map(|folder| {
        picture_figures(folder, &|done| progress.advance(done)).map_err(anyhow::Error::from)
    });
    figures.collect()
}

/// Cache figures of a row: one entry per order, and the sharing between the eyes.
type RowCaches = (Vec<CacheFigures>, Option<Sharing>);

/// The traces of all folders.
struct FolderTraces {
    traces: Traces,
    /// Folder and row of each trace.
    rows: Vec<(usize, usize)>,
    /// Rows of each folder.
    counts: Vec<usize>,
}

impl FolderTraces {
    fn open(folders: &[Folder]) -> Result<Self> {
        let (mut paths, mut rows) = (Vec::new(), Vec::new());
        for (index, folder) in folders.iter().enumerate() {
            for (row, of_row) in folder.manifest.rows.iter().enumerate() {
                if let Some(trace) = &of_row.trace {
                    paths.push(folder.file(trace)?);
                    rows.push((index, row));
                }
            }
        }
        let traces = Traces::open(&paths)?;
        for (id, (folder, row)) in traces.ids().zip(&rows) {
            folders[*folder].check_trace(*row, &id.checksum)?;
        }
        Ok(Self {
            traces,
            rows,
            counts: folders.iter().map(|f| f.manifest.rows.len()).collect(),
        })
    }

    /// Replays every trace in every order.
    fn replay(&self, config: &RunConfig, orders: &[Order]) -> Result<Vec<Vec<RowCaches>>> {
        let caches_bytes = [(config.level.l1.size_bytes, config.level.l2.size_bytes)];
        let plan = Plan::paper(*config, &caches_bytes, orders, false)?;
        let subjects = self.traces.subjects();
        let replays = (subjects.len() * (plan.points.len() + 1)) as u64;
        let progress = Progress::new("replaying", replays, "replays");
        let outcome = experiment::run(&plan, &subjects, None, &|done| progress.advance(done))?;
        super::warnings::of_outcome(&outcome);
        let shared = subjects
            .par_iter()
            .map(|subject| {
                let shared = sharing(subject.source, config);
                progress.advance(1);
                shared.with_context(|| subject.label.clone())
            })
            .collect::<Result<Vec<_>>>()?;
        let none = |count: &usize| vec![(Vec::new(), None); *count];
        let mut caches: Vec<Vec<RowCaches>> = self.counts.iter().map(none).collect();
        let results = outcome.rows();
        for ((&(folder, row), of_trace), shared) in self
            .rows
            .iter()
            .zip(results.chunks(plan.points.len()))
            .zip(shared)
        {
            caches[folder][row] = (of_trace.iter().map(cache_figures).collect(), Some(shared));
        }
        Ok(caches)
    }

    /// The traces of a folder by row; `None` for rows without a trace.
    fn of_rows(&self, folder: usize, of: &Folder) -> Vec<Option<&dyn TileSource>> {
        let mut out: Vec<Option<&dyn TileSource>> = vec![None; of.manifest.rows.len()];
        for (trace, (index, row)) in self.traces.sources().zip(&self.rows) {
            if *index == folder {
                out[*row] = Some(trace);
            }
        }
        out
    }
}

fn cache_figures(row: &ResultRow) -> CacheFigures {
    let result = row.result;
    CacheFigures {
        order: row.point.config.order,
        footprints: result.footprints,
        l1_footprint_miss_pct: 100.0 * result.l1.footprint_miss_rate,
        l2_line_miss_pct: 100.0 * result.l2.line_miss_rate,
        external_bytes: result.external_bytes,
        bound_bytes: row.bound_bytes(),
        frames: frame_count(row.subject.source.tables()),
    }
}

fn measured<'a>(
    folder: &'a Folder,
    row: usize,
    scene: &'a str,
    pictures: &PictureFigures,
    (caches, sharing): &RowCaches,
) -> Result<Measured<'a>> {
    let manifest = &folder.manifest;
    let of_row = &manifest.rows[row];
    let timing = Timing::of(of_row);
    Ok(Measured {
        scene,
        manifest,
        row: of_row,
        baseline: manifest.baseline_row().context("no baseline")?,
        timing: timing.with_context(|| format!("{}: no frame times", of_row.technique))?,
        worst_frame: manifest.frames[pictures.worst_frame],
        pictures: pictures.clone(),
        caches: caches.clone(),
        sharing: *sharing,
        dominated: false,
        dominated_in: Vec::new(),
    })
}

fn embedded(folder: &Folder, differences: Vec<Difference>) -> Result<Scene> {
    let embed = |difference: Difference| {
        let title = &folder.manifest.rows[difference.row].title;
        let picture = EmbeddedPicture::of(title, &difference.picture)?;
        Ok((difference, picture))
    };
    Ok(Scene {
        differences: differences.into_iter().map(embed).collect::<Result<_>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::arguments;
    use serde_json::Value;
    use std::fs;
    use std::path::Path;
    use studies::techniques::testing;

    fn run_on(folders: &[&Path], page: &Path) -> Result<ExitCode> {
        let mut line = vec!["--csv".to_owned()];
        line.push(page.with_extension("rows").display().to_string());
        line.extend(["--html".to_owned(), page.display().to_string()]);
        line.extend(folders.iter().map(|f| f.display().to_string()));
        run(&arguments(line))
    }

    #[test]
    fn a_folder_given_under_two_names_is_recognised() {
        let folder = tempfile::tempdir().unwrap();
        let (one, other) = (folder.path().join("a"), folder.path().join("b"));
        for path in [&one, &other] {
            std::fs::create_dir(path).unwrap();
        }
        check_once(&[one.clone(), other.clone()]).unwrap();
        let error = check_once(&[one.clone(), other, folder.path().join("b/../a")]).unwrap_err();
        assert!(
            error.to_string().contains(&one.display().to_string()),
            "{error}"
        );
    }

    #[test]
    fn rows_and_page_of_a_folder_are_written_reproducibly() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("plant");
        testing::folder(&folder);
        let page = root.path().join("out/page.html");
        run_on(&[&folder], &page).unwrap();
        let read = |extension: &str| fs::read_to_string(page.with_extension(extension)).unwrap();
        let first = ["html", "json", "csv", "rows"].map(read);
        run_on(&[&folder], &page).unwrap();
        assert_eq!(first, ["html", "json", "csv", "rows"].map(read));
        assert_eq!(first[2], first[3]);

        let json: Value = serde_json::from_str(&first[1]).unwrap();
        assert_eq!(json["schema"], "replay.techniques/2");
        let rows = json["rows"].as_array().unwrap();
        let names: Vec<&Value> = rows.iter().map(|r| &r["technique"]).collect();
        assert_eq!(names, ["per-eye", "superfrustum", "grey"]);
        for (row, ratio) in rows.iter().zip([1.0, 0.5, 0.8]) {
            assert!((row["frame_time_ratio"].as_f64().unwrap() - ratio).abs() < 1e-9);
            assert!(row["external_bytes"].as_u64().unwrap() > 0);
            assert_eq!(row["false_negatives"], 0);
            assert_eq!(row["false_positives"], 9);
        }
        assert_eq!(rows[1]["cull_tests_ratio"], 0.5);
        assert_eq!(rows[1]["flip_mean"], 0.0);
        assert!(rows[2]["flip_mean"].as_f64().unwrap() > 0.0);
        // The grey corner takes more time than the superfrustum and has an error.
        let dominated: Vec<&Value> = rows.iter().map(|r| &r["dominated"]).collect();
        assert_eq!(dominated, [true, false, true]);
        // The published saving of frustum tests is next to the measured one.
        assert_eq!(json["published"][0]["published_pct"], "up to 50");
        assert_eq!(json["published"][0]["ours_pct"], 50.0);
        for text in [
            "a processor's",
            "plant: run time against error",
            "4.00 pixels per degree",
            "Tile orders with and without",
            "data:image/jpeg",
        ] {
            assert!(first[0].contains(text), "{text}");
        }
    }

    #[test]
    fn an_output_inside_an_input_folder_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("plant");
        testing::folder(&folder);
        let manifest = folder.join("manifest.json");
        let before = fs::read(&manifest).unwrap();
        let page = folder.join("manifest.html");
        let error = run_on(&[&folder], &page).unwrap_err().to_string();
        assert!(error.contains("manifest.json"), "{error}");
        assert_eq!(fs::read(&manifest).unwrap(), before);
    }

    #[test]
    fn a_trace_that_is_damaged_is_named() {
        let root = tempfile::tempdir().unwrap();
        testing::folder(root.path());
        let trace = root.path().join("traces/grey.textrace");
        fs::write(&trace, b"PLXTRACE").unwrap();
        let page = root.path().join("page.html");
        let error = format!("{:#}", run_on(&[root.path()], &page).unwrap_err());
        assert!(error.contains("grey.textrace"), "{error}");
    }

    #[test]
    fn folders_of_one_scene_are_labelled_with_their_names() {
        let root = tempfile::tempdir().unwrap();
        let paths = ["one", "two"].map(|name| root.path().join(name));
        for path in &paths {
            testing::folder(path);
        }
        let folders = paths.each_ref().map(|path| Folder::open(path).unwrap());
        assert_eq!(labels(&folders), ["plant (one)", "plant (two)"]);
        assert_eq!(labels(&folders[..1]), ["plant"]);
    }
}
