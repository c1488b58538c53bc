//! Run time against error (`replay.accuracy/1`): tables, a chart a study, and the report's table of
//! errors.

use super::columns::{Column, Records, Row};
use super::errors::KnownError;
use super::html::{self, Section};
use super::plots::lines::Axis;
use super::plots::scatter::{NamedPoint, ScatterChart};
use super::plots::{PlotError, SeriesStyle};
use super::table::Table;
use super::theme;
use crate::accuracy::{ERROR_FIGURES, Estimate, Measured, VARIANTS, Variant};
use crate::config::RunConfig;
use crate::result::TOOL;
use crate::techniques::dominated;
use maud::html;
use serde::Serialize;

/// Schema of `accuracy.json`.
pub const ACCURACY_SCHEMA: &str = "replay.accuracy/1";

/// A variant on a trace.
pub struct VariantRow {
    /// The trace's label.
    pub scene: String,
    /// The variant.
    pub variant: &'static Variant,
    /// How far it is off.
    pub measured: Measured,
}

/// A kind of sample on a trace.
pub struct SampleRow {
    /// The trace's label.
    pub scene: String,
    /// How it does.
    pub estimate: Estimate,
}

/// All that was measured.
pub struct AccuracyReport {
    /// The machine.
    pub config: RunConfig,
    /// Variants by trace.
    pub variants: Vec<VariantRow>,
    /// Samples by trace.
    pub samples: Vec<SampleRow>,
}

impl Row for VariantRow {
    fn columns() -> Vec<Column<'static, Self>> {
        let mut columns = vec![
            Column::text("study", "study", |r: &Self| r.variant.study),
            Column::text("variant", "variant", |r: &Self| r.variant.name),
            Column::text("scene", "scene", |r: &Self| r.scene.clone()),
        ];
        for (index, (key, name, unit)) in ERROR_FIGURES.into_iter().enumerate() {
            let value = move |r: &Self| r.measured.errors[index];
            columns.push(Column::real(key, name, unit, 3, value));
        }
        let form = |r: &Self| r.measured.closed_form_points;
        columns.push(Column::real(
            "closed_form",
            "closed form \u{2212} model",
            "points",
            2,
            form,
        ));
        columns
    }
}

impl Row for SampleRow {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        vec![
            Column::text("scene", "scene", |r: &Self| r.scene.clone()),
            Column::text("of", "sampled", |r: &Self| format!("{:?}", r.estimate.of).to_lowercase()),
            Column::real("one_in", "one in", "", 0, |r: &Self| r.estimate.one_in),
            Column::real("error_pct", "error", "%", 2, |r: &Self| r.estimate.error_pct),
            Column::real("bias_pct", "bias", "%", 2, |r: &Self| r.estimate.bias_pct),
            Column::real("interval_pct", "95 % interval", "\u{b1} %", 2, |r: &Self| r.estimate.interval_pct),
            Column::real("holds_pct", "holds the truth", "%", 1, |r: &Self| r.estimate.holds_pct),
        ]
    }
}

/// A time: what was run, on what, and its ratio.
type Time = (String, String, f64);

/// The JSON object: nothing of it depends on the machine that ran it.
#[derive(Serialize)]
struct Document<'a> {
    schema: &'a str,
    tool: &'a str,
    config: &'a RunConfig,
    variants: Records<'a, 'static, VariantRow>,
    samples: Records<'a, 'static, SampleRow>,
}

impl AccuracyReport {
    /// Errors of the variants.
    #[must_use]
    pub fn variants(&self) -> Table {
        let table = Table::new(&VariantRow::columns(), &self.variants);
        table.grouped_by(2).without_empty_columns()
    }

    /// Errors of the samples.
    #[must_use]
    pub fn samples(&self) -> Table {
        Table::new(&SampleRow::columns(), &self.samples).grouped_by(2)
    }

    /// Times over the reference's; they differ from run to run.
    #[must_use]
    pub fn times(&self) -> Table {
        let variants = self.variants.iter().map(|row| {
            let name = row.variant.name.to_owned();
            (name, row.scene.clone(), row.measured.time_ratio)
        });
        let samples = self.samples.iter().filter_map(|row| {
            let Estimate { of, one_in, .. } = row.estimate;
            let name = format!("one in {one_in} {of:?}").to_lowercase();
            Some((name, row.scene.clone(), row.estimate.time_ratio?))
        });
        let times: Vec<Time> = variants.chain(samples).collect();
        let columns = [
            Column::text("variant", "variant", |t: &Time| t.0.clone()),
            Column::text("scene", "scene", |t: &Time| t.1.clone()),
            Column::real("time_ratio", "time", "\u{d7} reference", 3, |t: &Time| t.2),
        ];
        Table::new(&columns, &times).grouped_by(1)
    }

    /// As one JSON object, without times.
    ///
    /// # Errors
    /// A figure that is not finite.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(&Document {
            schema: ACCURACY_SCHEMA,
            tool: TOOL,
            config: &self.config,
            variants: Records {
                columns: &VariantRow::columns(),
                rows: &self.variants,
            },
            samples: Records {
                columns: &SampleRow::columns(),
                rows: &self.samples,
            },
        })
    }

    /// The rows of the report's table of errors: mean and largest of each contribution; `scenes` says
    /// what they were measured on.
    #[must_use]
    pub fn errors(&self, command: &str, scenes: &str) -> Vec<KnownError> {
        let mut contributions: Vec<_> = VARIANTS.iter().filter_map(|v| v.contribution).collect();
        contributions.dedup();
        let mut errors = Vec::new();
        for (index, (figure, name, unit)) in ERROR_FIGURES.into_iter().enumerate() {
            for contribution in &contributions {
                let rows = self.variants.iter();
                let of = rows.filter(|row| row.variant.contribution == Some(*contribution));
                let found: Vec<f64> = of
                    .filter_map(|row| Some(row.measured.errors[index]?.abs()))
                    .collect();
                if found.is_empty() {
                    continue;
                }
                let round = |value: f64| (value * 1e3).round() / 1e3;
                errors.push(KnownError {
                    figure: figure.to_owned(),
                    name: name.to_owned(),
                    contribution: format!("{contribution:?}").to_lowercase(),
                    mean: round(found.iter().sum::<f64>() / found.len() as f64),
                    largest: round(found.iter().copied().fold(0.0, f64::max)),
                    unit: unit.to_owned(),
                    scenes: scenes.to_owned(),
                    command: command.to_owned(),
                });
            }
        }
        errors
    }

    /// A chart a study: time against the mean absolute error of external bytes.
    #[must_use]
    pub fn charts(&self) -> Vec<(&'static str, ScatterChart)> {
        let mut studies: Vec<&'static str> = VARIANTS.iter().map(|v| v.study).collect();
        studies.dedup();
        studies
            .into_iter()
            .map(|study| (study, self.chart(study)))
            .collect()
    }

    fn chart(&self, study: &'static str) -> ScatterChart {
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mut named: Vec<(String, (f64, f64))> = vec![("reference".to_owned(), (1.0, 0.0))];
        for variant in VARIANTS.iter().filter(|variant| variant.study == study) {
            let rows = || {
                self.variants
                    .iter()
                    .filter(|row| row.variant.name == variant.name)
            };
            let errors = rows()
                .filter_map(|row| Some(row.measured.errors[0]?.abs()))
                .collect();
            let times = rows().map(|row| row.measured.time_ratio).collect();
            named.push((variant.name.to_owned(), (mean(times), mean(errors))));
        }
        let at: Vec<(f64, f64)> = named.iter().map(|(_, at)| *at).collect();
        let points = named.into_iter().zip(dominated(&at));
        ScatterChart {
            title: format!("{study}: time and error of external bytes"),
            x: Axis::linear("time, \u{d7} reference"),
            y: Axis::linear("mean absolute error of external bytes, %"),
            kinds: [
                "no other beats it".to_owned(),
                "another is as good in both".to_owned(),
            ],
            points: points
                .map(|((name, at), dominated)| NamedPoint {
                    style: SeriesStyle {
                        name,
                        color: theme::INK,
                    },
                    at,
                    dominated,
                })
                .collect(),
        }
    }

    /// The page: what was measured, with its charts.
    ///
    /// # Errors
    /// A chart that cannot be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let mut charts = Vec::new();
        for (_, chart) in self.charts() {
            charts.push((chart.svg()?, String::new()));
        }
        let sections = [
            Section::new(
                "In place of another",
                html! {
                    (self.variants().markup())
                    p.note { "The larger error of Morton order and Z2 STA; relative where the unit is %." }
                    (html::figures(&charts))
                },
            ),
            Section::new(
                "Samples",
                html! {
                    p { "External bytes estimated from a part, by textbook intervals. An interval lies where it holds the truth less often than 95 % of the time." }
                    (self.samples().markup())
                },
            ),
            Section::new(
                "Times",
                html! {
                    p { "Over the reference's, or over the whole's; from run to run they differ." }
                    (self.times().markup())
                },
            ),
        ];
        let lead = html! { p { "What a quicker way of counting, or another one, costs in accuracy: " (TOOL) ", one thread." } };
        Ok(html::page(
            "Parallax: run time against error",
            &lead,
            &sections,
        ))
    }
}
