//! `replay diff`: lists different keys of two traces' descriptions, and the first different entries and
//! record; or compares two results of `replay run`.

mod results;

use crate::records::Tiles;
use anyhow::{Result, ensure};
use formats::Trace;
use formats::interop::{node_to_json, slot_rows, slot_to_json};
use formats::raytrace::Raytrace;
use formats::textrace::Textrace;
use formats::textrace::geometry::GeometryView;
use report::notices;
use serde_json::Value;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay diff`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Exit code: 0 the same, 1 different, 2 unreadable.
Prints every different line of the description, then the first different entry of each table, then
the first different record. The tile encoding is not compared.
Of two results of `replay run --json`, prints settings and figures that differ; exit code 1 if a figure
differs by more than --threshold.

Examples:
  replay diff a.textrace b.textrace
  replay diff before.json after.json --threshold 1")]
pub struct DiffArgs {
    /// First trace, or JSON result
    pub left: PathBuf,
    /// Second trace, or JSON result
    pub right: PathBuf,
    /// Ignore the description (tool, command line, driver, ...)
    #[arg(long)]
    pub ignore_meta: bool,
    /// Largest change of a result's figure that counts as none, percent
    #[arg(long = "threshold", value_name = "PERCENT", default_value_t = 0.0, value_parser = parse_pct)]
    pub threshold_pct: f64,
}

fn parse_pct(text: &str) -> Result<f64, String> {
    let number = text.trim_end_matches('%').parse::<f64>().ok();
    let number = number.filter(|number| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| format!("expected a percentage of 0 or more, found '{text}'"))
}

/// Runs the subcommand.
///
/// # Errors
/// A trace cannot be read.
pub fn run(args: &DiffArgs) -> Result<ExitCode> {
    if results::is_json(&args.left) || results::is_json(&args.right) {
        return results::run(args);
    }
    ensure!(
        args.threshold_pct == 0.0,
        "--threshold: expected two JSON results of `replay run`, found traces"
    );
    let left = notices::open(&args.left)?;
    let right = notices::open(&args.right)?;
    let differences = differences(&left, &right, args.ignore_meta)?;
    if differences.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    super::print(&differences.join("\n"))?;
    Ok(ExitCode::FAILURE)
}

/// Lists the differences; empty if the traces have equal content.
fn differences(left: &Trace, right: &Trace, ignore_meta: bool) -> Result<Vec<String>> {
    match (left, right) {
        (Trace::Texture(left), Trace::Texture(right)) => textures(left, right, ignore_meta),
        (Trace::Ray(left), Trace::Ray(right)) => rays(left, right, ignore_meta),
        _ => {
            let kind = |trace: &Trace| trace.container().kind();
            Ok(vec![differ("kind", kind(left), kind(right))])
        }
    }
}

fn textures(left: &Textrace, right: &Textrace, ignore_meta: bool) -> Result<Vec<String>> {
    let (a, b) = (left.tables(), right.tables());
    let mut found = Vec::new();
    if !ignore_meta {
        found = keys("meta", &a.meta, &b.meta)?;
    }
    found.extend(entries("texture", &a.textures, &b.textures)?);
    found.extend(entries("sampler", &a.samplers, &b.samplers)?);
    found.extend(entries("draw", &a.draws, &b.draws)?);
    let passes = entries("pass", &a.passes, &b.passes)?;
    // Records can only be compared if both traces have the same tiles.
    let same_tiles = passes.is_none();
    found.extend(passes);
    if same_tiles {
        found.extend(first_line(left, right)?);
        found.extend(geometry(left, right));
    }
    Ok(found)
}

/// The first difference in the geometry; primitive lists are compared by checksum.
fn geometry(left: &Textrace, right: &Textrace) -> Option<String> {
    let (a, b) = (left.geometry(), right.geometry());
    if a == b {
        return None;
    }
    let (Some(a), Some(b)) = (a, b) else {
        return Some(differ("geometry", there(a.is_some()), there(b.is_some())));
    };
    if (&a.meshes, &a.draw_meshes) != (&b.meshes, &b.draw_meshes) {
        return Some(differ("meshes", a.meshes.len(), b.meshes.len()));
    }
    let views = a.views.len().min(b.views.len());
    let first = (0..views).find(|&view| {
        a.views[view] != b.views[view] || left.tile_lists(view).ok() != right.tile_lists(view).ok()
    });
    let view = first.unwrap_or(views);
    let of = |views: &[GeometryView]| format!("{:?}", views.get(view));
    Some(differ(
        &format!("primitive lists of view {view}"),
        of(&a.views),
        of(&b.views),
    ))
}

/// The first different line of two traces with the same tiles.
fn first_line<T: Tiles>(left: &T, right: &T) -> Result<Option<String>> {
    let (mut a, mut b) = (T::Content::default(), T::Content::default());
    for at in left.places() {
        left.decode(at, &mut a)?;
        right.decode(at, &mut b)?;
        if a == b {
            continue;
        }
        let place = format!("{} tile {} {}", T::pass_name(at), T::numbers(at).1, T::LINE);
        // Text is compared because NaN texture coordinates are not equal to themselves.
        let found = lines(&place, left.lines(at, &a)?, right.lines(at, &b)?);
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

fn rays(left: &Raytrace, right: &Raytrace, ignore_meta: bool) -> Result<Vec<String>> {
    let (mut a, b) = (left.tables().clone(), right.tables());
    if ignore_meta {
        a.meta.trace = b.meta.trace.clone();
    }
    let mut found = keys("meta", &a.meta, &b.meta)?;
    found.extend(keys("hierarchy", &a.bvh, &b.bvh)?);
    found.extend(entries("material", &a.materials, &b.materials)?);
    found.extend(entries("light", &a.lights, &b.lights)?);
    found.extend(entries("triangle", &a.triangles, &b.triangles)?);
    found.extend(hierarchies(left, right)?);
    if left.places() == right.places() {
        found.extend(first_line(left, right)?);
    }
    Ok(found)
}

/// The first different node or slot of two hierarchies.
fn hierarchies(left: &Raytrace, right: &Raytrace) -> Result<Option<String>> {
    let content = |trace: &Raytrace| -> Result<Option<Vec<[String; 2]>>> {
        let bvh = &trace.tables().bvh;
        let Some((hierarchy, _)) = trace.read_hierarchy()? else {
            return Ok(None);
        };
        let nodes = (0u32..).zip(hierarchy.children.chunks(bvh.traversal.width()));
        let nodes = nodes.map(|(node, children)| {
            let text = node_to_json(bvh, node, children)?;
            Ok([format!("node {node}"), text])
        });
        let slots = slot_rows(&hierarchy)
            .map(|row| Ok([format!("slot {}", row.slot), slot_to_json(bvh, &row)?]));
        let lines: serde_json::Result<_> = nodes.chain(slots).collect();
        Ok(Some(lines?))
    };
    let (Some(a), Some(b)) = (content(left)?, content(right)?) else {
        let [a, b] = [left, right].map(|trace| there(trace.has_hierarchy()));
        return Ok((a != b).then(|| differ("content of the hierarchy", a, b)));
    };
    let first = a.iter().zip(&b).find(|(a, b)| a != b);
    // Different numbers of nodes are differences of the summary.
    Ok(first.map(|([place, a], [_, b])| differ(place, a, b)))
}

fn there(is_there: bool) -> &'static str {
    if is_there { "there" } else { "absent" }
}

fn differ(what: &str, left: impl std::fmt::Display, right: impl std::fmt::Display) -> String {
    format!("{what} differs\n< {left}\n> {right}")
}

/// All different keys of two descriptions, with keys that only one of them has.
fn keys<T: serde::Serialize>(what: &str, left: &T, right: &T) -> Result<Vec<String>> {
    fn walk(path: &str, a: &Value, b: &Value, found: &mut Vec<String>) {
        match (a, b) {
            (Value::Object(a), Value::Object(b)) => {
                let of_b_alone = b.keys().filter(|key| !a.contains_key(*key));
                for key in a.keys().chain(of_b_alone) {
                    let of = |side: &'_ serde_json::Map<String, Value>| {
                        side.get(key).cloned().unwrap_or_default()
                    };
                    walk(&format!("{path}.{key}"), &of(a), &of(b), found);
                }
            }
            _ if a != b => found.push(differ(path, a, b)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    let (a, b) = (serde_json::to_value(left)?, serde_json::to_value(right)?);
    walk(what, &a, &b, &mut found);
    Ok(found)
}

/// First different entry of two tables.
fn entries<T: PartialEq + serde::Serialize>(
    what: &str,
    left: &[T],
    right: &[T],
) -> Result<Option<String>> {
    for (index, (a, b)) in left.iter().zip(right).enumerate() {
        if a != b {
            let (a, b) = (serde_json::to_string(a)?, serde_json::to_string(b)?);
            return Ok(Some(differ(&format!("{what} {index}"), a, b)));
        }
    }
    let counts = (left.len() != right.len()).then(|| {
        let what = format!("number of {what} entries");
        differ(&what, left.len(), right.len())
    });
    Ok(counts)
}

/// First different line of two lists, if any.
fn lines(place: &str, left: Vec<String>, right: Vec<String>) -> Option<String> {
    let count = left.len().max(right.len());
    let at = (0..count).find(|at| left.get(*at) != right.get(*at))?;
    let of = |lines: &[String]| {
        let end = || "no more records".to_owned();
        lines.get(at).cloned().unwrap_or_else(end)
    };
    Some(differ(&format!("{place} {at}"), of(&left), of(&right)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::file_of;
    use sim::stream::testing::Synthetic;

    fn compare(change: impl FnOnce(&mut sim::stream::MemoryTrace)) -> Vec<String> {
        let mut memory = Synthetic::default().generate();
        let left = file_of(&memory);
        change(&mut memory);
        let right = file_of(&memory);
        let open = |file: &tempfile::NamedTempFile| Trace::open(file.path()).unwrap();
        differences(&open(&left), &open(&right), false).unwrap()
    }

    #[test]
    fn a_trace_equals_itself() {
        assert_eq!(compare(|_| ()), Vec::<String>::new());
    }

    #[test]
    fn the_first_different_record_is_named() {
        let found = compare(|memory| {
            memory.tiles[1][3].records[2].uv[1] += 1;
            memory.tiles[1][4].records[0].uv[1] += 1;
        });
        assert_eq!(found.len(), 1);
        let expected = "pass 1 tile 3 record 2 differs\n< {";
        assert!(found[0].starts_with(expected), "{found:?}");
    }

    #[test]
    fn a_missing_record_is_named() {
        let found = compare(|memory| {
            let tile = &mut memory.tiles[0][0];
            tile.records.pop();
            let last = tile.runs.last_mut().unwrap();
            last.count -= 1;
            if last.count == 0 {
                tile.runs.pop();
            }
        });
        assert!(found[0].ends_with("> no more records"), "{found:?}");
    }

    #[test]
    fn tables_are_compared_entry_by_entry() {
        let found = compare(|memory| memory.tables.textures[0].name = "other".to_owned());
        assert!(found[0].starts_with("texture 0 differs"), "{found:?}");
        let found = compare(|memory| memory.tables.meta.seed += 1);
        assert_eq!(found, ["meta.seed differs\n< 1\n> 2"]);
    }

    #[test]
    fn content_after_a_different_description_is_also_compared() {
        let found = compare(|memory| {
            memory.tables.meta.driver = "another driver".to_owned();
            memory.tables.meta.hmd.ipd_m = 0.07;
            memory.tables.textures[2].name = "other".to_owned();
            memory.tiles[0][5].records[0].dx[0] += 1;
        });
        let what: Vec<&str> = found
            .iter()
            .filter_map(|text| text.lines().next())
            .collect();
        assert_eq!(
            what,
            [
                "meta.driver differs",
                "meta.hmd.ipd_m differs",
                "texture 2 differs",
                "pass 0 tile 5 record 0 differs"
            ]
        );
    }
}
