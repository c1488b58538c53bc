//! Traces of an experiment and their names.

use crate::paper::z2;
use crate::result::{TraceId, scene_name};
use crate::stream::TileSource;
use formats::textrace::Tables;
use formats::texture::TexelFormat;

/// A trace to replay, and how to name it.
pub struct Subject<'a> {
    /// The trace.
    pub source: &'a dyn TileSource,
    /// Scene name and checksum.
    pub id: TraceId,
    /// Short name in tables, unique in the experiment.
    pub label: String,
    /// Scene of the Z2 paper that it stands for.
    pub stand_in_for: Option<&'static str>,
}

impl<'a> Subject<'a> {
    /// A trace under a label; what it stands for follows from its scene's name.
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

/// Frames that a trace renders.
#[must_use]
pub fn frame_count(tables: &Tables) -> u32 {
    let seen = tables.passes.iter().filter(|p| p.is_seen());
    let mut frames: Vec<u32> = seen.map(|p| p.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    frames.len() as u32
}

/// Whether a trace samples a shadow map.
#[must_use]
pub fn has_shadow_maps(tables: &Tables) -> bool {
    let mut textures = tables.textures.iter();
    textures.any(|t| t.format == TexelFormat::R32f)
}

/// Short, unique names for traces given as tables, identity and file name without extension.
///
/// A trace goes by its scene's short name, with `+shadows` where a scene that is usually without
/// them has shadow maps. Traces that would share a name go by their files' names, and by the
/// checksum, too, where those are the same.
#[must_use]
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

/// A scene's short name, with `+shadows` where a scene that is usually without them has shadow maps.
#[must_use]
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
