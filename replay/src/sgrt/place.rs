//! A right sample under test and what arrived around it.

use super::frame::{Frame, Sample};
use super::reproject::{Candidate, Reprojection};

/// Columns and rows from a pixel to a neighbour.
pub type Offset = (i32, i32);

/// Neighbours that share an edge.
pub const FOUR: [Offset; 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];
/// And those that share a corner.
pub const EIGHT: [Offset; 8] = [
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
pub struct Place<'a> {
    /// Both eyes.
    pub frame: &'a Frame,
    /// What arrived where.
    pub arrived: &'a Reprojection,
    /// Number of the sample.
    pub index: usize,
}

impl<'a> Place<'a> {
    /// What arrived here.
    #[must_use]
    pub fn candidate(&self) -> &'a Candidate {
        &self.arrived.candidates[self.index]
    }

    /// The left sample that arrived here; there must be one.
    #[must_use]
    pub fn source(&self) -> &'a Sample {
        &self.frame.left().samples[self.candidate().source as usize]
    }

    /// Neighbouring pixels, where they lie in the image.
    pub fn neighbours(self, offsets: &'static [Offset]) -> impl Iterator<Item = Self> {
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

    /// Those at which something arrived.
    pub fn arrived_neighbours(self, offsets: &'static [Offset]) -> impl Iterator<Item = Self> {
        self.neighbours(offsets)
            .filter(|place| !place.candidate().is_missing())
    }
}
