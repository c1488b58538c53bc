//! `replay validate`: every checksum and invariant of a trace.

use super::trace_file::{TraceFile, tiles};
use anyhow::Result;
use formats::FormatError;
use formats::raytrace::RayTile;
use formats::textrace::Tile;
use formats::view::Eye;
use rayon::prelude::*;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay validate`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Exit code: 0 valid, 1 not (the first bad place is on stderr), 2 unreadable.

Example: replay validate c.textrace"
)]
pub struct ValidateArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// Worker threads
    #[command(flatten)]
    pub threads: shell::Threads,
}

/// Runs the subcommand.
///
/// # Errors
/// The file cannot be read at all.
pub fn run(args: &ValidateArgs) -> Result<ExitCode> {
    args.threads.start()?;
    match validate(&args.trace) {
        Ok(summary) => {
            super::print(&summary)?;
            Ok(ExitCode::SUCCESS)
        }
        Err(error @ FormatError::Io { .. }) => Err(error.into()),
        Err(error) => {
            shell::error(&format!("invalid: {error}"));
            Ok(ExitCode::FAILURE)
        }
    }
}

fn validate(path: &std::path::Path) -> formats::Result<String> {
    let trace = TraceFile::open(path)?;
    let container = trace.container();
    let (tile_count, items, what) = match &trace {
        TraceFile::Texture(trace) => {
            let tiles: Vec<_> = tiles(&trace.tables().passes).collect();
            // In parallel, but the first bad tile is the first in the file.
            let records = tiles
                .par_iter()
                .map_init(Tile::default, |tile, (pass, index)| {
                    trace.decode_tile(*pass, *index, tile)?;
                    Ok(tile.records.len() as u64)
                });
            let records = records.collect::<Vec<formats::Result<u64>>>();
            (tiles.len(), total(records)?, "records")
        }
        TraceFile::Ray(trace) => {
            let count = trace.tables().tile_count();
            let tiles: Vec<_> = [Eye::Left, Eye::Right]
                .into_iter()
                .flat_map(|eye| (0..count).map(move |tile| (eye, tile)))
                .collect();
            let rays = tiles
                .par_iter()
                .map_init(RayTile::default, |tile, (eye, index)| {
                    trace.decode_tile(*eye, *index, tile)?;
                    Ok(tile.rays.len() as u64)
                });
            let rays = rays.collect::<Vec<formats::Result<u64>>>();
            (tiles.len(), total(rays)?, "rays")
        }
    };
    // Last, since a tile's own checksum says more closely where the damage is.
    for entry in container.directory() {
        container.chunk(entry.tag)?;
    }
    Ok(format!(
        "{}: valid {} {}.{}, {} chunks, {tile_count} tiles, {items} {what}, {} bytes",
        container.file(),
        container.kind(),
        container.version().0,
        container.version().1,
        container.directory().len(),
        container.file_bytes(),
    ))
}

fn total(counts: Vec<formats::Result<u64>>) -> formats::Result<u64> {
    counts.into_iter().sum()
}
