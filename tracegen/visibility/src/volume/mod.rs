//! Convex volumes, and tests of four boxes at a time against them.
//!
//! Volumes are computed in double precision and include a margin for rounding in the driver. For the tests
//! they are converted to single precision, with a margin for the rounding of the tests. A box is only outside
//! if it would also be outside with exact arithmetic.

mod cone;
mod planes;

pub(crate) use cone::{Affine, Cone};
pub(crate) use planes::{HalfSpace, frustum, meeting_point};

use cone::PreparedCone;
use glam::{DVec3, Vec4};
use planes::PreparedPlane;

/// Relative rounding error of a sum of four products, including the preceding products of two matrices: 16
/// units in the last place of single precision, relative to the sum of the magnitudes of the terms.
pub(crate) const ROUNDING: f64 = 16.0 * (f32::EPSILON as f64) / 2.0;

/// One bit per side of a volume: its planes, then its cone.
pub(crate) type Sides = u8;

const MAX_PLANES: usize = 6;
const CONE: Sides = 1 << MAX_PLANES;

/// The points inside all half-spaces and inside the cone.
#[derive(Clone, Debug)]
pub struct Volume {
    /// Half-spaces, at most six.
    planes: [HalfSpace; MAX_PLANES],
    /// Cone that restricts the volume, if any.
    cone: Option<Cone>,
}

impl Volume {
    pub(crate) fn new(planes: [HalfSpace; MAX_PLANES], cone: Option<Cone>) -> Self {
        Self { planes, cone }
    }

    /// Whether a point in world space is inside.
    pub fn contains(&self, point: DVec3) -> bool {
        self.planes.iter().all(|plane| plane.height(point) >= 0.0)
            && self.cone.as_ref().is_none_or(|cone| cone.contains(point))
    }

    /// Prepares the volume for tests of boxes whose coordinates are at most `extent`.
    pub(crate) fn prepare(&self, extent: DVec3) -> Prepared {
        Prepared {
            planes: self.planes.map(|plane| plane.prepare(extent)),
            cone: self.cone.as_ref().map(|cone| cone.prepare(extent)),
        }
    }
}

/// A volume in single precision.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    planes: [PreparedPlane; MAX_PLANES],
    cone: Option<PreparedCone>,
}

/// Result of a test of four boxes.
pub(crate) struct Tested {
    /// One bit per box that is completely outside.
    pub outside: u32,
    /// One byte per box: the sides that it is completely inside of.
    inside: u32,
}

impl Tested {
    /// The sides among `sides` that a box may cross.
    pub fn left(&self, sides: Sides, lane: usize) -> Sides {
        sides & !(self.inside >> (8 * lane)) as Sides
    }
}

/// Maps four bits to the low bits of four bytes.
const SPREAD: [u32; 16] = {
    let mut table = [0; 16];
    let mut bits = 0;
    while bits < 16 {
        let mut lane = 0;
        while lane < 4 {
            table[bits] |= ((bits as u32 >> lane) & 1) << (8 * lane);
            lane += 1;
        }
        bits += 1;
    }
    table
};

impl Prepared {
    /// All sides.
    pub fn sides(&self) -> Sides {
        CONE - 1 + if self.cone.is_some() { CONE } else { 0 }
    }

    /// Tests four boxes, given as `[low or high][axis]`, against some of the sides.
    #[inline]
    pub fn test(&self, corners: &[[Vec4; 3]; 2], sides: Sides) -> Tested {
        let mut tested = Tested {
            outside: 0,
            inside: 0,
        };
        let mut planes = sides & (CONE - 1);
        while planes != 0 {
            let side = planes.trailing_zeros();
            planes &= planes - 1;
            let [outside, inside] = self.planes[side as usize].test(corners);
            tested.outside |= outside;
            tested.inside |= SPREAD[inside as usize & 15] << side;
            if tested.outside == 15 {
                return tested;
            }
        }
        if let Some(cone) = self.cone.as_ref().filter(|_| sides & CONE != 0) {
            let [outside, inside] = cone.test(corners);
            tested.outside |= outside;
            tested.inside |= SPREAD[inside as usize & 15] << MAX_PLANES;
        }
        tested
    }
}
