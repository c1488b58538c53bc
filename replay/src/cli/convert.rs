//! `replay convert`: a trace in another encoding, or as plain accesses for other simulators.

use super::ConfigArgs;
use super::trace_file::tiles;
use crate::config::RunConfig;
use crate::order;
use crate::stream::Feed;
use anyhow::{Context, Result, bail};
use formats::container::AtomicFile;
use formats::interop::{
    AccessSink, CsvWriter, DinWriter, Expander, Granularity, JsonlWriter, Origin,
};
use formats::layout::Layout;
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// What to convert to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// Dinero's text: `0 HEXADDR` a line
    Din,
    /// Comma-separated accesses with texture, level and texel
    Csv,
    /// The same as one JSON object a line
    Jsonl,
    /// A trace, its tiles encoded anew
    Textrace,
}

/// Tile encodings by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// Records as they are in memory
    Raw,
    /// Bit-packed differences
    #[default]
    Delta,
}

/// Access granularities by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum GranularityName {
    /// Every distinct texel of a footprint, at the address of its block
    Texel,
    /// Every distinct cache line of a footprint: what `replay run` counts as look-ups
    #[default]
    Line,
}

/// Arguments of `replay convert`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay convert c.textrace --to din --order z2-sta | dineroIV -informat d ...
  replay convert c.textrace --to csv --granularity texel -o c.csv
  replay convert c.textrace --to textrace --encoding raw -o raw.textrace")]
pub struct ConvertArgs {
    /// Texture trace
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
    let trace = Textrace::open(&args.trace)?;
    if args.to == Target::Textrace {
        return reencode(&trace, args);
    }
    if args.output.as_os_str() == "-" {
        let mut out = BufWriter::new(io::stdout().lock());
        write_accesses(&trace, &config, args, &mut out)?;
        out.flush()?;
    } else {
        let name = || args.output.display().to_string();
        let mut out = AtomicFile::create(&args.output).with_context(name)?;
        write_accesses(&trace, &config, args, &mut out)?;
        out.persist().with_context(name)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write_accesses(
    trace: &Textrace,
    config: &RunConfig,
    args: &ConvertArgs,
    out: &mut impl Write,
) -> Result<()> {
    match args.to {
        Target::Din => accesses(trace, config, args.granularity, &mut DinWriter(out)),
        Target::Csv => accesses(trace, config, args.granularity, &mut CsvWriter::new(out)?),
        Target::Jsonl => accesses(trace, config, args.granularity, &mut JsonlWriter(out)),
        Target::Textrace => bail!("a trace is not a list of accesses"),
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
    let order = config.order.build(config.seed);
    let mut feed = Feed::default();
    for item in order::plan(&*order, &tables.passes).iter().flatten() {
        feed.load(trace, item)?;
        while let Some(quad) = feed.next_quad() {
            let origin = Origin {
                pass: quad.at.pass,
                tile: quad.at.tile,
                draw: quad.draw,
                primitive: quad.primitive,
            };
            for record in quad.records {
                expander.expand(origin, record, |access| sink.write(access))?;
            }
        }
    }
    Ok(())
}

fn reencode(trace: &Textrace, args: &ConvertArgs) -> Result<ExitCode> {
    let encoding = match args.encoding {
        EncodingName::Raw => Encoding::Raw,
        EncodingName::Delta => Encoding::Delta,
    };
    if args.output.as_os_str() == "-" {
        let mut out = io::stdout().lock();
        if out.is_terminal() {
            bail!("a trace is binary: name a file with --output, or redirect standard output");
        }
        let mut writer = TextraceWriter::in_memory(trace.tables())?;
        append_tiles(trace, encoding, &mut writer)?;
        out.write_all(&writer.into_bytes()?)?;
        out.flush()?;
    } else {
        let mut writer = TextraceWriter::create(&args.output, trace.tables())?;
        append_tiles(trace, encoding, &mut writer)?;
        writer.finish()?;
    }
    Ok(ExitCode::SUCCESS)
}

fn append_tiles<W: Write + io::Seek>(
    trace: &Textrace,
    encoding: Encoding,
    writer: &mut TextraceWriter<W>,
) -> Result<()> {
    let mut tile = Tile::default();
    for (pass, index) in tiles(&trace.tables().passes) {
        trace.decode_tile(pass, index, &mut tile)?;
        let encoded = encode_tile_as(encoding, trace.tables(), &tile)?;
        writer.append(pass, index, encoded)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
