//! Prediction of planes from earlier planes, for encoder and decoder: a group's first quad in a run is
//! coded as its difference from the plane of an earlier run, its parent.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::GROUPS;
use super::plane::{Plane, Quad, cross, tilt_of};

/// Index of the code for the level of a plane's corrections, by the number of records of its group that are
/// likely to follow in the run: none, 1 or 2, 3 to 6, 7 to 14, or more.
#[inline(always)]
pub(super) fn level_context(likely_others: u32) -> usize {
    (likely_others.saturating_add(1).ilog2() as usize).min(4)
}

/// Index of the code for the sizes of a group's second quad: the third if the plane is uncorrected.
pub(super) fn first_noise(level: u32) -> usize {
    if level == 0 { 3 } else { 2 }
}

/// Number of the latest planes of a group that can be a parent. More would save few bytes and take longer.
const MOST_PARENTS: usize = 64;
/// Bits below the highest bit of the largest number of a parent.
pub(super) const MOST_PARENT_BITS: u32 = MOST_PARENTS.ilog2();

/// Largest number of planes per group for which memory is reserved at once.
const MOST_RESERVED: u32 = 128;

/// The earlier planes, by group.
pub(super) struct PlaneHistory {
    planes: [Vec<Plane>; GROUPS],
    /// Expected number of planes per group.
    likely: usize,
}

impl PlaneHistory {
    /// An empty history for a tile with this many runs.
    pub fn new(runs: u32) -> Self {
        Self {
            planes: [const { vec![] }; GROUPS],
            likely: runs.min(MOST_RESERVED) as usize,
        }
    }

    /// Number of planes of a group that can be a parent.
    #[inline(always)]
    pub fn count(&self, group: u8) -> usize {
        let planes = self.planes.get(usize::from(group) % GROUPS);
        planes.map_or(0, |planes| planes.len().min(MOST_PARENTS))
    }

    /// The plane at distance `back` before the last one of the group. The distance after the last possible
    /// parent means a plane of zeros; beyond it, `None`.
    #[inline(always)]
    pub fn parent(&self, group: u8, back: u32) -> Option<Plane> {
        let back = back as usize;
        let planes = self.planes.get(usize::from(group) % GROUPS)?;
        let can_be = planes.len().min(MOST_PARENTS);
        if back >= can_be {
            return (back == can_be).then(Plane::default);
        }
        planes.get(planes.len() - 1 - back).copied()
    }

    /// The last plane of the group.
    #[inline(always)]
    pub fn last(&self, group: usize) -> Option<&Plane> {
        self.planes.get(group % GROUPS)?.last()
    }

    /// Adds a plane.
    #[inline(always)]
    pub fn note(&mut self, group: u8, plane: Plane) {
        if let Some(planes) = self.planes.get_mut(usize::from(group) % GROUPS) {
            if planes.capacity() == 0 {
                planes.reserve(self.likely);
            }
            planes.push(plane);
        }
    }
}

/// Prediction of a run's first quad in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    quad: Quad,
    tilt: [f32; 2],
}

impl Expected {
    /// Predicts from an earlier plane; the tilt is that of the run's last coded plane, if any.
    #[inline(always)]
    pub fn new(parent: &Plane, of_run: Option<&Plane>, morton: u8) -> Self {
        Self {
            quad: parent.predict(morton),
            tilt: of_run.unwrap_or(parent).tilt_at(morton),
        }
    }

    /// Predicted dx and dy.
    #[inline(always)]
    pub fn slopes(&self) -> [[i32; 2]; 2] {
        let [_, dx, dy, _] = self.quad;
        [dx, dy]
    }

    /// Predicted cross, for known dx and dy.
    #[inline(always)]
    pub fn cross(&self, dx: [i32; 2], dy: [i32; 2]) -> [i32; 2] {
        cross(dx, dy, self.tilt)
    }

    #[inline(always)]
    pub fn uv(&self) -> [i32; 2] {
        let [uv, ..] = self.quad;
        uv
    }
}

/// The initial tilt: that of the run's other group, or estimated from the quad.
#[inline(always)]
pub(super) fn tilt_of_run(has_other: bool, quad: &Quad, expected: &Expected) -> [f32; 2] {
    if has_other {
        expected.tilt
    } else {
        tilt_of(quad, expected.tilt)
    }
}
