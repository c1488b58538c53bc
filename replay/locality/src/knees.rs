//! Two knees in the misses of an L2, each as a closed form and as measured.
//!
//! An order that renders one eye after the other finds the lines of the first eye again only if the L2 holds the
//! distinct lines of an eye. An order that renders rows of tile pairs finds the lines of the row above only if the L2
//! holds the distinct lines of a row. The measured knee is the smallest fully associative LRU cache that hits half of
//! those reuses.

use crate::figures::Figures;
use crate::place::Origin;
use std::collections::HashSet;

/// Stands for a use outside the rows of an eye's picture.
pub(crate) const NO_ROW: u32 = u32::MAX;

/// Distinct lines of rows, and the reuses from one row in another.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rows {
    /// Rows of tiles with look-ups, summed over frames. Row `n` of both eyes is one row.
    pub rows: u64,
    /// Distinct lines of each row, summed.
    pub row_lines: u64,
    /// Reuses in a frame whose previous use was in another row, by distance.
    pub distances: Vec<u64>,
}

impl Rows {
    pub(crate) fn add(&mut self, other: &Self) {
        self.rows += other.rows;
        self.row_lines += other.row_lines;
        if self.distances.len() < other.distances.len() {
            self.distances.resize(other.distances.len(), 0);
        }
        for (to, from) in self.distances.iter_mut().zip(&other.distances) {
            *to += from;
        }
    }
}

/// The rows of a stream, while it is analysed.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowCounts {
    counts: Rows,
    /// Row and line of every use in this frame.
    used: HashSet<(u32, u32)>,
    seen: HashSet<u32>,
}

impl RowCounts {
    pub(crate) fn begin_frame(&mut self) {
        self.used.clear();
        self.seen.clear();
    }

    /// A use of a line in a row, unless its last use was in the same row of this frame.
    pub(crate) fn enter(&mut self, row: u32, line: u32) {
        self.counts.rows += u64::from(self.seen.insert(row));
        self.counts.row_lines += u64::from(self.used.insert((row, line)));
    }

    /// A reuse in another row.
    pub(crate) fn reuse(&mut self, distance: u32) {
        let distance = distance as usize;
        let all = &mut self.counts.distances;
        if distance >= all.len() {
            all.resize(distance + 1, 0);
        }
        all[distance] += 1;
    }

    pub(crate) fn finish(self) -> Rows {
        self.counts
    }
}

/// The smallest cache in lines that hits half of these reuses; none without reuses.
fn half(mut counts: impl Iterator<Item = u64> + Clone) -> Option<u64> {
    let all: u64 = counts.clone().sum();
    let mut hits = 0;
    let distance = counts.position(|count| {
        hits += count;
        2 * hits >= all
    });
    distance
        .filter(|_| all > 0)
        .map(|distance| distance as u64 + 1)
}

impl Figures {
    /// Mean number of distinct lines of an eye in a frame: the closed form of the knee of the other eye's reuses.
    /// Lines that no eye uses count as half a line of each.
    pub fn eye_lines(&self) -> Option<f64> {
        let of_both = self.frame_lines + self.frame_lines_of_both_eyes;
        (self.frame_lines_of_both_eyes > 0)
            .then(|| of_both as f64 / (2 * self.frames.max(1)) as f64)
    }

    /// The smallest fully associative LRU cache in lines that hits half of the reuses from the other eye.
    pub fn eye_knee_lines(&self) -> Option<u64> {
        half(self.distances.of(Origin::OtherEye))
    }

    /// Mean number of distinct lines of a row of tile pairs: the closed form of the knee of the reuses of rows.
    pub fn row_lines(&self) -> Option<f64> {
        let rows = &self.rows;
        (rows.rows > 0).then(|| rows.row_lines as f64 / rows.rows as f64)
    }

    /// The smallest fully associative LRU cache in lines that hits half of the reuses from another row.
    pub fn row_knee_lines(&self) -> Option<u64> {
        half(self.rows.distances.iter().copied())
    }
}
