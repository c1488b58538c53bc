//! What an order may know when it plans a frame.

use super::View;
use super::directions::Directions;
use crate::config::RunConfig;
use formats::textrace::{PassKind, TraceMeta};

/// What is known beside the grids.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// Seed of the random curve.
    pub seed: u64,
    /// Cores that items are given to.
    pub cores: u32,
    /// Width and height of a tile.
    pub tile_px: u32,
    /// Size of the cache that cores share.
    pub l2_bytes: u64,
    /// Bytes of a line.
    pub line_bytes: u32,
    /// The display: its eyes' matrices.
    pub meta: Option<&'a TraceMeta>,
    /// What was counted in the last frame. The first frame of a trace stands for one of a head that does not move: its last
    /// frame was the same. None where nothing is counted.
    pub last: Option<&'a Counters>,
}

impl<'a> Known<'a> {
    /// What a machine knows of a trace before its first frame.
    #[must_use]
    pub fn new(config: &RunConfig, meta: &'a TraceMeta) -> Self {
        Self {
            seed: config.seed,
            cores: config.cores,
            tile_px: config.tile_px,
            l2_bytes: config.l2.size_bytes,
            line_bytes: config.line_bytes,
            meta: Some(meta),
            last: None,
        }
    }

    /// Where directions fall in the pictures of two eyes; none where nothing is known of the display, and for layers,
    /// whose projections are their own.
    pub(super) fn directions(&self, eyes: [View; 2]) -> Option<Directions> {
        let main = eyes.iter().all(|view| view.kind == PassKind::Main);
        let views = self.meta?.frames.first().filter(|_| main)?;
        Directions::new(&views.eyes, eyes, self.tile_px.max(1))
    }

    /// Columns and rows by which the tiles of the right eye lie left of and above those of the left eye that show the
    /// same point at infinity.
    #[must_use]
    pub fn offset(&self, eyes: [View; 2]) -> [i32; 2] {
        let directions = self.directions(eyes);
        directions.map_or([0, 0], |directions| directions.offset())
    }

    /// What was counted of the same view, or of a left view and its partner, in the last frame.
    pub(super) fn counted(&self, view: View) -> Option<&'a ViewCounters> {
        let key = |of: View| (of.number, of.kind, of.tiles);
        let mut views = self.last?.views.iter();
        views.find(|of| key(of.view) == key(view))
    }
}

/// What was counted in a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// By view, two eyes' views together.
    pub views: Vec<ViewCounters>,
}

/// What was counted in a view, or in the views of two eyes; shifts by row of the left eye's tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewCounters {
    /// The view; of two eyes the left one.
    pub view: View,
    /// Bytes of the lines that the tiles ask for: of each tile, and of the other eye's tile that shows the same at
    /// infinity, each line once. Misses of the L1 caches count them, a little from above.
    pub bytes: u64,
    /// Columns by which the right eye's tiles lie left of the left eye's tiles with the same primitives.
    pub primitive_shift: Vec<i32>,
    /// Likewise with the same lines.
    pub line_shift: Vec<i32>,
}
