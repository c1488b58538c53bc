//! Superfrustum culling: one frustum around both eyes' frusta, with its apex behind them (Everitt).
//!
//! For parallel eyes with outer tangents `tan_l` and `tan_r`, the side planes of the outer edges meet
//! `ipd / (tan_l + tan_r)` behind the eyes, and the vertical tangents shrink to `tan_v * far / (far + recession)`.
//! This implementation places the planes around the corners of both frusta. The result is the same for
//! parallel eyes, and also valid for canted and asymmetric ones.

use super::{CullInput, Volumes};
use crate::rig::{Eye, MAX_COMBINED_DEG, Rig, TooWide};
use crate::volume::{HalfSpace, Volume};
use glam::DVec3;

/// The superfrustum.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let planes = Superfrustum::new(frame.rig, frame.extent)?.planes;
    Ok(Volumes::Any(vec![Volume::new(planes, None)]))
}

/// A frustum that contains those of all eyes.
#[derive(Clone, Debug)]
pub struct Superfrustum {
    /// Intersection of the side planes, at the height of the eyes.
    pub apex: DVec3,
    /// Distance from the point between the eyes back to the apex, in metres.
    pub recession_m: f64,
    /// Tangents of the half-angles at the apex: to each side, up and down.
    pub tangents: [f64; 3],
    /// Left, right, bottom, top, near and far planes.
    pub(crate) planes: [HalfSpace; 6],
}

impl Superfrustum {
    /// A frustum around the frusta of `rig`, for geometry whose coordinates are at most `extent`.
    ///
    /// # Errors
    /// [`TooWide`].
    pub fn new(rig: &Rig, extent: DVec3) -> Result<Self, TooWide> {
        let edges: Vec<[DVec3; 2]> = (rig.eyes().iter())
            .flat_map(|eye| eye.edges(extent))
            .collect();
        let corners = || edges.iter().flatten().copied();
        let Head { up, forward, right } = Head::of(rig.eyes());
        // Angle of each edge to the right of straight ahead, in the plane perpendicular to `up`.
        let azimuths = edges.iter().map(|[near, far]| {
            let along = *far - *near;
            along.dot(right).atan2(along.dot(forward))
        });
        let (least, most) = azimuths.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), a| {
            (l.min(a), m.max(a))
        });
        let combined_deg = (most - least).to_degrees();
        // NaN, the result of invalid poses, is also too wide.
        if combined_deg.is_nan() || combined_deg >= MAX_COMBINED_DEG {
            let found_deg = Some(combined_deg).filter(|deg| deg.is_finite());
            return Err(TooWide { found_deg });
        }
        let (middle, half) = ((least + most) / 2.0, (most - least) / 2.0);
        let ahead = forward * middle.cos() + right * middle.sin();
        let aside = right * middle.cos() - forward * middle.sin();
        let around = |normal: DVec3| HalfSpace::around(normal, corners());
        let left_side = around(aside * half.cos() + ahead * half.sin());
        let right_side = around(ahead * half.sin() - aside * half.cos());

        let eyes = rig.eyes().iter().map(Eye::position);
        let center = eyes.sum::<DVec3>() / rig.eyes().len() as f64;
        // Coordinates of the apex in the two directions perpendicular to `up`, from the distances of `center`
        // to the side planes.
        let [l, r] = [left_side, right_side].map(|side| side.height(center));
        let back_m = (l + r) / (2.0 * half.sin());
        let apex = center - ahead * back_m + aside * ((r - l) / (2.0 * half.cos()));
        let slope = |sign: f64| {
            let steepest = |p: DVec3| sign * (p - apex).dot(up) / (p - apex).dot(ahead);
            corners().map(steepest).fold(f64::NEG_INFINITY, f64::max)
        };
        let [up_tangent, down_tangent] = [slope(1.0), slope(-1.0)];
        let level = |sign: f64, tangent: f64| {
            let normal = ahead * tangent - up * sign;
            HalfSpace::scaled(normal, -normal.dot(apex), 0.0)
        };
        Ok(Self {
            apex,
            recession_m: (center - apex).dot(forward),
            tangents: [half.tan(), up_tangent, down_tangent],
            planes: [
                left_side,
                right_side,
                level(-1.0, down_tangent),
                level(1.0, up_tangent),
                around(forward),
                around(-forward),
            ],
        })
    }
}

/// Directions of the head.
struct Head {
    up: DVec3,
    forward: DVec3,
    right: DVec3,
}

impl Head {
    fn of(eyes: &[Eye]) -> Self {
        let sum = |axis: usize| eyes.iter().map(|eye| eye.axes()[axis].gradient).sum();
        let (up, forward): (DVec3, DVec3) = (sum(1), sum(2));
        let up = up.normalize();
        let right = forward.cross(up).normalize();
        let forward = up.cross(right);
        Self { up, forward, right }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use formats::view::FovTangents;

    /// Known values: for 90 degrees and 64 mm, the apex is 32 mm behind the eyes.
    #[test]
    fn the_recession_of_parallel_eyes_is_the_closed_form() {
        let (near, far) = (0.1, 50.0);
        for (outer, inner, vertical, ipd) in [(1.0, 1.0, 1.0, 0.064), (1.397, 1.246, 1.466, 0.064)]
        {
            let fov = |left, right| FovTangents::new(left, right, vertical, vertical);
            let eyes = [fov(outer, inner), fov(inner, outer)];
            let rig = testing::rig(eyes, ipd, 0.0, near, far);
            let found = Superfrustum::new(&rig, DVec3::splat(60.0)).unwrap();
            let [outer, vertical, ipd, far] = [outer, vertical, ipd, far].map(f64::from);
            let recession_m = ipd / (2.0 * outer);
            let level = vertical * far / (far + recession_m);
            let expected = [recession_m, outer, level, level];
            let [side, up, down] = found.tangents;
            // Within a millimetre, because the planes include a margin for rounding in the driver.
            for (found, expected) in [found.recession_m, side, up, down].iter().zip(expected) {
                assert!((found - expected).abs() < 1e-3, "{found} {expected}");
            }
        }
    }

    #[test]
    fn eyes_whose_directions_diverge_too_much_are_refused() {
        let fov = |outer: f32| FovTangents::new(outer, outer, 1.0, 1.0);
        let wide = 70f32.to_radians().tan();
        let combined = |cant| {
            let rig = testing::rig([fov(wide); 2], 0.064, cant, 0.1, 100.0);
            Superfrustum::new(&rig, DVec3::splat(100.0)).map(|_| ())
        };
        assert_eq!(combined(15.0), Ok(()));
        let error = combined(20.0).unwrap_err().to_string();
        assert!(
            error.contains("below 179 degrees") && error.contains("180.0 degrees"),
            "{error}"
        );
    }
}
