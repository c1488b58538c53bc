//! An experiment file: traces, a base configuration, and the values to vary.
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
//!
//! The key `caches` sets the sizes of L1 and L2 together, as in `caches = ["8/128", "16/256"]`.

use super::keys::{parsed, set};
use super::plan::{Axis, MOST_POINTS, Plan, PlanError};
use sim::config::RunConfig;
use std::collections::HashSet;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// A parsed experiment file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExperimentFile {
    /// Traces named in the file.
    pub traces: Vec<String>,
    /// The base configuration.
    pub base: RunConfig,
    /// Axes to be crossed, in file order; the last one varies fastest.
    pub axes: Vec<Axis>,
    /// Values tried one at a time.
    pub one_at_a_time: Vec<Axis>,
}

/// A leaf of the document: dotted key, position of the key, and value.
type Leaf<'a, 'i> = (String, usize, &'a DeValue<'i>);

/// An error at a key, and the key's position in the text.
struct KeyError {
    offset: usize,
    key: String,
    message: String,
}

impl ExperimentFile {
    /// Parses an experiment file.
    ///
    /// # Errors
    /// A syntax error, an unknown key or an invalid value, each with its line.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        read(text, Self::read)
    }

    fn read(document: &DeTable) -> Result<Self, KeyError> {
        let mut file = Self::default();
        let mut base = to_table(&file.base);
        // Axes are checked against the base, wherever it stands in the file.
        let mut sections: Vec<_> = document.iter().collect();
        sections.sort_by_key(|(key, _)| (key.get_ref() != "base", key.span().start));
        for (key, value) in sections {
            let fault = |message: String| KeyError {
                offset: key.span().start,
                key: key.get_ref().to_string(),
                message,
            };
            match (key.get_ref().as_ref(), value.get_ref()) {
                ("traces", DeValue::Array(traces)) => {
                    for trace in traces.iter() {
                        let name = trace.get_ref().as_str();
                        let name = name.ok_or_else(|| fault("expected paths".to_owned()))?;
                        file.traces.push(name.to_owned());
                    }
                }
                ("base", DeValue::Table(table)) => file.base = with_keys(&mut base, table)?,
                ("axes", DeValue::Table(table)) => file.axes = axes(table, &base)?,
                ("one-at-a-time", DeValue::Table(table)) => {
                    file.one_at_a_time = axes(table, &base)?;
                }
                (name @ ("traces" | "base" | "axes" | "one-at-a-time"), other) => {
                    let expected = if name == "traces" {
                        "a list"
                    } else {
                        "a table"
                    };
                    let found = other.type_str();
                    return Err(fault(format!("expected {expected}, found {found}")));
                }
                _ => {
                    return Err(fault(
                        "unknown key, expected one of traces, base, axes, one-at-a-time".to_owned(),
                    ));
                }
            }
        }
        Ok(file)
    }

    /// Adds an axis `KEY=V1,V2,...`, whose values are numbers, booleans or text.
    ///
    /// # Errors
    /// Another syntax, a second axis of the same key, or a value that the key does not take.
    pub fn add_axis(&mut self, text: &str) -> Result<(), String> {
        let axis =
            Axis::parse(text).ok_or_else(|| format!("expected KEY=V1,V2,..., found `{text}`"))?;
        if self.axes.iter().any(|known| known.key == axis.key) {
            return Err(format!(
                "`{}`: expected one list of values, found two",
                axis.key
            ));
        }
        for value in &axis.values {
            let mut table = to_table(&self.base);
            set(&mut table, &axis.key, value.clone());
            parsed(&table).map_err(|message| format!("`{}`: {message}", axis.key))?;
        }
        self.axes.push(axis);
        Ok(())
    }

    /// All points of the file.
    ///
    /// # Errors
    /// Too many points, or an impossible configuration.
    pub fn plan(&self) -> Result<Plan, PlanError> {
        Plan::cross(self.base, &self.axes, &self.one_at_a_time)
    }
}

/// Parses a configuration file: its keys override the defaults.
///
/// # Errors
/// As [`ExperimentFile::parse`].
pub fn parse_config(text: &str) -> Result<RunConfig, PlanError> {
    read(text, |document| {
        with_keys(&mut to_table(&RunConfig::default()), document)
    })
}

/// Reads a document, adding lines to errors.
fn read<T>(text: &str, content: impl Fn(&DeTable) -> Result<T, KeyError>) -> Result<T, PlanError> {
    let line_at = |offset: usize| 1 + text.bytes().take(offset).filter(|b| *b == b'\n').count();
    let document = DeTable::parse(text).map_err(|e| PlanError::Syntax {
        line: line_at(e.span().map_or(0, |s| s.start)),
        message: brief(e.message()),
    })?;
    content(document.get_ref()).map_err(|fault| PlanError::Key {
        line: line_at(fault.offset),
        key: brief(&fault.key),
        message: brief(&fault.message),
    })
}

/// Sets the keys of a table in a configuration.
fn with_keys(config: &mut Table, table: &DeTable) -> Result<RunConfig, KeyError> {
    let mut last = parsed(config).unwrap_or_default();
    for (key, offset, value) in leaves(table)? {
        let found = to_value(value).and_then(|value| {
            set(config, &key, value);
            parsed(config)
        });
        last = found.map_err(|message| KeyError {
            offset,
            key,
            message,
        })?;
    }
    Ok(last)
}

/// The beginning of a text, which may quote a whole file.
fn brief(text: &str) -> String {
    const LONGEST_CHARS: usize = 500;
    match text.char_indices().nth(LONGEST_CHARS) {
        Some((end, _)) => format!("{}\u{2026}", &text[..end]),
        None => text.to_owned(),
    }
}

/// The axes of a section, in file order, with every value checked against the base.
fn axes(table: &DeTable, base: &Table) -> Result<Vec<Axis>, KeyError> {
    let axis = |key: &str, value: &DeValue| {
        let values = match to_value(value)? {
            Value::Array(values) if values.len() > MOST_POINTS => {
                let found = values.len();
                return Err(format!(
                    "expected at most {MOST_POINTS} values, found {found}"
                ));
            }
            Value::Array(values) if !values.is_empty() => values,
            other => return Err(format!("expected a list of values, found {other}")),
        };
        let mut table = base.clone();
        for value in &values {
            set(&mut table, key, value.clone());
            parsed(&table)?;
        }
        Ok(Axis {
            key: key.to_owned(),
            values,
        })
    };
    leaves(table)?
        .into_iter()
        .map(|(key, offset, value)| {
            axis(&key, value).map_err(|message| KeyError {
                offset,
                key,
                message,
            })
        })
        .collect()
}

/// The leaves of nested tables with dotted keys, in file order. A key can be written in several ways
/// (`"l1.ways"`, `l1.ways`), but only once.
fn leaves<'a, 'i>(table: &'a DeTable<'i>) -> Result<Vec<Leaf<'a, 'i>>, KeyError> {
    fn walk<'a, 'i>(table: &'a DeTable<'i>, prefix: &str, out: &mut Vec<Leaf<'a, 'i>>) {
        for (key, value) in table.iter() {
            let path = format!("{prefix}{}", key.get_ref());
            match value.get_ref() {
                DeValue::Table(inner) if !inner.is_empty() => {
                    walk(inner, &format!("{path}."), out);
                }
                leaf => out.push((path, key.span().start, leaf)),
            }
        }
    }
    let mut out = Vec::new();
    walk(table, "", &mut out);
    out.sort_by_key(|(_, offset, _)| *offset);
    let mut known = HashSet::new();
    match out.iter().find(|(key, ..)| !known.insert(key.as_str())) {
        None => Ok(out),
        Some((key, offset, _)) => Err(KeyError {
            offset: *offset,
            key: key.clone(),
            message: "duplicate key".to_owned(),
        }),
    }
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
        DeValue::Table(table) => table
            .iter()
            .map(|(key, value)| Ok((key.get_ref().to_string(), to_value(value.get_ref())?)))
            .collect::<Result<_, _>>()
            .map(Value::Table),
        other => Err(format!(
            "expected text, a number or a list, found {}",
            other.type_str()
        )),
    }
}

fn to_table(config: &RunConfig) -> Table {
    Table::try_from(config).unwrap_or_default()
}
