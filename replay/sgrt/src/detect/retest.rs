//! Re-tests: intersects the right-eye ray with the triangles that arrived around it.

use super::{Decision, PixelClass};
use crate::frame::SKY;
use crate::place::{Offset, RightSample};
use formats::view::Eye;

/// Intersects the right-eye ray with the triangles of the candidate and of its neighbours. The decision
/// becomes the nearest hit, or bad if there is none.
pub fn retest(at: RightSample, offsets: &'static [Offset], decision: &mut Decision) {
    let frame = at.frame;
    let eye = frame.tables.camera(Eye::Right);
    let direction = eye.direction(frame.position_px(at.index));

    let mut tested = [SKY; 9];
    let mut tests = 0usize;
    let mut nearest: Option<(f32, u32, u32)> = None;
    for place in std::iter::once(at).chain(at.arrived_neighbours(offsets)) {
        let primitive = place.source().primitive;
        if primitive == SKY || tested[..tests].contains(&primitive) {
            continue;
        }
        let Some(triangle) = frame.tables.triangle(primitive) else {
            continue;
        };
        tested[tests] = primitive;
        tests += 1;
        if let Some(t) = intersect(eye.position, direction, &triangle.vertices)
            && nearest.is_none_or(|(best, ..)| t < best)
        {
            nearest = Some((t, place.candidate().source, primitive));
        }
    }
    decision.tests = tests as u8;
    match nearest {
        Some((t, source, primitive)) => {
            decision.source = source;
            decision.primitive = primitive;
            decision.exact = Some(eye.at(direction, t));
        }
        // The sky has no triangle. It is reused if no triangle around it is hit.
        None if decision.primitive == SKY => {}
        None => decision.class = PixelClass::Bad,
    }
}

/// Distance at which a ray from `origin` along `direction` hits a triangle, from either side.
///
/// Double precision gives the exact answer except for rays within about 1e-12 of an edge.
pub fn intersect(origin: [f32; 3], direction: [f32; 3], vertices: &[[f32; 3]; 3]) -> Option<f32> {
    let o = origin.map(f64::from);
    let d = direction.map(f64::from);
    let [a, b, c] = vertices.map(|v| sub(v.map(f64::from), o));
    // Volumes of the tetrahedra between the ray and each edge. All have one sign for a hit.
    let u = dot(d, cross(c, b));
    let v = dot(d, cross(a, c));
    let w = dot(d, cross(b, a));
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let sum = u + v + w;
    if !inside || sum == 0.0 {
        return None;
    }
    let normal = cross(sub(b, a), sub(c, a));
    let t = dot(normal, a) / dot(normal, d);
    (t > 0.0 && t.is_finite()).then_some(t as f32)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, -2.0], [1.0, 0.0, -2.0], [0.0, 1.0, -2.0]];

    #[test]
    fn both_faces_are_hit_at_the_planes_distance() {
        let turned = [TRIANGLE[0], TRIANGLE[2], TRIANGLE[1]];
        for triangle in [TRIANGLE, turned] {
            assert_eq!(
                intersect([0.2, 0.2, 0.0], [0.0, 0.0, -1.0], &triangle),
                Some(2.0)
            );
        }
    }

    #[test]
    fn triangles_behind_or_beside_the_ray_are_missed() {
        assert_eq!(intersect([0.2, 0.2, 0.0], [0.0, 0.0, 1.0], &TRIANGLE), None);
        assert_eq!(
            intersect([0.6, 0.6, 0.0], [0.0, 0.0, -1.0], &TRIANGLE),
            None
        );
        assert_eq!(intersect([0.2, 0.2, 0.0], [1.0, 0.0, 0.0], &TRIANGLE), None);
        let line = [TRIANGLE[0], TRIANGLE[1], TRIANGLE[1]];
        assert_eq!(intersect([0.5, 0.0, 0.0], [0.0, 0.0, -1.0], &line), None);
    }

    proptest! {
        #[test]
        fn a_ray_at_a_point_of_the_triangle_hits_it_there(
            vertices in prop::array::uniform3(prop::array::uniform3(-5.0f32..5.0)),
            weights in (0.05f32..1.0, 0.05f32..1.0, 0.05f32..1.0),
        ) {
            let origin = [0.0f32, 0.0, 9.0];
            let sum = weights.0 + weights.1 + weights.2;
            let point: [f32; 3] = std::array::from_fn(|i| {
                (vertices[0][i] * weights.0 + vertices[1][i] * weights.1
                    + vertices[2][i] * weights.2) / sum
            });
            let to = glam::Vec3::from(point) - glam::Vec3::from(origin);
            let [a, b, c] = vertices.map(glam::Vec3::from);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            // The tracer's exact-edge tests cover slivers and grazing rays.
            prop_assume!((b - a).cross(c - a).length() > 0.5);
            prop_assume!(normal.dot(to.normalize()).abs() > 0.05);
            let t = intersect(origin, to.normalize().to_array(), &vertices);
            prop_assert!(t.is_some());
            prop_assert!((t.unwrap_or(0.0) - to.length()).abs() < 1e-3);
        }
    }
}
