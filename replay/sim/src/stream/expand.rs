//! Expands quads to lines. The tiles of a frame are read, expanded and counted in parallel, and every
//! order, cache and clock then reads the same lines.
//!
//! A frame is expanded when it is replayed and dropped afterwards, so memory does not grow with the number
//! of frames. Tiles for which the [`LineMemory`] has no room are counted, and expanded again whenever a
//! core needs them, until there is room.

use super::distinct::Distinct;
use super::footprint::{Bundle, Footprints, SampleRef, Scratch};
use super::last_used::LastUsed;
use super::lines::{QuadEnd, QuadRun, TileLines};
use super::tag::Tag;
use super::{Bins, LineSet, StreamError, TileAccesses, TileSource, TraceCounts, feed};
use crate::config::RunConfig;
use crate::order::TileRef;
use crate::tmu::Pending;
use formats::layout::Layout;
use formats::textrace::Tile;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Memory limit for the lines of all frames replayed at the same time.
#[derive(Debug)]
pub struct LineMemory {
    bytes: u64,
    left_bytes: AtomicU64,
}

impl LineMemory {
    /// Default limit: four stereo frames of the Z2 paper's size, or two if timed configurations are replayed.
    pub const USUAL_BYTES: u64 = 384 << 20;

    /// A limit of this many bytes.
    pub fn new(bytes: u64) -> Self {
        Self {
            bytes,
            left_bytes: AtomicU64::new(bytes),
        }
    }

    /// True if half of the memory is free, which leaves room for more frames.
    pub fn half_is_left(&self) -> bool {
        self.left() >= self.bytes / 2
    }

    fn left(&self) -> u64 {
        self.left_bytes.load(Ordering::Relaxed)
    }

    /// Copies the lines if there is room.
    fn keep(&self, lines: &TileLines) -> Option<TileLines> {
        let less = |left: u64| left.checked_sub(lines.bytes());
        let (set, get) = (Ordering::Relaxed, Ordering::Relaxed);
        let taken = self.left_bytes.fetch_update(set, get, less).is_ok();
        taken.then(|| lines.clone())
    }

    fn release(&self, bytes: u64) {
        self.left_bytes.fetch_add(bytes, Ordering::Relaxed);
    }
}

/// Expands the tiles of a trace with one sampling and layout.
pub struct Expander<'a> {
    source: &'a dyn TileSource,
    footprints: Footprints,
    bins: Bins,
    touched: LineSet,
    distinct: bool,
    all: bool,
    /// Number of sets for which idle accesses are left out (see [`LastUsed`]).
    idle_sets: Option<u32>,
    /// Halves of a tile may be apart in time.
    halves: bool,
}

/// Buffers for expanding a tile, reused from tile to tile, and the counts.
#[derive(Debug)]
pub(super) struct TileBuffers {
    tile: Tile,
    scratch: Scratch,
    counts: TraceCounts,
    distinct: Option<Distinct>,
    idle: Option<LastUsed>,
    /// The last tile's lines.
    pub(super) lines: TileLines,
}

impl<'a> Expander<'a> {
    /// Tiles that a thread expands per task.
    pub const CHUNK: usize = 64;

    /// An expander for a trace. Uses sampling, layout and line size of the configuration.
    ///
    /// # Errors
    /// Tables with invalid references, or too large an address space.
    pub fn new(source: &'a dyn TileSource, config: &RunConfig) -> Result<Self, StreamError> {
        let tables = source.tables();
        let footprints = Footprints::new(tables, config)?;
        Ok(Self {
            touched: LineSet::new(footprints.lines()),
            footprints,
            bins: Bins::new(tables, config.count_by)?,
            source,
            distinct: false,
            all: true,
            idle_sets: None,
            halves: false,
        })
    }

    /// Also lists the distinct lines of each quad.
    #[must_use]
    pub fn with_distinct_lines(self, distinct: bool) -> Self {
        Self { distinct, ..self }
    }

    /// Lists only the distinct lines of each quad.
    #[must_use]
    pub fn only_distinct_lines(self) -> Self {
        Self {
            distinct: true,
            all: false,
            ..self
        }
    }

    /// Leaves out accesses that change nothing in a cache of `sets` sets (a power of two) or more, see [`LastUsed`].
    #[must_use]
    pub fn without_idle_accesses(self, sets: u32) -> Self {
        Self {
            idle_sets: Some(sets),
            ..self
        }
    }

    /// Keeps accesses to the lower half of a tile even if the upper half accesses the same lines, because other tiles may come in between.
    #[must_use]
    pub fn in_halves(self, halves: bool) -> Self {
        Self { halves, ..self }
    }

    /// The trace as rendered.
    pub fn source(&self) -> &'a dyn TileSource {
        self.source
    }

    /// The bins for counts.
    pub fn bins(&self) -> &Bins {
        &self.bins
    }

    /// Location of the textures under a configuration.
    pub fn layout(&self, config: &RunConfig) -> Option<Arc<Layout>> {
        let layout = Layout::new(&self.source.tables().textures, &config.layout);
        layout.ok().map(Arc::new)
    }

    /// Lines of the whole address space.
    pub fn lines(&self) -> u64 {
        self.footprints.lines()
    }

    /// Expands all tiles of a frame and adds their accesses to `counts`.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn frame<'e>(
        &'e self,
        number: u32,
        memory: &'e LineMemory,
        counts: &mut TraceCounts,
    ) -> Result<Frame<'e>, StreamError> {
        let passes = &self.source.tables().passes;
        let of_frame = (0..).zip(passes).filter(|(_, pass)| pass.frame == number);
        let tiles: Vec<TileRef> = of_frame
            .flat_map(|(pass, p)| (0..p.tile_count()).map(move |tile| TileRef { pass, tile }))
            .collect();
        // Memory may be freed while other chunks are expanded, so chunks without room are deferred.
        let largest = AtomicU64::new(0);
        let chunk = |tiles: &[TileRef]| {
            let mut work = self.work();
            let mut expanded = Vec::with_capacity(tiles.len());
            let mut bytes = 0;
            for &at in tiles {
                let accesses = self.expand(at, &mut work)?;
                bytes += work.lines.bytes();
                expanded.push((at, accesses, memory.keep(&work.lines)));
            }
            largest.fetch_max(bytes, Ordering::Relaxed);
            Ok((work.counts, expanded))
        };
        let chunks = tiles.par_chunks(Self::CHUNK);
        let now = |tiles| {
            let room = memory.left() >= largest.load(Ordering::Relaxed);
            room.then(|| chunk(tiles)).transpose()
        };
        let first: Result<Vec<_>, StreamError> = chunks.clone().map(now).collect();
        let later = |(expanded, tiles)| Option::map_or_else(expanded, || chunk(tiles), Ok);
        let chunks: Result<Vec<_>, StreamError> =
            first?.into_par_iter().zip(chunks).map(later).collect();
        let mut frame = Frame {
            expander: self,
            number,
            memory,
            kept: passes.iter().map(|_| Vec::new()).collect(),
        };
        for (chunk_counts, expanded) in chunks? {
            counts.add(&chunk_counts);
            for (at, accesses, lines) in expanded {
                counts.tiles[self.bins.tile(at)] = accesses;
                let slot = lines.map_or_else(OnceLock::new, OnceLock::from);
                frame.kept[at.pass as usize].push(slot);
            }
        }
        counts.unique_lines = self.touched.count();
        Ok(frame)
    }

    pub(super) fn work(&self) -> TileBuffers {
        TileBuffers {
            tile: Tile::default(),
            scratch: self.footprints.scratch(self.distinct),
            counts: TraceCounts::without_tiles(&self.bins),
            distinct: self.distinct.then(Distinct::default),
            idle: self.idle_sets.map(LastUsed::new),
            lines: TileLines::default(),
        }
    }

    /// Expands a tile into `work.lines`.
    pub(super) fn expand(
        &self,
        at: TileRef,
        work: &mut TileBuffers,
    ) -> Result<TileAccesses, StreamError> {
        feed::read(self.source, at, &mut work.tile)?;
        let TileBuffers {
            tile,
            scratch,
            counts,
            distinct,
            idle,
            lines,
        } = work;
        lines.begin(self.bins.place(at));
        let first_cell = self.bins.first_cell(at);
        let mut sums = TileSums::default();
        let half_rows = feed::half_rows(self.source);
        for run in &tile.runs {
            let mut middle = None;
            if let Some(idle) = idle {
                idle.begin();
            }
            for records in feed::quads(tile, run) {
                if middle.is_none() && records.iter().any(|of| feed::is_lower(of, half_rows)) {
                    middle = Some(lines.quads.len() as u32);
                    if let Some(idle) = idle.as_mut().filter(|_| self.halves) {
                        idle.begin();
                    }
                }
                let lanes = feed::lanes(records);
                counts.quads += 1;
                counts.lanes += u64::from(lanes);
                sums.lanes += u64::from(lanes);
                let mut footprints = 0;
                if let Some(distinct) = distinct {
                    distinct.begin(lines.distinct.len());
                }
                self.footprints
                    .for_quad(run.draw, records, scratch, |sample, bundle| {
                        let cell = self.bins.cell(run.draw, sample.texture, bundle.level);
                        if let Some(distinct) = distinct {
                            let (found, uses) = (&mut lines.distinct, &mut lines.uses);
                            distinct.add(cell, sample.base_line, bundle, found, uses);
                        }
                        let (hash, lookups) = match idle {
                            Some(idle) => {
                                let is_idle = |line| idle.uses_again(line);
                                self.append(cell, sample, bundle, is_idle, lines)
                            }
                            None if self.all => self.append(cell, sample, bundle, |_| false, lines),
                            None => (0, bundle.distinct().lookups()),
                        };
                        counts.hash = counts.hash.wrapping_add(hash);
                        let cell = &mut counts.cells[first_cell + cell as usize];
                        cell.footprints += u64::from(bundle.count);
                        cell.line_lookups += u64::from(lookups);
                        footprints += u32::from(bundle.count);
                        sums.line_lookups += u64::from(lookups);
                    });
                sums.footprints += u64::from(footprints);
                checked_quad(at, footprints)?;
                if let Some(distinct) = distinct {
                    distinct.end(&mut lines.distinct, &mut lines.uses);
                }
                if !self.all {
                    counts.hash = counts.hash.wrapping_add(self.touch(lines));
                }
                lines.quads.push(QuadEnd {
                    end: lines.lines.len() as u32,
                    distinct_end: lines.distinct.len() as u32,
                    footprints,
                });
            }
            let end = lines.quads.len() as u32;
            lines.runs.push(QuadRun {
                primitive: run.primitive,
                middle: middle.unwrap_or(end),
                end,
            });
            sums.checked(at)?;
        }
        sums.checked(at)
    }

    /// Appends the footprints of a bundle, except lines with idle accesses. Returns the sum of
    /// [`access_hash`] over all line look-ups, and their number.
    #[inline(always)]
    fn append(
        &self,
        cell: u32,
        sample: SampleRef,
        bundle: &Bundle,
        mut is_idle: impl FnMut(u32) -> bool,
        out: &mut TileLines,
    ) -> (u64, u32) {
        let (mut hash, mut lookups) = (0_u64, 0);
        for (index, times) in bundle.runs() {
            let [first, other] = Tag::of_footprint(cell, times - 1);
            let mut tag = first;
            let mut once = 0_u64;
            let relative = bundle.lines_of(index);
            for relative in relative {
                let line = sample.base_line + relative;
                once = once.wrapping_add(access_hash(line));
                if is_idle(line) {
                    continue;
                }
                out.lines.push(line);
                out.tags.push(tag);
                tag = other;
                self.touched.insert(line);
            }
            hash = hash.wrapping_add(once.wrapping_mul(times.into()));
            lookups += relative.len() as u32 * times;
        }
        (hash, lookups)
    }

    /// The sum of [`access_hash`] over the last quad's footprints, if only distinct lines are listed.
    #[inline(always)]
    fn touch(&self, lines: &TileLines) -> u64 {
        let start = lines
            .quads
            .last()
            .map_or(0, |quad| quad.distinct_end as usize);
        let used = lines.distinct[start..].iter().zip(&lines.uses[start..]);
        used.fold(0, |hash, (&line, of)| {
            self.touched.insert(line);
            let times = of.footprints().count_ones();
            hash.wrapping_add(access_hash(line).wrapping_mul(times.into()))
        })
    }
}

/// Access counts of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct TileSums {
    lanes: u64,
    footprints: u64,
    line_lookups: u64,
}

impl TileSums {
    /// Checks that the counts fit their types. Every other per-tile count (footprints, missing lines) is at
    /// most the number of line look-ups.
    fn checked(self, at: TileRef) -> Result<TileAccesses, StreamError> {
        let fit = |name, count: u64| {
            u32::try_from(count).map_err(|_| StreamError::Tile {
                pass: at.pass,
                tile: at.tile,
                message: format!("expected fewer than 2^32 {name}, found {count}"),
            })
        };
        fit("line look-ups", self.line_lookups)?;
        Ok(TileAccesses {
            lanes: fit("lanes", self.lanes)?,
            footprints: fit("footprints", self.footprints)?,
        })
    }
}

/// Checks that a quad has no more footprints than a thread of a texture unit supports.
fn checked_quad(at: TileRef, footprints: u32) -> Result<(), StreamError> {
    if footprints <= Pending::MOST {
        return Ok(());
    }
    Err(StreamError::Tile {
        pass: at.pass,
        tile: at.tile,
        message: format!(
            "expected at most {} footprints a quad, found {footprints}",
            Pending::MOST
        ),
    })
}

/// Hash of one line access. Hashes are summed, so that their order does not matter.
#[inline(always)]
fn access_hash(line: u32) -> u64 {
    let mixed = (u64::from(line) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

/// The tiles of a frame.
pub struct Frame<'e> {
    expander: &'e Expander<'e>,
    number: u32,
    memory: &'e LineMemory,
    /// By pass and tile. Empty for passes of other frames and for tiles that memory has no room for yet.
    kept: Vec<Vec<OnceLock<TileLines>>>,
}

impl<'e> Frame<'e> {
    pub(super) fn expander(&self) -> &'e Expander<'e> {
        self.expander
    }

    /// The number of the frame.
    pub fn number(&self) -> u32 {
        self.number
    }

    pub(super) fn kept(&self, at: TileRef) -> Option<&TileLines> {
        self.slot(at)?.get()
    }

    /// Keeps the lines of a tile that was expanded again, if there is room now.
    pub(super) fn keep(&self, at: TileRef, lines: &TileLines) {
        if let Some(slot) = self.slot(at)
            && slot.get().is_none()
            && let Some(copy) = self.memory.keep(lines)
            && let Err(copy) = slot.set(copy)
        {
            // Another core has stored the tile already.
            self.memory.release(copy.bytes());
        }
    }

    fn slot(&self, at: TileRef) -> Option<&OnceLock<TileLines>> {
        self.kept[at.pass as usize].get(at.tile as usize)
    }

    /// Number of tiles that are expanded again when a core needs them.
    #[cfg(test)]
    fn not_kept(&self) -> usize {
        let slots = self.kept.iter().flatten();
        slots.filter(|slot| slot.get().is_none()).count()
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        let kept = self.kept.iter().flatten().filter_map(OnceLock::get);
        self.memory.release(kept.map(TileLines::bytes).sum());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::order::WorkItem;
    use crate::stream::testing::{tables, tile};
    use crate::stream::{Cores, MemoryTrace};

    #[test]
    fn tiles_are_stored_once_there_is_room() {
        let trace = MemoryTrace {
            tables: tables(&[[64, 64]]),
            tiles: vec![vec![tile(&[(0, 9), (1, 20)])], vec![tile(&[(0, 7)])]],
        };
        let expander = Expander::new(&trace, &RunConfig::default()).unwrap();
        fn expand<'e>(
            expander: &'e Expander<'_>,
            memory: &'e LineMemory,
        ) -> (Frame<'e>, TraceCounts) {
            let mut counts = TraceCounts::new(expander.bins());
            let frame = expander.frame(0, memory, &mut counts).unwrap();
            (frame, counts)
        }
        let plenty = LineMemory::new(1 << 20);
        let (frame, expected) = expand(&expander, &plenty);
        let bytes = plenty.bytes - plenty.left();
        let lines_of = |frame: &Frame<'_>, pass: u32| {
            let mut cores = Cores::new(frame, 1);
            cores
                .load(0, &WorkItem::Tile(TileRef { pass, tile: 0 }))
                .unwrap();
            let quads = std::iter::from_fn(|| Some(cores.next_quad(0)?.lines.to_vec()));
            quads.collect::<Vec<_>>()
        };
        let lines = [0, 1].map(|pass| lines_of(&frame, pass));
        assert!(frame.not_kept() == 0 && !lines[1].is_empty());

        let memory = LineMemory::new(bytes);
        let (first, _) = expand(&expander, &memory);
        let (second, counts) = expand(&expander, &memory);
        assert_eq!((first.not_kept(), second.not_kept()), (0, 2));
        assert_eq!((counts.hash, counts.quads), (expected.hash, expected.quads));
        let read = |kept: [usize; 2]| {
            for (pass, kept) in kept.into_iter().enumerate() {
                assert_eq!(lines_of(&second, pass as u32), lines[pass]);
                assert_eq!(second.not_kept(), 2 - kept);
            }
        };
        read([0, 0]);
        drop(first);
        read([1, 2]);
        read([2, 2]);
        assert_eq!(memory.left(), 0);
        drop(second);
        assert_eq!(memory.left(), bytes);
    }

    #[test]
    fn a_quad_with_more_footprints_than_a_thread_supports_is_refused() {
        let at = TileRef { pass: 3, tile: 17 };
        assert!(checked_quad(at, Pending::MOST).is_ok());
        let error = checked_quad(at, Pending::MOST + 1).unwrap_err().to_string();
        let expected = "expected at most 1048576 footprints a quad, found 1048577";
        assert!(error.contains(expected) && error.contains("17"), "{error}");
    }

    #[test]
    fn a_tile_whose_counters_would_overflow_is_refused() {
        let at = TileRef { pass: 3, tile: 17 };
        let most = u64::from(u32::MAX);
        let full = TileSums {
            lanes: most,
            footprints: most,
            line_lookups: most,
        };
        let accesses = full.checked(at).unwrap();
        assert_eq!((accesses.lanes, accesses.footprints), (u32::MAX, u32::MAX));
        let over = [
            TileSums {
                lanes: most + 1,
                ..full
            },
            TileSums {
                footprints: most + 1,
                ..full
            },
            TileSums {
                line_lookups: most + 1,
                ..full
            },
        ];
        for (sums, name) in over
            .into_iter()
            .zip(["lanes", "footprints", "line look-ups"])
        {
            let error = sums.checked(at).unwrap_err().to_string();
            assert!(
                error.contains(&format!(
                    "expected fewer than 2^32 {name}, found 4294967296"
                )) && error.contains("17"),
                "{error}"
            );
        }
    }
}
