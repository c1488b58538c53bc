//! What the planes of a tile have to do with each other, in both directions alike: a group's first quad
//! in a run is told as it differs from the plane of an earlier run, its parent.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::GROUPS;
use super::plane::{Quad, Surface, cross, tilt_of};
use crate::varint::low_u32;

/// Which code tells the level of a plane's corrections, by how many records of its group are likely to
/// follow in the run; `None` where none are.
pub(super) fn level_context(likely_others: u32) -> Option<usize> {
    match likely_others {
        0 => None,
        1 | 2 => Some(0),
        3..=6 => Some(1),
        7..=14 => Some(2),
        _ => Some(3),
    }
}

/// Which code tells the sizes of a group's second quad: the third where the plane is uncorrected.
pub(super) fn first_noise(level: u32) -> usize {
    if level == 0 { 3 } else { 2 }
}

/// Most planes of a group that can be a parent. More would be smaller by little and take longer.
const MOST_PARENTS: usize = 64;
/// Bits below the highest one of the largest number that names a parent.
pub(super) const MOST_PARENT_BITS: u32 = MOST_PARENTS.ilog2();

/// The planes so far, and the last ones of each group.
pub(super) struct Lineage {
    planes: Vec<Surface>,
    /// Indices in `planes` by group: of its n-th plane at n modulo [`MOST_PARENTS`].
    last: [[u32; MOST_PARENTS]; GROUPS],
    /// Surfaces of each group.
    counts: [usize; GROUPS],
}

impl Lineage {
    pub fn new() -> Self {
        Self {
            planes: vec![],
            last: [[0; MOST_PARENTS]; GROUPS],
            counts: [0; GROUPS],
        }
    }

    /// Surfaces of a group that can be a parent.
    #[inline(always)]
    pub fn count(&self, group: u8) -> usize {
        let count = self.counts.get(usize::from(group) % GROUPS);
        count.copied().unwrap_or_default().min(MOST_PARENTS)
    }

    /// The plane that is `back` planes of the group before the last one; past all that can be a parent
    /// a plane of zeros, then none.
    #[inline(always)]
    pub fn parent(&self, group: u8, back: usize) -> Option<Surface> {
        let group = usize::from(group) % GROUPS;
        let count = *self.counts.get(group)?;
        let can_be = count.min(MOST_PARENTS);
        if back >= can_be {
            return (back == can_be).then(Surface::default);
        }
        let slot = (count - 1 - back) % MOST_PARENTS;
        let index = *self.last.get(group)?.get(slot)?;
        self.planes.get(index as usize).copied()
    }

    /// Takes in a plane.
    #[inline(always)]
    pub fn note(&mut self, group: u8, surface: Surface) {
        let group = usize::from(group) % GROUPS;
        if let Some((last, count)) = self.last.get_mut(group).zip(self.counts.get_mut(group)) {
            if let Some(slot) = last.get_mut(*count % MOST_PARENTS) {
                *slot = low_u32(self.planes.len() as u64);
            }
            *count += 1;
        }
        self.planes.push(surface);
    }
}

/// What is expected of a run's first quad in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    quad: Quad,
    tilt: [f64; 2],
}

impl Expected {
    /// What an earlier plane makes of it; the slope of w is that of the plane last told in the run, if
    /// there is one.
    #[inline(always)]
    pub fn new(parent: &Surface, of_run: Option<&Surface>, x: u8, y: u8) -> Self {
        Self {
            quad: parent.predict(x, y),
            tilt: of_run.unwrap_or(parent).tilt_at(x, y),
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
pub(super) fn tilt_of_run(has_other: bool, quad: &Quad, expected: &Expected) -> [f64; 2] {
    if has_other {
        expected.tilt
    } else {
        tilt_of(quad, expected.tilt)
    }
}
