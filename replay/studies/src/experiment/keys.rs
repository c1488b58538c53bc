//! Dotted keys of a configuration as a TOML table.

use serde::Deserialize;
use sim::config::{Levels, RunConfig};
use toml::{Table, Value};

/// Sizes of L1 and L2 as one key, as in `8/128`. Numbers without a unit are KiB.
pub const CACHES: &str = "caches";

/// Sets a dotted key, creating the tables on its path. Levels are addressed by name (`l1.size_bytes`); the
/// level after the last one is added. [`CACHES`] sets two keys.
pub(super) fn set(table: &mut Table, key: &str, value: Value) {
    if key == CACHES
        && let Some(sizes) = value.as_str()
    {
        // Without a slash, both sizes are the whole text, which no size is.
        let (l1, l2) = sizes.split_once('/').unwrap_or((sizes, sizes));
        for (key, size) in [("l1.size_bytes", l1), ("l2.size_bytes", l2)] {
            let is_kib = sizes.contains('/') && size.trim().parse::<u64>().is_ok();
            let unit = if is_kib { "KiB" } else { "" };
            set(table, key, Value::String(format!("{}{unit}", size.trim())));
        }
        return;
    }
    let Some((first, rest)) = key.split_once('.') else {
        table.insert(key.to_owned(), value);
        return;
    };
    let is_level = |name: &&str| name.eq_ignore_ascii_case(first);
    if let Some(index) = Levels::NAMES.iter().position(is_level)
        && let Some(levels) = table.get_mut("level").and_then(Value::as_array_mut)
        && index <= levels.len()
    {
        if index == levels.len() {
            levels.push(Value::Table(Table::new()));
        }
        if let Some(level) = levels[index].as_table_mut() {
            set(level, rest, value);
        }
        return;
    }
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

/// The configuration that a table describes.
pub(super) fn parsed(table: &Table) -> Result<RunConfig, String> {
    RunConfig::deserialize(Value::Table(table.clone())).map_err(|e| e.message().to_owned())
}
