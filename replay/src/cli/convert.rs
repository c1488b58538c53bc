//! `replay convert`: a trace in another encoding, or as plain accesses for other simulators.

use super::ConfigArgs;
use super::tiles::{ray_tiles, tiles};
use crate::config::RunConfig;
use crate::order;
use crate::stream::{for_quads, rendered};
use anyhow::{Context, Result, bail, ensure};
use formats::Trace;
use formats::container::{AtomicFile, is_stdout};
use formats::interop::plain::{CompressedWriter, Compression, PlainAccess, PlainForm, PlainWriter};
use formats::interop::{
    AccessSink, CsvWriter, Expander, Granularity, JsonlWriter, Origin, RayAccess, ray_samples,
};
use formats::layout::Layout;
use formats::raytrace::{RayTile, Raytrace, RaytraceWriter, encode_ray_tile};
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as, with_operands};
use shell::Output;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// What to convert to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// Dinero's text: `0 HEXADDR` a line
    Din,
    /// Addresses of 32 bits, little-endian
    U32,
    /// Addresses of 64 bits
    U64,
    /// gem5's packet trace: protocol-buffer messages
    Gem5,
    /// Ramulator 2's LoadStoreTrace: `LD 0xADDR` a line
    Ramulator,
    /// Ramulator 2's SimpleO3 trace: `0 ADDR` a line, decimal
    RamulatorO3,
    /// ChampSim's 64-byte instruction records, a load each; addresses begin at 2^40
    Champsim,
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
    /// The form, if accesses are written as addresses alone.
    fn plain(self) -> Option<PlainForm> {
        Some(match self {
            Self::Din => PlainForm::Din,
            Self::U32 => PlainForm::U32,
            Self::U64 => PlainForm::U64,
            Self::Gem5 => PlainForm::Gem5,
            Self::Ramulator => PlainForm::Ramulator,
            Self::RamulatorO3 => PlainForm::RamulatorO3,
            Self::Champsim => PlainForm::Champsim,
            Self::Csv | Self::Jsonl | Self::Textrace | Self::Raytrace => return None,
        })
    }

    fn is_trace(self) -> bool {
        matches!(self, Self::Textrace | Self::Raytrace)
    }

    fn is_text(self) -> bool {
        !self.is_trace() && self.plain().is_none_or(PlainForm::is_text)
    }
}

/// Compressions by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CompressionName {
    /// gzip
    Gzip,
    /// Zstandard
    Zstd,
}

/// Tile encodings by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// Records as they are in memory
    Raw,
    /// Bit-packed differences
    #[default]
    Delta,
    /// A plane for each primitive: about 0.5 of the size, slower to read and to write
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
  replay convert c.textrace --to u32 --order morton -o c.u32.zst
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
    /// Compress accesses [default: as the output's name asks, .gz or .zst]
    #[arg(long, value_name = "METHOD")]
    pub compress: Option<CompressionName>,
    /// What counts as an access [default: line]
    #[arg(long)]
    pub granularity: Option<GranularityName>,
    /// Tile encoding of --to textrace [default: delta]
    #[arg(long)]
    pub encoding: Option<EncodingName>,
    /// Order, sampling and layout; what concerns caches has no effect here
    #[command(flatten)]
    pub machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, the configuration is impossible, or the output cannot be written.
pub fn run(args: &ConvertArgs) -> Result<ExitCode> {
    args.check()?;
    let config = args.machine.resolve()?;
    let compression = args.compression()?;
    let output = if args.to.is_text() && compression.is_none() {
        Output::text("--output", &args.output)
    } else {
        Output::binary("--output", &args.output)
    };
    let inputs = [Some(args.trace.as_path()), args.machine.file()];
    shell::check_outputs(&[output], inputs.into_iter().flatten())?;
    let trace = Trace::open(&args.trace)?;
    if args.to.is_trace() {
        reencode(&trace, args)?;
    } else if is_stdout(&args.output) {
        let mut out = CompressedWriter::new(compression, shell::stdout());
        write_accesses(&trace, &config, args, &mut out)?;
        out.finish()?.flush()?;
    } else {
        let name = || format!("cannot write {}", args.output.display());
        let out = AtomicFile::create(&args.output).with_context(name)?;
        let mut out = CompressedWriter::new(compression, out);
        write_accesses(&trace, &config, args, &mut out).with_context(name)?;
        out.finish()?.persist().with_context(name)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl ConvertArgs {
    /// Refuses flags that say nothing about what is written.
    fn check(&self) -> Result<()> {
        ensure!(
            self.encoding.is_none() || self.to == Target::Textrace,
            "--encoding: only with --to textrace"
        );
        if self.to.is_trace() {
            ensure!(
                self.granularity.is_none(),
                "--granularity: expected accesses to write, found a trace"
            );
            if let Some(flag) = self.machine.first_of_traces() {
                bail!("{flag}: a trace holds records, whatever the machine: it is for accesses");
            }
        }
        Ok(())
    }

    /// What accesses are compressed by: the flag, or else the name of the output.
    fn compression(&self) -> Result<Option<Compression>> {
        let named = Compression::of_name(&self.output.to_string_lossy());
        if self.to.is_trace() {
            let asked = match named {
                None => "--compress".to_owned(),
                Some(_) => format!("--output {}", self.output.display()),
            };
            ensure!(
                self.compress.is_none() && named.is_none(),
                "{asked}: a trace is not compressed as a whole: its tiles are packed by --encoding"
            );
            return Ok(None);
        }
        let flag = match self.compress {
            Some(CompressionName::Gzip) => Some(Compression::Gzip),
            Some(CompressionName::Zstd) => Some(Compression::Zstd),
            None => return Ok(named),
        };
        if let (Some(flag), Some(named)) = (flag, named)
            && flag != named
        {
            bail!(
                "--compress {}: expected {}, which the name {} asks for",
                flag.name(),
                named.name(),
                self.output.display()
            );
        }
        Ok(flag)
    }

    fn granularity(&self) -> GranularityName {
        self.granularity.unwrap_or_default()
    }
}

fn write_accesses(
    trace: &Trace,
    config: &RunConfig,
    args: &ConvertArgs,
    out: &mut impl Write,
) -> Result<()> {
    if let Trace::Ray(trace) = trace
        && !trace.tables().meta.has_visits
    {
        bail!(
            "{}: the trace lists no visits, so it has no addresses; `tracegen rays --visits` lists them",
            trace.container().file()
        );
    }
    match (trace, args.to.plain()) {
        (Trace::Texture(trace), Some(form)) => {
            let mut sink = PlainWriter::new(form, out)?;
            accesses(trace, config, args.granularity(), &mut sink)
        }
        (Trace::Texture(trace), None) if args.to == Target::Csv => {
            accesses(trace, config, args.granularity(), &mut CsvWriter::new(out)?)
        }
        (Trace::Texture(trace), None) => {
            accesses(trace, config, args.granularity(), &mut JsonlWriter(out))
        }
        (Trace::Ray(trace), Some(form)) => {
            let mut out = PlainWriter::new(form, out)?;
            ray_accesses(trace, config, args, |access| {
                out.access(&PlainAccess::read(access.address, access.bytes))
            })
        }
        (Trace::Ray(trace), None) if args.to == Target::Csv => {
            writeln!(out, "{}", RayAccess::CSV_HEADER)?;
            ray_accesses(trace, config, args, |access| access.write_csv(out))
        }
        (Trace::Ray(trace), None) => ray_accesses(trace, config, args, |access| {
            writeln!(out, "{}", serde_json::to_string(access)?)
        }),
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
    let source = rendered(trace, config)?;
    let order = config.order.build(config.seed);
    for item in order::plan(&*order, &tables.passes).iter().flatten() {
        for_quads(&source, item, |quad| -> Result<()> {
            let origin = Origin {
                pass: quad.at.pass,
                tile: quad.at.tile,
                draw: quad.draw,
                primitive: quad.primitive,
            };
            for (record, operands) in with_operands(quad.records) {
                expander.expand(origin, record, operands, |access| sink.write(access))?;
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
    mut write: impl FnMut(&RayAccess) -> io::Result<()>,
) -> Result<()> {
    let tables = trace.tables();
    let by_line = args.granularity() == GranularityName::Line;
    let mut tile = RayTile::default();
    for (eye, index) in ray_tiles(tables) {
        trace.decode_tile(eye, index, &mut tile)?;
        for sample in ray_samples(tables, eye, index, &tile) {
            sample.accesses(&tables.bvh, |access| {
                if !by_line {
                    return write(access);
                }
                let bytes = config.line_bytes;
                access.lines(bytes).try_for_each(|address| {
                    write(&RayAccess {
                        address,
                        bytes,
                        ..*access
                    })
                })
            })?;
        }
    }
    Ok(())
}

/// Writes the trace itself.
fn reencode(trace: &Trace, args: &ConvertArgs) -> Result<()> {
    match (trace, args.to) {
        (Trace::Texture(trace), Target::Textrace) => {
            let encoding = match args.encoding.unwrap_or_default() {
                EncodingName::Raw => Encoding::Raw,
                EncodingName::Delta => Encoding::Delta,
                EncodingName::Planes => Encoding::Planes,
            };
            let tables = trace.tables();
            let mut writer = TextraceWriter::create(&args.output, tables)?;
            if let Some(geometry) = trace.geometry() {
                writer = writer.with_geometry(geometry.clone())?;
                for (number, view) in geometry.views.iter().enumerate() {
                    writer.append_view(*view, &trace.tile_lists(number)?)?;
                }
            }
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
