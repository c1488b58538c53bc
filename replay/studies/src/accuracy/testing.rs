//! Small inputs for tests.

use super::headline::Replays;
use super::inputs::Inputs;
use crate::experiment::Subject;
use sim::config::{LevelConfig, Levels, RunConfig};
use sim::result::TraceId;
use sim::stream::testing::Synthetic;
use sim::stream::{MemoryTrace, TileSource};

/// A trace that fits in no cache of [`inputs`].
pub(super) fn small_trace() -> MemoryTrace {
    Synthetic {
        materials: 4,
        ..Synthetic::one_layer([96, 96], 24)
    }
    .generate()
}

/// A labelled trace.
pub fn subject<'a>(trace: &'a dyn TileSource, label: &str) -> Subject<'a> {
    Subject::new(trace, TraceId::default(), label.to_owned())
}

/// Inputs with a single trace.
pub fn inputs(trace: &dyn TileSource) -> Inputs<'_> {
    Inputs {
        config: RunConfig {
            level: Levels::two(LevelConfig::lru(8 << 10), LevelConfig::lru(16 << 10)),
            ..RunConfig::default()
        },
        subjects: vec![subject(trace, "small")],
        truths: Vec::new(),
        captures: Vec::new(),
        seconds: Vec::new(),
        rays: Vec::new(),
        techniques: &[],
        traversal: Vec::new(),
        replays: Replays::default(),
    }
}
