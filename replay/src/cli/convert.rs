//! `replay convert`: writes a trace in another encoding, or its accesses for other simulators.

pub(super) mod columns;

use super::ConfigArgs;
use super::tiles::{ray_tiles, tiles};
use anyhow::{Context, Result, bail, ensure};
use columns::RowKind;
use formats::Trace;
use formats::container::{AtomicFile, is_stdout};
use formats::interop::plain::{CompressedWriter, Compression, PlainForm};
use formats::interop::{Access, Expander, Granularity, Origin, RayAccess, ray_samples};
use formats::layout::Layout;
use formats::raytrace::{
    RayTile, Raytrace, RaytraceWriter, encode_ray_tile, encode_ray_tile_with_geometry,
};
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as, with_operands};
use report::notices;
use shell::Output;
use sim::config::{Order, RunConfig};
use sim::order::rays::{RayPlan, eye_of, tiles_of};
use sim::order::{PlanInputs, TileRef};
use sim::stream::{TileSource, for_quads, plan, ray_counters, rendered};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Output forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// Text for Dinero: `0 HEXADDR` per line
    Din,
    /// Addresses, 32 bits, little-endian
    U32,
    /// Addresses, 64 bits, little-endian
    U64,
    /// Packet trace for gem5 (protocol-buffer messages)
    Gem5,
    /// LoadStoreTrace for Ramulator 2: `LD 0xADDR` per line
    Ramulator,
    /// SimpleO3 trace for Ramulator 2: `0 ADDR` per line, decimal
    RamulatorO3,
    /// 64-byte instruction records for ChampSim, one load each; addresses start at 2^40
    Champsim,
    /// Accesses as CSV, with texture, level and texel, or with ray and node
    Csv,
    /// The columns of csv as JSON Lines
    Jsonl,
    /// The columns of csv as an array of NumPy with named fields
    Npy,
    /// The columns of csv as Parquet
    Parquet,
    /// Texture trace with its tiles encoded again
    Textrace,
    /// Ray trace with its tiles encoded again
    Raytrace,
}

impl Target {
    /// The plain form, if the output has only addresses.
    fn plain(self) -> Option<PlainForm> {
        Some(match self {
            Self::Din => PlainForm::Din,
            Self::U32 => PlainForm::U32,
            Self::U64 => PlainForm::U64,
            Self::Gem5 => PlainForm::Gem5,
            Self::Ramulator => PlainForm::Ramulator,
            Self::RamulatorO3 => PlainForm::RamulatorO3,
            Self::Champsim => PlainForm::Champsim,
            Self::Csv
            | Self::Jsonl
            | Self::Npy
            | Self::Parquet
            | Self::Textrace
            | Self::Raytrace => return None,
        })
    }

    fn is_trace(self) -> bool {
        matches!(self, Self::Textrace | Self::Raytrace)
    }

    fn is_text(self) -> bool {
        let lines = matches!(self, Self::Csv | Self::Jsonl);
        lines || self.plain().is_some_and(PlainForm::is_text)
    }

    fn has_rows(self) -> bool {
        self.plain().is_none() && !self.is_trace()
    }
}

/// Compressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CompressionName {
    /// gzip
    Gzip,
    /// Zstandard
    Zstd,
}

/// Tile encodings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// Records as in memory
    Raw,
    /// Bit-packed differences
    #[default]
    Delta,
    /// One plane per primitive: about half the size of delta, slower to read and write
    Planes,
}

/// Access granularities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum GranularityName {
    /// Every distinct texel of a footprint, at the address of its block; for rays, every visited node or
    /// triangle, at its first byte
    Texel,
    /// Every distinct cache line of a footprint, which `replay run` counts as look-ups; for rays, every
    /// distinct line of a visit
    #[default]
    Line,
    /// With csv, jsonl, npy and parquet: no accesses, but every record or ray, with the columns of
    /// `replay dump --parquet`
    Record,
    /// Likewise, every child of every inner node of a ray trace's hierarchy
    Node,
    /// Likewise, the triangle of every slot of the hierarchy
    Slot,
}

impl GranularityName {
    /// The flag's value and the rows, if the output holds rows of the trace instead of accesses.
    fn of_rows(self) -> Option<(&'static str, RowKind)> {
        match self {
            Self::Texel | Self::Line => None,
            Self::Record => Some(("record", RowKind::Record)),
            Self::Node => Some(("node", RowKind::Node)),
            Self::Slot => Some(("slot", RowKind::Slot)),
        }
    }
}

/// Arguments of `replay convert`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay convert c.textrace --to din --order z2-sta | dineroIV -informat d ...
  replay convert c.textrace --to u32 --order morton -o c.u32.zst
  replay convert c.textrace --to csv --granularity texel -o c.csv
  replay convert c.textrace --to npy --order z2-sta -o c.npy
  replay convert c.textrace --to npy --granularity record -o records.npy
  replay convert c.textrace --to textrace --encoding raw -o raw.textrace
  replay convert r.raytrace --to csv | head
  replay convert r.raytrace --to din --order z2-lrta -o r.din
  replay convert r.raytrace --to npy --granularity node -o nodes.npy
Without --order, rays are written tile by tile, left eye first. Their accesses need a trace with
visits (tracegen rays --visits).")]
pub struct ConvertArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// Output form
    #[arg(long)]
    pub to: Target,
    /// Output file; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    pub output: PathBuf,
    /// Compression of the accesses [default: from the output's extension, .gz or .zst]
    #[arg(long, value_name = "METHOD")]
    pub compress: Option<CompressionName>,
    /// Unit of an access [default: line]
    #[arg(long)]
    pub granularity: Option<GranularityName>,
    /// Tile encoding of --to textrace [default: delta]
    #[arg(long)]
    pub encoding: Option<EncodingName>,
    /// Sampling and layout for a texture trace, --order and --line for both kinds. Of the caches only the line size
    /// counts, and the size of the L2 where the order depends on it
    #[command(flatten)]
    pub machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, the configuration is invalid, or the output cannot be written.
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
    let trace = notices::open(&args.trace)?;
    if matches!(trace, Trace::Ray(_)) {
        args.check_for_rays(&config)?;
    }
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
    /// Fails if a flag does not apply to the output form.
    fn check(&self) -> Result<()> {
        ensure!(
            self.encoding.is_none() || self.to == Target::Textrace,
            "--encoding: only with --to textrace"
        );
        if let Some((rows, _)) = self.granularity.and_then(GranularityName::of_rows) {
            ensure!(
                self.to.has_rows(),
                "--granularity {rows}: only with --to csv, jsonl, npy and parquet"
            );
            if let Some(flag) = self.machine.first_of_traces() {
                bail!("{flag}: it has no effect on records, only on accesses");
            }
        }
        if self.to.is_trace() {
            ensure!(
                self.granularity.is_none(),
                "--granularity: expected accesses to write, found a trace"
            );
            if let Some(flag) = self.machine.first_of_traces() {
                bail!("{flag}: it has no effect on a trace, only on accesses");
            }
        }
        Ok(())
    }

    /// Fails if a setting of tiles and textures other than the order is given for rays, or an order for no accesses.
    fn check_for_rays(&self, config: &RunConfig) -> Result<()> {
        if let Some(flag) = self.machine.without_order().first_of_traces() {
            bail!("{flag}: it has no effect on a ray trace");
        }
        if let Some(order) = self.machine.order() {
            RayPlan::check(order).context("--order")?;
        } else if let (Some(file), true) = (
            self.machine.file(),
            config.order != RunConfig::default().order,
        ) {
            bail!(
                "{}: order {} has no effect on a ray trace; give it with --order",
                file.display(),
                config.order.name()
            );
        }
        Ok(())
    }

    /// Compression of the accesses: from the flag, or from the output's extension.
    fn compression(&self) -> Result<Option<Compression>> {
        let named = Compression::of_name(&self.output.to_string_lossy());
        if self.to.is_trace() {
            let asked = match named {
                None => "--compress".to_owned(),
                Some(_) => format!("--output {}", self.output.display()),
            };
            ensure!(
                self.compress.is_none() && named.is_none(),
                "{asked}: a trace cannot be compressed as a whole; use --encoding, which compresses its tiles"
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
                "--compress {}: expected {}, because the output is named {}",
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
    out: &mut (impl Write + Send),
) -> Result<()> {
    if let Some((_, kind)) = args.granularity().of_rows() {
        return columns::of_trace(trace, kind, args.to, out, &|_, _| true);
    }
    if let Trace::Ray(trace) = trace
        && !trace.tables().meta.has_visits
    {
        bail!(
            "{}: the trace has no visits and therefore no addresses; capture it with `tracegen rays --visits`",
            trace.container().file()
        );
    }
    match trace {
        Trace::Texture(trace) => columns::rows::<Access>(args.to, out, |sink| {
            accesses(trace, config, args.granularity(), sink)
        }),
        Trace::Ray(trace) => {
            columns::rows::<RayAccess>(args.to, out, |sink| ray_accesses(trace, config, args, sink))
        }
    }
}

/// Writes the accesses of one core that renders the whole order, as `replay run --cores 1` replays them.
fn accesses(
    trace: &Textrace,
    config: &RunConfig,
    granularity: GranularityName,
    sink: columns::Row<'_, Access>,
) -> Result<()> {
    let config = &RunConfig {
        cores: 1,
        ..*config
    };
    let source = rendered(trace, config)?;
    let tables = source.tables();
    let layout = Layout::new(&tables.textures, &config.layout)?;
    let expander = Expander {
        tables,
        layout: &layout,
        sampling: config.sampling,
        granularity: match granularity {
            GranularityName::Texel => Granularity::Texel,
            _ => Granularity::Line,
        },
        line_bytes: config.line_bytes,
    };
    for item in plan(&source, config)?.iter().flatten() {
        for_quads(&source, item, |quad| -> Result<()> {
            let origin = Origin {
                pass: quad.at.pass,
                tile: quad.at.tile,
                draw: quad.draw,
                primitive: quad.primitive,
            };
            for (record, operands) in with_operands(quad.records) {
                expander.expand(origin, record, operands, &mut *sink)?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Writes the accesses of rays to the hierarchy as one unit makes them, without an order in file order.
fn ray_accesses(
    trace: &Raytrace,
    config: &RunConfig,
    args: &ConvertArgs,
    sink: columns::Row<'_, RayAccess>,
) -> Result<()> {
    let tables = trace.tables();
    let by_line = args.granularity() == GranularityName::Line;
    let order = args.machine.order().unwrap_or(Order::SCANLINE);
    let mut inputs = PlanInputs {
        cores: 1,
        ..PlanInputs::new(config, &tables.meta.trace)
    };
    let decode = |eye, index, tile: &mut RayTile| trace.decode_tile(eye, index, tile);
    let counters = if order.parts().needs_counters() {
        Some(ray_counters(tables, &inputs, decode)?)
    } else {
        None
    };
    inputs.last = counters.as_ref();
    let plan = RayPlan::new(order, &inputs, tables, 0);
    for batch in plan.batches() {
        let places: Vec<TileRef> = tiles_of(batch).collect();
        let mut tiles = vec![RayTile::default(); places.len()];
        let mut samples = Vec::new();
        for (at, tile) in places.iter().zip(&mut tiles) {
            decode(eye_of(*at), at.tile, tile)?;
        }
        for (at, tile) in places.iter().zip(&tiles) {
            samples.push(ray_samples(tables, eye_of(*at), at.tile, tile).collect::<Vec<_>>());
        }
        let pixels: Vec<usize> = samples.iter().map(Vec::len).collect();
        for turn in plan.turns(batch, &pixels) {
            samples[turn.tile][turn.pixel].accesses(&tables.bvh, |access| {
                if !by_line {
                    return sink(access);
                }
                let bytes = config.line_bytes;
                access.lines(bytes).try_for_each(|address| {
                    sink(&RayAccess {
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

/// Writes the trace in the requested encoding.
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
            if let Some((hierarchy, _)) = trace.read_hierarchy()? {
                writer = writer.with_hierarchy(hierarchy);
            }
            let mut tile = RayTile::default();
            for (eye, index) in ray_tiles(tables) {
                trace.decode_tile_with_geometry(eye, index, &mut tile)?;
                let encoded = if trace.has_geometry() {
                    encode_ray_tile_with_geometry(tables, tables.camera(eye), &tile)?
                } else {
                    encode_ray_tile(&tile, tables.meta.has_visits)?
                };
                writer.tile(&encoded)?;
            }
            writer.finish(tables)?;
        }
        _ => bail!(
            "{}: a {} cannot be converted to the other kind of trace",
            trace.container().file(),
            trace.container().kind()
        ),
    }
    Ok(())
}

#[cfg(test)]
mod tests;
