//! The walk over a trace: frame after frame, each expanded to lines and planned with the counters of the frame
//! before. Whatever replays, lists or converts a trace in an order takes its plans from here, so all of them
//! render the same items in the same sequence.

use super::{Expander, Frame, LineMemory, StreamError, TileSource, TraceCounts};
use crate::config::{Order, RunConfig};
use crate::order::{Counters, Phase, PlanInputs, frames, plan_frame};
use formats::textrace::Tables;
use std::collections::HashMap;
use std::sync::Arc;

/// A walk over the frames of a trace, in one or several orders.
pub struct Walk<'e> {
    expander: &'e Expander<'e>,
    memory: &'e LineMemory,
    config: RunConfig,
    needs_counters: bool,
    /// The frame planned last, and its counters.
    last: Option<(u32, Arc<Counters>)>,
    counts: TraceCounts,
    /// What frames counted that are repeated.
    of_frames: HashMap<u32, TraceCounts>,
}

impl<'e> Walk<'e> {
    /// A walk with the expander's trace. Configurations of all plans have the tile size, the line size, the
    /// sampling and the layout of `config`.
    pub fn new(
        expander: &'e Expander<'e>,
        memory: &'e LineMemory,
        config: &RunConfig,
        orders: impl IntoIterator<Item = Order>,
    ) -> Self {
        Self {
            expander,
            memory,
            config: *config,
            needs_counters: orders.into_iter().any(|of| of.parts().needs_counters()),
            last: None,
            counts: TraceCounts::new(expander.bins()),
            of_frames: HashMap::new(),
        }
    }

    /// The numbers of all frames, ascending.
    pub fn frames(&self) -> Vec<u32> {
        frames(&self.tables().passes)
    }

    /// The tables of the trace as rendered.
    pub fn tables(&self) -> &'e Tables {
        self.expander.source().tables()
    }

    /// The accesses of all frames expanded so far.
    pub fn counts(&self) -> &TraceCounts {
        &self.counts
    }

    /// Expands a frame.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn expand(&mut self, number: u32) -> Result<Frame<'e>, StreamError> {
        (self.expander).frame(number, self.memory, &mut self.counts)
    }

    /// Expands a frame that [`Self::repeat`] may repeat.
    ///
    /// # Errors
    /// As [`Self::expand`].
    pub fn expand_to_repeat(&mut self, number: u32) -> Result<Frame<'e>, StreamError> {
        let before = self.counts.sums();
        let frame = self.expand(number)?;
        let of_frame = self.counts.since(&before);
        self.of_frames.entry(number).or_insert(of_frame);
        Ok(frame)
    }

    /// Counts a frame that equals an earlier one, without expanding it. False if that one is unknown.
    pub fn repeat(&mut self, number: u32, earlier: u32) -> bool {
        let Some(counts) = self.of_frames.get(&earlier) else {
            return false;
        };
        self.counts.add(counts);
        let passes = &self.tables().passes;
        let of_frame = |number| {
            let all = (0..)
                .zip(passes)
                .filter(move |(_, pass)| pass.frame == number);
            all.map(|(pass, _)| pass)
        };
        for (to, from) in of_frame(number).zip(of_frame(earlier)) {
            self.counts.repeat_tiles(self.expander.bins(), to, from);
        }
        true
    }

    /// Plans a frame that need not be expanded. None if an order needs counters.
    pub fn plan_uncounted(&self, number: u32) -> Option<FramePlan<'e>> {
        (!self.needs_counters).then(|| FramePlan {
            tables: self.tables(),
            number,
            last: None,
        })
    }

    /// Plans an expanded frame. Orders that need counters get those of the frame before; the first frame of
    /// a trace uses its own.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn plan(&mut self, frame: &Frame<'_>) -> Result<FramePlan<'e>, StreamError> {
        let number = frame.number();
        let mut last = None;
        if self.needs_counters {
            let own = Arc::new(self.count(frame)?);
            let before = self.frames().into_iter().rfind(|&of| of < number);
            last = Some(match (before, self.last.take()) {
                (None, _) => Arc::clone(&own),
                (Some(before), Some((of, counters))) if of == before => counters,
                // The walk left out frames.
                (Some(before), _) => {
                    let mut apart = TraceCounts::new(self.expander.bins());
                    let before = self.expander.frame(before, self.memory, &mut apart)?;
                    Arc::new(self.count(&before)?)
                }
            });
            self.last = Some((number, own));
        }
        Ok(FramePlan {
            tables: self.tables(),
            number,
            last,
        })
    }

    fn count(&self, frame: &Frame<'_>) -> Result<Counters, StreamError> {
        frame.counters(&PlanInputs::new(&self.config, &self.tables().meta))
    }
}

/// What an order needs to plan a frame.
pub struct FramePlan<'e> {
    tables: &'e Tables,
    number: u32,
    last: Option<Arc<Counters>>,
}

impl FramePlan<'_> {
    /// The work of the frame in the order of `config`.
    pub fn phases(&self, config: &RunConfig) -> Vec<Phase> {
        let inputs = PlanInputs {
            last: self.last.as_deref(),
            ..PlanInputs::new(config, &self.tables.meta)
        };
        plan_frame(config.order, &inputs, &self.tables.passes, self.number)
    }
}

/// All work of a trace in the order of `config`, without its lines. Reads tiles only if the order needs
/// counters.
///
/// # Errors
/// An unreadable tile, or textures that are too large to count their lines.
pub fn plan(rendered: &dyn TileSource, config: &RunConfig) -> Result<Vec<Phase>, StreamError> {
    let tables = rendered.tables();
    let mut phases = Vec::new();
    if !config.order.parts().needs_counters() {
        for number in frames(&tables.passes) {
            let last = None;
            phases.extend(
                FramePlan {
                    tables,
                    number,
                    last,
                }
                .phases(config),
            );
        }
        return Ok(phases);
    }
    let expander = Expander::new(rendered, config)?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, [config.order]);
    for number in walk.frames() {
        let frame = walk.expand(number)?;
        phases.extend(walk.plan(&frame)?.phases(config));
    }
    Ok(phases)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::MemoryTrace;
    use crate::stream::testing::different_frames;

    fn config() -> RunConfig {
        let order = Order::find("zig-zag+sta+row-lines").unwrap();
        RunConfig {
            order,
            ..RunConfig::default()
        }
    }

    fn planned(trace: &MemoryTrace, numbers: &[u32]) -> Vec<Vec<Phase>> {
        let config = config();
        let expander = Expander::new(trace, &config).unwrap();
        let memory = LineMemory::new(LineMemory::USUAL_BYTES);
        let mut walk = Walk::new(&expander, &memory, &config, [config.order]);
        let plan = |&number: &u32| {
            let frame = walk.expand(number).unwrap();
            walk.plan(&frame).unwrap().phases(&config)
        };
        numbers.iter().map(plan).collect()
    }

    #[test]
    fn a_frame_is_planned_with_the_counters_of_the_frame_before() {
        let trace = different_frames();
        let config = config();
        let expander = Expander::new(&trace, &config).unwrap();
        let memory = LineMemory::new(LineMemory::USUAL_BYTES);
        let inputs = PlanInputs::new(&config, &trace.tables.meta);
        let counters = [0, 1, 2].map(|number| {
            let mut counts = TraceCounts::new(expander.bins());
            let frame = expander.frame(number, &memory, &mut counts).unwrap();
            frame.counters(&inputs).unwrap()
        });
        let expected: Vec<Vec<Phase>> = [(0, 0), (1, 0), (2, 1)]
            .map(|(number, last)| {
                let inputs = PlanInputs {
                    last: Some(&counters[last]),
                    ..inputs
                };
                plan_frame(config.order, &inputs, &trace.tables.passes, number)
            })
            .to_vec();
        let uncounted = plan_frame(config.order, &inputs, &trace.tables.passes, 2);
        assert_ne!(expected[2], uncounted, "the counters have no effect here");
        assert_eq!(planned(&trace, &[0, 1, 2]), expected);
        assert_eq!(plan(&trace, &config).unwrap(), expected.concat());
    }

    #[test]
    fn a_walk_that_leaves_out_frames_plans_as_one_over_all_frames() {
        let trace = different_frames();
        let all = planned(&trace, &[0, 1, 2]);
        assert_eq!(planned(&trace, &[2]), all[2..]);
        assert_eq!(planned(&trace, &[0, 2]), [all[0].clone(), all[2].clone()]);
    }
}
