//! The information that is available when an order plans a frame.

use super::View;
use super::directions::Directions;
use crate::config::RunConfig;
use formats::textrace::{PassKind, TraceMeta};

/// The information available besides the grids.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlanInputs<'a> {
    /// Seed of the random curve.
    pub seed: u64,
    /// Number of cores.
    pub cores: u32,
    /// Width and height of a tile.
    pub tile_px: u32,
    /// Size of the L2 in bytes.
    pub l2_bytes: u64,
    /// Line size in bytes.
    pub line_bytes: u32,
    /// The matrices of the display's eyes.
    pub meta: Option<&'a TraceMeta>,
    /// Counters of the last frame; none if nothing is counted. The first frame of a trace uses its own
    /// counters, as if the head had not moved.
    pub last: Option<&'a Counters>,
}

impl<'a> PlanInputs<'a> {
    /// The information available before the first frame of a trace.
    pub fn new(config: &RunConfig, meta: &'a TraceMeta) -> Self {
        Self {
            seed: config.seed,
            cores: config.cores,
            tile_px: config.tile_px,
            l2_bytes: config.level.l2.size_bytes,
            line_bytes: config.line_bytes,
            meta: Some(meta),
            last: None,
        }
    }

    /// Maps directions to the pictures of two eyes. None for an unknown display, and for layers, which have
    /// their own projections.
    pub(super) fn directions(&self, eyes: [View; 2]) -> Option<Directions> {
        let main = eyes.iter().all(|view| view.kind == PassKind::Main);
        let views = self.meta?.frames.first().filter(|_| main)?;
        Directions::new(&views.eyes, eyes, self.tile_px.max(1))
    }

    /// Columns and rows by which a point at infinity lies further left and further up in the right eye's
    /// picture than in the left eye's.
    pub fn offset(&self, eyes: [View; 2]) -> [i32; 2] {
        let directions = self.directions(eyes);
        directions.map_or([0, 0], |directions| directions.offset())
    }

    /// The last frame's counters of the same view, or of a left view and its partner.
    pub(super) fn counted(&self, view: View) -> Option<&'a ViewCounters> {
        let key = |of: View| (of.number, of.kind, of.tiles);
        let mut views = self.last?.views.iter();
        views.find(|of| key(of.view) == key(view))
    }
}

/// Counters of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// One entry per view. The two views of a stereo pair have one entry.
    pub views: Vec<ViewCounters>,
}

/// Counters of a view, or of the views of two eyes. Shifts have one entry per row of the left eye's tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewCounters {
    /// The view; the left one of a stereo pair.
    pub view: View,
    /// Bytes of the distinct lines of each tile, or of each pair of tiles that show the same point at infinity,
    /// summed over tiles or pairs. The misses of the L1 caches are no substitute, because they can be far
    /// fewer.
    pub bytes: u64,
    /// Columns by which the right eye's tiles lie further left than the left eye's tiles with the same
    /// primitives.
    pub primitive_shift: Vec<i32>,
    /// Columns by which the right eye's tiles lie further left than the left eye's tiles with the same lines.
    pub line_shift: Vec<i32>,
}
