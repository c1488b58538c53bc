//! `replay diff`: the first difference between two texture traces.

use super::trace_file::tiles;
use anyhow::Result;
use formats::interop::{Origin, record_to_json};
use formats::textrace::{Tables, Textrace, Tile};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay diff`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Exit code: 0 the same, 1 different, 2 unreadable.
How tiles are encoded makes no difference.

Example: replay diff a.textrace b.textrace")]
pub struct DiffArgs {
    /// One texture trace
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
    let left = Textrace::open(&args.left)?;
    let right = Textrace::open(&args.right)?;
    match first_difference(&left, &right, args.ignore_meta)? {
        None => Ok(ExitCode::SUCCESS),
        Some(difference) => {
            super::print(&difference)?;
            Ok(ExitCode::FAILURE)
        }
    }
}

/// Describes the first difference, if there is one.
fn first_difference(
    left: &Textrace,
    right: &Textrace,
    ignore_meta: bool,
) -> Result<Option<String>> {
    if let Some(text) = tables(left.tables(), right.tables(), ignore_meta)? {
        return Ok(Some(text));
    }
    let (mut a, mut b) = (Tile::default(), Tile::default());
    for (pass, index) in tiles(&left.tables().passes) {
        left.decode_tile(pass, index, &mut a)?;
        right.decode_tile(pass, index, &mut b)?;
        if a != b {
            return Ok(Some(tile(pass as u32, index as u32, &a, &b)));
        }
    }
    Ok(None)
}

fn differ(what: &str, left: impl std::fmt::Display, right: impl std::fmt::Display) -> String {
    format!("{what} differs\n< {left}\n> {right}")
}

/// First different entry of the tables.
fn tables(left: &Tables, right: &Tables, ignore_meta: bool) -> Result<Option<String>> {
    if !ignore_meta && left.meta != right.meta {
        let (a, b) = (
            serde_json::to_value(&left.meta)?,
            serde_json::to_value(&right.meta)?,
        );
        let mut keys = a.as_object().into_iter().flat_map(serde_json::Map::keys);
        if let Some(key) = keys.find(|key| a[*key] != b[*key]) {
            return Ok(Some(differ(&format!("meta.{key}"), &a[key], &b[key])));
        }
    }
    Ok(entries("texture", &left.textures, &right.textures)?
        .or(entries("sampler", &left.samplers, &right.samplers)?)
        .or(entries("draw", &left.draws, &right.draws)?)
        .or(entries("pass", &left.passes, &right.passes)?))
}

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
        differ(
            &format!("number of {what} entries"),
            left.len(),
            right.len(),
        )
    });
    Ok(counts)
}

/// First different record of two tiles that are known to differ.
fn tile(pass: u32, index: u32, left: &Tile, right: &Tile) -> String {
    let (a, b) = (located(pass, index, left), located(pass, index, right));
    let at = a.iter().zip(&b).position(|(a, b)| a != b);
    let at = at.unwrap_or(a.len().min(b.len()));
    let end = || "no more records".to_owned();
    differ(
        &format!("pass {pass} tile {index} record {at}"),
        a.get(at).cloned().unwrap_or_else(end),
        b.get(at).cloned().unwrap_or_else(end),
    )
}

fn located(pass: u32, index: u32, tile: &Tile) -> Vec<String> {
    let of_run = |run: &formats::textrace::PrimitiveRun| {
        let origin = Origin {
            pass,
            tile: index,
            draw: run.draw,
            primitive: run.primitive,
        };
        let records = tile
            .records
            .iter()
            .skip(run.first as usize)
            .take(run.count as usize);
        records.map(move |record| record_to_json(origin, record).to_string())
    };
    tile.runs.iter().flat_map(of_run).collect()
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
        let open = |file: &tempfile::NamedTempFile| Textrace::open(file.path()).unwrap();
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
