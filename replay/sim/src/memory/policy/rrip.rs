//! Re-reference interval prediction: SRRIP, BRRIP and DRRIP (Jaleel et al., ISCA 2010, sections 4
//! and 5), 2 bits per line.
//!
//! A hit promotes a line only after another line has been filled into its set. Earlier accesses
//! belong to the quads that fetched the line and count as one access: all policies here rely on
//! repeated accesses changing nothing.

use crate::memory::cache::{Cache, EMPTY, empty_way};

/// A distant re-reference: the next victim.
pub(super) const DISTANT: u8 = 3;
/// A long re-reference.
pub(super) const LONG: u8 = 2;
/// Every 32nd bimodal fill is long, the others are distant.
const BIMODAL: u32 = 32;
/// Sets dedicated to each of the two duelling insertions.
const LEADERS: u32 = 32;
/// Maximum of the 10-bit counter of the duelling sets.
const MOST_SELECTED: u32 = 1023;

/// Lines with their predictions.
pub(super) struct Sets {
    tags: Vec<u32>,
    predictions: Vec<u8>,
    /// The most recently filled way, by set.
    newest: Vec<u8>,
    ways: usize,
    set_mask: u32,
}

impl Sets {
    /// All empty; `sets` is a power of two, `ways` at most 255.
    pub(super) fn new(sets: u32, ways: u32) -> Self {
        Self {
            tags: vec![EMPTY; sets as usize * ways as usize],
            predictions: vec![DISTANT; sets as usize * ways as usize],
            newest: vec![u8::MAX; sets as usize],
            ways: ways as usize,
            set_mask: sets - 1,
        }
    }

    /// The set of a line.
    pub(super) const fn set(&self, line: u32) -> usize {
        (line & self.set_mask) as usize
    }

    /// Looks a line up and promotes it. Returns its place, and whether this is the first promotion since its fill.
    pub(super) fn lookup(&mut self, line: u32) -> Option<(usize, bool)> {
        let set = self.set(line);
        let first = set * self.ways;
        let tags = &self.tags[first..first + self.ways];
        let way = tags.iter().position(|&tag| tag == line)?;
        let is_newest = usize::from(self.newest[set]) == way;
        let prediction = &mut self.predictions[first + way];
        let is_first = !is_newest && *prediction != 0;
        if !is_newest {
            *prediction = 0;
        }
        Some((first + way, is_first))
    }

    /// The place for the next line of a set: an empty way, or the victim. The victim is the first
    /// way with a distant re-reference, after ageing all ways until there is one.
    pub(super) fn victim(&mut self, set: usize) -> usize {
        let first = set * self.ways;
        let ways = first..first + self.ways;
        if let Some(empty) = self.tags[ways.clone()].iter().position(|&tag| tag == EMPTY) {
            return first + empty;
        }
        let predictions = &mut self.predictions[ways];
        let oldest = predictions.iter().copied().max().unwrap_or(DISTANT);
        for prediction in predictions.iter_mut() {
            *prediction += DISTANT - oldest;
        }
        first + predictions.iter().position(|&p| p == DISTANT).unwrap_or(0)
    }

    /// True if the line is resident.
    pub(super) fn contains(&self, line: u32) -> bool {
        let first = self.set(line) * self.ways;
        self.tags[first..first + self.ways].contains(&line)
    }

    /// The line at a place, or [`EMPTY`].
    pub(super) fn line(&self, place: usize) -> u32 {
        self.tags[place]
    }

    /// Writes a line to a place of its set.
    pub(super) fn insert(&mut self, place: usize, line: u32, prediction: u8) {
        let set = self.set(line);
        self.tags[place] = line;
        self.predictions[place] = prediction;
        self.newest[set] = (place - set * self.ways) as u8;
    }

    /// Removes a line. Returns true if it was resident.
    pub(super) fn remove(&mut self, line: u32) -> bool {
        let set = self.set(line);
        let first = set * self.ways;
        let Some(way) = empty_way(&mut self.tags[first..first + self.ways], line) else {
            return false;
        };
        self.predictions[first + way] = DISTANT;
        if usize::from(self.newest[set]) == way {
            self.newest[set] = u8::MAX;
        }
        true
    }

    /// Removes all lines.
    pub(super) fn clear(&mut self) {
        self.tags.fill(EMPTY);
        self.predictions.fill(DISTANT);
        self.newest.fill(u8::MAX);
    }
}

/// The re-reference predicted for a new line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Insertion {
    /// Long.
    Static,
    /// Distant, except for one fill in 32.
    Bimodal,
    /// The one of the two that misses less in its dedicated sets.
    Dueling,
}

/// A cache with re-reference interval prediction.
pub(super) struct Rrip {
    sets: Sets,
    insertion: Insertion,
    /// Bimodal fills so far.
    fills: u32,
    /// Incremented by misses in sets dedicated to static insertion, decremented by those of bimodal insertion.
    selected: u32,
    /// Distance between sets dedicated to the same insertion.
    stride: u32,
}

impl Rrip {
    /// An empty cache; `sets` is a power of two, `ways` at most 255.
    pub fn new(sets: u32, ways: u32, insertion: Insertion) -> Self {
        Self {
            sets: Sets::new(sets, ways),
            insertion,
            fills: 0,
            selected: MOST_SELECTED / 2,
            stride: (sets / LEADERS).max(2),
        }
    }

    /// The insertion for a fill of a set. Counts the fill as a miss in the duel.
    fn insertion(&mut self, set: usize) -> Insertion {
        if self.insertion != Insertion::Dueling {
            return self.insertion;
        }
        match set as u32 % self.stride {
            0 => {
                self.selected = (self.selected + 1).min(MOST_SELECTED);
                Insertion::Static
            }
            1 => {
                self.selected = self.selected.saturating_sub(1);
                Insertion::Bimodal
            }
            _ if self.selected > MOST_SELECTED / 2 => Insertion::Bimodal,
            _ => Insertion::Static,
        }
    }
}

impl Cache for Rrip {
    fn lookup(&mut self, line: u32) -> bool {
        self.sets.lookup(line).is_some()
    }

    fn contains(&self, line: u32) -> bool {
        self.sets.contains(line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let set = self.sets.set(line);
        let prediction = match self.insertion(set) {
            Insertion::Bimodal => {
                self.fills += 1;
                if self.fills.is_multiple_of(BIMODAL) {
                    LONG
                } else {
                    DISTANT
                }
            }
            Insertion::Static | Insertion::Dueling => LONG,
        };
        let place = self.sets.victim(set);
        let evicted = self.sets.line(place);
        self.sets.insert(place, line, prediction);
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        self.sets.remove(line)
    }

    /// Also restarts the duel, because other work between two frames would train the counter for itself.
    fn clear(&mut self) {
        self.sets.clear();
        self.fills = 0;
        self.selected = MOST_SELECTED / 2;
    }
}
