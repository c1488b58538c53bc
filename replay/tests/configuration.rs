//! Compares `docs/use/configuration.md` with the code. Keys, defaults, values and their meanings come from
//! the types. `UPDATE_DOCS=1` rewrites the page; review the diff.

use replay::config::{
    Allocation, Assign, CountBy, FrameConfig, FrameMachine, Hsr, Inclusion, Key, LevelClients,
    Levels, Mode, Order, PrefetchConfig, Prefetching, Replacement, RunConfig, SetIndex, TmuConfig,
    TmuModel,
};
use replay::memory::dram::{DramConfig, DramPreset, Mapping, PagePolicy};
use replay::registry::Choice;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

const INTRODUCTION: &str = "\
# Configuration of a replay

This page lists every key of a machine and of an experiment file. It is for users of `--config`, `replay sweep` and `--print-config`. It is made from the source; a test compares it.

`replay run --config FILE` reads the keys as TOML. Flags override the file, and the file overrides the defaults, which are the Z2 paper's
machine. `replay run --print-config` prints the whole configuration. Unknown keys are refused. Sizes (`size_bytes`) are numbers of bytes or
texts such as `\"16KiB\"`. The number of sets is a power of two, and all caches of a level together have at most 2^24 lines.

    order = \"z2-sta\"
    l1.size_bytes = \"16KiB\"          # a key of one level: l1 to l6
    l3.size_bytes = \"4MiB\"           # a level that is added
    l3.line_bytes = 64

Levels are a list of two to six `[[level]]` tables, the L1 first. Such a list in a file replaces the default levels;
`l1.KEY` changes one key of one level.

## Experiment files

`replay sweep FILE` replays every point of an experiment:

    traces = [\"crytek.textrace\"]      # beside the file; the command line's traces replace them
    [base]                            # any key below
    mode = \"functional\"
    [axes]                            # crossed with one another
    order = [\"morton\", \"z2-sta\"]
    l1.size_bytes = [\"8KiB\", \"16KiB\"]
    [one-at-a-time]                   # each value alone, the rest as in base; crossed with axes
    layout.block_order = [\"morton\", \"tiled\"]

`order` accepts the names below and lists of parts, for example `\"strip8+sta+offset+boustro\"` ([orders.md](../models/orders.md)).

A sweep has at most 100000 points. An impossible point is refused before any is replayed. A sweep that was stopped continues
where it stopped: each point's result is a row of a file under `points/` in the output folder.
[many-machines.md](many-machines.md) shows how to split a sweep over machines.

## Keys
";

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap().to_owned()
}

/// Documented items of a type's body: documentation, attributes and the item's own line.
struct Item {
    about: String,
    renamed: Option<String>,
    line: String,
}

/// The items of `pub struct name` or `pub enum name`, searched in all sources.
fn items(sources: &str, name: &str) -> Vec<Item> {
    let head = ["struct", "enum"].map(|kind| format!("pub {kind} {name} "));
    let start = head.iter().find_map(|head| {
        let head = sources.find(head)?;
        Some(head + sources[head..].find("{\n")? + 2)
    });
    let body = &sources[start.unwrap_or_else(|| panic!("no type {name}"))..];
    let (mut items, mut about, mut renamed) = (Vec::new(), String::new(), None);
    let mut is_key = true;
    for line in body.lines().map(str::trim).take_while(|line| *line != "}") {
        if let Some(text) = line.strip_prefix("///") {
            about += text;
        } else if line == "#[serde(skip)]" {
            is_key = false;
        } else if line.starts_with("#[") {
            let quoted = line.strip_prefix("#[serde(rename = \"");
            renamed = quoted
                .and_then(|rest| Some(rest.split_once('"')?.0.to_owned()))
                .or(renamed);
        } else if !std::mem::replace(&mut is_key, true) {
            about.clear();
        } else if !line.is_empty() {
            items.push(Item {
                about: std::mem::take(&mut about).trim().to_owned(),
                renamed: renamed.take(),
                line: line.to_owned(),
            });
        }
    }
    items
}

fn kebab(variant: &str) -> String {
    let mut out = String::new();
    for (i, c) in variant.chars().enumerate() {
        if c.is_ascii_uppercase() && i > 0 {
            out.push('-');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

/// Names and meanings of a type's values; empty for numbers and flags.
fn values(sources: &str, type_name: &str) -> Vec<(String, String)> {
    fn of<T: Choice>() -> Vec<(String, String)> {
        let values = T::choices().iter();
        let named = values.map(|value| (value.choice_name().to_owned(), value.help().to_owned()));
        named.collect()
    }
    match type_name {
        "Order" => of::<Order>(),
        "Replacement" => of::<Replacement>(),
        "Prefetching" => of::<Prefetching>(),
        "Mode" => of::<Mode>(),
        "Allocation" => of::<Allocation>(),
        "TmuModel" => of::<TmuModel>(),
        "Assign" => of::<Assign>(),
        "Hsr" => of::<Hsr>(),
        "CountBy" => of::<CountBy>(),
        "Inclusion" => of::<Inclusion>(),
        "LevelClients" => of::<LevelClients>(),
        "SetIndex" => of::<SetIndex>(),
        "DramPreset" => of::<DramPreset>(),
        "Mapping" => of::<Mapping>(),
        "PagePolicy" => of::<PagePolicy>(),
        "FrameMachine" => of::<FrameMachine>(),
        "BetweenFrames" | "FilterOverride" | "LodFormula" | "AnisotropyModel" | "BlockOrder"
        | "TextureOrder" | "TexelFormat" => {
            let name = |item: &Item| {
                let variant = item.line.split([' ', ',']).next().unwrap();
                let number = variant.split_once('(');
                let name = number.map_or_else(|| kebab(variant), |(name, _)| kebab(name) + "-N");
                item.renamed.clone().unwrap_or(name)
            };
            let items = items(sources, type_name);
            items.iter().map(|i| (name(i), i.about.clone())).collect()
        }
        _ => Vec::new(),
    }
}

/// The default configuration, with a prefetcher, an L3, DRAM and all memory clients.
fn defaults() -> Table {
    let config = RunConfig {
        prefetch: Some(PrefetchConfig::default()),
        level: Levels::default()
            .over(&[Levels::usual(2, 4 << 20)])
            .unwrap(),
        dram: Some(DramConfig::default()),
        frame: Some(FrameConfig::default()),
        ..RunConfig::default()
    };
    Table::try_from(config).unwrap()
}

/// A configuration with one key set.
fn with(key: &str, value: Value) -> Result<RunConfig, String> {
    let mut table = defaults();
    let (mut inner, mut rest) = (&mut table, key);
    while let Some((first, last)) = rest.split_once('.') {
        inner = match inner.get_mut(first).unwrap() {
            Value::Array(tables) => tables.last_mut().unwrap().as_table_mut().unwrap(),
            table => table.as_table_mut().unwrap(),
        };
        rest = last;
    }
    inner.insert(rest.to_owned(), value);
    table.try_into().map_err(|e: toml::de::Error| e.to_string())
}

/// The accepted range of a number, from the error for a value outside it.
fn range(key: &str) -> Option<String> {
    [-1_000_000, 0, 3, 4_000_000_000]
        .into_iter()
        .flat_map(|n| [Value::Integer(n), Value::Float(n as f64)])
        .filter_map(|value| with(key, value).ok()?.validate().err())
        .map(|error| error.to_string())
        .find_map(|text| {
            let of_key = text.starts_with(&format!("{key}: "));
            let expected = text.split_once("expected ")?.1;
            of_key.then(|| expected.rsplit_once(", found").unwrap().0.to_owned())
        })
}

/// The default of a key that the serialised default may omit.
fn default_of(key: &str) -> Option<Value> {
    fn find<T: Default>(keys: &[Key<T>], key: &str) -> Option<Value> {
        let (_, value) = keys.iter().find(|(other, _)| *other == key)?;
        Value::try_from(value(&T::default())).ok()
    }
    find(RunConfig::KEYS, key)
        .or_else(|| find(TmuConfig::KEYS, key))
        .or_else(|| find(FrameConfig::KEYS, key))
        .or_else(|| match key {
            "level.sectors" => Some(Value::Integer(1)),
            "level.victim_lines" => Some(Value::Integer(0)),
            "level.inclusion" => Value::try_from(Inclusion::default()).ok(),
            "level.set_index" => Value::try_from(SetIndex::default()).ok(),
            "level.clients" => Value::try_from(LevelClients::default()).ok(),
            _ => None,
        })
}

/// Adds a line for every key of a type, and the keys of the types in it.
fn describe(sources: &str, type_name: &str, prefix: &str, defaults: &Table, page: &mut String) {
    for item in items(sources, type_name) {
        let (name, kind) = item
            .line
            .trim_start_matches("pub ")
            .split_once(": ")
            .unwrap();
        let key = format!("{prefix}{name}");
        let kind = kind.trim_end_matches([',', ';']);
        let (kind, _) = kind.split_once(" = ").unwrap_or((kind, ""));
        let kind = kind
            .strip_prefix("Option<")
            .map_or(kind, |k| k.trim_end_matches('>'));
        let kind = if kind == "SamplingConfig" {
            "SamplingOptions"
        } else {
            kind
        };
        let default = defaults.get(name);
        if let Some(Value::Table(inner)) = default {
            describe(sources, kind, &format!("{key}."), inner, page);
            continue;
        }
        if let Some(Value::Array(tables)) = default {
            let inner = tables.last().unwrap().as_table().unwrap();
            describe(sources, "LevelConfig", &format!("{key}."), inner, page);
            continue;
        }
        let left_out = default_of(&key);
        let default = default.or(left_out.as_ref());
        let default = match default {
            _ if key == "level.size_bytes" => "required".to_owned(),
            _ if key == "level.ways" => "`4`; below the L2 `16`".to_owned(),
            _ if key == "level.shared" => "`true`; the L1 `false`".to_owned(),
            _ if key == "level.hit_cycles" => "`20`; below the L2 `60`".to_owned(),
            None => "none".to_owned(),
            Some(value) => format!("`{value}`"),
        };
        let values = values(sources, kind);
        for (value, _) in &values {
            let read = with(&key, Value::String(value.replace("-N", "-50")));
            assert!(read.is_ok(), "{key} = {value}: {read:?}");
        }
        let range = range(&key).map_or_else(String::new, |r| format!(" Accepted: {r}."));
        let about = item.about.replace('|', "\\|");
        let _ = writeln!(page, "| `{key}` | {default} | {about}{range} |");
        for (value, about) in values {
            let about = about.trim_end_matches('.').replace('|', "\\|");
            let _ = writeln!(page, "| | `\"{value}\"` | {about} |");
        }
    }
}

fn page() -> String {
    let sources: String = [
        "replay/sim/src/config.rs",
        "replay/sim/src/config/between_frames.rs",
        "replay/sim/src/config/level.rs",
        "replay/sim/src/config/prefetch.rs",
        "replay/sim/src/config/tmu.rs",
        "replay/sim/src/config/frame.rs",
        "replay/sim/src/memory/dram/mod.rs",
        "replay/sim/src/memory/dram/mapping.rs",
        "replay/sim/src/memory/dram/presets.rs",
        "formats/src/footprint/options.rs",
        "formats/src/footprint/aniso.rs",
        "formats/src/layout/mod.rs",
        "formats/src/texture.rs",
    ]
    .map(|path| fs::read_to_string(root().join(path)).unwrap())
    .concat();
    let defaults = defaults();
    let mut page =
        format!("{INTRODUCTION}\n| key | default; values | what it is |\n| --- | --- | --- |\n");
    describe(&sources, "RunConfig", "", &defaults, &mut page);
    page
}

#[test]
fn the_documentation_of_keys_matches_the_code() {
    let path = root().join("docs/use/configuration.md");
    let page = page();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, &page).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == page,
        "docs/use/configuration.md differs from the code; UPDATE_DOCS=1 rewrites it"
    );
}

#[test]
fn every_key_is_documented_on_one_line() {
    fn count(table: &Table) -> usize {
        let inner = |value: &Value| match value {
            Value::Array(tables) => tables[0].as_table().map_or(1, count),
            value => value.as_table().map_or(1, count),
        };
        table.values().map(inner).sum()
    }
    let page = page();
    let keys: Vec<&str> = page
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect();
    // Three keys have no default, and for fourteen the default is listed elsewhere.
    let written = count(&defaults());
    assert_eq!(keys.len(), written + 17);
    for line in keys {
        let about = line.split(" | ").last().unwrap();
        assert!(about.len() > 8, "{line}");
    }
}
