//! The table: JSON for programs, Markdown for readers.

use super::{Bounds, Outcome, Point, Sweep};
use serde::Serialize;
use std::fmt::Write;

/// Schema of the table.
const SCHEMA: &str = "tracegen.stress/1";

/// All sweeps.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Report {
    schema: &'static str,
    sweeps: Vec<SweepRow>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct SweepRow {
    name: &'static str,
    about: &'static str,
    bounds: Bounds,
    points: Vec<Point>,
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<Report>(SCHEMA)
}

impl Default for Report {
    fn default() -> Self {
        Self {
            schema: SCHEMA,
            sweeps: Vec::new(),
        }
    }
}

impl Report {
    pub(super) fn add(&mut self, sweep: &Sweep, points: Vec<Point>) {
        self.sweeps.push(SweepRow {
            name: sweep.name,
            about: sweep.about,
            bounds: sweep.bounds,
            points,
        });
    }

    /// Points beyond their bounds without the expected warning.
    pub fn broken(&self) -> usize {
        let points = self.sweeps.iter().flat_map(|row| &row.points);
        points.filter(|p| p.outcome == Outcome::Broken).count()
    }

    /// One line per sweep, then a table of points per sweep.
    pub fn markdown(&self) -> String {
        let mut text = String::from(
            "# Numerical stress\n\nCaptures against a reference (see each sweep). Within: the error keeps the bound. Warned: it does not, \
             and the program says so. Refused: exit code 2.\nBroken: neither.\n\n\
             | sweep | points | within | warned | refused | broken | largest error within | bound |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        );
        for row in &self.sweeps {
            let of = |outcome| row.points.iter().filter(move |p| p.outcome == outcome);
            let largest = |figure: fn(&super::Error) -> f64| {
                let errors = of(Outcome::Within).filter_map(|p| p.error.as_ref());
                errors.map(figure).fold(0.0, f64::max)
            };
            let counts = [
                Outcome::Within,
                Outcome::Warned,
                Outcome::Refused,
                Outcome::Broken,
            ]
            .map(|outcome| of(outcome).count().to_string());
            let _ = writeln!(
                text,
                "| {} | {} | {} | {:.4} % of fragments, {:.4} texels | {} %, {} texels |",
                row.name,
                row.points.len(),
                counts.join(" | "),
                largest(|e| e.fragments_pct),
                largest(|e| e.uv_texels),
                row.bounds.fragments_pct,
                row.bounds.uv_texels,
            );
        }
        for row in &self.sweeps {
            let _ = writeln!(
                text,
                "\n## {}\n\n{}\n\n| at | outcome | fragments | differ % | uv texels | said |\n| --- | --- | --- | --- | --- | --- |",
                row.name, row.about
            );
            for point in &row.points {
                let figures = point.error.map_or("- | - | -".to_owned(), |e| {
                    format!(
                        "{} | {:.4} | {:.4}",
                        e.fragments, e.fragments_pct, e.uv_texels
                    )
                });
                let said = point.said.as_deref().unwrap_or("").replace('|', "\\|");
                let outcome = format!("{:?}", point.outcome).to_lowercase();
                let _ = writeln!(text, "| {} | {outcome} | {figures} | {said} |", point.at);
            }
        }
        text
    }
}
