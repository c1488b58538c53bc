//! `replay diff`: the first difference between two traces.

use super::dump::record_lines;
use super::tiles::{ray_tiles, tiles};
use anyhow::Result;
use formats::Trace;
use formats::interop::ray_samples;
use formats::raytrace::{RayTile, Raytrace};
use formats::textrace::{Textrace, Tile};
use serde_json::Value;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay diff`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Exit code: 0 the same, 1 different, 2 unreadable.
How tiles are encoded makes no difference.

Example: replay diff a.textrace b.textrace")]
pub struct DiffArgs {
    /// One trace
    pub left: PathBuf,
    /// The other
    pub right: PathBuf,
    /// Ignore the description (tool, command line, driver, ...)
    #[arg(long)]
    pub ignore_meta: bool,
}

/// Runs the subcommand.
///
/// # Errors
/// A trace cannot be read.
pub fn run(args: &DiffArgs) -> Result<ExitCode> {
    let left = Trace::open(&args.left)?;
    let right = Trace::open(&args.right)?;
    match first_difference(&left, &right, args.ignore_meta)? {
        None => Ok(ExitCode::SUCCESS),
        Some(difference) => {
            super::print(&difference)?;
            Ok(ExitCode::FAILURE)
        }
    }
}

/// Describes the first difference, if there is one.
fn first_difference(left: &Trace, right: &Trace, ignore_meta: bool) -> Result<Option<String>> {
    match (left, right) {
        (Trace::Texture(left), Trace::Texture(right)) => textures(left, right, ignore_meta),
        (Trace::Ray(left), Trace::Ray(right)) => rays(left, right, ignore_meta),
        _ => {
            let kind = |trace: &Trace| trace.container().kind();
            Ok(Some(differ("kind", kind(left), kind(right))))
        }
    }
}

fn textures(left: &Textrace, right: &Textrace, ignore_meta: bool) -> Result<Option<String>> {
    let (a, b) = (left.tables(), right.tables());
    let meta = (!ignore_meta).then(|| keys("meta", &a.meta, &b.meta));
    let tables = meta
        .transpose()?
        .flatten()
        .or(entries("texture", &a.textures, &b.textures)?)
        .or(entries("sampler", &a.samplers, &b.samplers)?)
        .or(entries("draw", &a.draws, &b.draws)?)
        .or(entries("pass", &a.passes, &b.passes)?);
    if tables.is_some() {
        return Ok(tables);
    }
    let (mut a, mut b) = (Tile::default(), Tile::default());
    for (pass, index) in tiles(&left.tables().passes) {
        left.decode_tile(pass, index, &mut a)?;
        right.decode_tile(pass, index, &mut b)?;
        if a != b {
            let [a, b] = [&a, &b].map(|tile| record_lines(pass, index, tile).collect());
            let place = format!("pass {pass} tile {index} record");
            return Ok(lines(&place, a, b));
        }
    }
    Ok(None)
}

fn rays(left: &Raytrace, right: &Raytrace, ignore_meta: bool) -> Result<Option<String>> {
    let (mut a, mut b) = (left.tables().clone(), right.tables().clone());
    if ignore_meta {
        a.meta.trace = b.meta.trace.clone();
    }
    let tables = keys("meta", &a.meta, &b.meta)?
        .or(keys("hierarchy", &a.bvh, &b.bvh)?)
        .or(entries("material", &a.materials, &b.materials)?)
        .or(entries("light", &a.lights, &b.lights)?)
        .or(entries("triangle", &a.triangles, &b.triangles)?);
    if tables.is_some() {
        return Ok(tables);
    }
    b.meta.trace = std::mem::take(&mut a.meta.trace);
    let (mut tile_a, mut tile_b) = (RayTile::default(), RayTile::default());
    for (eye, index) in ray_tiles(&a) {
        left.decode_tile(eye, index, &mut tile_a)?;
        right.decode_tile(eye, index, &mut tile_b)?;
        if tile_a == tile_b {
            continue;
        }
        let of = |tile: &RayTile| -> Result<Vec<String>> {
            let samples = ray_samples(&b, eye, index, tile);
            Ok(samples
                .map(|s| s.to_json(&b.bvh))
                .collect::<Result<_, _>>()?)
        };
        let place = format!("{eye:?} eye tile {index} sample").to_lowercase();
        // Texture coordinates may be NaN, which differs from itself but not in print.
        let found = lines(&place, of(&tile_a)?, of(&tile_b)?);
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

fn differ(what: &str, left: impl std::fmt::Display, right: impl std::fmt::Display) -> String {
    format!("{what} differs\n< {left}\n> {right}")
}

/// First different key of two descriptions.
fn keys<T: serde::Serialize>(what: &str, left: &T, right: &T) -> Result<Option<String>> {
    fn first(path: &str, a: &Value, b: &Value) -> Option<String> {
        match (a, b) {
            (Value::Object(a), Value::Object(b)) => a.iter().find_map(|(key, value)| {
                let other = b.get(key).unwrap_or(&Value::Null);
                first(&format!("{path}.{key}"), value, other)
            }),
            _ => (a != b).then(|| differ(path, a, b)),
        }
    }
    let (a, b) = (serde_json::to_value(left)?, serde_json::to_value(right)?);
    Ok(first(what, &a, &b))
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

/// First different line of two lists, if there is one.
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
    use crate::stream::synthetic::Synthetic;

    fn compare(change: impl FnOnce(&mut crate::stream::MemoryTrace)) -> Option<String> {
        let mut memory = Synthetic::default().generate();
        let left = file_of(&memory);
        change(&mut memory);
        let right = file_of(&memory);
        let open = |file: &tempfile::NamedTempFile| Trace::open(file.path()).unwrap();
        first_difference(&open(&left), &open(&right), false).unwrap()
    }

    #[test]
    fn a_trace_equals_itself() {
        assert_eq!(compare(|_| ()), None);
    }

    #[test]
    fn the_first_different_record_is_named() {
        let text = compare(|memory| {
            memory.tiles[1][3].records[2].uv[1] += 1;
            memory.tiles[1][4].records[0].uv[1] += 1;
        });
        let text = text.unwrap();
        assert!(
            text.starts_with("pass 1 tile 3 record 2 differs\n< {"),
            "{text}"
        );
    }

    #[test]
    fn a_missing_record_is_named() {
        let text = compare(|memory| {
            let tile = &mut memory.tiles[0][0];
            tile.records.pop();
            let last = tile.runs.last_mut().unwrap();
            last.count -= 1;
            if last.count == 0 {
                tile.runs.pop();
            }
        });
        assert!(text.unwrap().ends_with("> no more records"));
    }

    #[test]
    fn tables_are_compared_entry_by_entry() {
        let text = compare(|memory| memory.tables.textures[0].name = "other".to_owned());
        assert!(text.unwrap().starts_with("texture 0 differs"));
        let text = compare(|memory| memory.tables.meta.seed += 1);
        assert!(text.unwrap().starts_with("meta.seed differs"));
    }
}
