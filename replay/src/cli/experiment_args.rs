//! Arguments that `replay paper` and `replay report` share: axes and outputs.

use super::ConfigArgs;
use super::order_arg::parse_orders;
use super::subjects::{Traces, replayed};
use crate::files;
use anyhow::{Context, Result, bail, ensure};
use rayon::prelude::*;
use report::picture::EmbeddedPicture;
use report::z2::model::PaperReport;
use shell::Output;
use sim::config::RunConfig;
use sim::paper::{self, z2};
use sim::size::parse_bytes;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use studies::experiment::{Plan, Subject};

/// Arguments of the Z2 paper's experiment.
#[derive(Debug, clap::Args)]
pub(super) struct ExperimentArgs {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    /// Orders to compare, comma-separated, or `all`
    #[arg(long, value_name = "ORDERS", default_value = "morton,z2-lrta,z2-sta")]
    orders: String,
    /// L1/L2 sizes in KiB, comma-separated
    #[arg(
        long,
        value_name = "L1/L2,...",
        default_value = "8/128,16/128,8/256,16/256"
    )]
    caches: String,
    /// Scene of the paper to compare with: SCENE for every trace, or LABEL=SCENE; `none` for no comparison
    #[arg(long = "as", value_name = "SCENE")]
    stand_ins: Vec<String>,
    /// Rendered picture of both eyes for the page: LABEL=FILE (or FILE if there is one trace)
    #[arg(long = "image", value_name = "LABEL=FILE")]
    images: Vec<String>,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    machine: ConfigArgs,
}

impl ExperimentArgs {
    /// Replays every point and passes the report, the pictures, and whether standard output is free to `write`.
    /// Returns exit code 1 if the orders replayed different accesses. Checks `outputs` first.
    ///
    /// # Errors
    /// Wrong arguments, an unreadable trace or picture, an output that cannot be written, or an error of
    /// `write`.
    pub fn run(
        &self,
        outputs: &[Output],
        functional: bool,
        tile_maps: bool,
        write: impl FnOnce(&PaperReport, &[EmbeddedPicture], bool) -> Result<()>,
    ) -> Result<ExitCode> {
        self.threads.start()?;
        let base = self.machine.resolve_without_preset()?;
        refuse_varied(&base, &RunConfig::default())?;
        let images = self.images.iter().map(|image| {
            let file = image
                .split_once('=')
                .map_or(image.as_str(), |(_, file)| file);
            Path::new(file)
        });
        let traces = self.traces.iter().map(PathBuf::as_path);
        let prints =
            files::check_outputs(outputs, traces.chain(images).chain(self.machine.file()))?;
        let caches = parse_caches(&self.caches)?;
        let mut plan = Plan::paper(base, &caches, &parse_orders(&self.orders)?, functional)?;
        if let Some(preset) = self.machine.preset() {
            ensure!(
                preset.machine().is_none(),
                "--preset: expected z2-paper, whose rates are counted as the paper's, found {}; replay run and replay orders take it",
                preset.name()
            );
            ensure!(
                base.is_looping(),
                "--preset: it is compared with the timed model; leave out --mode"
            );
            plan = plan.beside(preset, self.machine.resolve()?)?;
        }
        if tile_maps {
            plan = plan.with_tile_maps();
        }
        let traces = Traces::open(&self.traces)?;
        let mut subjects = traces.subjects();
        self.choose_stand_ins(&mut subjects)?;
        let pictures = self.pictures(&subjects)?;
        let outcome = replayed(&plan, &subjects, None)?;
        shell::note(&outcome.shared());
        let report = PaperReport::new(&outcome);
        write(&report, &pictures, prints)?;
        if let Some(problem) = report.not_conserved() {
            shell::error(&problem);
            return Ok(ExitCode::FAILURE);
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Sets the scenes of `--as`, which override those found by the scenes' names.
    fn choose_stand_ins(&self, subjects: &mut [Subject]) -> Result<()> {
        let labels: Vec<String> = subjects.iter().map(|s| s.label.clone()).collect();
        for (label, _) in self.stand_ins.iter().filter_map(|s| s.rsplit_once('=')) {
            ensure!(
                labels.iter().any(|known| known == label),
                "--as: expected one of {}, found `{label}`",
                labels.join(", ")
            );
        }
        for subject in subjects {
            if let Some(scene) =
                paper::assigned_scene(&self.stand_ins, &subject.label, &z2::SCENES)?
            {
                subject.stand_in_for = scene;
            }
        }
        Ok(())
    }

    /// True if the page shows pictures.
    pub(super) fn has_pictures(&self) -> bool {
        !self.images.is_empty()
    }

    /// The pictures of `--image`, each with the label of its trace.
    ///
    /// # Errors
    /// A label that no trace has, or a file that is not a picture.
    fn pictures(&self, subjects: &[Subject]) -> Result<Vec<EmbeddedPicture>> {
        let known: Vec<&str> = subjects.iter().map(|s| s.label.as_str()).collect();
        let pictures: Vec<Result<EmbeddedPicture>> = self
            .images
            .par_iter()
            .map(|image| {
                let (label, path) = match image.split_once('=') {
                    Some((label, path)) => (label, path),
                    None if known.len() == 1 => (known[0], image.as_str()),
                    None => bail!(
                        "--image {image}: expected LABEL=FILE with one of {}",
                        known.join(", ")
                    ),
                };
                ensure!(
                    known.contains(&label),
                    "--image {image}: expected one of {}, found {label}",
                    known.join(", ")
                );
                EmbeddedPicture::open(label, Path::new(path))
            })
            .collect();
        // Report the first error in the order of the arguments.
        pictures.into_iter().collect()
    }
}

/// Refuses flags of settings that the command varies.
///
/// # Errors
/// A setting that differs from the `usual` one.
pub(super) fn refuse_varied(base: &RunConfig, usual: &RunConfig) -> Result<()> {
    ensure!(
        base.order == usual.order,
        "--order is varied here; use --orders"
    );
    refuse_sizes(base, usual)
}

/// As [`refuse_varied`], of the sizes alone.
///
/// # Errors
/// As above.
pub(super) fn refuse_sizes(base: &RunConfig, usual: &RunConfig) -> Result<()> {
    let [sizes, usual_sizes] = [base, usual].map(|config| {
        let level = &config.level;
        [level.l1.size_bytes, level.l2.size_bytes]
    });
    ensure!(
        sizes == usual_sizes,
        "--l1 and --l2 are varied here; use --caches"
    );
    Ok(())
}

/// Parses L1 and L2 sizes, such as `8/128,16KiB/1MiB`, to bytes. Numbers without a unit are KiB.
///
/// # Errors
/// Any other syntax.
pub(super) fn parse_caches(text: &str) -> Result<Vec<(u64, u64)>> {
    let bytes = |size: &str| {
        let size = size.trim();
        let bytes = match size.parse::<u64>() {
            Ok(kib) => kib.checked_mul(1 << 10),
            Err(_) => parse_bytes(size).ok(),
        };
        bytes.filter(|bytes| (1..=1 << 30).contains(bytes))
    };
    text.split(',')
        .map(|pair| {
            let sizes = pair
                .split_once('/')
                .and_then(|(l1, l2)| Some((bytes(l1)?, bytes(l2)?)));
            sizes.with_context(|| {
                let usual = z2::CACHES_KIB
                    .map(|(l1, l2)| format!("{l1}/{l2}"))
                    .join(",");
                format!("--caches: expected L1/L2 as in {usual} (KiB) or 8KiB/1MiB, found `{pair}`")
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cache_sizes_are_in_kib_or_have_a_unit() {
        assert_eq!(
            parse_caches("8/128, 16/256").unwrap(),
            [(8192, 131_072), (16_384, 262_144)]
        );
        assert_eq!(
            parse_caches("4KiB/1MiB, 512B/8").unwrap(),
            [(4096, 1 << 20), (512, 8192)]
        );
        assert_eq!(
            parse_caches("8-128").unwrap_err().to_string(),
            "--caches: expected L1/L2 as in 8/128,16/128,8/256,16/256 (KiB) or 8KiB/1MiB, found `8-128`"
        );
    }
}
