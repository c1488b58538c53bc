//! Traces of an experiment, and their labels.

use formats::textrace::Tables;
use formats::texture::TexelFormat;
use sim::paper::z2;
use sim::result::{TraceId, scene_name};
use sim::stream::TileSource;

/// A trace to replay, and its label.
pub struct Subject<'a> {
    /// The trace.
    pub source: &'a dyn TileSource,
    /// Scene name and checksum.
    pub id: TraceId,
    /// Short name in tables, unique in the experiment.
    pub label: String,
    /// Scene of the Z2 paper that it stands in for.
    pub stand_in_for: Option<&'static str>,
}

impl<'a> Subject<'a> {
    /// A trace with a label. The scene's name determines what it stands in for.
    pub fn new(source: &'a dyn TileSource, id: TraceId, label: String) -> Self {
        let tables = source.tables();
        Self {
            stand_in_for: z2::stand_in(&tables.meta.scene, has_shadow_maps(tables)),
            source,
            id,
            label,
        }
    }
}

/// Number of frames of a trace.
pub fn frame_count(tables: &Tables) -> u32 {
    let seen = tables.passes.iter().filter(|p| p.is_seen());
    let mut frames: Vec<u32> = seen.map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    frames.len() as u32
}

/// Whether a trace samples a shadow map.
pub fn has_shadow_maps(tables: &Tables) -> bool {
    let mut textures = tables.textures.iter();
    textures.any(|t| t.format == TexelFormat::R32f)
}

/// Short, unique labels for traces, given as tables, identity and file stem.
///
/// The label is the scene's short name, with `+shadows` if the trace has shadow maps and the scene usually
/// has none. Traces that would share a label are labelled by file stem, and by checksum as well if stems
/// are equal.
pub fn labels(traces: &[(&Tables, &TraceId, String)]) -> Vec<String> {
    let scenes: Vec<String> = traces
        .iter()
        .map(|(tables, ..)| scene_label(tables))
        .collect();
    let count = |names: &mut dyn Iterator<Item = &String>, name: &String| {
        names.filter(|other| *other == name).count()
    };
    let mut names: Vec<String> = scenes.clone();
    for (name, (.., file)) in names.iter_mut().zip(traces) {
        if count(&mut scenes.iter(), name) > 1 {
            name.clone_from(file);
        }
    }
    let unique = |(name, (_, id, _)): (&String, &(&Tables, &TraceId, String))| {
        if count(&mut names.iter(), name) > 1 {
            format!("{name} {}", id.checksum)
        } else {
            name.clone()
        }
    };
    names.iter().zip(traces).map(unique).collect()
}

/// The scene's short name, with `+shadows` if the trace has shadow maps and the scene usually has none.
pub fn scene_label(tables: &Tables) -> String {
    let name = scene_name(&tables.meta.scene);
    let usual = name.contains("shadow") || name.contains("jungle");
    let suffix = if has_shadow_maps(tables) && !usual {
        "+shadows"
    } else {
        ""
    };
    format!("{name}{suffix}")
}
