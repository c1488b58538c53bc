//! Re-reference interval prediction: SRRIP, BRRIP and DRRIP (Jaleel et al., ISCA 2010, sections 4 and 5), 2 bits per line.
//!
//! A line is promoted by a hit once another line has been filled into its set. Accesses before that belong to the quads that
//! fetched the line, and count as one: all policies here rely on it that repeats of an access change nothing.

use super::{Cache, EMPTY, empty_way};

/// A distant re-reference: the next victim.
pub(super) const DISTANT: u8 = 3;
/// A long re-reference.
pub(super) const LONG: u8 = 2;
/// One fill of so many is long where the others are distant.
const BIMODAL: u32 = 32;
/// Sets that always take one of the two dueling insertions.
const LEADERS: u32 = 32;
/// Largest value of the counter of the dueling sets, 10 bits.
const MOST_SELECTED: u32 = 1023;

/// Lines with their predictions.
pub(super) struct Sets {
    tags: Vec<u32>,
    predictions: Vec<u8>,
    /// The way that was filled last, by set.
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

    /// Looks a line up and promotes it: its place, and whether it had not been promoted since its fill.
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

    /// The place of the next line of a set, empty or of the victim: the first way whose re-reference is distant, after all have
    /// aged until there is one.
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

    /// True if the line is there.
    pub(super) fn contains(&self, line: u32) -> bool {
        let first = self.set(line) * self.ways;
        self.tags[first..first + self.ways].contains(&line)
    }

    /// The line at a place, [`EMPTY`] where there is none.
    pub(super) fn line(&self, place: usize) -> u32 {
        self.tags[place]
    }

    /// Puts a line at a place of its set.
    pub(super) fn insert(&mut self, place: usize, line: u32, prediction: u8) {
        let set = self.set(line);
        self.tags[place] = line;
        self.predictions[place] = prediction;
        self.newest[set] = (place - set * self.ways) as u8;
    }

    /// Takes a line out. True if it was there.
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

    /// Takes all lines out.
    pub(super) fn clear(&mut self) {
        self.tags.fill(EMPTY);
        self.predictions.fill(DISTANT);
        self.newest.fill(u8::MAX);
    }
}

/// What re-reference a new line is predicted to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Insertion {
    /// Long.
    Static,
    /// Distant, but for one fill of 32.
    Bimodal,
    /// That of the two which misses less in the sets that always use it.
    Dueling,
}

/// A cache with re-reference interval prediction.
pub struct Rrip {
    sets: Sets,
    insertion: Insertion,
    /// Bimodal fills so far.
    fills: u32,
    /// Grows with misses of leaders with static insertion, falls with those of bimodal ones.
    selected: u32,
    /// Distance between leaders of a kind.
    stride: u32,
}

impl Rrip {
    /// An empty cache; `sets` is a power of two, `ways` at most 255.
    #[must_use]
    pub fn new(sets: u32, ways: u32, insertion: Insertion) -> Self {
        Self {
            sets: Sets::new(sets, ways),
            insertion,
            fills: 0,
            selected: MOST_SELECTED / 2,
            stride: (sets / LEADERS).max(2),
        }
    }

    /// The insertion that a fill of a set uses. A fill is a miss, which the duel counts.
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

    /// The duel begins anew as well: other work between two frames trains the counter for itself.
    fn clear(&mut self) {
        self.sets.clear();
        self.fills = 0;
        self.selected = MOST_SELECTED / 2;
    }
}
