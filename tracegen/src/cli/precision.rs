//! `tracegen precision`.

use clap::Args;
use formats::text::json_text;
use lab::traversal::precision::{Precision, measure};
use lab::traversal::reference::TestMesh;
use serde::Serialize;
use shell::{Output, Progress};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `tracegen precision`.
#[derive(Args, Debug)]
#[command(
    after_help = "The times in the result are of this machine. `replay accuracy --traversal FILE` sets it beside other choices."
)]
pub struct PrecisionArgs {
    /// File for the JSON (schema tracegen.precision/1) [default: standard output].
    #[arg(short, long, value_name = "JSON")]
    output: Option<PathBuf>,
    /// Rays per distance.
    #[arg(long, value_name = "N", default_value_t = 6000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    rays: u32,
}

/// Distances from the origin, metres.
const PLACES_M: [f64; 5] = [0.0, 1e3, 1e5, 1e6, 1e7];

/// Schema of the JSON.
const SCHEMA: &str = "tracegen.precision/1";

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrecisionDocument {
    schema: &'static str,
    tool: String,
    /// The traced mesh.
    mesh: String,
    rows: Vec<PrecisionRow>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrecisionRow {
    arithmetic: &'static str,
    /// Distance from the origin in metres.
    at_m: f64,
    /// Rays whose answer is certain.
    rays: u64,
    /// Percentage of these that hit instead of missing, or miss instead of hitting.
    wrong_pct: f64,
    /// 99th percentile of the relative error of the distance, parts per million.
    distance_ppm: f64,
    /// Time relative to double precision.
    time_ratio: f64,
}

impl From<Precision> for PrecisionRow {
    fn from(row: Precision) -> Self {
        Self {
            arithmetic: row.arithmetic,
            at_m: row.at_m,
            rays: row.rays,
            wrong_pct: row.wrong_pct,
            distance_ppm: row.distance_ppm,
            time_ratio: row.time_ratio,
        }
    }
}

/// The schema of the JSON object.
#[cfg(test)]
pub(crate) fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<PrecisionDocument>(SCHEMA)
}

/// Runs `tracegen precision`.
///
/// # Errors
/// A file that cannot be written.
pub fn run(args: &PrecisionArgs) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.output {
        shell::check_outputs(&[Output::text("--output", path)], None)?;
    }
    let progress = Progress::new("tracing", PLACES_M.len() as u64, "places");
    let mesh = TestMesh::sphere(5);
    let mut rows = Vec::new();
    for at_m in PLACES_M {
        rows.extend(measure(&mesh, at_m, args.rays as usize).map(PrecisionRow::from));
        progress.advance(1);
    }
    drop(progress);
    let document = PrecisionDocument {
        schema: SCHEMA,
        tool: super::tool(),
        mesh: format!("a sphere of 10 m, {} triangles", mesh.triangles.len()),
        rows,
    };
    let text = json_text(&document)?;
    match &args.output {
        Some(path) => shell::write_file(path, text)?,
        None => shell::print(&text)?,
    }
    Ok(ExitCode::SUCCESS)
}
