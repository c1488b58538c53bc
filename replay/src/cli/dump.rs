//! `replay dump`: prints decoded records as JSON Lines.

use super::convert::Target;
use super::convert::columns::{self, RowKind};
use super::tiles::NumberRange;
use crate::files;
use crate::records::{self, Tiles};
use anyhow::{Context, Result, bail, ensure};
use formats::Trace;
use formats::container::AtomicFile;
use formats::interop::{node_to_json, slot_rows, slot_to_json};
use formats::raytrace::Raytrace;
use formats::textrace::Textrace;
use report::notices;
use shell::Output;
use std::cell::Cell;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `replay dump`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A texture trace has one line per record. A ray trace has one line per sample of a pixel,
with its rays and, if the trace has them, their geometry and their visits.

Examples:
  replay dump c.textrace --pass 0 --tile 1200
  replay dump c.textrace --tile 40..48 | jq .primitive
  replay dump r.raytrace --pass 1 --tile 7 | jq '.rays[].steps'
  replay dump r.raytrace --nodes --parquet nodes.parquet
  replay dump c.textrace --parquet records.parquet"
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
    /// Print the texture reads of vertex shaders instead, one line per read, in the order of draws, instances
    /// and vertices
    #[arg(long, conflicts_with_all = ["pass", "tile", "lists", "parquet"])]
    pub vertex_reads: bool,
    /// Print the hierarchy's inner nodes instead, one line per node; in Parquet, one row per child. Needs a
    /// trace captured with `tracegen rays --hierarchy`
    #[arg(long, conflicts_with_all = ["pass", "tile", "lists", "samples"])]
    pub nodes: bool,
    /// Print the hierarchy's triangles instead, one line per slot. Needs a trace captured with
    /// `tracegen rays --hierarchy`
    #[arg(long, conflicts_with_all = ["pass", "tile", "lists", "samples", "nodes"])]
    pub slots: bool,
    /// Write a Parquet file instead: one row per record or, for ray traces, one row per ray
    #[arg(long, value_name = "FILE", conflicts_with = "lists")]
    pub parquet: Option<PathBuf>,
    /// One row per sample of a pixel, with its hit and its colour, instead of one per ray
    #[arg(long, requires = "parquet")]
    pub samples: bool,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read, it does not have such a pass or tile, or the output cannot be written.
pub fn run(args: &DumpArgs) -> Result<ExitCode> {
    if let Some(path) = &args.parquet {
        files::check_outputs(&[Output::binary("--parquet", path)], [args.trace.as_path()])?;
        to_parquet(&notices::open(&args.trace)?, args, path)?;
        return Ok(ExitCode::SUCCESS);
    }
    let trace = notices::open(&args.trace)?;
    let mut out = shell::stdout();
    match &trace {
        _ if args.nodes || args.slots => hierarchy(&trace, args, &mut out)?,
        Trace::Texture(trace) if args.lists => primitive_lists(trace, &mut out)?,
        Trace::Texture(trace) if args.vertex_reads => vertex_reads(trace, &mut out)?,
        Trace::Ray(_) if args.lists || args.vertex_reads => bail!(
            "{}: expected a texture trace, found {}",
            if args.lists {
                "--lists"
            } else {
                "--vertex-reads"
            },
            args.trace.display()
        ),
        _ => dump(&trace, args, &mut out)?,
    }
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

impl DumpArgs {
    /// Whether a tile of a pass is to be dumped.
    fn has(&self, pass: usize, tile: usize) -> bool {
        self.pass.is_none_or(|range| range.contains(pass))
            && self.tile.is_none_or(|range| range.contains(tile))
    }
}

/// Writes the chosen rows as Parquet.
fn to_parquet(trace: &Trace, args: &DumpArgs, path: &Path) -> Result<()> {
    ensure!(
        !args.samples || matches!(trace, Trace::Ray(_)),
        "--samples: expected a ray trace, found {}",
        args.trace.display()
    );
    let kind = match args {
        _ if args.nodes || args.slots => {
            let trace = ray_trace(trace, args)?;
            if !trace.has_hierarchy() {
                records::hierarchy(trace)?;
            }
            if args.nodes {
                RowKind::Node
            } else {
                RowKind::Slot
            }
        }
        _ if args.samples => RowKind::Sample,
        _ => RowKind::Record,
    };
    let name = || format!("cannot write {}", path.display());
    let mut out = AtomicFile::create(path).with_context(name)?;
    let any = Cell::new(args.nodes || args.slots);
    let chosen = |pass, tile| {
        let is_chosen = args.has(pass, tile);
        any.set(any.get() || is_chosen);
        is_chosen
    };
    columns::of_trace(trace, kind, Target::Parquet, &mut out, &chosen).with_context(name)?;
    check_any(any.get(), trace, args)?;
    out.persist().with_context(name)
}

fn dump(trace: &Trace, args: &DumpArgs, out: &mut impl Write) -> Result<()> {
    let any = match trace {
        Trace::Texture(trace) => lines(&**trace, args, out)?,
        Trace::Ray(trace) => lines(&**trace, args, out)?,
    };
    check_any(any, trace, args)
}

/// Fails if no tile matched.
fn check_any(any: bool, trace: &Trace, args: &DumpArgs) -> Result<()> {
    if any {
        return Ok(());
    }
    let (passes, most) = match trace {
        Trace::Texture(trace) => {
            let passes = &trace.tables().passes;
            let most = passes.iter().map(formats::textrace::Pass::tile_count).max();
            (passes.len(), most.unwrap_or(0))
        }
        Trace::Ray(trace) => (2, trace.tables().tile_count()),
    };
    let first = |range: Option<NumberRange>| range.map_or(0, NumberRange::first);
    bail!(
        "{}: no pass {} tile {}; the trace has {passes} passes of at most {most} tiles",
        trace.container().file(),
        first(args.pass),
        first(args.tile),
    )
}

/// Prints the chosen tiles line by line; returns false if no tile matches.
fn lines<T: Tiles>(trace: &T, args: &DumpArgs, out: &mut impl Write) -> Result<bool> {
    let mut tile = T::Content::default();
    let mut any = false;
    for at in trace.places() {
        let (pass, number) = T::numbers(at);
        if args.has(pass, number) {
            any = true;
            trace.decode(at, &mut tile)?;
            for line in trace.lines(at, &tile)? {
                writeln!(out, "{line}")?;
            }
        }
    }
    Ok(any)
}

/// The ray trace whose hierarchy is asked for.
fn ray_trace<'a>(trace: &'a Trace, args: &DumpArgs) -> Result<&'a Raytrace> {
    match trace {
        Trace::Ray(trace) => Ok(trace),
        Trace::Texture(_) => bail!(
            "{}: expected a ray trace, found {}",
            if args.nodes { "--nodes" } else { "--slots" },
            args.trace.display()
        ),
    }
}

/// Prints the inner nodes or the triangles of the hierarchy.
fn hierarchy(trace: &Trace, args: &DumpArgs, out: &mut impl Write) -> Result<()> {
    let trace = ray_trace(trace, args)?;
    let (bvh, hierarchy) = (&trace.tables().bvh, records::hierarchy(trace)?);
    if args.nodes {
        let nodes = hierarchy.children.chunks(bvh.traversal.width());
        for (node, children) in (0u32..).zip(nodes) {
            writeln!(out, "{}", node_to_json(bvh, node, children)?)?;
        }
    } else {
        for row in slot_rows(&hierarchy) {
            writeln!(out, "{}", slot_to_json(bvh, &row)?)?;
        }
    }
    Ok(())
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

/// Prints the texture reads of vertex shaders.
fn vertex_reads(trace: &Textrace, out: &mut impl Write) -> Result<()> {
    ensure!(
        !trace.vertex_reads().is_empty(),
        "{}: expected a trace with texture reads of vertex shaders, found none",
        trace.container().file()
    );
    for draw in trace.vertex_reads() {
        for read in &draw.reads {
            let Some(site) = draw.sites.get(read.site as usize) else {
                continue;
            };
            let mut line = serde_json::json!({
                "frame": draw.frame, "eye": draw.eye, "draw": draw.draw, "instance": read.instance,
                "vertex": read.vertex, "texture": site.texture, "layer": read.layer, "offset": site.offset,
            });
            if site.fetches {
                line["texel"] = serde_json::json!(read.at.map(u32::cast_signed));
                line["level"] = read.level.cast_signed().into();
            } else {
                line["sampler"] = site.sampler.into();
                line["uv"] = serde_json::json!(read.at.map(f32::from_bits));
                line["level"] = f32::from_bits(read.level).into();
            }
            writeln!(out, "{line}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::{self, file_of};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use sim::stream::testing::Synthetic;

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
            vertex_reads: false,
            nodes: false,
            slots: false,
            parquet: None,
            samples: false,
        };
        let mut text = Vec::new();
        dump(&trace, &args, &mut text).unwrap();
        let expected: usize = memory.tiles[1][2..5].iter().map(|t| t.records.len()).sum();
        let lines = testing::lines(&text);
        assert!(expected > 0);
        assert_eq!(lines.len(), expected);
        let first: serde_json::Value = serde_json::from_str(&lines[0]).unwrap();
        assert_eq!(first["uv"][0], memory.tiles[1][2].records[0].uv[0]);
    }

    #[test]
    fn parquet_holds_the_chosen_rows_and_is_absent_after_an_error() {
        let memory = Synthetic::default().generate();
        let file = file_of(&memory);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.parquet");
        let args = |pass: &str, samples| DumpArgs {
            trace: file.path().to_owned(),
            pass: Some(pass.parse().unwrap()),
            tile: Some("2..5".parse().unwrap()),
            lists: false,
            vertex_reads: false,
            nodes: false,
            slots: false,
            parquet: Some(path.clone()),
            samples,
        };
        for (args, expected) in [
            (args("9", false), "no pass 9 tile 2"),
            (args("1", true), "--samples: expected a ray trace, found"),
        ] {
            let error = run(&args).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        }
        run(&args("1", false)).unwrap();
        let rows: usize = memory.tiles[1][2..5].iter().map(|t| t.records.len()).sum();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let found = reader.metadata().file_metadata().num_rows();
        assert_eq!(found, i64::try_from(rows).unwrap());
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
            vertex_reads: false,
            nodes: false,
            slots: false,
            parquet: None,
            samples: false,
        };
        let error = dump(&trace, &args, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("no pass 9"), "{error}");
    }
}
