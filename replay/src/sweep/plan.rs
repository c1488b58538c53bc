//! An experiment file and the points that it stands for.
//!
//! ```toml
//! traces = ["crytek.textrace"]      # beside the file; the command line's traces win
//! [base]                            # any key of the replay configuration
//! mode = "functional"
//! [axes]                            # crossed with one another
//! order = ["morton", "z2-sta"]
//! l1.size_bytes = ["8KiB", "16KiB"]
//! [one-at-a-time]                   # each value alone, the rest as in base; crossed with axes
//! layout.block_order = ["morton", "tiled"]
//! ```

use crate::config::RunConfig;
use serde::{Deserialize, Serialize};
use thiserror::Error;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// More points than this are taken for a mistake.
pub const MOST_POINTS: usize = 100_000;

/// An experiment that cannot be planned; every text names the line.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// No TOML.
    #[error("line {line}: {message}")]
    Syntax {
        /// Line from 1.
        line: usize,
        /// The parser's words.
        message: String,
    },
    /// A key that the experiment or the configuration does not have, or a value it does not take.
    #[error("line {line}: `{key}`: {message}")]
    Key {
        /// Line from 1.
        line: usize,
        /// Key with dots.
        key: String,
        /// Expected and found.
        message: String,
    },
    /// A configuration that no machine can have.
    #[error("point {point}: {message}")]
    Point {
        /// What is set at the point.
        point: String,
        /// What is wrong.
        message: String,
    },
    /// Too many points.
    #[error("expected at most {MOST_POINTS} points, found {found}")]
    TooMany {
        /// Points.
        found: usize,
    },
}

/// A key and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Key of the configuration, with dots.
    pub key: String,
    /// Values in the order of the file.
    pub values: Vec<Value>,
}

/// A parsed experiment file.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Traces that it names.
    pub traces: Vec<String>,
    /// The base configuration.
    pub base: RunConfig,
    /// Axes that are crossed, in the order of the file; the last one runs fastest.
    pub axes: Vec<Axis>,
    /// Values that are tried alone.
    pub one_at_a_time: Vec<Axis>,
}

/// One configuration of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Values of the axes, in their order.
    pub settings: Vec<(String, Value)>,
    /// The value that is tried alone, if any.
    pub change: Option<(String, Value)>,
    /// The whole configuration.
    pub config: RunConfig,
}

impl Point {
    /// `order=z2-sta l1.size_bytes=8KiB`, with the change at the end.
    #[must_use]
    pub fn title(&self) -> String {
        let parts: Vec<String> = self
            .settings
            .iter()
            .chain(&self.change)
            .map(|(key, value)| format!("{key}={}", plain(value)))
            .collect();
        if parts.is_empty() {
            "base".to_owned()
        } else {
            parts.join(" ")
        }
    }
}

/// A value without quotes.
#[must_use]
pub fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// A key with dots, its line and its value.
type Leaf<'a, 'i> = (String, usize, &'a DeValue<'i>);

impl Experiment {
    /// Parses an experiment file.
    ///
    /// # Errors
    /// Syntax, an unknown key, a value that its key does not take; each with its line.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        let line_at = |offset: usize| 1 + text.bytes().take(offset).filter(|b| *b == b'\n').count();
        let document = DeTable::parse(text).map_err(|e| PlanError::Syntax {
            line: line_at(e.span().map_or(0, |s| s.start)),
            message: e.message().to_owned(),
        })?;
        let mut experiment = Self {
            traces: Vec::new(),
            base: RunConfig::default(),
            axes: Vec::new(),
            one_at_a_time: Vec::new(),
        };
        let mut base = defaults();
        // Axes are checked against the base, wherever the file has it.
        let mut sections: Vec<_> = document.get_ref().iter().collect();
        sections.sort_by_key(|(key, _)| (key.get_ref() != "base", key.span().start));
        for (key, value) in sections {
            let at = |message: String| PlanError::Key {
                line: line_at(key.span().start),
                key: key.get_ref().to_string(),
                message,
            };
            match (key.get_ref().as_ref(), value.get_ref()) {
                ("traces", DeValue::Array(traces)) => {
                    for trace in traces.iter() {
                        let name = trace.get_ref().as_str();
                        let name = name.ok_or_else(|| at("expected paths".to_owned()))?;
                        experiment.traces.push(name.to_owned());
                    }
                }
                ("base", DeValue::Table(table)) => {
                    for (key, line, value) in leaves(table, &line_at) {
                        let value = to_value(value).map_err(|m| key_error(line, &key, m))?;
                        set(&mut base, &key, value);
                        experiment.base = parsed(&base).map_err(|m| key_error(line, &key, m))?;
                    }
                }
                ("axes", DeValue::Table(table)) => experiment.axes = axes(table, &base, &line_at)?,
                ("one-at-a-time", DeValue::Table(table)) => {
                    experiment.one_at_a_time = axes(table, &base, &line_at)?;
                }
                (name @ ("traces" | "base" | "axes" | "one-at-a-time"), other) => {
                    let expected = if name == "traces" {
                        "a list"
                    } else {
                        "a table"
                    };
                    return Err(at(format!(
                        "expected {expected}, found {}",
                        other.type_str()
                    )));
                }
                _ => {
                    return Err(at(
                        "unknown key, expected one of traces, base, axes, one-at-a-time".to_owned(),
                    ));
                }
            }
        }
        Ok(experiment)
    }

    /// Every point: the product of the axes, each with the base and with every single change.
    ///
    /// # Errors
    /// Too many points, or one whose configuration is impossible.
    pub fn points(&self) -> Result<Vec<Point>, PlanError> {
        let mut changes: Vec<Option<(String, Value)>> = vec![None];
        for axis in &self.one_at_a_time {
            changes.extend(
                axis.values
                    .iter()
                    .map(|v| Some((axis.key.clone(), v.clone()))),
            );
        }
        let found = self
            .axes
            .iter()
            .map(|a| a.values.len())
            .try_fold(changes.len(), usize::checked_mul)
            .unwrap_or(usize::MAX);
        if found > MOST_POINTS {
            return Err(PlanError::TooMany { found });
        }
        let mut grid: Vec<Vec<(String, Value)>> = vec![Vec::new()];
        for axis in &self.axes {
            grid = grid
                .iter()
                .flat_map(|settings| {
                    axis.values.iter().map(move |value| {
                        let mut longer = settings.clone();
                        longer.push((axis.key.clone(), value.clone()));
                        longer
                    })
                })
                .collect();
        }
        let base = to_table(&self.base);
        let mut points = Vec::with_capacity(found);
        for change in &changes {
            for settings in &grid {
                let mut table = base.clone();
                for (key, value) in settings.iter().chain(change) {
                    set(&mut table, key, value.clone());
                }
                let mut point = Point {
                    settings: settings.clone(),
                    change: change.clone(),
                    config: self.base,
                };
                let checked = parsed(&table)
                    .and_then(|c| c.validate().map(|()| c).map_err(|e| e.to_string()));
                point.config = checked.map_err(|message| PlanError::Point {
                    point: point.title(),
                    message,
                })?;
                points.push(point);
            }
        }
        Ok(points)
    }
}

fn key_error(line: usize, key: &str, message: String) -> PlanError {
    PlanError::Key {
        line,
        key: key.to_owned(),
        message,
    }
}

/// The axes of a section, in the order of the file, every value checked against the base.
fn axes(
    table: &DeTable,
    base: &Table,
    line_at: &dyn Fn(usize) -> usize,
) -> Result<Vec<Axis>, PlanError> {
    leaves(table, line_at)
        .into_iter()
        .map(|(key, line, value)| {
            let values = match to_value(value).map_err(|m| key_error(line, &key, m))? {
                Value::Array(values) if !values.is_empty() => values,
                other => {
                    let message = format!("expected a list of values, found {other}");
                    return Err(key_error(line, &key, message));
                }
            };
            for value in &values {
                let mut table = base.clone();
                set(&mut table, &key, value.clone());
                parsed(&table).map_err(|m| key_error(line, &key, m))?;
            }
            Ok(Axis { key, values })
        })
        .collect()
}

/// The leaves of nested tables with dotted keys, in the order of the file.
fn leaves<'a, 'i>(table: &'a DeTable<'i>, line_at: &dyn Fn(usize) -> usize) -> Vec<Leaf<'a, 'i>> {
    fn walk<'a, 'i>(
        table: &'a DeTable<'i>,
        prefix: &str,
        out: &mut Vec<(usize, String, &'a DeValue<'i>)>,
    ) {
        for (key, value) in table.iter() {
            let path = if prefix.is_empty() {
                key.get_ref().to_string()
            } else {
                format!("{prefix}.{}", key.get_ref())
            };
            match value.get_ref() {
                DeValue::Table(inner) => walk(inner, &path, out),
                leaf => out.push((key.span().start, path, leaf)),
            }
        }
    }
    let mut found = Vec::new();
    walk(table, "", &mut found);
    found.sort_by_key(|(start, _, _)| *start);
    found
        .into_iter()
        .map(|(start, path, leaf)| (path, line_at(start), leaf))
        .collect()
}

fn to_value(value: &DeValue) -> Result<Value, String> {
    match value {
        DeValue::String(text) => Ok(Value::String(text.to_string())),
        DeValue::Boolean(flag) => Ok(Value::Boolean(*flag)),
        DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
            .map(Value::Integer)
            .map_err(|e| format!("{}: {e}", number.as_str())),
        DeValue::Float(number) => number
            .as_str()
            .parse()
            .map(Value::Float)
            .map_err(|e| format!("{}: {e}", number.as_str())),
        DeValue::Array(items) => items
            .iter()
            .map(|i| to_value(i.get_ref()))
            .collect::<Result<_, _>>()
            .map(Value::Array),
        other => Err(format!(
            "expected text, a number or a list, found {}",
            other.type_str()
        )),
    }
}

/// Sets a dotted key, making the tables on its way.
fn set(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
        }
        Some((first, rest)) => {
            let inner = table
                .entry(first)
                .or_insert_with(|| Value::Table(Table::new()));
            if !inner.is_table() {
                *inner = Value::Table(Table::new());
            }
            if let Value::Table(inner) = inner {
                set(inner, rest, value);
            }
        }
    }
}

fn to_table(config: &RunConfig) -> Table {
    Table::try_from(config).unwrap_or_default()
}

fn defaults() -> Table {
    to_table(&RunConfig::default())
}

fn parsed(table: &Table) -> Result<RunConfig, String> {
    RunConfig::deserialize(Value::Table(table.clone())).map_err(|e| e.message().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Mode, Order};

    const FILE: &str = "traces = [\"a.textrace\"]\n\n[base]\nmode = \"functional\"\n\n[axes]\norder = [\"morton\", \"z2-sta\"]\nl1.size_bytes = [\"8KiB\", \"16KiB\"]\n\n[one-at-a-time]\nlayout.block_order = [\"morton\"]\n";

    #[test]
    fn axes_are_crossed_and_changes_come_alone() {
        let points = Experiment::parse(FILE).unwrap().points().unwrap();
        let titles: Vec<String> = points.iter().map(Point::title).collect();
        assert_eq!(titles.len(), 8);
        assert_eq!(titles[1], "order=morton l1.size_bytes=16KiB");
        assert_eq!(
            titles[7],
            "order=z2-sta l1.size_bytes=16KiB layout.block_order=morton"
        );
        assert!(points.iter().all(|p| p.config.mode == Mode::Functional));
        assert_eq!(points[3].config.order, Order::Z2_STA);
        assert_eq!(points[3].config.l1.size_bytes, 16 << 10);
        assert_eq!(points[3].config.l1.ways, 4);
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_line() {
        let error = Experiment::parse("[axes]\norder = [\"morton\"]\nl3.size_bytes = [\"1MiB\"]\n")
            .unwrap_err();
        let text = error.to_string();
        assert!(
            text.starts_with(
                "line 3: `l3.size_bytes`: unknown field `l3`, expected one of `mode`, `order`"
            ),
            "{text}"
        );
    }

    #[test]
    fn an_unknown_section_is_refused_with_its_line() {
        assert_eq!(
            Experiment::parse("[base]\nseed = 2\n[axis]\n")
                .unwrap_err()
                .to_string(),
            "line 3: `axis`: unknown key, expected one of traces, base, axes, one-at-a-time"
        );
    }

    #[test]
    fn a_value_that_a_key_does_not_take_is_refused() {
        let text = Experiment::parse("[axes]\n\norder = [\"spiral\"]\n")
            .unwrap_err()
            .to_string();
        assert!(
            text.starts_with("line 3: `order`: unknown variant `spiral`"),
            "{text}"
        );
        let text = Experiment::parse("[axes]\norder = \"morton\"\n")
            .unwrap_err()
            .to_string();
        assert_eq!(
            text,
            "line 2: `order`: expected a list of values, found \"morton\""
        );
    }

    #[test]
    fn the_example_experiments_can_be_planned() {
        let caches = Experiment::parse(include_str!("../../experiments/caches.toml")).unwrap();
        assert_eq!(caches.points().unwrap().len(), 48);
        let choices =
            Experiment::parse(include_str!("../../experiments/open-choices.toml")).unwrap();
        assert_eq!(choices.points().unwrap().len() % 3, 0);
    }

    #[test]
    fn an_impossible_point_is_named() {
        let experiment =
            Experiment::parse("[axes]\nl1.size_bytes = [\"8KiB\", \"6KiB\"]\n").unwrap();
        let text = experiment.points().unwrap_err().to_string();
        assert!(
            text.starts_with("point l1.size_bytes=6KiB: L1 cache of 6 KiB"),
            "{text}"
        );
    }

    #[test]
    fn a_syntax_error_names_its_line() {
        let text = Experiment::parse("[base]\nseed = = 1\n")
            .unwrap_err()
            .to_string();
        assert!(text.starts_with("line 2: "), "{text}");
    }

    #[test]
    fn millions_of_points_are_refused_before_they_are_made() {
        let values: Vec<String> = (1..=400).map(|i| i.to_string()).collect();
        let file = format!(
            "[axes]\nseed = [{0}]\ntmu.threads = [{0}]\n",
            values.join(",")
        );
        assert_eq!(
            Experiment::parse(&file).unwrap().points().unwrap_err(),
            PlanError::TooMany { found: 160_000 }
        );
    }
}
