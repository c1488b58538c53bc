//! Simulates many LRU hierarchies in one pass over an order's lines.
//!
//! Without latencies, the interleaving of cores does not depend on cache contents, so all configurations
//! see the same accesses. Configurations that differ in what their caches keep between frames start a frame
//! with different contents. An LRU set holds the lines used last, so these contents become equal after as many
//! distinct lines as the set has ways. From then on to the end of the frame, one simulation serves all of them
//! ([`history`]).

mod history;
mod past;
mod pending;
mod tally;

use self::history::History;
use self::past::Past;
use crate::config::{BetweenFrames, LevelConfig, RunConfig, SetIndex};
use crate::engine::machine::{AtOnce, FrameWork, Machine};
use crate::engine::outcome::MachineOutcome;
use crate::stream::{Bins, Consumer, QuadLines, StreamError, Tag, interleave};

/// Sets and ways of a cache. Caches with a hashed set index sort before the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Shape {
    pub(crate) is_modulo: bool,
    pub(crate) sets: u32,
    pub(crate) ways: u32,
}

/// The shapes of both levels.
pub(crate) type LevelGeometry = (Shape, Shape);

/// The geometry of a configuration with a shared L2 whose caches are all plain LRU, the L2 with any set index.
pub fn geometry(config: &RunConfig) -> Option<LevelGeometry> {
    if !config.level.l2.shared {
        return None;
    }
    let of = |cache: &LevelConfig, level| {
        let sets = cache.sets(level, config.line_bytes).ok()?;
        cache.is_plain_lru().then_some(Shape {
            is_modulo: true,
            sets,
            ways: cache.ways,
        })
    };
    let l2 = LevelConfig {
        set_index: SetIndex::Modulo,
        ..config.level.l2
    };
    let l2 = Shape {
        is_modulo: config.level.l2.set_index == SetIndex::Modulo,
        ..of(&l2, "L2")?
    };
    Some((of(&config.level.l1, "L1")?, l2))
}

/// Quads between two comparisons of cache contents.
const COMPARE_EVERY: u32 = if cfg!(test) { 4 } else { 256 };

/// LRU hierarchies with each of some treatments between frames.
pub(crate) struct OnePass {
    first: History,
    /// The other treatments.
    others: Vec<History>,
    /// Quads since the last comparison.
    quads: u32,
    /// True if the L1 contents of another treatment may differ from the first one's.
    apart: bool,
    past: Past,
}

impl OnePass {
    /// Empty caches of at least one geometry, with each treatment between frames.
    pub fn new(
        bins: &Bins,
        cores: u32,
        tile_maps: bool,
        geometries: &[LevelGeometry],
        treatments: &[BetweenFrames],
    ) -> Self {
        let history = |between| History::new(bins, cores, tile_maps, geometries, between);
        let [first, others @ ..] = treatments else {
            return Self::new(bins, cores, tile_maps, geometries, &[BetweenFrames::Keep]);
        };
        Self {
            first: history(*first),
            others: others.iter().map(|of| history(*of)).collect(),
            quads: 0,
            apart: false,
            past: Past::new(!tile_maps),
        }
    }

    /// Sends a quad to the treatments whose L1 contents may differ from the first one's.
    #[inline(never)]
    fn quad_apart(&mut self, core: usize, quad: QuadLines<'_>) {
        for other in self.others.iter_mut().filter(|other| other.is_apart()) {
            other.quad(&mut [], core, quad);
        }
        self.quads += 1;
        if self.quads.is_multiple_of(COMPARE_EVERY) {
            self.unite();
        }
    }

    /// Lets treatments with the first one's L1 contents follow it.
    fn unite(&mut self) {
        self.apart = false;
        for index in 0..self.others.len() {
            if self.others[index].is_apart() && self.others[index].has_l1_of(&self.first) {
                self.first.drain(&mut self.others);
                self.others[index].follow(&self.first);
            }
            self.apart |= self.others[index].is_apart();
        }
    }

    fn histories(&self) -> impl Iterator<Item = &History> + Clone {
        std::iter::once(&self.first).chain(&self.others)
    }

    fn histories_mut(&mut self) -> impl Iterator<Item = &mut History> {
        std::iter::once(&mut self.first).chain(&mut self.others)
    }
}

impl Consumer for OnePass {
    #[inline]
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        self.first.quad(&mut self.others, core, quad);
        if self.apart {
            self.quad_apart(core, quad);
        }
    }
}

impl Machine for OnePass {
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError> {
        if frame.identity.is_some_and(|identity| self.knows(identity)) {
            frame
                .identity
                .into_iter()
                .for_each(|identity| self.repeat(identity));
            return Ok(());
        }
        let start = frame
            .identity
            .map(|of| self.past.start(of, self.histories()));
        self.unite();
        let answer = interleave(frame.cores, frame.phases, frame.assign, self);
        self.first.drain(&mut self.others);
        for other in &mut self.others {
            other.drain(&mut []);
            other.catch_up(&self.first);
        }
        if let Some(start) = start {
            let histories = std::iter::once(&self.first).chain(&self.others);
            self.past.remember(start, histories);
        }
        answer
    }

    fn knows(&self, identity: u128) -> bool {
        self.past.find(identity, self.histories()).is_some()
    }

    fn repeat(&mut self, identity: u128) {
        let Some(found) = self.past.find(identity, self.histories()) else {
            return;
        };
        let histories = std::iter::once(&mut self.first).chain(&mut self.others);
        self.past.repeat(found, histories);
    }

    fn between_frames(&mut self, index: usize, config: &RunConfig) {
        self.histories_mut()
            .for_each(|of| of.between_frames(index, config));
    }

    fn outcome(&self, config: &RunConfig) -> MachineOutcome {
        // Only configurations with a geometry are in a group of several.
        let mut histories = self.histories();
        let of_config = histories.find(|of| of.between == config.between_frames);
        let counts = geometry(config)
            .zip(of_config)
            .map(|(geometry, of)| of.counts(geometry));
        let mut counts = counts.unwrap_or_default();
        if !config.tile_maps {
            counts.tiles.clear();
        }
        counts.into()
    }
}

impl AtOnce for OnePass {
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>) {
        self.first.lines(lines, tags, missed);
    }

    fn finish(&mut self) {
        self.first.drain(&mut []);
    }
}
