//! Arguments that `replay paper` and `replay report` share: what to vary, and what to write.

use super::ConfigArgs;
use crate::config::{Order, RunConfig};
use crate::paper::{Z2_CACHES_KIB, Z2_ORDERS, Z2_SCENES};
use crate::report::files::write_atomically;
use crate::report::picture::Picture;
use crate::report::z2::experiment::{Plan, Subject, labels, twin_of};
use crate::report::z2::model::PaperReport;
use crate::report::z2::{page, tables};
use anyhow::{Context, Result, bail, ensure};
use shell::Progress;
use std::path::{Path, PathBuf};

/// Arguments of the Z2 paper's experiment.
#[derive(Debug, clap::Args)]
pub struct ExperimentArgs {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    machine: ConfigArgs,
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
    /// Scene of the paper to set beside: SCENE for every trace, or LABEL=SCENE; `none` for none
    #[arg(long = "as", value_name = "SCENE")]
    twins: Vec<String>,
    /// Picture of both eyes for the page, LABEL=FILE (or FILE for a single trace)
    #[arg(long = "image", value_name = "LABEL=FILE")]
    images: Vec<String>,
    #[command(flatten)]
    threads: shell::Threads,
}

impl ExperimentArgs {
    /// Replays every point. Progress goes to stderr.
    ///
    /// # Errors
    /// Wrong arguments, an unreadable trace.
    pub fn run(&self, functional: bool, tile_maps: bool) -> Result<PaperReport> {
        self.threads.start()?;
        let base = self.machine.resolve()?;
        let usual = RunConfig::default();
        ensure!(
            base.order == usual.order,
            "--order is varied here; use --orders"
        );
        ensure!(
            (base.l1.size_bytes, base.l2.size_bytes) == (usual.l1.size_bytes, usual.l2.size_bytes),
            "--l1 and --l2 are varied here; use --caches"
        );
        let plan = Plan {
            base,
            caches_bytes: parse_caches(&self.caches)?,
            orders: parse_orders(&self.orders)?,
            functional,
            tile_maps,
        };
        let opened = self
            .traces
            .iter()
            .map(|path| super::open_textrace(path))
            .collect::<Result<Vec<_>>>()?;
        let names = labels(
            &opened
                .iter()
                .map(|(t, id)| (t.tables(), id))
                .collect::<Vec<_>>(),
        );
        let subjects: Vec<Subject> = opened
            .iter()
            .zip(names)
            .map(|((trace, id), label)| {
                Ok(Subject {
                    source: trace,
                    id: id.clone(),
                    twin: twin(&self.twins, &label)?.unwrap_or_else(|| twin_of(trace.tables())),
                    label,
                })
            })
            .collect::<Result<_>>()?;
        let replays = plan.replays(subjects.len()) as u64;
        let progress = Progress::new("replaying", replays, "replays");
        Ok(plan.run(&subjects, &|| progress.advance(1))?)
    }

    /// The pictures that were asked for, each with its trace's label.
    ///
    /// # Errors
    /// A label that no trace has, a file that is no picture.
    pub fn pictures(&self, report: &PaperReport) -> Result<Vec<Picture>> {
        let known: Vec<&str> = report.traces.iter().map(|t| t.label.as_str()).collect();
        self.images
            .iter()
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
                Picture::open(label, Path::new(path))
            })
            .collect()
    }
}

/// Writes the page, and the same numbers beside it as JSON and CSV.
///
/// # Errors
/// A plot that cannot be drawn, a file that cannot be written.
pub fn write_page(report: &PaperReport, pictures: &[Picture], path: &Path) -> Result<()> {
    let html = page::page(report, pictures)?;
    let mut json = serde_json::to_vec(report).context("report as JSON")?;
    json.push(b'\n');
    write_atomically(&path.with_extension("json"), &json)?;
    write_atomically(&path.with_extension("csv"), tables::csv(report).as_bytes())?;
    write_atomically(path, html.as_bytes())
}

/// Names the traces whose orders replayed different accesses; `Ok` when there are none.
///
/// # Errors
/// The differing runs.
pub fn check_conservation(report: &PaperReport) -> std::result::Result<(), String> {
    let wrong: Vec<String> = report
        .conservation
        .iter()
        .filter(|c| !c.differing.is_empty())
        .map(|c| format!("{}: {}", c.scene, c.differing.join(", ")))
        .collect();
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!(
        "orders replayed different accesses: {}",
        wrong.join("; ")
    ))
}

fn parse_orders(text: &str) -> Result<Vec<Order>> {
    if text == "all" {
        let others = Order::all().filter(|o| !Z2_ORDERS.contains(o));
        return Ok(Z2_ORDERS.into_iter().chain(others).collect());
    }
    let mut orders = Vec::new();
    for name in text.split(',').map(str::trim) {
        let Some(order) = Order::find(name) else {
            let known: Vec<&str> = Order::all().map(|o| o.name()).collect();
            bail!(
                "--orders: expected `all` or some of {}, found `{name}`",
                known.join(", ")
            );
        };
        if !orders.contains(&order) {
            orders.push(order);
        }
    }
    Ok(orders)
}

fn parse_caches(text: &str) -> Result<Vec<(u64, u64)>> {
    let kib = |number: &str| {
        number
            .trim()
            .parse::<u64>()
            .ok()
            .filter(|n| (1..=1 << 20).contains(n))
    };
    text.split(',')
        .map(|pair| {
            let sizes = pair
                .split_once('/')
                .and_then(|(l1, l2)| Some((kib(l1)? << 10, kib(l2)? << 10)));
            sizes.with_context(|| {
                let usual = Z2_CACHES_KIB.map(|(l1, l2)| format!("{l1}/{l2}")).join(",");
                format!("--caches: expected L1/L2 in KiB as in {usual}, found `{pair}`")
            })
        })
        .collect()
}

/// The twin that the arguments give to a label: `None` leaves it to the scene's name.
fn twin(twins: &[String], label: &str) -> Result<Option<Option<String>>> {
    let mut found = None;
    for entry in twins {
        let (name, scene) = entry
            .rsplit_once('=')
            .map_or((None, entry.as_str()), |(n, s)| (Some(n), s));
        ensure!(
            scene == "none" || Z2_SCENES.contains(&scene),
            "--as: expected none or one of {}, found `{scene}`",
            Z2_SCENES.join(", ")
        );
        if name.is_none_or(|n| n == label) {
            found = Some((scene != "none").then(|| scene.to_owned()));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_orders_begin_with_the_papers() {
        let orders = parse_orders("all").unwrap();
        assert_eq!(orders[..3], Z2_ORDERS);
        assert_eq!(orders.len(), Order::all().len());
    }

    #[test]
    fn an_unknown_order_is_named_with_the_known_ones() {
        let known: Vec<&str> = Order::all().map(Order::name).collect();
        assert_eq!(
            parse_orders("morton,spiral").unwrap_err().to_string(),
            format!(
                "--orders: expected `all` or some of {}, found `spiral`",
                known.join(", ")
            )
        );
    }

    #[test]
    fn cache_sizes_are_in_kib() {
        assert_eq!(
            parse_caches("8/128, 16/256").unwrap(),
            [(8192, 131_072), (16_384, 262_144)]
        );
        assert_eq!(
            parse_caches("8-128").unwrap_err().to_string(),
            "--caches: expected L1/L2 in KiB as in 8/128,16/128,8/256,16/256, found `8-128`"
        );
    }

    #[test]
    fn a_twin_can_be_given_for_one_label_or_for_all() {
        let twins = ["crytek-sponza".to_owned(), "b=none".to_owned()];
        assert_eq!(
            twin(&twins, "a").unwrap(),
            Some(Some("crytek-sponza".to_owned()))
        );
        assert_eq!(twin(&twins, "b").unwrap(), Some(None));
        assert_eq!(twin(&[], "a").unwrap(), None);
        assert!(
            twin(&["x".to_owned()], "a")
                .unwrap_err()
                .to_string()
                .starts_with("--as: expected none or one of")
        );
    }
}
