//! Compares two JSON results of `replay run`: settings, and figures beyond a threshold.

use super::DiffArgs;
use anyhow::{Context, Result, ensure};
use report::columns::{Columns, columns_of};
use report::html::change;
use report::table::Table;
use serde_json::Value;
use sim::result::RUN_SCHEMA;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::ExitCode;

/// Largest file that is read as a result.
const MOST_BYTES: u64 = 1 << 30;

/// Whether a file begins as JSON. False for standard input, which has traces.
pub(super) fn is_json(path: &Path) -> bool {
    let mut first = [0];
    let mut file = File::open(path).ok().filter(|_| !shell::is_stdout(path));
    let read = file.as_mut().map(|file| file.read_exact(&mut first));
    matches!(read, Some(Ok(()))) && first == *b"{"
}

/// A number of both results.
#[derive(Debug, PartialEq)]
struct Figure {
    key: String,
    values: [f64; 2],
}

impl Figure {
    fn change_pct(&self) -> f64 {
        let [left, right] = self.values;
        match left == right {
            true => 0.0,
            false => 100.0 * (right / left - 1.0),
        }
    }

    /// A figure that was zero has no change in percent, so any other value is beyond.
    fn is_beyond(&self, threshold_pct: f64) -> bool {
        let pct = self.change_pct();
        !pct.is_finite() || pct.abs() > threshold_pct
    }
}

/// Prints the sentence about memory traffic, settings that differ, and figures that differ. Exit code 1 if a figure
/// differs by more than the threshold.
///
/// # Errors
/// A file that is no result of `replay run`.
pub(super) fn run(args: &DiffArgs) -> Result<ExitCode> {
    let results = [read(&args.left)?, read(&args.right)?];
    let threshold = args.threshold_pct;
    let figures = figures(&results);
    let beyond = |figure: &&Figure| figure.is_beyond(threshold);
    let count = figures.iter().filter(beyond).count();
    let mut text = String::new();
    if let Some(bytes) = figures.iter().find(|of| of.key == "external_bytes") {
        let words = change(bytes.change_pct(), "less", "more", "as much");
        text = format!(
            "{} reads {words} texture data from DRAM {} {}: {} and {} bytes.\n",
            args.right.display(),
            if words == "as much" { "as" } else { "than" },
            args.left.display(),
            bytes.values[1],
            bytes.values[0]
        );
    }
    text += &format!(
        "{count} of {} figures differ by more than {threshold} %.\n",
        figures.len()
    );
    for (path, keys) in [&args.left, &args.right]
        .into_iter()
        .zip(only_in_one(&results))
    {
        if !keys.is_empty() {
            text += &format!("Only in {}: {}\n", path.display(), keys.join(", "));
        }
    }
    for (key, [left, right]) in settings(&results) {
        text += &format!("{key}: {left} and {right}\n");
    }
    let differing: Vec<Figure> = figures
        .into_iter()
        .filter(|of| of.values[0] != of.values[1])
        .collect();
    if !differing.is_empty() {
        let columns = columns_of::<Figure>()
            .text("figure", "figure", |of| of.key.clone())
            .real("first", "first", "", 0, |of| shown(of.values[0]))
            .real("second", "second", "", 0, |of| shown(of.values[1]))
            .real("change_pct", "change", "%", 2, |of| {
                Some(of.change_pct()).filter(|pct| pct.is_finite())
            })
            .text("beyond", "beyond", |of| of.is_beyond(threshold));
        text += &format!("\n{}", Table::new(&columns, &differing).text());
    }
    super::super::print(text.trim_end())?;
    Ok(ExitCode::from(u8::from(count > 0)))
}

/// Counts as integers, rates with four decimals.
fn shown(value: f64) -> String {
    let decimals = if value.fract() == 0.0 { 0 } else { 4 };
    format!("{value:.decimals$}")
}

fn read(path: &Path) -> Result<Value> {
    let name = || path.display().to_string();
    let mut text = String::new();
    let file = File::open(path).with_context(name)?;
    file.take(MOST_BYTES)
        .read_to_string(&mut text)
        .with_context(name)?;
    let result: Value = serde_json::from_str(&text).with_context(name)?;
    let schema = result["schema"].as_str().unwrap_or("none");
    ensure!(
        schema == RUN_SCHEMA,
        "{}: expected a result of `replay run --json` (schema {RUN_SCHEMA}), found schema {schema}",
        path.display()
    );
    Ok(result)
}

/// Leaves of a JSON object by path. Lists are left out: they are parts of the totals.
fn leaves(value: &Value, path: &str, out: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                let dot = if path.is_empty() { "" } else { "." };
                leaves(value, &format!("{path}{dot}{key}"), out);
            }
        }
        Value::Array(_) => {}
        leaf => {
            out.insert(path.to_owned(), leaf.clone());
        }
    }
}

fn both(results: &[Value; 2], member: &str) -> [BTreeMap<String, Value>; 2] {
    [0, 1].map(|side| {
        let mut out = BTreeMap::new();
        leaves(&results[side][member], "", &mut out);
        out
    })
}

/// Figures that only one result has, by result.
fn only_in_one(results: &[Value; 2]) -> [Vec<String>; 2] {
    let sides = both(results, "result");
    [0, 1].map(|side: usize| {
        let is_alone = |key: &&String| !sides[1 - side].contains_key(*key);
        sides[side].keys().filter(is_alone).cloned().collect()
    })
}

/// Numbers that both results have.
fn figures(results: &[Value; 2]) -> Vec<Figure> {
    let [left, right] = both(results, "result");
    let figure = |(key, left): (&String, &Value)| {
        let values = [left.as_f64()?, right.get(key)?.as_f64()?];
        let key = key.clone();
        Some(Figure { key, values })
    };
    left.iter().filter_map(figure).collect()
}

/// Settings, traces and model versions that differ.
fn settings(results: &[Value; 2]) -> Vec<(String, [String; 2])> {
    let mut out = Vec::new();
    for member in ["trace", "config", "model_version"] {
        let [left, right] = both(results, member);
        let keys: std::collections::BTreeSet<&String> = left.keys().chain(right.keys()).collect();
        for key in keys {
            let [a, b] =
                [&left, &right].map(|of| of.get(key).map_or("none".to_owned(), Value::to_string));
            if a != b {
                let dot = if key.is_empty() { "" } else { "." };
                out.push((format!("{member}{dot}{key}"), [a, b]));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn figures_settings_and_zeros_are_compared() {
        let result = |order: &str, bytes: u64, cycles: u64| json!({"config": {"order": order, "l1": {"ways": 4}}, "result": {"external_bytes": bytes, "cycles": cycles, "by_view": [1]}});
        let results = [result("morton", 100, 0), result("z2-sta", 60, 5)];
        let found = figures(&results);
        assert_eq!(found.len(), 2);
        let mut unlike = results.clone();
        unlike[1]["result"] = json!({"external_bytes": 60, "tmu": {"loops": 1}});
        assert_eq!(
            only_in_one(&unlike),
            [vec!["cycles".to_owned()], vec!["tmu.loops".to_owned()]]
        );
        let bytes = &found[1];
        assert_eq!(bytes.key, "external_bytes");
        assert!((bytes.change_pct() + 40.0).abs() < 1e-9);
        assert!(bytes.is_beyond(39.0) && !bytes.is_beyond(41.0));
        assert!(found[0].is_beyond(1e9));
        let settings = settings(&results);
        assert_eq!(settings.len(), 1);
        assert_eq!(settings[0].0, "config.order");
    }
}
