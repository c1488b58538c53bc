//! What the planes of a tile have to do with each other, in both directions alike: a group's first quad
//! in a run is coded as its difference from the plane of an earlier run, its parent.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::GROUPS;
use super::plane::{Plane, Quad, cross, tilt_of};

/// Which code tells the level of a plane's corrections, by how many records of its group are likely to
/// follow in the run: none, 1 or 2, 3 to 6, 7 to 14, or more.
#[inline(always)]
pub(super) fn level_context(likely_others: u32) -> usize {
    (likely_others.saturating_add(1).ilog2() as usize).min(4)
}

/// Which code tells the sizes of a group's second quad: the third where the plane is uncorrected.
pub(super) fn first_noise(level: u32) -> usize {
    if level == 0 { 3 } else { 2 }
}

/// Most planes of a group that can be a parent. More would be smaller by little and take longer.
const MOST_PARENTS: usize = 64;
/// Bits below the highest one of the largest number that names a parent.
pub(super) const MOST_PARENT_BITS: u32 = MOST_PARENTS.ilog2();

/// Planes of a group that memory is taken for at once.
const MOST_RESERVED: u32 = 128;

/// The planes so far, by group.
pub(super) struct Lineage {
    planes: [Vec<Plane>; GROUPS],
    /// Planes of a group that there may be.
    likely: usize,
}

impl Lineage {
    /// For a tile of so many runs.
    pub fn new(runs: u32) -> Self {
        Self {
            planes: [const { vec![] }; GROUPS],
            likely: runs.min(MOST_RESERVED) as usize,
        }
    }

    /// Planes of a group that can be a parent.
    #[inline(always)]
    pub fn count(&self, group: u8) -> usize {
        let planes = self.planes.get(usize::from(group) % GROUPS);
        planes.map_or(0, |planes| planes.len().min(MOST_PARENTS))
    }

    /// The plane that is `back` planes of the group before the last one; past all that can be a parent
    /// a plane of zeros, then none.
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

    /// The plane of the group that was taken in last.
    #[inline(always)]
    pub fn last(&self, group: usize) -> Option<&Plane> {
        self.planes.get(group % GROUPS)?.last()
    }

    /// Takes in a plane.
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

/// What is expected of a run's first quad in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    quad: Quad,
    tilt: [f32; 2],
}

impl Expected {
    /// What an earlier plane makes of it; the slope of w is that of the plane last told in the run, if
    /// there is one.
    #[inline(always)]
    pub fn new(parent: &Plane, of_run: Option<&Plane>, morton: u8) -> Self {
        Self {
            quad: parent.predict(morton),
            tilt: of_run.unwrap_or(parent).tilt_at(morton),
        }
    }

    /// dx and dy, before anything is known.
    #[inline(always)]
    pub fn slopes(&self) -> [[i32; 2]; 2] {
        let [_, dx, dy, _] = self.quad;
        [dx, dy]
    }

    /// cross, once dx and dy are known.
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

/// The slope of w to start from: that of the run's other group, or what the quad tells.
#[inline(always)]
pub(super) fn tilt_of_run(has_other: bool, quad: &Quad, expected: &Expected) -> [f32; 2] {
    if has_other {
        expected.tilt
    } else {
        tilt_of(quad, expected.tilt)
    }
}
