//! What the planes of a tile have to do with each other, in both directions alike: a group's first quad
//! in a run is told as it differs from the plane of an earlier run, its parent.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::GROUPS;
use super::plane::{Plane, Quad, cross, tilt_of};

/// Which code tells the level of a plane's corrections, by the records after the first one of its
/// group in its run; `None` where there are none.
pub(super) fn level_context(others: u32) -> Option<usize> {
    match others {
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

/// The planes so far, by group.
pub(super) struct Lineage {
    /// Places in `planes`: where each group's start, and how many it has.
    groups: [(usize, usize); GROUPS],
    /// Indices of planes, those of a group side by side.
    planes: Vec<usize>,
}

impl Lineage {
    /// For planes of these groups.
    pub fn new(groups: impl Iterator<Item = u8> + Clone) -> Self {
        let mut counts = [0usize; GROUPS];
        let mut all = 0;
        for group in groups {
            all += 1;
            if let Some(count) = counts.get_mut(usize::from(group) % GROUPS) {
                *count += 1;
            }
        }
        let mut next = 0;
        Self {
            groups: counts.map(|count| {
                next += count;
                (next - count, 0)
            }),
            planes: vec![0; all],
        }
    }

    /// Planes of a group so far.
    pub fn count(&self, group: u8) -> usize {
        let of = self.groups.get(usize::from(group) % GROUPS);
        of.map_or(0, |(_, count)| *count)
    }

    /// Index of the plane that is `back` planes of the group before the last one; past all there is
    /// a plane of zeros (`Some(None)`).
    pub fn parent(&self, group: u8, back: usize) -> Option<Option<usize>> {
        let (first, count) = *self.groups.get(usize::from(group) % GROUPS)?;
        if back == count {
            return Some(None);
        }
        let at = first + count.checked_sub(back + 1)?;
        Some(Some(self.planes.get(at).copied()?))
    }

    /// Takes in a plane.
    pub fn note(&mut self, group: u8, index: usize) {
        if let Some((first, count)) = self.groups.get_mut(usize::from(group) % GROUPS) {
            if let Some(place) = self.planes.get_mut(*first + *count) {
                *place = index;
            }
            *count += 1;
        }
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
    pub fn new(parent: &Plane, of_run: Option<&Plane>, x: u8, y: u8) -> Self {
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
