//! What is remembered from record to record of a tile, in both directions alike.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::mode::Departure;
use super::plane::{Plane, Quad, cross, tilt_of};
use crate::textrace::PrimitiveRun;

/// Number of groups that a record can name.
pub(super) const GROUPS: usize = 16;

/// What came after a group's record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Follow {
    pub group: u8,
    /// It was of the same quad and had the same mask.
    pub same_quad: bool,
}

/// What is known of a uv group.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    /// Planes of the runs so far.
    pub planes: Vec<Plane>,
    /// The plane of the run under way, if the run had the group.
    pub plane: Plane,
    /// How large the last residuals were: which code tells of the next.
    pub noise: usize,
    /// How far the run's last quad departed from the plane.
    pub departure: Departure,
}

/// What is remembered.
pub(super) struct State {
    pub groups: [Group; GROUPS],
    follows: [Follow; GROUPS],
    /// Lanes of each quad that the draw has covered.
    covered: [u8; 64],
    draw: u32,
    pub group: u8,
    /// The run's last record: place on the Morton curve and mask; before the first one 0 and 0.
    pub morton: u32,
    pub mask: u8,
    /// Place of the first record of the run, or of the last one's before its first record.
    pub morton_of_start: u32,
    /// The last record came right after the one before it on the curve.
    stepped_one: bool,
    pub first_of_run: bool,
    /// Groups that the run has had, a bit each.
    seen: u16,
    /// The plane of the run that was last told.
    run_plane: Option<Plane>,
}

impl State {
    pub fn new() -> Self {
        Self {
            groups: std::array::from_fn(|_| Group::default()),
            follows: follow_themselves(),
            covered: [0; 64],
            draw: 0,
            group: 0,
            morton: 0,
            mask: 0,
            morton_of_start: 0,
            stepped_one: false,
            first_of_run: true,
            seen: 0,
            run_plane: None,
        }
    }

    pub fn start_run(&mut self, run: &PrimitiveRun) {
        if run.draw != self.draw {
            self.draw = run.draw;
            self.covered = [0; 64];
            self.follows = follow_themselves();
            self.group = 0;
        }
        self.morton = 0;
        self.mask = 0;
        self.first_of_run = true;
        self.seen = 0;
        self.run_plane = None;
    }

    /// The run has had the group.
    #[inline(always)]
    pub fn has_seen(&self, group: u8) -> bool {
        self.seen >> (group & 15) & 1 == 1
    }

    /// What is expected after the last record's group.
    #[inline(always)]
    pub fn follow(&self) -> Follow {
        let found = self.follows.get(usize::from(self.group) % GROUPS).copied();
        found.unwrap_or(Follow {
            group: 0,
            same_quad: false,
        })
    }

    /// Which code tells step and mask.
    #[inline(always)]
    pub fn place_context(&self) -> usize {
        if self.first_of_run {
            16
        } else {
            let corner = usize::from(self.morton.to_le_bytes()[0] & 3);
            corner << 2 | usize::from(self.mask == 15) << 1 | usize::from(self.stepped_one)
        }
    }

    /// Swaps a quad's full mask with the one that leaves no lane of it to other primitives of the
    /// draw, or undoes it: a mesh covers every lane once, so 15 stands for the likeliest mask.
    #[inline(always)]
    pub fn swap_mask(&self, morton: u32, mask: u8) -> u8 {
        let covered = self.covered.get(morton as usize & 63).copied();
        let rest = 15 & !covered.unwrap_or_default();
        // Without branches, which would be hard to predict.
        let swaps = (rest != 0) & ((mask == 15) | (mask == rest));
        mask ^ ((15 ^ rest) * u8::from(swaps))
    }

    /// Takes in a record's place, mask and group.
    #[inline(always)]
    pub fn note_place(&mut self, morton: u32, mask: u8, group: u8) {
        let same_quad = !self.first_of_run && morton == self.morton && mask == self.mask;
        if let Some(follow) = self.follows.get_mut(usize::from(self.group) % GROUPS) {
            *follow = Follow { group, same_quad };
        }
        if let Some(covered) = self.covered.get_mut(morton as usize & 63) {
            *covered |= mask;
        }
        if !same_quad {
            self.stepped_one = !self.first_of_run & (morton == self.morton + 1);
        }
        if self.first_of_run {
            self.morton_of_start = morton;
        }
        self.morton = morton;
        self.mask = mask;
        self.group = group;
        self.first_of_run = false;
    }

    #[inline(always)]
    pub fn group_mut(&mut self, group: u8) -> &mut Group {
        group_of(&mut self.groups, group)
    }

    /// The plane of an earlier run that a first quad continues: 0 the last one; past all, a plane
    /// of zeros.
    pub fn parent(&self, group: u8, back: usize) -> Option<Plane> {
        let planes = &self.groups.get(usize::from(group) % GROUPS)?.planes;
        if back == planes.len() {
            return Some(Plane::default());
        }
        let at = planes.len().checked_sub(back + 1)?;
        planes.get(at).copied()
    }

    /// The slope of w to start from: that of the run's other group, or what the quad tells.
    pub fn tilt(&self, x: u8, y: u8, quad: &Quad, parent: &Expected) -> [f64; 2] {
        match &self.run_plane {
            Some(plane) => plane.tilt_at(x, y),
            None => tilt_of(quad, parent.tilt),
        }
    }

    /// What an earlier plane makes of a run's first quad.
    pub fn expect(&self, parent: &Plane, x: u8, y: u8) -> Expected {
        let tilt = match &self.run_plane {
            Some(plane) => plane.tilt_at(x, y),
            None => parent.tilt_at(x, y),
        };
        Expected {
            quad: parent.predict(x, y),
            tilt,
        }
    }

    /// Takes in the plane of a group's first quad of the run.
    pub fn start_plane(&mut self, group: u8, plane: Plane, noise: usize, departure: Departure) {
        self.run_plane = Some(plane);
        self.seen |= 1 << (group & 15);
        let group = self.group_mut(group);
        group.planes.push(plane);
        group.plane = plane;
        group.noise = noise;
        group.departure = departure;
    }
}

/// What is expected of a run's first quad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    quad: Quad,
    pub tilt: [f64; 2],
}

impl Expected {
    /// dx and dy, before anything is known.
    pub fn slopes(&self) -> [[i32; 2]; 2] {
        let [_, dx, dy, _] = self.quad;
        [dx, dy]
    }

    /// cross, once dx and dy are known.
    pub fn cross(&self, dx: [i32; 2], dy: [i32; 2]) -> [i32; 2] {
        cross(dx, dy, self.tilt)
    }

    pub fn uv(&self) -> [i32; 2] {
        let [uv, ..] = self.quad;
        uv
    }
}

/// A group by its number, of which only the lowest four bits count.
#[inline(always)]
pub(super) fn group_of(groups: &mut [Group; GROUPS], group: u8) -> &mut Group {
    #[allow(
        clippy::indexing_slicing,
        reason = "the index is below the array's length"
    )]
    &mut groups[usize::from(group) % GROUPS]
}

fn follow_themselves() -> [Follow; GROUPS] {
    let mut group = 0;
    std::array::from_fn(|_| {
        group += 1;
        Follow {
            group: group - 1,
            same_quad: false,
        }
    })
}
