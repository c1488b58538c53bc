//! The caches as threads see them that stop at a miss, and the two ways of counting: primary misses
//! with the bytes that memory sends, and first look-ups.

use super::super::counts::{CacheCounts, CellMisses};
use super::thread::{FETCHES_UNTIL_KEPT, Thread};
use crate::cache::{Cache, InFlight, Levels};
use crate::config::TmuConfig;
use crate::result::FirstLookups;

/// A cache and what is on its way into it.
struct Level<C> {
    cache: C,
    in_flight: InFlight,
}

impl<C: Cache> Level<C> {
    fn new(cache: C, usual_cycles: u64) -> Self {
        Self {
            cache,
            in_flight: InFlight::new(usual_cycles),
        }
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.in_flight.clear();
    }

    #[inline(always)]
    fn arrive(&mut self, now: u64) {
        self.in_flight.arrive(now, &mut self.cache);
    }

    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now {
            self.cache.fill(line);
        } else {
            self.in_flight.request(line, now, arrival);
        }
    }
}

/// What a footprint finds in its core's own cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// All its lines.
    All,
    /// Not all of them: [`Memory::ask`] knows which.
    NotAll,
}

/// L1 caches over a shared L2.
pub struct Memory<C> {
    l1: Vec<Level<C>>,
    l2: Level<C>,
    l1_penalty_cycles: u64,
    l2_penalty_cycles: u64,
    counts: CacheCounts,
    /// Lines that the footprint looked up last did not find, by core.
    absent: Vec<Vec<u32>>,
    first: FirstLookups,
    /// Look-ups that found their data with the thread, not in the cache.
    pub forwarded: u64,
}

impl<C: Cache> Memory<C> {
    /// Empty caches.
    pub fn new(levels: Levels<C>, tmu: &TmuConfig, counts: CacheCounts) -> Self {
        let [l1_penalty_cycles, l2_penalty_cycles] =
            [tmu.l1_penalty_cycles, tmu.l2_penalty_cycles].map(u64::from);
        let first = |cache| Level::new(cache, l1_penalty_cycles + l2_penalty_cycles);
        Self {
            absent: vec![Vec::with_capacity(4); levels.l1.len()],
            l1: levels.l1.into_iter().map(first).collect(),
            l2: Level::new(levels.l2, l2_penalty_cycles),
            l1_penalty_cycles,
            l2_penalty_cycles,
            counts,
            first: FirstLookups::default(),
            forwarded: 0,
        }
    }

    /// Primary misses.
    pub fn counts(&self) -> &CacheCounts {
        &self.counts
    }

    /// First look-ups of so many footprints.
    pub fn first_lookups(&self, footprints: u64) -> FirstLookups {
        FirstLookups {
            forwarded: self.forwarded,
            ..self.first
        }
        .over(footprints)
    }

    /// Empties all caches. Nobody waits for what is on its way.
    pub fn flush(&mut self) {
        self.l1.iter_mut().for_each(Level::clear);
        self.l2.clear();
    }

    /// Looks up all lines of a footprint in the core's own cache. Doing so once more at the same
    /// cycle changes nothing.
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, lines: &[u32]) -> Seen {
        let level = &mut self.l1[core];
        level.arrive(now);
        match level.cache.lookup_all(lines) {
            None => Seen::All,
            Some(first) => {
                let (absent, cache) = (&mut self.absent[core], &mut level.cache);
                absent.clear();
                absent.push(lines[first]);
                let rest = lines[first + 1..].iter();
                absent.extend(rest.filter(|&&line| !cache.lookup(line)));
                Seen::NotAll
            }
        }
    }

    /// The footprint that was looked up last asks for the lines that it did not find, unless they
    /// are on their way.
    pub fn ask(&mut self, core: usize, now: u64, thread: &mut Thread) {
        let Some(footprint) = thread.footprint() else {
            return;
        };
        let (cell, tile) = (footprint.cell, footprint.tile);
        let mut state = thread.state;
        let first = !std::mem::replace(&mut state.tried, true);
        if state.kept_from.is_some() {
            // All is asked for; the thread waits for the last of it.
            return;
        }
        self.first.l1_misses += u64::from(first);
        self.l2.arrive(now);
        let CellMisses { l1, l2 } = &mut self.counts.cells[cell];
        let (mut fetched, mut from_memory, mut latest) = (0_u32, 0_u32, now);
        for &line in &self.absent[core] {
            let l1_level = &mut self.l1[core];
            let known = l1_level.in_flight.arrival(line);
            // A line on its way into the L1 is a miss of the L2 until memory has sent it.
            let in_l2 = match known {
                Some(_) => self.l2.in_flight.arrival(line).is_none(),
                None => self.l2.cache.lookup(line),
            };
            if first {
                self.first.l2_lookups += 1;
                self.first.l2_misses += u64::from(!in_l2);
                l1.secondary += u64::from(known.is_some());
            }
            let arrival = known.unwrap_or_else(|| {
                fetched += 1;
                let there = if in_l2 {
                    now
                } else if let Some(arrival) = self.l2.in_flight.arrival(line) {
                    l2.secondary += 1;
                    arrival
                } else {
                    from_memory += 1;
                    let arrival = now + self.l2_penalty_cycles;
                    self.l2.enter(line, now, arrival);
                    arrival
                };
                let arrival = there + self.l1_penalty_cycles;
                l1_level.enter(line, now, arrival);
                arrival
            });
            latest = latest.max(arrival);
        }
        l1.lines += u64::from(fetched);
        l2.lines += u64::from(from_memory);
        // A footprint counts once, however often it asks.
        let newly_fetched = fetched > 0 && !std::mem::replace(&mut state.fetched, true);
        let newly_missed = from_memory > 0 && !std::mem::replace(&mut state.from_memory, true);
        l1.footprints += u64::from(newly_fetched);
        l2.footprints += u64::from(newly_missed);
        if let Some(tile) = self.counts.tiles.get_mut(tile) {
            tile.l1_footprints = tile.l1_footprints.wrapping_add(u32::from(newly_fetched));
            tile.l2_lines = tile.l2_lines.wrapping_add(from_memory);
        }
        if fetched > 0 {
            state.fetches += 1;
            if state.fetches == FETCHES_UNTIL_KEPT {
                state.kept_from = Some(latest);
            }
        }
        thread.state = state;
    }
}
