//! `replay info`: prints a summary of a trace.

use super::tiles::{ray_tiles, tiles};
use crate::report::columns::{Column, Show};
use crate::report::table::Table;
use anyhow::Result;
use formats::Trace;
use formats::container::Container;
use formats::raytrace::{RayKind, RayTile, Raytrace, RaytraceTables};
use formats::textrace::{ChosenTechniques, Encoding, Pass, PassKind, Textrace, TraceMeta};
use formats::texture::Texture;
use formats::view::Eye;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Schema of the object that `replay info --json` prints.
const SCHEMA: &str = "replay.info/2";

/// Arguments of `replay info`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  replay info c.textrace
  replay info c.textrace --json | jq .totals")]
pub struct InfoArgs {
    /// Trace, .textrace or .raytrace
    pub trace: PathBuf,
    /// Print one JSON object (schema replay.info/2) with the complete tables
    #[arg(long)]
    pub json: bool,
}

/// Runs the subcommand.
///
/// # Errors
/// The trace cannot be read.
pub fn run(args: &InfoArgs) -> Result<ExitCode> {
    let trace = Trace::open(&args.trace)?;
    let value = to_json(&trace)?;
    super::print(&if args.json {
        serde_json::to_string_pretty(&value)?
    } else {
        match &trace {
            Trace::Texture(trace) => texture_text(trace, &value),
            Trace::Ray(trace) => ray_text(trace)?,
        }
    })?;
    Ok(ExitCode::SUCCESS)
}

/// The trace's tables and totals, as `--json` prints them.
///
/// # Errors
/// An unreadable tile.
pub fn to_json(trace: &Trace) -> Result<Value> {
    let container = trace.container();
    let mut value = json!({
        "schema": SCHEMA,
        "kind": container.kind().to_string(),
        "version": version(container),
        "checksum": format!("{:08x}", trace.content_checksum()),
        "file_checksum": format!("{:08x}", container.file_checksum()),
        "file_bytes": container.file_bytes(),
        "chunks": chunks(container),
    });
    match trace {
        Trace::Texture(trace) => {
            let tables = trace.tables();
            value["meta"] = serde_json::to_value(&tables.meta)?;
            value["totals"] = totals(trace)?;
            value["passes"] = passes(trace)?;
            value["textures"] = serde_json::to_value(&tables.textures)?;
            value["samplers"] = serde_json::to_value(&tables.samplers)?;
            value["draws"] = serde_json::to_value(&tables.draws)?;
        }
        Trace::Ray(trace) => {
            let tables = trace.tables();
            let [left, right] = ray_counts(trace)?;
            value["meta"] = serde_json::to_value(&tables.meta)?;
            value["totals"] = json!({ "left": left.to_json(), "right": right.to_json() });
            value["hierarchy"] = serde_json::to_value(&tables.bvh)?;
            let settings = tables.bvh.settings.iter();
            value["hierarchy"]["settings"] = settings.map(|(k, v)| (k.clone(), json!(v))).collect();
            value["materials"] = serde_json::to_value(&tables.materials)?;
            value["lights"] = serde_json::to_value(&tables.lights)?;
            value["triangles"] = serde_json::to_value(&tables.triangles)?;
        }
    }
    Ok(value)
}

fn version(container: &Container) -> String {
    let (major, minor) = container.version();
    format!("{major}.{minor}")
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

/// Counts of some tiles, read from the index only.
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
    for encoding in Encoding::ALL {
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

/// The first lines of the text, for any kind of trace.
fn heading(container: &Container, meta: &TraceMeta, checksum: u32) -> String {
    format!(
        "{}: {} {} (content {checksum:08x}, file {:08x}), {} bytes\nscene {}, {} triangles, camera {}, {} frame(s)\n\
         written by {} through {} ({})\ncommand {}\ndisplay {} ({}), {}x{} px an eye, IPD {} mm\n\n",
        container.file(),
        container.kind(),
        version(container),
        container.file_checksum(),
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
    )
}

fn texture_text(trace: &Textrace, value: &Value) -> String {
    let totals = &value["totals"];
    let mut text = heading(
        trace.container(),
        &trace.tables().meta,
        trace.content_checksum(),
    );
    if let Some(techniques) = &trace.tables().meta.techniques {
        text += &techniques_text(techniques);
    }
    text += &pass_table(trace);
    text += "\n";
    text += &texture_table(&trace.tables().textures);
    text += &format!(
        "\n{} draws, {} samplers; {} records in {} tile bytes, {:.2} bytes per record\n",
        trace.tables().draws.len(),
        trace.tables().samplers.len(),
        totals["records"],
        totals["tile_bytes"],
        totals["bytes_per_record"].as_f64().unwrap_or(0.0),
    );
    text
}

/// The techniques that the frames were rendered with, and why they were chosen.
fn techniques_text(techniques: &ChosenTechniques) -> String {
    let schedule = &techniques.schedule;
    match &techniques.choice {
        Some(choice) => format!(
            "techniques: {schedule}\nchosen by --auto {} --objective {}: {}\n\n",
            choice.budget, choice.objective, choice.reason
        ),
        None => format!("techniques: {schedule}\n\n"),
    }
}

/// A column of counts.
fn count<'a, R>(name: &'static str, value: impl Fn(&R) -> u64 + 'a) -> Column<'a, R> {
    Column::new(name, name, "", Show::Whole, value)
}

fn pass_table(trace: &Textrace) -> String {
    let passes = trace.tables().passes.iter().enumerate();
    let rows: Vec<(usize, &Pass, Counts)> = passes
        .map(|(index, pass)| {
            let of_pass = (0..pass.tile_count() as usize).map(|tile| (index, tile));
            (index, pass, Counts::of(trace, of_pass))
        })
        .collect();
    type PassRow<'a> = (usize, &'a Pass, Counts);
    let columns = [
        count("pass", |r: &PassRow| r.0 as u64),
        count("frame", |r: &PassRow| r.1.frame.into()),
        Column::text("kind", "kind", |r: &PassRow| match r.1.kind {
            PassKind::Layer => format!("layer {}", r.1.layer),
            kind => lower(&kind),
        }),
        Column::text("eye", "eye", |r: &PassRow| {
            r.1.eye.map_or("both".to_owned(), |eye| lower(&eye))
        }),
        Column::text("px", "px", |r: &PassRow| {
            format!("{}x{}", r.1.size_px[0], r.1.size_px[1])
        }),
        Column::text("tiles", "tiles", |r: &PassRow| {
            format!("{} of {}", r.2.touched_tiles, r.2.tiles)
        }),
        count("records", |r: &PassRow| r.2.records),
        count("runs", |r: &PassRow| r.2.runs),
        count("bytes", |r: &PassRow| r.2.bytes),
    ];
    Table::new(&columns, &rows).text()
}

fn texture_table(textures: &[Texture]) -> String {
    let rows: Vec<(usize, &Texture)> = textures.iter().enumerate().collect();
    type TextureRow<'a> = (usize, &'a Texture);
    let columns = [
        count("texture", |r: &TextureRow| r.0 as u64),
        Column::text("name", "name", |r: &TextureRow| r.1.name.clone()),
        Column::text("size", "size", |r: &TextureRow| {
            format!("{}x{}", r.1.size[0], r.1.size[1])
        }),
        count("levels", |r: &TextureRow| r.1.levels.into()),
        count("layers", |r: &TextureRow| r.1.layers.into()),
        Column::text("format", "format", |r: &TextureRow| {
            format!("{} {}", lower(&r.1.format), lower(&r.1.color_space))
        }),
    ];
    Table::new(&columns, &rows).text()
}

/// Ray and traversal counts of one eye.
#[derive(Clone, Copy, Default)]
struct RayCounts {
    samples: u64,
    hits: u64,
    /// By [`RayKind`].
    rays: [u64; 4],
    steps: u64,
    triangle_tests: u64,
    alpha_tests: u64,
    visits: u64,
}

const RAY_KINDS: [RayKind; 4] = [
    RayKind::Primary,
    RayKind::Shadow,
    RayKind::Reflection,
    RayKind::Refraction,
];

impl RayCounts {
    fn of(tile: &RayTile) -> Self {
        let mut counts = Self {
            samples: tile.pixels.len() as u64,
            hits: tile.pixels.iter().filter(|p| p.hit.is_some()).count() as u64,
            visits: tile.visits.len() as u64,
            ..Self::default()
        };
        for ray in &tile.rays {
            counts.rays[ray.kind as usize] += 1;
            counts.steps += u64::from(ray.steps);
            counts.triangle_tests += u64::from(ray.triangle_tests);
            counts.alpha_tests += u64::from(ray.alpha_tests);
        }
        counts
    }

    fn add(mut self, other: Self) -> Self {
        self.samples += other.samples;
        self.hits += other.hits;
        self.rays = std::array::from_fn(|kind| self.rays[kind] + other.rays[kind]);
        self.steps += other.steps;
        self.triangle_tests += other.triangle_tests;
        self.alpha_tests += other.alpha_tests;
        self.visits += other.visits;
        self
    }

    fn to_json(self) -> Value {
        let by_kind = RAY_KINDS.map(|kind| (kind_name(kind), self.rays[kind as usize].into()));
        json!({
            "samples": self.samples,
            "hits": self.hits,
            "rays": serde_json::Map::from_iter(by_kind),
            "steps": self.steps,
            "triangle_tests": self.triangle_tests,
            "alpha_tests": self.alpha_tests,
            "visits": self.visits,
        })
    }
}

fn kind_name(kind: RayKind) -> String {
    lower(&kind)
}

/// Name of a variant as the tables write it.
fn lower(variant: &impl std::fmt::Debug) -> String {
    format!("{variant:?}").to_lowercase()
}

/// Counts of the left and of the right eye; decodes every tile.
fn ray_counts(trace: &Raytrace) -> Result<[RayCounts; 2]> {
    let tiles: Vec<(Eye, u32)> = ray_tiles(trace.tables()).collect();
    let of_tiles: Vec<RayCounts> = tiles
        .par_iter()
        .map_init(RayTile::default, |tile, (eye, index)| {
            trace.decode_tile(*eye, *index, tile)?;
            Ok(RayCounts::of(tile))
        })
        .collect::<formats::Result<_>>()?;
    let of_eye = |wanted| {
        let own = tiles
            .iter()
            .zip(&of_tiles)
            .filter(|((eye, _), _)| *eye == wanted);
        own.fold(RayCounts::default(), |sum, (_, counts)| sum.add(*counts))
    };
    Ok([Eye::Left, Eye::Right].map(of_eye))
}

fn ray_text(trace: &Raytrace) -> Result<String> {
    let RaytraceTables {
        meta,
        bvh,
        materials,
        lights,
        triangles,
    } = trace.tables();
    let mut text = heading(trace.container(), &meta.trace, trace.content_checksum());
    text += &format!(
        "hierarchy by {}, walked as {}: {} triangles, {} nodes, {} leaves, depth {}, SAH cost {:.2}, \
         {} bytes a node, {} a triangle\n{} sample(s) a pixel, reflections {} deep, visits {}\n\n",
        bvh.builder,
        format!("{:?}", bvh.traversal).to_lowercase(),
        bvh.triangles,
        bvh.nodes,
        bvh.leaves,
        bvh.depth,
        bvh.sah_cost,
        bvh.bytes_per_node,
        bvh.bytes_per_triangle,
        meta.samples_per_px,
        meta.max_depth,
        if meta.has_visits {
            "listed"
        } else {
            "not listed"
        },
    );
    let [left, right] = ray_counts(trace)?;
    type EyeRow = (&'static str, RayCounts);
    let mut columns = vec![
        Column::text("eye", "eye", |r: &EyeRow| r.0),
        count("samples", |r: &EyeRow| r.1.samples),
        count("hits", |r: &EyeRow| r.1.hits),
    ];
    for kind in RAY_KINDS {
        let rays = move |r: &EyeRow| r.1.rays[kind as usize];
        columns.push(Column::new(
            kind_name(kind),
            kind_name(kind),
            "",
            Show::Whole,
            rays,
        ));
    }
    for (name, of) in [
        ("steps a ray", (|c| c.steps) as fn(&RayCounts) -> u64),
        ("tests a ray", |c| c.triangle_tests),
    ] {
        columns.push(Column::real(name, name, "", 2, move |r: &EyeRow| {
            of(&r.1) as f64 / r.1.rays.iter().sum::<u64>().max(1) as f64
        }));
    }
    let table = Table::new(&columns, &[("left", left), ("right", right)]).text();
    text += &format!(
        "{table}\n{} materials, {} lights, {} triangles hit\n",
        materials.len(),
        lights.len(),
        triangles.len(),
    );
    Ok(text)
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
        let value = to_json(&Trace::open(file.path()).unwrap()).unwrap();
        let records: usize = memory.tiles.iter().flatten().map(|t| t.records.len()).sum();
        assert_eq!(value["totals"]["records"], records);
        let by_pass = value["passes"].as_array().unwrap();
        let sum: u64 = by_pass
            .iter()
            .map(|p| p["counts"]["records"].as_u64().unwrap())
            .sum();
        assert_eq!(sum, records as u64);
        assert_eq!(value["schema"], "replay.info/2");
    }

    #[test]
    fn the_text_names_every_texture() {
        let memory = Synthetic::default().generate();
        let file = file_of(&memory);
        let trace = Trace::open(file.path()).unwrap();
        let Trace::Texture(textures) = &trace else {
            panic!("a texture trace");
        };
        let text = texture_text(textures, &to_json(&trace).unwrap());
        for texture in &memory.tables.textures {
            assert!(text.contains(&texture.name), "{text}");
        }
    }
}
