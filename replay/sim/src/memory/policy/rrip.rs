//! Re-reference interval prediction: SRRIP, BRRIP and DRRIP (Jaleel et al., ISCA 2010, sections 4
//! and 5), 2 bits per line.
//!
//! A hit promotes a line only after another line has been filled into its set. Earlier accesses
//! belong to the quads that fetched the line and count as one access: all policies here rely on
//! repeated accesses changing nothing.

use super::{Geometry, Policy};

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

/// The predictions of all lines.
pub(super) struct Predictions {
    by_place: Vec<u8>,
    /// The most recently filled way, by set.
    newest: Vec<u32>,
    ways: usize,
}

impl Predictions {
    pub(super) fn new(geometry: Geometry) -> Self {
        Self {
            by_place: vec![DISTANT; geometry.lines()],
            newest: vec![0; geometry.sets as usize],
            ways: geometry.ways as usize,
        }
    }

    /// Promotes the line in a way. True for the first promotion since its fill.
    pub(super) fn hit(&mut self, set: u32, way: u32) -> bool {
        if self.newest[set as usize] == way {
            return false;
        }
        let prediction = &mut self.by_place[set as usize * self.ways + way as usize];
        std::mem::take(prediction) != 0
    }

    pub(super) fn fill(&mut self, set: u32, way: u32, prediction: u8) {
        self.by_place[set as usize * self.ways + way as usize] = prediction;
        self.newest[set as usize] = way;
    }

    /// The first way with a distant re-reference, after ageing all ways until there is one.
    pub(super) fn victim(&mut self, set: u32) -> u32 {
        let first = set as usize * self.ways;
        let predictions = &mut self.by_place[first..first + self.ways];
        let oldest = predictions.iter().copied().max().unwrap_or(DISTANT);
        for prediction in predictions.iter_mut() {
            *prediction += DISTANT - oldest;
        }
        let distant = predictions.iter().position(|&of| of == DISTANT);
        distant.unwrap_or(0) as u32
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

/// Re-reference interval prediction.
pub(super) struct Rrip {
    predictions: Predictions,
    insertion: Insertion,
    /// Bimodal fills so far.
    fills: u32,
    /// Incremented by misses in sets dedicated to static insertion, decremented by those of bimodal insertion.
    selected: u32,
    /// Distance between sets dedicated to the same insertion.
    stride: u32,
}

impl Rrip {
    pub(super) fn new(geometry: Geometry, insertion: Insertion) -> Self {
        Self {
            predictions: Predictions::new(geometry),
            insertion,
            fills: 0,
            selected: MOST_SELECTED / 2,
            stride: (geometry.sets / LEADERS).max(2),
        }
    }

    /// The insertion for a fill of a set. Counts the fill as a miss in the duel.
    fn insertion(&mut self, set: u32) -> Insertion {
        if self.insertion != Insertion::Dueling {
            return self.insertion;
        }
        match set % self.stride {
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

impl Policy for Rrip {
    fn hit(&mut self, set: u32, way: u32, _line: u32) {
        self.predictions.hit(set, way);
    }

    fn fill(&mut self, set: u32, way: u32, _line: u32) {
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
        self.predictions.fill(set, way, prediction);
    }

    fn victim(&mut self, set: u32) -> u32 {
        self.predictions.victim(set)
    }

    /// Restarts the duel, because other work between two frames would train the counter for itself.
    fn clear(&mut self) {
        self.fills = 0;
        self.selected = MOST_SELECTED / 2;
    }
}
