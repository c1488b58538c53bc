//! How many more lines a picture has at a larger size.

use sim::config::RunConfig;
use sim::engine::ReplayError;
use sim::order::frames;
use sim::stream::{Expander, LineMemory, TileSource, TraceCounts, rendered};

/// Distinct lines of a trace whose samples read levels as if its pictures had sides `zoom` times as long. Such samples
/// are those of every `zoom`-th pixel of the larger picture. Footprints of neighbours share lines, so these read most of its
/// lines.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn distinct_lines(
    trace: &dyn TileSource,
    config: &RunConfig,
    zoom: f64,
) -> Result<u64, ReplayError> {
    let mut config = *config;
    config.sampling.lod_bias -= zoom.log2() as f32;
    config.validate()?;
    let rendered = rendered(trace, &config)?;
    let expander = Expander::new(&rendered, &config)?.only_distinct_lines();
    let memory = LineMemory::new(0);
    let mut counts = TraceCounts::new(expander.bins());
    for number in frames(&trace.tables().passes) {
        drop(expander.frame(number, &memory, &mut counts)?);
    }
    Ok(counts.unique_lines)
}
