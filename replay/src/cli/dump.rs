//! `replay dump`: decoded records as JSON Lines.

use super::trace_file::{NumberRange, tiles};
use anyhow::{Result, bail};
use formats::interop::{Origin, record_to_json};
use formats::textrace::{Textrace, Tile};
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay dump`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay dump c.textrace --pass 0 --tile 1200
  replay dump c.textrace --tile 40..48 | jq .primitive")]
pub struct DumpArgs {
    /// Texture trace
    pub trace: PathBuf,
    /// Passes, a number or a range such as 0..2
    #[arg(long, value_name = "RANGE")]
    pub pass: Option<NumberRange>,
    /// Tiles of each pass, a number or a range such as 40..48
    #[arg(long, value_name = "RANGE")]
    pub tile: Option<NumberRange>,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, has no such pass or tile, or the output cannot be written.
pub fn run(args: &DumpArgs) -> Result<ExitCode> {
    let trace = Textrace::open(&args.trace)?;
    let mut out = BufWriter::new(io::stdout().lock());
    dump(&trace, args, &mut out)?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

fn dump(trace: &Textrace, args: &DumpArgs, out: &mut impl Write) -> Result<()> {
    let passes = &trace.tables().passes;
    let chosen = |range: Option<NumberRange>, number| range.is_none_or(|r| r.contains(number));
    let mut tile = Tile::default();
    let mut any = false;
    for (pass, index) in tiles(passes) {
        if !chosen(args.pass, pass) || !chosen(args.tile, index) {
            continue;
        }
        any = true;
        trace.decode_tile(pass, index, &mut tile)?;
        for run in &tile.runs {
            let origin = Origin {
                pass: pass as u32,
                tile: index as u32,
                draw: run.draw,
                primitive: run.primitive,
            };
            for record in tile
                .records
                .iter()
                .skip(run.first as usize)
                .take(run.count as usize)
            {
                writeln!(out, "{}", record_to_json(origin, record))?;
            }
        }
    }
    if any {
        return Ok(());
    }
    let first = |range: Option<NumberRange>| range.map_or(0, NumberRange::first);
    let most = passes.iter().map(formats::textrace::Pass::tile_count).max();
    bail!(
        "{}: no pass {} tile {}; the trace has {} passes of at most {} tiles",
        trace.container().file(),
        first(args.pass),
        first(args.tile),
        passes.len(),
        most.unwrap_or(0)
    )
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
        let trace = Textrace::open(file.path()).unwrap();
        let args = DumpArgs {
            trace: file.path().to_owned(),
            pass: Some("1".parse().unwrap()),
            tile: Some("2..5".parse().unwrap()),
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
    fn a_pass_that_is_not_there_is_an_error() {
        let file = file_of(&Synthetic::default().generate());
        let trace = Textrace::open(file.path()).unwrap();
        let args = DumpArgs {
            trace: file.path().to_owned(),
            pass: Some("9".parse().unwrap()),
            tile: None,
        };
        let error = dump(&trace, &args, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("no pass 9"), "{error}");
    }
}
