//! Analyses a stream of lines.
//!
//! Every use of a line gets the next time on an axis. The number of lines whose last use is later than this
//! line's is the number of distinct lines used since: its stack distance (Bennett & Kruskal 1975, Olken
//! 1981), counted in O(log n). Immediate reuse changes nothing. A full axis is renumbered, so memory
//! depends only on the number of distinct lines.

use crate::axis::{CountedTimes, Renumbering};
use crate::caches::Caches;
use crate::distances::Distances;
use crate::figures::Figures;
use crate::knees::{NO_ROW, RowCounts};
use crate::last_use::{LastUses, NEVER, Span};
use crate::place::{ByOrigin, Origin, Place, TileOfEye};
use crate::working_set::WorkingSets;
use sim::config::{ConfigError, LevelConfig, RunConfig, accept};

/// The cache that receives a stream.
#[derive(Clone, Copy, Debug)]
pub struct StreamCache {
    /// Size, ways and policy.
    pub cache: LevelConfig,
    /// `L1` or `L2`, for errors.
    pub level: &'static str,
    /// Bytes per line.
    pub line_bytes: u32,
    /// Seed of random replacement.
    pub seed: u64,
}

/// Upper limit for the lines of all caches. The caches of the curves, up to sixteen times as large and of
/// several associativities, then take about 800 MiB.
const MOST_LINES: u64 = 1 << 21;

/// Checks that memory suffices for the caches of a configuration with `first_levels` L1s.
///
/// # Errors
/// Too many lines.
pub(crate) fn check_size(config: &RunConfig, first_levels: u32) -> Result<(), ConfigError> {
    let lines = |cache: &LevelConfig| cache.size_bytes / u64::from(config.line_bytes);
    let of_first = lines(&config.level.l1).saturating_mul(first_levels.into());
    let found = of_first.saturating_add(lines(&config.level.l2));
    accept(
        found <= MOST_LINES,
        "lines of all L1 and L2 caches",
        "at most 2097152 for locality, whose curves extend to 16 times the size",
        found,
    )
}

/// Length of the first axis.
const FIRST_AXIS: u32 = 1 << 16;

/// An analysis in progress. Set the place with [`Self::at`], then add every line looked up there.
pub struct Profile {
    of: StreamCache,
    /// Capacity of the cache in lines.
    lines: u32,
    /// Absent if only distances are asked for.
    caches: Option<Box<Caches>>,

    here: TileOfEye,
    /// Row of the tile, or [`NO_ROW`].
    row: u32,
    item: Option<u32>,
    span: Span,
    /// Number of tiles so far.
    tiles: u32,

    uses: LastUses,
    /// Times of the last uses of all lines.
    last_times: CountedTimes,
    now: u32,
    /// Length of the axis.
    times: u32,
    /// Start of the frame, on the axis and on the clock of tiles.
    frame_start: u32,
    frame_first: Span,
    /// Frames with look-ups, and whether this frame has had one.
    frames: u64,
    is_frame_counted: bool,

    rows: RowCounts,
    distances: Distances,
    /// Immediate reuses.
    at_once: ByOrigin,
    first_uses: u64,
    working_sets: WorkingSets,
    frame_lines: u64,
    frame_lines_of_both_eyes: u64,
    frame_lines_of_earlier_frames: u64,
}

impl Profile {
    /// Largest size in the curves over the configured size rounded up to a power of two.
    pub(crate) const LARGEST_OVER_CONFIGURED: u64 = Caches::LARGEST_OVER_CONFIGURED;

    /// An empty analysis.
    ///
    /// # Errors
    /// An impossible cache.
    pub fn new(of: StreamCache) -> Result<Self, ConfigError> {
        Self::with_axis(of, FIRST_AXIS)
    }

    /// An analysis whose first axis has this length, a multiple of 64.
    pub(crate) fn with_axis(of: StreamCache, times: u32) -> Result<Self, ConfigError> {
        Ok(Self {
            caches: Some(Box::new(Caches::new(&of, times)?)),
            ..Self::without_caches(of, times)?
        })
    }

    /// An analysis of distances and first uses alone.
    ///
    /// # Errors
    /// An impossible cache.
    pub(crate) fn of_distances(of: StreamCache) -> Result<Self, ConfigError> {
        Self::without_caches(of, FIRST_AXIS)
    }

    fn without_caches(of: StreamCache, times: u32) -> Result<Self, ConfigError> {
        let lines = of.cache.sets(of.level, of.line_bytes)? * of.cache.ways;
        Ok(Self {
            of,
            lines,
            caches: None,
            here: TileOfEye::NONE,
            row: NO_ROW,
            item: None,
            span: Span::new(1, 1),
            tiles: 0,
            uses: LastUses::default(),
            last_times: CountedTimes::new(times),
            now: 0,
            times,
            frame_start: 0,
            frame_first: Span::new(1, 1),
            frames: 0,
            is_frame_counted: false,
            rows: RowCounts::default(),
            distances: Distances::default(),
            at_once: ByOrigin::default(),
            first_uses: 0,
            working_sets: WorkingSets::default(),
            frame_lines: 0,
            frame_lines_of_both_eyes: 0,
            frame_lines_of_earlier_frames: 0,
        })
    }

    /// Empties all caches and returns the figures so far. What follows is analysed as a separate stream.
    /// The configured cache is reused, because random replacement continues its sequence.
    ///
    /// # Errors
    /// An impossible cache.
    pub fn flush(&mut self) -> Result<Figures, ConfigError> {
        let mut next = Self::without_caches(self.of, self.times)?;
        if let Some(caches) = &mut self.caches {
            let mut empty = Caches::new(&self.of, self.times)?;
            std::mem::swap(&mut empty.configured, &mut caches.configured);
            empty.configured.clear();
            next.caches = Some(Box::new(empty));
        }
        Ok(std::mem::replace(self, next).finish())
    }

    /// Starts a frame. Caches keep their lines.
    pub(crate) fn begin_frame(&mut self) {
        self.frame_start = self.now;
        self.frame_first = Span::new(self.tiles + 1, 1);
        self.is_frame_counted = false;
        self.rows.begin_frame();
        self.item = None;
    }

    /// Sets the place of the following look-ups.
    pub fn at(&mut self, place: &Place) {
        self.here = TileOfEye::of(place);
        // Rows are not asked for with distances alone.
        let row = place.row.filter(|_| self.caches.is_some());
        self.row = row.unwrap_or(NO_ROW);
        self.frames += u64::from(!self.is_frame_counted);
        self.is_frame_counted = true;
        if self.item.is_none_or(|item| place.item > item) {
            self.item = Some(place.item);
            self.span = Span::new(self.tiles + 1, place.tiles);
            self.tiles = (self.tiles + place.tiles.clamp(1, 2)).min(Span::MOST_TILES);
        }
    }

    /// Looks up a line in all caches, and fills it on a miss. Returns true for a hit in the configured cache; false
    /// without caches.
    pub fn access(&mut self, line: u32) -> bool {
        if self.now == self.times {
            self.renumber();
        }
        let mut caches = self.caches.as_deref_mut();
        let configured = caches.as_mut().map(|caches| &mut caches.configured);
        let hit = configured.is_some_and(|cache| cache.access(line));
        let last = self.uses.of(line);
        let (before, place_before, row_before) = (last.time, last.place, last.row);
        (last.place, last.row) = (self.here, self.row);
        let in_this_frame = before != NEVER && before >= self.frame_start;
        let is_other_row = row_before != self.row && self.row != NO_ROW;
        if is_other_row || !in_this_frame && self.row != NO_ROW {
            self.rows.enter(self.row, line);
        }
        let is_from_row = in_this_frame && is_other_row && row_before != NO_ROW;
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
            self.first_uses += 1;
            if let Some(caches) = caches {
                caches.first_use(line, now);
            }
            self.now += 1;
            return hit;
        }
        let origin = Origin::of(place_before, in_this_frame, self.here).index();
        if before + 1 == now && in_this_frame {
            self.at_once[origin] += 1;
            if is_from_row {
                self.rows.reuse(0);
            }
            return hit;
        }
        last.time = now;
        let distance = self.last_times.move_to_end(before, now);
        self.distances.count(distance, origin, 1);
        if is_from_row {
            self.rows.reuse(distance);
        }
        if let Some(caches) = caches {
            let hits = [hit, distance < self.lines];
            caches.reuse(line, origin, [before, now], hits);
        }
        self.now += 1;
        hit
    }

    /// Removes all times from the axis that are no longer referenced.
    #[cold]
    fn renumber(&mut self) {
        let opt_times = self.caches.iter().flat_map(|caches| caches.opt_times());
        let numbers = Renumbering::new(&self.last_times, opt_times);
        let room = (u64::from(numbers.len()) * 4).next_power_of_two();
        let times = u32::try_from(room).unwrap_or(NEVER).max(self.times);
        self.last_times = self.last_times.renumbered(&numbers, times);
        if let Some(caches) = &mut self.caches {
            caches.renumber(&numbers, times);
        }
        for line in self.uses.used() {
            line.time = numbers.of(line.time);
        }
        self.frame_start = numbers.of(self.frame_start);
        (self.now, self.times) = (numbers.len(), times);
    }

    /// The figures of all look-ups.
    pub fn finish(mut self) -> Figures {
        for last in self.uses.used() {
            self.working_sets.ended(last, self.tiles);
        }
        let mut distances = self.distances;
        for (origin, &times) in self.at_once.iter().enumerate() {
            distances.count(0, origin, times);
        }
        let reuses: u64 = distances.total().iter().sum();
        let figures =
            (self.caches).map_or_else(Figures::default, |caches| caches.figures(&self.at_once));
        Figures {
            accesses: self.first_uses + reuses,
            unique_lines: self.first_uses,
            tiles: self.tiles.into(),
            frames: self.frames,
            rows: self.rows.finish(),
            frame_lines: self.frame_lines,
            frame_lines_of_both_eyes: self.frame_lines_of_both_eyes,
            frame_lines_of_earlier_frames: self.frame_lines_of_earlier_frames,
            configured_lines: self.lines.into(),
            working_sets: self.working_sets.curve(self.tiles),
            distances,
            ..figures
        }
    }
}
