//! `replay info`: what a trace holds.

use super::run::plain;
use super::trace_file::{TraceFile, tiles};
use crate::size::format_bytes;
use anyhow::Result;
use formats::container::Container;
use formats::raytrace::Raytrace;
use formats::textrace::{Encoding, Textrace};
use formats::texture::Texture;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Schema of the object that `replay info --json` prints.
const SCHEMA: &str = "replay.info/1";

/// Arguments of `replay info`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay info c.textrace
  replay info c.textrace --json | jq .totals")]
pub struct InfoArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// Print one JSON object (schema replay.info/1) with the whole tables
    #[arg(long)]
    pub json: bool,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read.
pub fn run(args: &InfoArgs) -> Result<ExitCode> {
    let trace = TraceFile::open(&args.trace)?;
    let value = to_json(&trace)?;
    super::print(&if args.json {
        serde_json::to_string_pretty(&value)?
    } else {
        match &trace {
            TraceFile::Texture(trace) => texture_text(trace, &value),
            TraceFile::Ray(trace) => ray_text(trace),
        }
    })?;
    Ok(ExitCode::SUCCESS)
}

fn to_json(trace: &TraceFile) -> Result<Value> {
    let container = trace.container();
    let mut value = json!({
        "schema": SCHEMA,
        "kind": container.kind().to_string(),
        "version": format!("{}.{}", container.version().0, container.version().1),
        "checksum": format!("{:08x}", container.file_checksum()),
        "file_bytes": container.file_bytes(),
        "chunks": chunks(container),
    });
    if let TraceFile::Texture(trace) = trace {
        let tables = trace.tables();
        value["meta"] = serde_json::to_value(&tables.meta)?;
        value["totals"] = totals(trace)?;
        value["passes"] = passes(trace)?;
        value["textures"] = serde_json::to_value(&tables.textures)?;
        value["samplers"] = serde_json::to_value(&tables.samplers)?;
        value["draws"] = serde_json::to_value(&tables.draws)?;
    }
    Ok(value)
}

fn chunks(container: &Container) -> Vec<Value> {
    let chunk = |entry: &formats::container::ChunkEntry| {
        json!({
            "tag": entry.tag.to_string(),
            "offset_bytes": entry.offset_bytes,
            "length_bytes": entry.length_bytes,
            "crc32": format!("{:08x}", entry.crc32),
        })
    };
    container.directory().iter().map(chunk).collect()
}

/// Counts of some tiles, from the index alone.
#[derive(Default)]
struct Counts {
    tiles: u64,
    touched_tiles: u64,
    records: u64,
    runs: u64,
    bytes: u64,
}

impl Counts {
    fn of(trace: &Textrace, tiles: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut counts = Self::default();
        for (pass, tile) in tiles {
            let stats = trace.tile_stats(pass, tile);
            counts.tiles += 1;
            counts.touched_tiles += u64::from(stats.records > 0);
            counts.records += u64::from(stats.records);
            counts.runs += u64::from(stats.runs);
            counts.bytes += u64::from(stats.bytes);
        }
        counts
    }

    fn to_json(&self) -> Value {
        json!({
            "tiles": self.tiles,
            "touched_tiles": self.touched_tiles,
            "records": self.records,
            "runs": self.runs,
            "tile_bytes": self.bytes,
            "bytes_per_record": self.bytes as f64 / self.records.max(1) as f64,
        })
    }
}

fn totals(trace: &Textrace) -> Result<Value> {
    let passes = &trace.tables().passes;
    let mut value = Counts::of(trace, tiles(passes)).to_json();
    for encoding in [Encoding::Raw, Encoding::Delta] {
        let mut count = 0u64;
        for (pass, tile) in tiles(passes) {
            let used = trace.tile_stats(pass, tile).records > 0;
            count += u64::from(used && trace.tile_encoding(pass, tile)? == encoding);
        }
        let name = serde_json::to_value(encoding)?;
        value["tiles_by_encoding"][name.as_str().unwrap_or_default()] = count.into();
    }
    Ok(value)
}

fn passes(trace: &Textrace) -> Result<Value> {
    let mut all = Vec::new();
    for (index, pass) in trace.tables().passes.iter().enumerate() {
        let mut value = serde_json::to_value(pass)?;
        let of_pass = (0..pass.tile_count() as usize).map(|tile| (index, tile));
        value["counts"] = Counts::of(trace, of_pass).to_json();
        all.push(value);
    }
    Ok(all.into())
}

fn texture_text(trace: &Textrace, value: &Value) -> String {
    let meta = &trace.tables().meta;
    let container = trace.container();
    let totals = &value["totals"];
    let mut text = format!(
        "{}: {} {} ({}), {} bytes\nscene {}, {} triangles, camera {}, {} frame(s)\n\
         written by {} through {} ({})\ncommand {}\ndisplay {} ({}), {}x{} px an eye, IPD {} mm\n\n",
        container.file(),
        container.kind(),
        value["version"].as_str().unwrap_or_default(),
        value["checksum"].as_str().unwrap_or_default(),
        container.file_bytes(),
        meta.scene,
        meta.scene_triangles,
        meta.camera,
        meta.frames.len(),
        meta.tool,
        meta.backend,
        meta.driver,
        meta.command_line.join(" "),
        meta.hmd.name,
        meta.hmd.source,
        meta.hmd.eye_size_px[0],
        meta.hmd.eye_size_px[1],
        meta.hmd.ipd_m * 1000.0,
    );
    text += &pass_table(trace);
    text += "\n\n";
    text += &texture_table(&trace.tables().textures);
    text += &format!(
        "\n\n{} draws, {} samplers; {} records in {} tile bytes, {:.2} bytes a record\n",
        trace.tables().draws.len(),
        trace.tables().samplers.len(),
        totals["records"],
        totals["tile_bytes"],
        totals["bytes_per_record"].as_f64().unwrap_or(0.0),
    );
    text
}

fn pass_table(trace: &Textrace) -> String {
    let mut table = plain(&[
        "pass", "frame", "kind", "eye", "px", "tiles", "records", "runs", "bytes",
    ]);
    for (index, pass) in trace.tables().passes.iter().enumerate() {
        let of_pass = (0..pass.tile_count() as usize).map(|tile| (index, tile));
        let counts = Counts::of(trace, of_pass);
        table.add_row([
            index.to_string(),
            pass.frame.to_string(),
            format!("{:?}", pass.kind).to_lowercase(),
            pass.eye
                .map_or("both".to_owned(), |eye| format!("{eye:?}").to_lowercase()),
            format!("{}x{}", pass.size_px[0], pass.size_px[1]),
            format!("{} of {}", counts.touched_tiles, counts.tiles),
            counts.records.to_string(),
            counts.runs.to_string(),
            counts.bytes.to_string(),
        ]);
    }
    table.to_string()
}

fn texture_table(textures: &[Texture]) -> String {
    let mut table = plain(&["texture", "name", "size", "levels", "layers", "format"]);
    for (index, texture) in textures.iter().enumerate() {
        table.add_row([
            index.to_string(),
            texture.name.clone(),
            format!("{}x{}", texture.size[0], texture.size[1]),
            texture.levels.to_string(),
            texture.layers.to_string(),
            format!("{:?} {:?}", texture.format, texture.color_space).to_lowercase(),
        ]);
    }
    table.to_string()
}

fn ray_text(trace: &Raytrace) -> String {
    let container = trace.container();
    let mut table = plain(&["chunk", "offset", "bytes"]);
    for entry in container.directory() {
        table.add_row([
            entry.tag.to_string(),
            entry.offset_bytes.to_string(),
            entry.length_bytes.to_string(),
        ]);
    }
    let [columns, rows] = trace.tables().tiles();
    format!(
        "{}: {} {}.{} ({:08x}), {}\n2 x {columns}x{rows} tiles, {} materials, {} lights, {} triangles hit\n\n{table}\n",
        container.file(),
        container.kind(),
        container.version().0,
        container.version().1,
        container.file_checksum(),
        format_bytes(container.file_bytes()),
        trace.tables().materials.len(),
        trace.tables().lights.len(),
        trace.tables().triangles.len(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::testing::file_of;
    use crate::stream::synthetic::Synthetic;

    #[test]
    fn totals_are_the_sums_over_the_trace() {
        let memory = Synthetic::default().generate();
        let file = file_of(&memory);
        let value = to_json(&TraceFile::open(file.path()).unwrap()).unwrap();
        let records: usize = memory.tiles.iter().flatten().map(|t| t.records.len()).sum();
        assert_eq!(value["totals"]["records"], records);
        let by_pass = value["passes"].as_array().unwrap();
        let sum: u64 = by_pass
            .iter()
            .map(|p| p["counts"]["records"].as_u64().unwrap())
            .sum();
        assert_eq!(sum, records as u64);
        assert_eq!(value["schema"], "replay.info/1");
    }

    #[test]
    fn the_text_names_every_texture() {
        let memory = Synthetic::default().generate();
        let file = file_of(&memory);
        let trace = TraceFile::open(file.path()).unwrap();
        let TraceFile::Texture(textures) = &trace else {
            panic!("a texture trace");
        };
        let text = texture_text(textures, &to_json(&trace).unwrap());
        for texture in &memory.tables.textures {
            assert!(text.contains(&texture.name), "{text}");
        }
    }
}
