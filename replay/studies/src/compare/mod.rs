//! Compares two captures of the same views, fragment by fragment.
//!
//! A fragment is a lane of a quad of a primitive; both captures number primitives alike. Fragments in both
//! are compared by texture coordinates, levels of detail and footprints. The effect on caches is measured
//! by replays.

mod differences;
mod fault;
mod partners;
mod tally;
#[cfg(test)]
mod tests;
mod tile;

pub use differences::Differences;
pub use fault::NotComparable;
pub use tally::Tally;

use formats::textrace::Tables;
use partners::Partners;
use rayon::prelude::*;
use serde::Serialize;
use sim::config::RunConfig;
use sim::order::TileRef;
use sim::stream::{StreamError, TileSource, shaded};
use tile::Comparer;

/// A class of fragments: those of a material, or of opaque draws.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Class {
    /// Name of the class.
    pub name: String,
    /// Differences in the class.
    #[serde(flatten)]
    pub tally: Tally,
}

/// The result of a comparison.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Comparison {
    /// All fragments.
    pub all: Tally,
    /// Opaque draws and others, if the first trace records which are opaque.
    pub by_opacity: Vec<Class>,
    /// By material, in the order of the first trace's draws.
    pub by_material: Vec<Class>,
    /// Tiles with at least one different record.
    pub tiles_that_differ: u64,
    /// Number of tiles of the views.
    pub tiles: u64,
}

/// Checks that two captures show the same views of the same textured triangles.
///
/// # Errors
/// The first property that they do not share.
pub fn comparable(tables: [&Tables; 2]) -> Result<(), NotComparable> {
    Partners::new(tables).map(drop)
}

/// Compares the fragments that a replay of two captures shades, after the configuration's hidden-surface
/// removal and with its sampling.
///
/// # Errors
/// Captures that do not show the same views of the same textured triangles; a trace without the fragments
/// that the removal needs; an unreadable tile.
pub fn compare(traces: [&dyn TileSource; 2], config: &RunConfig) -> anyhow::Result<Comparison> {
    /// Tiles that a thread compares per task.
    const CHUNK: usize = 64;
    let partners = Partners::new(traces.map(TileSource::tables))?;
    let [a, b] = traces;
    let shaded = [shaded(a, config.hsr)?, shaded(b, config.hsr)?];
    let traces = shaded.each_ref().map(|trace| trace as &dyn TileSource);
    let sampling = &config.sampling;
    let passes = &traces[0].tables().passes;
    let tiles: Vec<TileRef> = (0..)
        .zip(passes)
        .flat_map(|(pass, p)| (0..p.tile_count()).map(move |tile| TileRef { pass, tile }))
        .collect();
    let chunk = |tiles: &[TileRef]| -> Result<_, StreamError> {
        let mut comparer = Comparer::new(traces, &partners, sampling);
        for &at in tiles {
            comparer.tile(at)?;
        }
        Ok(comparer.finish())
    };
    let chunks: Vec<_> = tiles.par_chunks(CHUNK).map(chunk).collect();
    let mut by_draw = vec![Tally::default(); partners.count()];
    let mut tiles_that_differ = 0;
    for chunk in chunks {
        let (tallies, differing) = chunk?;
        tiles_that_differ += differing;
        for (sum, tally) in by_draw.iter_mut().zip(&tallies) {
            sum.add(tally);
        }
    }
    let mut all = Tally::default();
    by_draw.iter().for_each(|tally| all.add(tally));
    Ok(Comparison {
        all,
        by_opacity: classes(&by_draw, |draw| partners.opacity(draw)),
        by_material: classes(&by_draw, |draw| Some(partners.material(draw))),
        tiles_that_differ,
        tiles: tiles.len() as u64,
    })
}

/// Sums over draws with the same name, in order of first occurrence.
fn classes<'n>(by_draw: &[Tally], name: impl Fn(usize) -> Option<&'n str>) -> Vec<Class> {
    let mut classes: Vec<Class> = Vec::new();
    for (draw, tally) in by_draw.iter().enumerate() {
        let Some(name) = name(draw).filter(|_| !tally.is_empty()) else {
            continue;
        };
        match classes.iter_mut().find(|class| class.name == name) {
            Some(class) => class.tally.add(tally),
            None => classes.push(Class {
                name: name.to_owned(),
                tally: tally.clone(),
            }),
        }
    }
    classes
}
