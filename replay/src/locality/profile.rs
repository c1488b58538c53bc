//! The analysis of one stream of lines, line by line.
//!
//! Every new use of a line gets the next time on an axis. The times of the lines' last uses that lie
//! behind a line's own are the distinct lines used since: its stack distance (Bennett & Kruskal
//! 1975, Olken 1981), counted in O(log n). A line that is used again at once moves nothing. A full
//! axis is numbered anew, so that memory follows from the distinct lines alone.

use super::axis::{CountedTimes, Renumbering};
use super::distances::Distances;
use super::figures::Figures;
use super::last_use::{LastUses, NEVER, Span};
use super::opt;
use super::place::{ByOrigin, Origin, Place, TileOfEye, add};
use super::set_associative::{CacheHits, SetAssociative};
use super::split::MissSplit;
use super::working_set::WorkingSets;
use crate::config::{ConfigError, LevelConfig, RunConfig, accept};
use crate::memory::{AnyCache, Cache};

/// The cache that a stream goes to.
#[derive(Clone, Copy, Debug)]
pub struct StreamCache {
    /// Size, ways and policy.
    pub cache: LevelConfig,
    /// `L1` or `L2`, for errors.
    pub level: &'static str,
    /// Bytes of a line.
    pub line_bytes: u32,
    /// Seed of random replacement.
    pub seed: u64,
}

/// Associativities of the curves.
const WAYS: [u32; 5] = [1, 2, 4, 8, 16];

/// Sizes of the curves: the configured one over 8 to 16 times it.
const SIZES: std::ops::RangeInclusive<i32> = -3..=4;

/// More lines of all caches together than this are taken for a mistake: the curves' caches, up to sixteen times
/// as large and of several associativities, take some 800 MiB for as many.
const MOST_LINES: u64 = 1 << 21;

/// Checks that memory holds what stands for caches of a configuration, `first_levels` of them L1s.
///
/// # Errors
/// Too many lines.
pub(super) fn check_size(config: &RunConfig, first_levels: u32) -> Result<(), ConfigError> {
    let lines = |cache: &LevelConfig| cache.size_bytes / u64::from(config.line_bytes);
    let of_first = lines(&config.level.l1).saturating_mul(first_levels.into());
    let found = of_first.saturating_add(lines(&config.level.l2));
    accept(
        found <= MOST_LINES,
        "lines of all L1 and L2 caches",
        "at most 2097152 for locality, whose curves go to sixteen times the size",
        found,
    )
}

/// Times of the first axis.
const FIRST_AXIS: u32 = 1 << 16;

/// An analysis under way. Tell it the place, then every line asked for there.
pub struct Profile {
    of: StreamCache,
    cache: Box<dyn Cache>,
    /// Capacity of the cache in lines.
    lines: u32,

    here: TileOfEye,
    item: Option<u32>,
    span: Span,
    /// Tiles begun.
    tiles: u32,

    uses: LastUses,
    /// Times of all lines' last uses.
    last_times: CountedTimes,
    now: u32,
    /// Length of the axis.
    times: u32,
    /// When the frame began: on the axis, and on the clock of tiles.
    frame_start: u32,
    frame_first: Span,

    distances: Distances,
    /// Reuses of the line that was used last.
    at_once: ByOrigin,
    split: MissSplit,
    lru: SetAssociative,
    opt: Vec<opt::FullyAssociative>,
    opt_of_geometry: opt::SetAssociative,
    working_sets: WorkingSets,
    frame_lines: u64,
    frame_lines_of_both_eyes: u64,
    frame_lines_of_earlier_frames: u64,
}

impl Profile {
    /// Largest size of the curves over the configured one, rounded up to a power of two.
    pub(super) const LARGEST_OVER_CONFIGURED: u64 = 1 << *SIZES.end();

    /// An analysis before its first line.
    ///
    /// # Errors
    /// A cache that cannot be built.
    pub fn new(of: StreamCache) -> Result<Self, ConfigError> {
        Self::with_axis(of, FIRST_AXIS)
    }

    /// An analysis whose first axis has so many times, a multiple of 64.
    pub(super) fn with_axis(of: StreamCache, times: u32) -> Result<Self, ConfigError> {
        let sets = of.cache.sets(of.level, of.line_bytes)?;
        let ways = of.cache.ways;
        let lines = sets * ways;
        let mut sizes: Vec<u32> = SIZES
            .filter_map(|power| match power {
                0.. => lines.next_power_of_two().checked_shl(power as u32),
                _ => Some(lines.next_power_of_two() >> -power),
            })
            .filter(|&size| size > 0)
            .chain([lines])
            .collect();
        sizes.sort_unstable();
        sizes.dedup();
        let geometry = |size: u32, ways: u32| {
            let fits = size.is_multiple_of(ways) && (size / ways).is_power_of_two();
            fits.then(|| (size / ways, ways))
        };
        let of_sizes = sizes.iter().flat_map(|&size| {
            let all = WAYS.into_iter().chain([ways]);
            all.filter_map(move |ways| geometry(size, ways))
        });
        let opt = sizes.iter();
        Ok(Self {
            of,
            cache: AnyCache::build(&of.cache, of.level, of.line_bytes, of.seed)?.into_box(),
            lines,
            here: TileOfEye::NONE,
            item: None,
            span: Span::new(1, 1),
            tiles: 0,
            uses: LastUses::default(),
            last_times: CountedTimes::new(times),
            now: 0,
            times,
            frame_start: 0,
            frame_first: Span::new(1, 1),
            distances: Distances::default(),
            at_once: ByOrigin::default(),
            split: MissSplit::default(),
            lru: SetAssociative::new(of_sizes.chain([(sets, ways)]).collect()),
            opt: opt
                .map(|&size| opt::FullyAssociative::new(size, times))
                .collect(),
            opt_of_geometry: opt::SetAssociative::new(sets, ways),
            working_sets: WorkingSets::default(),
            frame_lines: 0,
            frame_lines_of_both_eyes: 0,
            frame_lines_of_earlier_frames: 0,
        })
    }

    /// Empties all caches and returns the figures of what was asked for until then. What follows is
    /// analysed as a stream of its own. The configured cache stays the same one, since random
    /// replacement goes on with its numbers.
    ///
    /// # Errors
    /// A cache that cannot be built.
    pub fn flush(&mut self) -> Result<Figures, ConfigError> {
        let next = Self::with_axis(self.of, self.times)?;
        let mut last = std::mem::replace(self, next);
        std::mem::swap(&mut self.cache, &mut last.cache);
        self.cache.clear();
        Ok(last.finish())
    }

    /// A frame begins. Caches keep what they hold.
    pub fn begin_frame(&mut self) {
        self.frame_start = self.now;
        self.frame_first = Span::new(self.tiles + 1, 1);
        self.item = None;
    }

    /// What follows is asked for here.
    pub fn at(&mut self, place: &Place) {
        self.here = TileOfEye::of(place);
        if self.item.is_none_or(|item| place.item > item) {
            self.item = Some(place.item);
            self.span = Span::new(self.tiles + 1, place.tiles);
            self.tiles = (self.tiles + place.tiles.clamp(1, 2)).min(Span::MOST_TILES);
        }
    }

    /// A line is asked for. True if the configured cache has it; it is filled where not.
    pub fn access(&mut self, line: u32) -> bool {
        if self.now == self.times {
            self.renumber();
        }
        let hit = self.cache.access(line);
        let last = self.uses.of(line);
        let (before, place_before) = (last.time, last.place);
        last.place = self.here;
        if last.span != self.span || place_before != self.here {
            if last.span < self.frame_first {
                self.frame_lines += 1;
                self.frame_lines_of_earlier_frames += u64::from(before != NEVER);
            }
            if let Some(eye) = self.here.eye() {
                let [own, other] = [last.span_of_eye[eye], last.span_of_eye[1 - eye]];
                let both = own < self.frame_first && other >= self.frame_first;
                self.frame_lines_of_both_eyes += u64::from(both);
            }
            self.working_sets.used(last, self.here, self.span);
        }
        let now = self.now;
        if before == NEVER {
            last.time = now;
            self.last_times.insert(now);
            self.lru.access(line, None);
            self.opt_of_geometry.access(line, None, now);
            self.split.compulsory += 1;
            self.now += 1;
            return hit;
        }
        let in_this_frame = before >= self.frame_start;
        let origin = Origin::of(place_before, in_this_frame, self.here).index();
        if before + 1 == now && in_this_frame {
            self.at_once[origin] += 1;
            return hit;
        }
        last.time = now;
        let distance = self.last_times.move_to_end(before, now);
        self.distances.count(distance, origin, 1);
        self.split.count(origin, hit, distance < self.lines);
        self.lru.access(line, Some(origin));
        for opt in &mut self.opt {
            let kept = before + 1 == now || opt.reuse(before, now);
            opt.hits[origin] += u64::from(kept);
        }
        let kept = self.opt_of_geometry.access(line, Some(before), now);
        self.opt_of_geometry.hits[origin] += u64::from(kept);
        self.now += 1;
        hit
    }

    /// Leaves on the axis only the times that something still refers to.
    #[cold]
    fn renumber(&mut self) {
        let opt_times = self.opt.iter().map(opt::FullyAssociative::times);
        let numbers = Renumbering::new(&self.last_times, opt_times);
        let room = (u64::from(numbers.len()) * 4).next_power_of_two();
        let times = u32::try_from(room).unwrap_or(NEVER).max(self.times);
        self.last_times = self.last_times.renumbered(&numbers, times);
        for opt in &mut self.opt {
            opt.renumber(&numbers, times);
        }
        self.opt_of_geometry.renumber(&numbers);
        for line in self.uses.used() {
            line.time = numbers.of(line.time);
        }
        self.frame_start = numbers.of(self.frame_start);
        (self.now, self.times) = (numbers.len(), times);
    }

    /// The figures of all that was asked for.
    #[must_use]
    pub fn finish(mut self) -> Figures {
        for last in self.uses.used() {
            self.working_sets.ended(last, self.tiles);
        }
        let mut distances = self.distances;
        for (origin, &times) in self.at_once.iter().enumerate() {
            distances.count(0, origin, times);
        }
        let mut split = self.split;
        add(&mut split.hits_of_both, &self.at_once);
        let reuses: u64 = distances.total().iter().sum();
        let with_front = |hits: &ByOrigin| {
            let mut hits = *hits;
            add(&mut hits, &self.at_once);
            hits
        };
        let opt = self.opt.iter().map(|opt| CacheHits {
            lines: opt.lines.into(),
            ways: None,
            hits: with_front(&opt.hits),
        });
        let lru = self.lru.hits().into_iter().map(|cache| CacheHits {
            hits: with_front(&cache.hits),
            ..cache
        });
        Figures {
            accesses: split.compulsory + reuses,
            unique_lines: split.compulsory,
            tiles: self.tiles.into(),
            frame_lines: self.frame_lines,
            frame_lines_of_both_eyes: self.frame_lines_of_both_eyes,
            frame_lines_of_earlier_frames: self.frame_lines_of_earlier_frames,
            split,
            lru: lru.collect(),
            opt: opt.collect(),
            configured_lines: self.lines.into(),
            opt_of_geometry: with_front(&self.opt_of_geometry.hits),
            working_sets: self.working_sets.curve(self.tiles),
            distances,
        }
    }
}
