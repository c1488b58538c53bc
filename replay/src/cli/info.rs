//! `replay info`: prints a summary of a trace.

mod json;

#[cfg(test)]
pub(crate) use json::schema;
pub use json::to_json;

use anyhow::Result;
use formats::Trace;
use formats::container::Container;
use formats::raytrace::RayKind;
use formats::raytrace::{Raytrace, RaytraceTables};
use formats::text::name_of;
use formats::textrace::{ChosenTechniques, PassKind, Textrace, TraceMeta};
use formats::texture::{Sampler, Texture};
use json::{
    PassJson, RayCounts, Totals, VertexReadsJson, lower, passes, ray_counts, version, vertex_reads,
};
use report::columns::{Column, Show};
use report::notices;
use report::table::Table;
use std::path::PathBuf;
use std::process::ExitCode;

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
    let trace = notices::open(&args.trace)?;
    super::print(&match &trace {
        _ if args.json => serde_json::to_string_pretty(&to_json(&trace)?)?,
        Trace::Texture(trace) => texture_text(trace)?,
        Trace::Ray(trace) => ray_text(trace)?,
    })?;
    Ok(ExitCode::SUCCESS)
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

fn texture_text(trace: &Textrace) -> Result<String> {
    let totals = Totals::of(trace)?;
    let shared = totals.shared_tiles;
    let totals = totals.counts;
    let mut text = heading(
        trace.container(),
        &trace.tables().meta,
        trace.content_checksum(),
    );
    if let Some(techniques) = &trace.tables().meta.techniques {
        text += &techniques_text(techniques);
    }
    for notice in sim::result::notices_of(&trace.tables().meta) {
        text += &format!("{notice}\n");
    }
    text += &pass_table(trace);
    text += "\n";
    text += &texture_table(&trace.tables().textures);
    let of_vertices = vertex_reads(trace)?;
    if !of_vertices.is_empty() {
        text += &format!("\nvertex texture reads\n{}", vertex_table(&of_vertices));
    }
    text += &format!(
        "\n{} draws, {} samplers{}; {} records in {} tile bytes, {:.2} bytes per record\n",
        trace.tables().draws.len(),
        trace.tables().samplers.len(),
        anisotropy_text(&trace.tables().samplers),
        totals.records,
        totals.tile_bytes,
        totals.bytes_per_record,
    );
    if let Some(shared) = shared {
        text += &format!("{shared} tiles share the bytes of earlier ones\n");
    }
    Ok(text)
}

/// How many of the samplers are anisotropic, and the largest anisotropy; empty if none is.
fn anisotropy_text(samplers: &[Sampler]) -> String {
    let found = samplers.iter().filter(|sampler| sampler.is_anisotropic());
    let most = found.clone().map(Sampler::max_anisotropy).reduce(f32::max);
    most.map_or_else(String::new, |most| {
        format!(", {} of them anisotropic up to {most}", found.count())
    })
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
    let rows: Vec<(usize, PassJson<'_>)> = passes(trace).into_iter().enumerate().collect();
    type PassRow<'a> = (usize, PassJson<'a>);
    let columns = [
        count("pass", |r: &PassRow| r.0 as u64),
        count("frame", |r: &PassRow| r.1.pass.frame.into()),
        Column::text("kind", "kind", |r: &PassRow| match r.1.pass.kind {
            PassKind::Layer => format!("layer {}", r.1.pass.layer),
            kind => lower(&kind),
        }),
        Column::text("eye", "eye", |r: &PassRow| {
            r.1.pass.eye.map_or("both".to_owned(), |eye| lower(&eye))
        }),
        Column::text("px", "px", |r: &PassRow| {
            format!("{}x{}", r.1.pass.size_px[0], r.1.pass.size_px[1])
        }),
        Column::text("tiles", "tiles", |r: &PassRow| {
            format!("{} of {}", r.1.counts.touched_tiles, r.1.counts.tiles)
        }),
        count("records", |r: &PassRow| r.1.counts.records),
        count("runs", |r: &PassRow| r.1.counts.runs),
        count("bytes", |r: &PassRow| r.1.counts.tile_bytes),
    ];
    Table::new(&columns, &rows).text()
}

fn vertex_table(rows: &[VertexReadsJson]) -> String {
    let columns = [
        count("frame", |r: &VertexReadsJson| r.frame.into()),
        Column::text("eye", "eye", |r: &VertexReadsJson| {
            r.eye.map_or("both or none".to_owned(), |eye| lower(&eye))
        }),
        count("draws", |r: &VertexReadsJson| r.draws),
        count("vertices", |r: &VertexReadsJson| r.vertices),
        count("reads", |r: &VertexReadsJson| r.reads),
        count("texels", |r: &VertexReadsJson| r.texels),
        count("lines", |r: &VertexReadsJson| r.lines),
    ];
    Table::new(&columns, rows).text()
}

fn texture_table(textures: &[Texture]) -> String {
    let rows: Vec<(usize, &Texture)> = textures.iter().enumerate().collect();
    type TextureRow<'a> = (usize, &'a Texture);
    let columns = [
        count("texture", |r: &TextureRow| r.0 as u64),
        Column::text("name", "name", |r: &TextureRow| match r.1.part {
            Some(part) => format!("{} (part of {})", r.1.name, part.of),
            None => r.1.name.clone(),
        }),
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

fn listed(there: bool) -> &'static str {
    if there { "listed" } else { "not listed" }
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
    let instances = (bvh.instances).map(|of| format!("{} instances, ", of.count));
    let instances = instances.unwrap_or_default();
    let update = (bvh.update).map(|of| format!("{of} from the frame before\n"));
    text += &format!(
        "hierarchy by {}, walked as {}: {}{} triangles, {} nodes, {} leaves, depth {}, SAH cost {:.2}, \
         {} bytes a node, {} a triangle\n{}{} sample(s) a pixel, reflections {} deep, visits {}, \
         geometry {}, hierarchy {}\n\n",
        bvh.builder,
        name_of(&bvh.traversal),
        instances,
        bvh.triangles,
        bvh.nodes,
        bvh.leaves,
        bvh.depth,
        bvh.sah_cost,
        bvh.bytes_per_node,
        bvh.bytes_per_triangle,
        update.unwrap_or_default(),
        meta.samples_per_px,
        meta.max_depth,
        listed(meta.has_visits),
        listed(trace.has_geometry()),
        listed(trace.has_hierarchy()),
    );
    let [left, right] = ray_counts(trace)?;
    type EyeRow = (&'static str, RayCounts);
    let mut columns = vec![
        Column::text("eye", "eye", |r: &EyeRow| r.0),
        count("samples", |r: &EyeRow| r.1.samples),
        count("hits", |r: &EyeRow| r.1.hits),
    ];
    for kind in RayKind::ALL {
        let rays = move |r: &EyeRow| r.1.rays[kind as usize];
        if kind.needs_lighting() && left.rays[kind as usize] + right.rays[kind as usize] == 0 {
            continue;
        }
        columns.push(Column::new(
            kind.to_string(),
            kind.to_string(),
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
    use sim::stream::testing::Synthetic;

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
        let text = texture_text(textures).unwrap();
        for texture in &memory.tables.textures {
            assert!(text.contains(&texture.name), "{text}");
        }
    }
}
