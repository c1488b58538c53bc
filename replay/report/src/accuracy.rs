//! Run time against error (`replay.accuracy/3`): a table and a chart per study, the recommended choices,
//! and the table of errors on reports.

use super::answers;
use super::columns::{Column, Columns, Kind, Value, columns_of};
use super::document::Document;
use super::errors::KnownError;
use super::html::{self, Answer, Page};
use super::lists::unique;
use super::plots::bars::{BarChart, BarGroup};
use super::plots::lines::Axis;
use super::plots::scatter::{NamedPoint, ScatterChart};
use super::plots::{PlotError, SeriesStyle};
use super::table::{Style, Table};
use super::theme;
use maud::{Markup, html};
use serde::Serialize;
use sim::config::RunConfig;
use sim::result::TOOL;
use studies::accuracy::{Choice, Contribution, Metric, Study, headline_figures};
use studies::techniques::dominated;

/// The estimate of one sample, in tables of the studies of samples.
const ESTIMATE: Metric = Metric {
    key: "estimate_pct",
    name: "one estimate",
    unit: "% of all",
};

/// A study with its measurements.
pub struct Measured {
    /// The study.
    pub study: &'static Study,
    /// Its choices on each scene; not empty.
    pub choices: Vec<Choice>,
}

/// All measurements.
pub struct AccuracyReport {
    /// The machine.
    pub config: RunConfig,
    /// Version of the ray-tracing models, if a study used them.
    pub ray_model_version: Option<u32>,
    /// Studies that had inputs.
    pub studies: Vec<Measured>,
}

/// Mean and maximum of absolute values; `None` if there are none.
fn mean_and_largest(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let values: Vec<f64> = values.map(f64::abs).collect();
    let largest = values.iter().copied().reduce(f64::max)?;
    Some((values.iter().sum::<f64>() / values.len() as f64, largest))
}

impl Measured {
    /// Columns of its choices. Times are optional because they differ from run to run.
    fn columns(&self, times: bool) -> Vec<Column<'static, Choice>> {
        let mut columns = columns_of::<Choice>()
            .text("scene", "on", |c| c.scene.clone())
            .text("choice", "choice", |c| c.name.clone());
        if times {
            columns.push(Column::real(
                "time_ratio",
                "time",
                "\u{d7}",
                3,
                |c: &Choice| c.time_ratio,
            ));
        }
        for (index, figure) in self.study.figures.iter().enumerate() {
            let decimals = if figure.unit.is_empty() { 4 } else { 3 };
            let value = move |c: &Choice| c.values[index];
            columns.push(Column::real(
                figure.key,
                figure.name,
                figure.unit,
                decimals,
                value,
            ));
        }
        if self.choices.iter().any(|c| c.estimate_pct.is_some()) {
            let Metric { key, name, unit } = ESTIMATE;
            let value = |c: &Choice| c.estimate_pct.clone();
            columns.push(Column::real(key, name, unit, 1, value));
        }
        columns
    }

    /// One row per choice and scene, with times.
    pub fn table(&self) -> Table {
        Table::new(&self.columns(true), &self.choices)
            .grouped_by(1)
            .without_empty_columns()
    }

    /// Names of its choices, in order of first occurrence.
    fn names(&self) -> Vec<&str> {
        unique(self.choices.iter().map(|choice| choice.name.as_str()))
    }

    fn of<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Choice> {
        self.choices.iter().filter(move |c| c.name == name)
    }

    /// Mean time of a choice and the mean of its absolute error.
    fn time_and_error(&self, name: &str) -> Option<(f64, f64)> {
        let (time, _) = mean_and_largest(self.of(name).filter_map(|c| c.time_ratio))?;
        let (error, _) = mean_and_largest(self.of(name).filter_map(|c| c.values[0]))?;
        Some((time, error))
    }

    /// Chart of the estimates, with their intervals or bounds; `None` without estimates.
    fn estimates(&self) -> Option<BarChart> {
        let names = self.names();
        let scenes = unique(self.choices.iter().map(|choice| choice.scene.as_str()));
        let group = |scene: &&str| {
            let of = |name: &str| {
                let mut choices = self.choices.iter();
                choices.find(|c| c.name == name && c.scene == *scene)
            };
            let figures: Vec<_> = (names.iter())
                .map(|name| of(name).and_then(|c| c.estimate_pct.as_ref()))
                .collect();
            BarGroup {
                label: (*scene).to_owned(),
                values: figures.iter().map(|f| Some(f.as_ref()?.value)).collect(),
                ends: figures
                    .iter()
                    .map(|f| f.map(|f| [f.low.max(0.0), f.high]))
                    .collect(),
                ..BarGroup::default()
            }
        };
        let groups: Vec<BarGroup> = scenes.iter().map(group).collect();
        let any = groups.iter().any(|group| group.numbers().next().is_some());
        any.then(|| BarChart {
            title: format!("{}: one estimate each", self.study.title),
            value_label: "estimated external bytes, % of those of the whole trace".to_owned(),
            group_label: "trace".to_owned(),
            series: (0..)
                .zip(&names)
                .map(|(i, name)| SeriesStyle::nth(*name, i))
                .collect(),
            groups,
            reference: Some(100.0),
            ..BarChart::default()
        })
    }

    /// Chart of time against error; `None` if no choice has both.
    pub fn chart(&self) -> Option<ScatterChart> {
        let names = self.names();
        let mut named: Vec<(&str, (f64, f64))> = Vec::new();
        // The choices of a study may include its reference.
        if !names.contains(&self.study.reference) {
            named.push((self.study.reference, (1.0, 0.0)));
        }
        let names = names.into_iter();
        named.extend(names.filter_map(|name| Some((name, self.time_and_error(name)?))));
        if named.len() < 2 {
            return None;
        }
        let at: Vec<(f64, f64)> = named.iter().map(|(_, at)| *at).collect();
        let points = named.into_iter().zip(dominated(&at));
        let error = self.study.figures[0];
        let unit = if error.unit.is_empty() { "" } else { ", " };
        Some(ScatterChart {
            title: self.study.title.to_owned(),
            x: Axis::linear(format!("time of {}, \u{d7}", self.study.time)),
            y: Axis::from_zero(
                format!("{}{unit}{}, mean", error.name, error.unit),
                at.iter().map(|at| at.1),
            ),
            kinds: [
                "not dominated".to_owned(),
                "dominated: another is as good in both".to_owned(),
            ],
            points: points
                .map(|((name, at), dominated)| NamedPoint {
                    style: SeriesStyle {
                        name: name.to_owned(),
                        color: theme::INK,
                    },
                    at,
                    dominated,
                })
                .collect(),
        })
    }
}

/// A row of the table of recommended choices, one per study.
struct Advice<'a> {
    study: &'a Study,
    /// Mean time over the reference's time.
    time: Option<f64>,
    /// Mean and maximum of the absolute error; `None` for the reference.
    error: Option<(f64, f64)>,
}

/// The JSON object. It has no values that depend on the host machine.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct AccuracyJson<'a> {
    /// Version of the ray-tracing models, if a study used them. `model_version` is that of the texture models.
    #[serde(skip_serializing_if = "Option::is_none")]
    ray_model_version: Option<u32>,
    config: &'a RunConfig,
    studies: Vec<StudyJson<'a>>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct StudyJson<'a> {
    key: &'a str,
    title: &'a str,
    about: &'a str,
    reference: &'a str,
    recommended: &'a str,
    reason: &'a str,
    #[cfg_attr(feature = "testing", schemars(with = "Vec<serde_json::Value>"))]
    choices: Table,
}

impl Document for AccuracyReport {
    const SCHEMA: &'static str = "replay.accuracy/3";

    /// Without times.
    fn content(&self) -> impl Serialize {
        let study = |measured: &Measured| StudyJson {
            key: measured.study.key,
            title: measured.study.title,
            about: measured.study.about,
            reference: measured.study.reference,
            recommended: measured.study.recommended,
            reason: measured.study.reason,
            choices: Table::new(&measured.columns(false), &measured.choices),
        };
        AccuracyJson {
            ray_model_version: self.ray_model_version,
            config: &self.config,
            studies: self.studies.iter().map(study).collect(),
        }
    }

    /// Every value of every choice, one per line.
    fn rows(&self) -> Table {
        type Line<'a> = (&'a Study, &'a Choice, &'a Metric, Value);
        let lines: Vec<Line<'_>> = (self.studies.iter())
            .flat_map(|m| m.choices.iter().map(|choice| (m.study, choice)))
            .flat_map(|(study, choice)| {
                let values = choice.values.iter().map(|value| (*value).into());
                let values = values.chain([choice.estimate_pct.clone().into()]);
                let metrics = study.figures.iter().chain([&ESTIMATE]).zip(values);
                metrics.map(move |(metric, value)| (study, choice, metric, value))
            })
            .filter(|line| line.3 != Value::None)
            .collect();
        let columns = columns_of::<Line<'_>>()
            .text("study", "study", |l| l.0.key)
            .text("choice", "choice", |l| l.1.name.clone())
            .text("scene", "scene", |l| l.1.scene.clone())
            .text("figure", "figure", |l| l.2.key)
            .real("value", "value", "", 6, |l| l.3.clone())
            .change_last(|column| column.kind(Kind::Real))
            .text("unit", "unit", |l| l.2.unit);
        Table::new(&columns, &lines)
    }

    fn text(&self, style: Style) -> String {
        let mut text = self.advice(true).styled(style);
        for measured in &self.studies {
            let Study { title, about, .. } = measured.study;
            text += &format!("\n{title}: {about}\n{}", measured.table().styled(style));
        }
        text
    }
}

impl AccuracyReport {
    /// The recommended choice of each study and its error, optionally with its time.
    pub fn advice(&self, times: bool) -> Table {
        let advice: Vec<Advice<'_>> = (self.studies.iter())
            .map(|measured| {
                let study = measured.study;
                let is_reference = study.recommended == study.reference;
                let of = || measured.of(study.recommended);
                let time = mean_and_largest(of().filter_map(|c| c.time_ratio));
                let error = mean_and_largest(of().filter_map(|c| c.values[0]));
                Advice {
                    study,
                    time: time.map(|t| t.0).or(is_reference.then_some(1.0)),
                    error: error.or(is_reference.then_some((0.0, 0.0))),
                }
            })
            .collect();
        let mut columns = columns_of::<Advice<'_>>()
            .text("study", "study", |a| a.study.title)
            .text("recommended", "recommended", |a| a.study.recommended);
        if times {
            columns.push(Column::real(
                "time_ratio",
                "time",
                "\u{d7}",
                2,
                |a: &Advice<'_>| a.time,
            ));
        }
        columns = columns
            .text("figure", "error of", |a| a.study.figures[0].name)
            .real("mean", "mean", "", 3, |a| a.error.map(|e| e.0))
            .real("largest", "largest", "", 3, |a| a.error.map(|e| e.1))
            .text("unit", "", |a| a.study.figures[0].unit)
            .text("reason", "because", |a| a.study.reason);
        Table::new(&columns, &advice)
    }

    /// Times over the reference's time, as CSV. They differ from run to run.
    pub fn times_csv(&self) -> String {
        type TimeLine<'a> = (&'a Study, &'a Choice);
        let lines: Vec<TimeLine<'_>> = (self.studies.iter())
            .flat_map(|m| m.choices.iter().map(|choice| (m.study, choice)))
            .filter(|(_, choice)| choice.time_ratio.is_some())
            .collect();
        let columns = columns_of::<TimeLine<'_>>()
            .text("study", "study", |l| l.0.key)
            .text("choice", "choice", |l| l.1.name.clone())
            .text("scene", "scene", |l| l.1.scene.clone())
            .real("time_ratio", "time", "\u{d7}", 3, |l| l.1.time_ratio);
        Table::new(&columns, &lines).csv()
    }

    /// The rows of the table of errors on reports: mean and maximum of each contribution, and the scenes on
    /// which they were measured. `size` adds the image size to a scene's name.
    pub fn errors(&self, command: &str, size: &dyn Fn(&str) -> String) -> Vec<KnownError> {
        let mut errors = Vec::new();
        for figure in headline_figures() {
            for contribution in Contribution::ALL {
                let mut scenes: Vec<String> = Vec::new();
                let mut values = Vec::new();
                for measured in &self.studies {
                    let keys = measured.study.figures.iter();
                    let Some(index) = keys.into_iter().position(|f| f.key == figure.key) else {
                        continue;
                    };
                    let of = measured.choices.iter();
                    for choice in of.filter(|c| c.contribution == Some(contribution)) {
                        let Some(value) = choice.values[index] else {
                            continue;
                        };
                        values.push(value);
                        let scene = size(&choice.scene);
                        if !scenes.contains(&scene) {
                            scenes.push(scene);
                        }
                    }
                }
                let Some((mean, largest)) = mean_and_largest(values.into_iter()) else {
                    continue;
                };
                let round = |value: f64| (value * 1e4).round() / 1e4;
                errors.push(KnownError {
                    figure: figure.key.to_owned(),
                    name: figure.name.to_owned(),
                    contribution: contribution.name().to_owned(),
                    mean: round(mean),
                    largest: round(largest),
                    unit: figure.unit.to_owned(),
                    scenes: scenes.join(", "),
                    command: command.to_owned(),
                });
            }
        }
        errors
    }

    /// The page: the recommended choices, and one section per study.
    ///
    /// # Errors
    /// A chart that cannot be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let mut page = Page::default();
        page.add(
            "What to choose",
            html! {
                p { "The recommended choice of each study, its time over the time of the study's reference, and its error: mean and maximum over the scenes. Times differ from run to run." }
                // The sections of the studies show the reasons.
                @let advice = self.advice(true);
                @let keys = advice.headings.iter().map(|h| h.key.as_ref()).filter(|key| *key != "reason");
                (advice.picked(keys).markup())
            },
        );
        for measured in &self.studies {
            page.add(measured.study.title, section(measured)?);
        }
        let about = html! { p { "Run time and error of faster methods (" (TOOL) "), measured one after another on one thread." } };
        let chart = self.studies.iter().find_map(Measured::chart);
        let chart = html::chart(chart.map(|chart| chart.svg()), "")?;
        let recommended: Vec<_> = (self.studies.iter())
            .map(|measured| {
                let study = measured.study;
                let times = measured.of(study.recommended).filter_map(|c| c.time_ratio);
                let time = mean_and_largest(times).map(|t| t.0);
                let is_reference = study.recommended == study.reference;
                (study.title.to_owned(), time, is_reference)
            })
            .collect();
        let answer = Answer {
            sentences: answers::recommended(&recommended),
            chart,
            about,
        };
        Ok(page.text("Parallax: run time against error", &answer))
    }
}

fn section(measured: &Measured) -> Result<Markup, PlotError> {
    let study = measured.study;
    let chart = measured.chart().map(|chart| chart.svg());
    let chart = chart
        .into_iter()
        .chain(measured.estimates().map(|chart| chart.svg()));
    Ok(html! {
        p { (study.about) }
        p { "Recommended: " strong { (study.recommended) } ", " (study.reason) "." }
        (html::charts(chart)?)
        (measured.table().markup())
        p.note { "Time: " (study.time) "." }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::figure::{Because, Figure};
    use studies::accuracy::STUDIES;

    fn report() -> AccuracyReport {
        let study = STUDIES.iter().find(|s| s.key == "mode").unwrap();
        let choice = |scene: &str, time, bytes| Choice {
            name: "functional".into(),
            scene: scene.into(),
            contribution: Some(Contribution::Timing),
            time_ratio: Some(time),
            values: vec![Some(bytes), Some(0.1), None, None, None, None],
            estimate_pct: None,
        };
        AccuracyReport {
            config: RunConfig::default(),
            ray_model_version: None,
            studies: vec![Measured {
                study,
                choices: vec![choice("a", 0.2, -0.5), choice("b", 0.4, 0.1)],
            }],
        }
    }

    #[test]
    fn errors_are_means_and_maxima_of_absolute_values_with_their_scenes() {
        let errors = report().errors("replay accuracy", &|scene| format!("{scene} 1x1"));
        assert_eq!(errors.len(), 2);
        let bytes = &errors[0];
        assert_eq!(
            (bytes.figure.as_str(), bytes.contribution.as_str()),
            ("external_bytes", "timing")
        );
        assert_eq!((bytes.mean, bytes.largest), (0.3, 0.5));
        assert_eq!(bytes.scenes, "a 1x1, b 1x1");
    }

    #[test]
    fn times_are_on_the_page_and_in_a_separate_table_but_not_in_the_results() {
        let report = report();
        // The mean over both scenes of the recommended choice's times.
        assert_eq!(report.advice(true).cells()[0][2], "0.30");
        assert_eq!(report.studies[0].table().cells()[0][2], "0.200");
        assert!(report.times_csv().contains("0.2"));
        assert!(!report.json().unwrap().contains("time_ratio"));
        assert!(!report.csv().contains("time_ratio"));
        let page = report.page().unwrap();
        for text in ["Functional or timed", "0.200", "what to choose"] {
            assert!(page.to_lowercase().contains(&text.to_lowercase()), "{text}");
        }
    }

    #[test]
    fn an_estimate_has_its_ends_in_every_output() {
        let mut report = report();
        let because = Because::Sampling {
            method: "Student's t",
            n: 4,
            of: 16,
            degrees_of_freedom: 3.0,
        };
        let estimate = Figure::sampled(101.0, 2.5, 0.95, because);
        report.studies[0].choices[0].estimate_pct = Some(estimate);
        let json: serde_json::Value = serde_json::from_str(&report.json().unwrap()).unwrap();
        let row = &json["studies"][0]["choices"][0];
        let figure = &row["figures"]["estimate_pct"];
        assert_eq!(
            (&row["estimate_pct"], &figure["high"]),
            (&101.0.into(), &103.5.into())
        );
        assert_eq!(
            (&figure["confidence"], &figure["because"]["n"]),
            (&0.95.into(), &4.into())
        );
        assert!(json["studies"][0]["choices"][1].get("figures").is_none());
        let csv = report.csv();
        assert!(csv.starts_with("study,choice,scene,figure,value,value_low,value_high,unit"));
        assert!(
            csv.contains("estimate_pct,101,98.5,103.5,% of all"),
            "{csv}"
        );
        assert!(
            report
                .text(Style::Terminal)
                .contains("101.0 (98.5 to 103.5)")
        );
        assert!(report.page().unwrap().contains("one estimate each"));
    }

    #[test]
    fn a_chart_has_the_reference_and_one_point_per_choice() {
        let chart = report().studies[0].chart().unwrap();
        let names: Vec<&str> = chart.points.iter().map(|p| p.style.name.as_str()).collect();
        assert_eq!(names, ["timed", "functional"]);
        assert!(
            (chart.points[1].at.0 - 0.3).abs() < 1e-9 && (chart.points[1].at.1 - 0.3).abs() < 1e-9
        );
    }
}
