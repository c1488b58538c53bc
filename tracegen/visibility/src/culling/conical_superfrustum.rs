//! Conical superfrustum culling: one cone around the visible part of both lenses, inside the superfrustum.
//!
//! For parallel eyes whose lenses show a circle of tangent `r` around straight ahead, the cone has the same
//! tangent. Its apex is `ipd / (2 r)` behind the eyes, as in the superfrustum.

use super::superfrustum::Superfrustum;
use super::{CullInput, Volumes};
use crate::rig::{Eye, MAX_COMBINED_DEG, Rig, TooWide};
use crate::volume::{Affine, Cone, Volume};
use glam::DVec3;

/// Number of corners of the polygon around a lens's circle.
const CORNERS: u32 = 64;

/// The cone and the superfrustum.
pub(super) fn volumes(frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
    let planes = Superfrustum::new(frame.rig, frame.extent)?.planes;
    let cone = cone(frame.rig, frame.extent)?;
    Ok(Volumes::Any(vec![Volume::new(planes, Some(cone))]))
}

/// A circular cone around what the lenses of `rig` show of geometry whose coordinates are at most `extent`.
fn cone(rig: &Rig, extent: DVec3) -> Result<Cone, TooWide> {
    let eyes = rig.eyes();
    let axis = (eyes.iter().map(lens_direction).sum::<DVec3>()).normalize();
    let center = eyes.iter().map(Eye::position).sum::<DVec3>() / eyes.len() as f64;
    let edges: Vec<[DVec3; 2]> = (eyes.iter())
        .flat_map(|eye| lens_edges(eye, extent))
        .collect();
    // Components along the axis and perpendicular to it.
    let split = |v: DVec3| {
        let along = v.dot(axis);
        (along, (v - axis * along).length())
    };
    let widest = (edges.iter())
        .map(|[near, far]| {
            let (along, across) = split(*far - *near);
            across.atan2(along)
        })
        .fold(0.0, f64::max);
    let combined_deg = 2.0 * widest.to_degrees();
    if !axis.is_finite() || combined_deg.is_nan() || combined_deg >= MAX_COMBINED_DEG {
        let found_deg = Some(combined_deg).filter(|deg| deg.is_finite());
        return Err(TooWide { found_deg });
    }
    let tangent = widest.tan();
    // The apex must be far enough back for both ends of every edge.
    let back_m = (edges.iter().flatten())
        .map(|end| {
            let (along, across) = split(*end - center);
            across / tangent - along
        })
        .fold(f64::NEG_INFINITY, f64::max);
    let apex = center - axis * back_m;
    let (x, y) = axis.any_orthonormal_pair();
    Ok(Cone {
        x: Affine::around(x, apex),
        y: Affine::around(y, apex),
        radius: Affine::around(axis, apex).times(tangent),
    })
}

/// Direction of the centre of an eye's lens.
fn lens_direction(eye: &Eye) -> DVec3 {
    let [right, up, forward] = eye.axes().map(|axis| axis.gradient);
    let [x, y] = eye.lens.center.map(f64::from);
    (right * x + up * y + forward).normalize()
}

/// Near and far ends of the edges around an eye's lens cone.
fn lens_edges(eye: &Eye, extent: DVec3) -> impl Iterator<Item = [DVec3; 2]> {
    let [right, up, forward] = eye.axes().map(|axis| axis.gradient);
    let position = eye.position();
    let depths = {
        let corners = eye.edges(extent);
        let depth = |p: DVec3| (p - position).dot(forward);
        [depth(corners[0][0]), depth(corners[0][1])]
    };
    let [x, y] = eye.lens.center.map(f64::from);
    let step = std::f64::consts::TAU / f64::from(CORNERS);
    // The sides of the polygon touch the circle.
    let radius = eye.lens_radius() / (step / 2.0).cos();
    (0..CORNERS).map(move |corner| {
        let (sin, cos) = (f64::from(corner) * step).sin_cos();
        let along = right * (x + radius * cos) + up * (y + radius * sin) + forward;
        depths.map(|depth| position + along * depth)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use formats::view::FovTangents;

    #[test]
    fn the_cone_of_parallel_eyes_is_the_closed_form() {
        let fov = FovTangents::new(1.2, 1.2, 1.2, 1.2);
        let rig = testing::rig([fov; 2], 0.064, 0.0, 0.1, 50.0);
        let cone = cone(&rig, DVec3::splat(60.0)).unwrap();
        // The radius is enlarged by one pixel of 1000, and by the corners of the polygon.
        let expected = 0.064 / 2.0 / 1.2;
        // The apex is on the axis through the origin, where the radius is 0.
        let apex = cone.radius.constant / cone.radius.gradient.length();
        assert!((apex - expected).abs() < 2e-4, "{apex} {expected}");
        let tangent = cone.radius.gradient.length();
        assert!((1.2..1.2 + 5e-3).contains(&tangent), "{tangent}");
    }
}
