//! A right sample under test, and the arrivals around it.

use super::frame::{Frame, Sample};
use super::reproject::{Candidate, Reprojection};

/// Column and row offset of a neighbour.
pub type Offset = (i32, i32);

/// The next pixel of the row.
pub(super) const RIGHT: [Offset; 1] = [(1, 0)];
/// Neighbours that share an edge.
pub(super) const FOUR: [Offset; 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];
/// Neighbours that share an edge or a corner.
pub(super) const EIGHT: [Offset; 8] = [
    (0, -1),
    (-1, 0),
    (1, 0),
    (0, 1),
    (-1, -1),
    (1, -1),
    (-1, 1),
    (1, 1),
];

/// A right sample.
#[derive(Clone, Copy)]
pub struct RightSample<'a> {
    /// Both eyes.
    pub frame: &'a Frame,
    /// All arrivals.
    pub arrived: &'a Reprojection,
    /// Index of the sample.
    pub index: usize,
}

impl<'a> RightSample<'a> {
    /// The arrival here.
    pub(super) fn candidate(&self) -> &'a Candidate {
        &self.arrived.candidates[self.index]
    }

    /// The left sample that arrived here. Panics if there is none.
    pub fn source(&self) -> &'a Sample {
        &self.frame.left().samples[self.candidate().source as usize]
    }

    /// Neighbouring pixels inside the image.
    pub(super) fn neighbours(self, offsets: &'static [Offset]) -> impl Iterator<Item = Self> {
        let [width, height] = self.frame.size_px.map(|s| s as i32);
        let index = self.index as i32;
        offsets.iter().filter_map(move |(dx, dy)| {
            let (x, y) = (index % width + dx, index / width + dy);
            let inside = (0..width).contains(&x) && (0..height).contains(&y);
            inside.then(|| Self {
                index: (y * width + x) as usize,
                ..self
            })
        })
    }

    /// Neighbouring pixels with an arrival.
    pub(super) fn arrived_neighbours(
        self,
        offsets: &'static [Offset],
    ) -> impl Iterator<Item = Self> {
        self.neighbours(offsets)
            .filter(|place| !place.candidate().is_missing())
    }
}
