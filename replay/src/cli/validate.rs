//! `replay validate`: checks every checksum and invariant of a trace.

use super::tiles::{ray_tiles, tiles};
use anyhow::Result;
use formats::raytrace::{RAY_TILES, RayTile, check_relations};
use formats::textrace::Tile;
use formats::textrace::geometry::ViewTarget;
use formats::textrace::tables::TEXTURES;
use formats::{FormatError, Trace};
use rayon::prelude::*;
use report::notices;
use sim::config::RunConfig;
use sim::stream::Expander;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay validate`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Exit code: 0 valid, 1 invalid (stderr names the first invalid place), 2 unreadable.

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
/// The file cannot be read.
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

/// Checks a trace by opening it and decoding all tiles, as every reader does.
fn validate(path: &std::path::Path) -> formats::Result<String> {
    let trace = notices::open(path)?;
    let container = trace.container();
    // Tiles are decoded in parallel, but the error names the first bad tile in the file.
    let (counts, what): (Vec<formats::Result<u64>>, _) = match &trace {
        Trace::Texture(trace) => {
            // `replay run` refuses these tables before the first tile.
            if let Err(error) = Expander::new(trace.as_ref(), &RunConfig::default()) {
                let expected = "tables that can be replayed";
                return Err(container.malformed(TEXTURES, 0, expected, error));
            }
            let lists = trace.pass_lists()?;
            let tiles: Vec<_> = tiles(&trace.tables().passes).collect();
            let records = tiles
                .par_iter()
                .map_init(Tile::default, |tile, (pass, index)| {
                    trace.decode_tile(*pass, *index, tile)?;
                    if let Some(lists) = &lists {
                        trace.check_listed(*pass, *index, tile, &lists[*pass])?;
                    }
                    Ok(tile.records.len() as u64)
                });
            let counts = records.collect();
            let views = trace.geometry().map_or(&[][..], |geometry| &geometry.views);
            for (number, view) in views.iter().enumerate() {
                if matches!(view.target, ViewTarget::ShadowMap(_)) {
                    trace.tile_lists(number)?;
                }
            }
            (counts, "records")
        }
        Trace::Ray(trace) => {
            let hierarchy = trace.read_hierarchy()?;
            let tiles: Vec<_> = ray_tiles(trace.tables()).collect();
            let rays = tiles
                .par_iter()
                .map_init(RayTile::default, |tile, (eye, index)| {
                    trace.decode_tile_with_geometry(*eye, *index, tile)?;
                    check_relations(tile, hierarchy.as_ref()).map_err(|broken| {
                        let place = format!("{eye} eye tile {index}, {}", broken.what);
                        let expected = format!("{place}: {}", broken.expected);
                        container.malformed(RAY_TILES, 0, expected, broken.found)
                    })?;
                    Ok(tile.rays.len() as u64)
                });
            (rays.collect(), "rays")
        }
    };
    let tile_count = counts.len();
    let items: u64 = counts.into_iter().sum::<formats::Result<_>>()?;
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
