//! `replay dump`: prints decoded records as JSON Lines.

use super::tiles::{NumberRange, ray_tiles, tiles};
use anyhow::{Result, bail};
use formats::Trace;
use formats::interop::{Origin, ray_samples, record_to_json};
use formats::raytrace::{RayTile, Raytrace};
use formats::textrace::{Textrace, Tile};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay dump`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A texture trace has one line per record. A ray trace has one line per sample of a pixel,
with its rays and, if the trace has them, their visits.

Examples:
  replay dump c.textrace --pass 0 --tile 1200
  replay dump c.textrace --tile 40..48 | jq .primitive
  replay dump r.raytrace --pass 1 --tile 7 | jq '.rays[].steps'"
)]
pub struct DumpArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// Passes: a number or a range such as 0..2; in ray traces, 0 is the left eye and 1 the right
    #[arg(long, value_name = "RANGE")]
    pub pass: Option<NumberRange>,
    /// Tiles of each pass: a number or a range such as 40..48
    #[arg(long, value_name = "RANGE")]
    pub tile: Option<NumberRange>,
    /// Print primitive lists instead of records: one line per tile of each view captured with --geometry
    #[arg(long, conflicts_with_all = ["pass", "tile"])]
    pub lists: bool,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, it does not have such a pass or tile, or the output cannot be written.
pub fn run(args: &DumpArgs) -> Result<ExitCode> {
    let trace = Trace::open(&args.trace)?;
    let mut out = shell::stdout();
    match (&trace, args.lists) {
        (Trace::Texture(trace), true) => primitive_lists(trace, &mut out)?,
        (Trace::Ray(_), true) => bail!(
            "--lists: expected a texture trace, found {}",
            args.trace.display()
        ),
        (_, false) => dump(&trace, args, &mut out)?,
    }
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

fn dump(trace: &Trace, args: &DumpArgs, out: &mut impl Write) -> Result<()> {
    let chosen = |pass, tile| {
        args.pass.is_none_or(|range| range.contains(pass))
            && args.tile.is_none_or(|range| range.contains(tile))
    };
    let (any, passes, most) = match trace {
        Trace::Texture(trace) => {
            let passes = &trace.tables().passes;
            let most = passes.iter().map(formats::textrace::Pass::tile_count).max();
            (
                records(trace, chosen, out)?,
                passes.len(),
                most.unwrap_or(0),
            )
        }
        Trace::Ray(trace) => (samples(trace, chosen, out)?, 2, trace.tables().tile_count()),
    };
    if any {
        return Ok(());
    }
    let first = |range: Option<NumberRange>| range.map_or(0, NumberRange::first);
    bail!(
        "{}: no pass {} tile {}; the trace has {passes} passes of at most {most} tiles",
        trace.container().file(),
        first(args.pass),
        first(args.tile),
    )
}

/// Prints the records of the chosen tiles; returns false if no tile matches.
fn records(
    trace: &Textrace,
    chosen: impl Fn(usize, usize) -> bool,
    out: &mut impl Write,
) -> Result<bool> {
    let mut tile = Tile::default();
    let mut any = false;
    for (pass, index) in tiles(&trace.tables().passes).filter(|at| chosen(at.0, at.1)) {
        any = true;
        trace.decode_tile(pass, index, &mut tile)?;
        for line in record_lines(pass, index, &tile) {
            writeln!(out, "{line}")?;
        }
    }
    Ok(any)
}

/// The records of a tile as JSON Lines.
pub fn record_lines(pass: usize, index: usize, tile: &Tile) -> impl Iterator<Item = String> {
    tile.runs.iter().flat_map(move |run| {
        let origin = Origin {
            pass: pass as u32,
            tile: index as u32,
            draw: run.draw,
            primitive: run.primitive,
        };
        let records = tile.records.iter().skip(run.first as usize);
        let records = records.take(run.count as usize);
        records.map(move |record| record_to_json(origin, record).to_string())
    })
}

/// Prints the primitives of each tile of each view.
fn primitive_lists(trace: &Textrace, out: &mut impl Write) -> Result<()> {
    let Some(geometry) = trace.geometry() else {
        bail!(
            "{}: expected a trace with primitive lists (captured with `tracegen raster --geometry`), found none",
            trace.container().file()
        );
    };
    for (number, view) in geometry.views.iter().enumerate() {
        let lists = trace.tile_lists(number)?;
        for tile in 0..view.tile_count() {
            let line =
                serde_json::json!({"view": number, "tile": tile, "primitives": lists.tile(tile)});
            writeln!(out, "{line}")?;
        }
    }
    Ok(())
}

/// Prints the samples of the chosen tiles; returns false if no tile matches.
fn samples(
    trace: &Raytrace,
    chosen: impl Fn(usize, usize) -> bool,
    out: &mut impl Write,
) -> Result<bool> {
    let tables = trace.tables();
    let mut tile = RayTile::default();
    let mut any = false;
    for (eye, index) in ray_tiles(tables).filter(|at| chosen(at.0 as usize, at.1 as usize)) {
        any = true;
        trace.decode_tile(eye, index, &mut tile)?;
        for sample in ray_samples(tables, eye, index, &tile) {
            writeln!(out, "{}", sample.to_json(&tables.bvh)?)?;
        }
    }
    Ok(any)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::{file_of, lines};
    use crate::stream::synthetic::Synthetic;

    #[test]
    fn a_dump_holds_every_record_of_the_chosen_tiles() {
        let memory = Synthetic::default().generate();
        let file = file_of(&memory);
        let trace = Trace::open(file.path()).unwrap();
        let args = DumpArgs {
            trace: file.path().to_owned(),
            pass: Some("1".parse().unwrap()),
            tile: Some("2..5".parse().unwrap()),
            lists: false,
        };
        let mut text = Vec::new();
        dump(&trace, &args, &mut text).unwrap();
        let expected: usize = memory.tiles[1][2..5].iter().map(|t| t.records.len()).sum();
        let lines = lines(&text);
        assert!(expected > 0);
        assert_eq!(lines.len(), expected);
        let first: serde_json::Value = serde_json::from_str(&lines[0]).unwrap();
        assert_eq!(first["uv"][0], memory.tiles[1][2].records[0].uv[0]);
    }

    #[test]
    fn a_missing_pass_is_an_error() {
        let file = file_of(&Synthetic::default().generate());
        let trace = Trace::open(file.path()).unwrap();
        let args = DumpArgs {
            trace: file.path().to_owned(),
            pass: Some("9".parse().unwrap()),
            tile: None,
            lists: false,
        };
        let error = dump(&trace, &args, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("no pass 9"), "{error}");
    }
}
