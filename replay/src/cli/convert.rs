//! `replay convert`: a trace in another encoding, or as plain accesses for other simulators.

use super::ConfigArgs;
use super::tiles::{ray_tiles, tiles};
use crate::config::RunConfig;
use crate::order;
use crate::stream::{for_quads, shaded};
use anyhow::{Context, Result, bail};
use formats::Trace;
use formats::container::{AtomicFile, is_stdout};
use formats::interop::{
    AccessSink, CsvWriter, DinWriter, Expander, Granularity, JsonlWriter, Origin, RayAccess,
    ray_samples,
};
use formats::layout::Layout;
use formats::raytrace::{RayTile, Raytrace, RaytraceWriter, encode_ray_tile};
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as};
use shell::Output;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// What to convert to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// Dinero's text: `0 HEXADDR` a line
    Din,
    /// Comma-separated accesses with texture, level and texel, or ray and node
    Csv,
    /// The same as one JSON object a line
    Jsonl,
    /// A texture trace, its tiles encoded anew
    Textrace,
    /// A ray trace, its tiles encoded anew
    Raytrace,
}

impl Target {
    fn is_text(self) -> bool {
        matches!(self, Self::Din | Self::Csv | Self::Jsonl)
    }
}

/// Tile encodings by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// Records as they are in memory
    Raw,
    /// Bit-packed differences
    #[default]
    Delta,
    /// A plane for each primitive: about 0.6 of the size, slower to read and to write
    Planes,
}

/// Access granularities by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum GranularityName {
    /// Every distinct texel of a footprint, at the address of its block; every node or triangle
    /// that a ray visits, at its first byte
    Texel,
    /// Every distinct cache line of a footprint, which `replay run` counts as look-ups, or of a
    /// visit
    #[default]
    Line,
}

/// Arguments of `replay convert`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay convert c.textrace --to din --order z2-sta | dineroIV -informat d ...
  replay convert c.textrace --to csv --granularity texel -o c.csv
  replay convert c.textrace --to textrace --encoding raw -o raw.textrace
  replay convert r.raytrace --to csv | head
Rays come tile by tile, left eye first; their accesses need a trace with visits
(tracegen rays --visits).")]
pub struct ConvertArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// What to write
    #[arg(long)]
    pub to: Target,
    /// Output file; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    pub output: PathBuf,
    /// What counts as an access
    #[arg(long, value_enum, default_value_t)]
    pub granularity: GranularityName,
    /// Tile encoding of --to textrace
    #[arg(long, value_enum, default_value_t)]
    pub encoding: EncodingName,
    /// Order, sampling and layout; what concerns caches has no effect here
    #[command(flatten)]
    pub machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, the configuration is impossible, or the output cannot be written.
pub fn run(args: &ConvertArgs) -> Result<ExitCode> {
    let config = args.machine.resolve()?;
    let output = if args.to.is_text() {
        Output::text("--output", &args.output)
    } else {
        Output::binary("--output", &args.output)
    };
    let inputs = [Some(args.trace.as_path()), args.machine.file()];
    shell::check_outputs(&[output], inputs.into_iter().flatten())?;
    let trace = Trace::open(&args.trace)?;
    if matches!(args.to, Target::Textrace | Target::Raytrace) {
        reencode(&trace, args)?;
    } else if is_stdout(&args.output) {
        let mut out = BufWriter::new(io::stdout().lock());
        write_accesses(&trace, &config, args, &mut out)?;
        out.flush()?;
    } else {
        let name = || format!("cannot write {}", args.output.display());
        let mut out = AtomicFile::create(&args.output).with_context(name)?;
        write_accesses(&trace, &config, args, &mut out).with_context(name)?;
        out.persist().with_context(name)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write_accesses(
    trace: &Trace,
    config: &RunConfig,
    args: &ConvertArgs,
    out: &mut impl Write,
) -> Result<()> {
    match trace {
        Trace::Texture(trace) => {
            let granularity = args.granularity;
            match args.to {
                Target::Csv => accesses(trace, config, granularity, &mut CsvWriter::new(out)?),
                Target::Jsonl => accesses(trace, config, granularity, &mut JsonlWriter(out)),
                _ => accesses(trace, config, granularity, &mut DinWriter(out)),
            }
        }
        Trace::Ray(trace) => ray_accesses(trace, config, args, out),
    }
}

/// Writes the accesses of one core that works through the whole order alone.
fn accesses(
    trace: &Textrace,
    config: &RunConfig,
    granularity: GranularityName,
    sink: &mut impl AccessSink,
) -> Result<()> {
    let tables = trace.tables();
    let layout = Layout::new(&tables.textures, &config.layout)?;
    let expander = Expander {
        tables,
        layout: &layout,
        sampling: config.sampling,
        granularity: match granularity {
            GranularityName::Texel => Granularity::Texel,
            GranularityName::Line => Granularity::Line,
        },
        line_bytes: config.line_bytes,
    };
    let source = shaded(trace, config.hsr)?;
    let order = config.order.build(config.seed);
    for item in order::plan(&*order, &tables.passes).iter().flatten() {
        for_quads(&source, item, |quad| -> Result<()> {
            let origin = Origin {
                pass: quad.at.pass,
                tile: quad.at.tile,
                draw: quad.draw,
                primitive: quad.primitive,
            };
            for record in quad.records {
                expander.expand(origin, record, |access| sink.write(access))?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Writes what the rays read of the hierarchy, in file order.
fn ray_accesses(
    trace: &Raytrace,
    config: &RunConfig,
    args: &ConvertArgs,
    out: &mut impl Write,
) -> Result<()> {
    let tables = trace.tables();
    if !tables.meta.has_visits {
        bail!(
            "{}: the trace lists no visits, so it has no addresses; `tracegen rays --visits` lists them",
            trace.container().file()
        );
    }
    if args.to == Target::Csv {
        writeln!(out, "{}", RayAccess::CSV_HEADER)?;
    }
    let by_line = args.granularity == GranularityName::Line;
    let mut tile = RayTile::default();
    for (eye, index) in ray_tiles(tables) {
        trace.decode_tile(eye, index, &mut tile)?;
        for sample in ray_samples(tables, eye, index, &tile) {
            sample.accesses(&tables.bvh, |access| {
                if !by_line {
                    return write_access(args.to, access, out);
                }
                let bytes = config.line_bytes;
                access.lines(bytes).try_for_each(|address| {
                    let line = RayAccess {
                        address,
                        bytes,
                        ..*access
                    };
                    write_access(args.to, &line, out)
                })
            })?;
        }
    }
    Ok(())
}

fn write_access(to: Target, access: &RayAccess, out: &mut impl Write) -> io::Result<()> {
    match to {
        Target::Csv => access.write_csv(out),
        Target::Jsonl => writeln!(out, "{}", serde_json::to_string(access)?),
        _ => writeln!(out, "0 {:x}", access.address),
    }
}

/// Writes the trace itself.
fn reencode(trace: &Trace, args: &ConvertArgs) -> Result<()> {
    match (trace, args.to) {
        (Trace::Texture(trace), Target::Textrace) => {
            let encoding = match args.encoding {
                EncodingName::Raw => Encoding::Raw,
                EncodingName::Delta => Encoding::Delta,
                EncodingName::Planes => Encoding::Planes,
            };
            let tables = trace.tables();
            let mut writer = TextraceWriter::create(&args.output, tables)?;
            let mut tile = Tile::default();
            for (pass, index) in tiles(&tables.passes) {
                trace.decode_tile(pass, index, &mut tile)?;
                writer.append(pass, index, encode_tile_as(encoding, tables, &tile)?)?;
            }
            writer.finish()?;
        }
        (Trace::Ray(trace), Target::Raytrace) => {
            let tables = trace.tables();
            let mut writer = RaytraceWriter::create(&args.output)?;
            let mut tile = RayTile::default();
            for (eye, index) in ray_tiles(tables) {
                trace.decode_tile(eye, index, &mut tile)?;
                writer.tile(&encode_ray_tile(&tile, tables.meta.has_visits)?)?;
            }
            writer.finish(tables)?;
        }
        _ => bail!(
            "{}: a {} cannot become a trace of the other kind",
            trace.container().file(),
            trace.container().kind()
        ),
    }
    Ok(())
}

#[cfg(test)]
mod tests;
