//! A quad on its way through a texture unit, footprint by footprint.

use crate::stream::QuadLines;

/// Look-ups of one footprint that asked for lines, after which the thread keeps what has arrived.
///
/// Fills are delayed: lines that crowd each other out of a set may do so for ever, each thread's
/// arrival taking away what the other one is about to use. A thread that has asked so often for the
/// same footprint gets its data from the fill itself.
pub const FETCHES_UNTIL_KEPT: u32 = 8;

/// A thread's footprints and how far it has come.
#[derive(Debug, Default)]
pub struct Thread {
    lines: Vec<u32>,
    footprints: Vec<Listed>,
    tile: usize,
    /// Footprint that is next, its first line, and how often it was filtered already.
    at: usize,
    line: usize,
    filtered: u32,
    /// What has become of the footprint that is next.
    pub state: FootprintState,
}

/// A footprint and how often it follows itself.
#[derive(Debug)]
struct Listed {
    end: usize,
    repeats: u32,
    cell: usize,
}

/// What has become of a footprint.
#[derive(Clone, Copy, Debug, Default)]
pub struct FootprintState {
    /// It was looked up before.
    pub tried: bool,
    /// It asked the L2.
    pub fetched: bool,
    /// It made the L2 ask memory.
    pub from_memory: bool,
    /// Look-ups that asked the L2.
    pub fetches: u32,
    /// From this cycle on the thread has its data, whatever the cache holds.
    pub kept_from: Option<u64>,
}

/// The footprint that is next.
#[derive(Clone, Copy, Debug)]
pub struct Current<'a> {
    /// Its distinct lines.
    pub lines: &'a [u32],
    /// Where it counts.
    pub cell: usize,
    /// Its tile.
    pub tile: usize,
}

impl Thread {
    /// A new thread, in the memory of an old one.
    pub fn begin(&mut self, quad: QuadLines<'_>) {
        self.lines.clear();
        self.lines.extend_from_slice(quad.lines);
        self.footprints.clear();
        let mut end = 0;
        self.footprints.extend(quad.footprints().map(|footprint| {
            end += footprint.lines.len();
            Listed {
                end,
                repeats: footprint.repeats,
                cell: footprint.cell,
            }
        }));
        self.tile = quad.tile();
        (self.at, self.line, self.filtered) = (0, 0, 0);
        self.state = FootprintState::default();
    }

    /// The footprint that is next; none when all are filtered.
    #[inline]
    pub fn footprint(&self) -> Option<Current<'_>> {
        let listed = self.footprints.get(self.at)?;
        Some(Current {
            lines: &self.lines[self.line..listed.end],
            cell: listed.cell,
            tile: self.tile,
        })
    }

    /// True if the thread has the data of the footprint that is next.
    #[inline]
    pub fn has_kept(&self, now: u64) -> bool {
        self.state.kept_from.is_some_and(|from| from <= now)
    }

    /// The footprint is filtered.
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
