//! A quad in a texture unit, processed footprint by footprint.

use crate::stream::QuadLines;

/// Number of requesting look-ups of a footprint after which the thread keeps arriving data.
///
/// With delayed fills, threads can evict each other's lines from a set forever, each fill evicting the line
/// that the other thread needs next. After this many attempts a thread takes its data from the fill itself.
pub(super) const FETCHES_UNTIL_KEPT: u32 = 8;

/// A thread's footprints and its progress.
#[derive(Debug, Default)]
pub(crate) struct Thread {
    lines: Vec<u32>,
    footprints: Vec<ThreadFootprint>,
    tile: usize,
    /// Index of the next footprint, index of its first line, and number of its repeats already filtered.
    at: usize,
    line: usize,
    filtered: u32,
    /// State of the next footprint.
    pub state: FootprintState,
}

/// A footprint and its number of repeats.
#[derive(Debug)]
struct ThreadFootprint {
    end: usize,
    repeats: u32,
    cell: usize,
}

/// Progress of a footprint.
#[derive(Clone, Copy, Debug, Default)]
pub struct FootprintState {
    /// It has been looked up.
    pub tried: bool,
    /// It has requested lines from the L2.
    pub fetched: bool,
    /// It has caused a fetch from memory.
    pub from_memory: bool,
    /// Number of look-ups that requested lines.
    pub fetches: u32,
    /// From this cycle on the thread has its data, whatever the cache holds.
    pub kept_from: Option<u64>,
}

/// The next footprint.
#[derive(Clone, Copy, Debug)]
pub struct Current<'a> {
    /// Its distinct lines.
    pub lines: &'a [u32],
    /// Its cell for counts.
    pub cell: usize,
    /// Its tile.
    pub tile: usize,
}

impl Thread {
    /// Starts a thread, reusing the allocations of a finished one.
    pub fn begin(&mut self, quad: QuadLines<'_>) {
        self.lines.clear();
        self.lines.extend_from_slice(quad.lines);
        self.footprints.clear();
        let mut end = 0;
        self.footprints.extend(quad.footprints().map(|footprint| {
            end += footprint.lines.len();
            ThreadFootprint {
                end,
                repeats: footprint.repeats,
                cell: footprint.cell,
            }
        }));
        self.tile = quad.tile();
        (self.at, self.line, self.filtered) = (0, 0, 0);
        self.state = FootprintState::default();
    }

    /// The next footprint, or none when all are filtered.
    #[inline]
    pub fn footprint(&self) -> Option<Current<'_>> {
        let listed = self.footprints.get(self.at)?;
        Some(Current {
            lines: &self.lines[self.line..listed.end],
            cell: listed.cell,
            tile: self.tile,
        })
    }

    /// True if the thread has kept the data of the next footprint.
    #[inline]
    pub fn has_kept(&self, now: u64) -> bool {
        self.state.kept_from.is_some_and(|from| from <= now)
    }

    /// Marks the footprint as filtered.
    #[inline]
    pub fn advance(&mut self) {
        let listed = &self.footprints[self.at];
        if self.filtered < listed.repeats {
            self.filtered += 1;
        } else {
            self.filtered = 0;
            self.line = listed.end;
            self.at += 1;
        }
        self.state = FootprintState::default();
    }
}
