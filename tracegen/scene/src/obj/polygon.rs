//! Triangulation of polygons.

use glam::{DVec2, Vec3};

/// Most corners of a polygon for ear cutting, whose time is quadratic. Larger polygons become fans.
const MAX_EARS: usize = 256;

/// Three corners per triangle, as indices into `polygon`, in the polygon's winding.
///
/// A polygon for which a fan from its first corner reverses no triangle (every convex one) becomes
/// that fan. Others are triangulated by ear cutting. A polygon that crosses itself may give
/// overlapping triangles.
pub(super) fn triangulate(polygon: &[Vec3]) -> Vec<[usize; 3]> {
    let fan = || (2..polygon.len()).map(|i| [0, i - 1, i]).collect();
    if polygon.len() == 3 || polygon.len() > MAX_EARS {
        return fan();
    }
    let flat = flatten(polygon);
    if (2..flat.len()).all(|i| turn(flat[0], flat[i - 1], flat[i]) >= 0.0) {
        return fan();
    }
    Ears::new(flat).cut()
}

/// The polygon in 2D, seen from the side on which it winds counter-clockwise.
fn flatten(polygon: &[Vec3]) -> Vec<DVec2> {
    // Newell's normal, which allows collinear corners.
    let around = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let normal: glam::DVec3 = around
        .map(|(a, b)| {
            let (a, b) = ((*a - polygon[0]).as_dvec3(), (*b - polygon[0]).as_dvec3());
            a.cross(b)
        })
        .sum();
    let (x, y) = normal
        .try_normalize()
        .unwrap_or(glam::DVec3::Z)
        .any_orthonormal_pair();
    polygon
        .iter()
        .map(|p| (*p - polygon[0]).as_dvec3())
        .map(|p| DVec2::new(p.dot(x), p.dot(y)))
        .collect()
}

/// Twice the signed area of a triangle: positive where it winds counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// The remaining polygon, as a ring.
struct Ears {
    points: Vec<DVec2>,
    next: Vec<usize>,
    previous: Vec<usize>,
}

impl Ears {
    fn new(points: Vec<DVec2>) -> Self {
        let n = points.len();
        Self {
            points,
            next: (0..n).map(|i| (i + 1) % n).collect(),
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
        }
    }

    fn cut(mut self) -> Vec<[usize; 3]> {
        let mut left = self.points.len();
        let mut triangles = Vec::with_capacity(left - 2);
        // Cutting an ear changes which corners are ears at its two neighbours only.
        let mut ears: Vec<bool> = (0..left).map(|i| self.is_ear(i)).collect();
        let mut at = 0;
        while left > 3 {
            let from = at;
            while !ears[at] {
                at = self.next[at];
                if at == from {
                    // Without an ear, the polygon crosses itself. Cutting any corner still
                    // terminates.
                    break;
                }
            }
            let (before, after) = (self.previous[at], self.next[at]);
            triangles.push([before, at, after]);
            self.next[before] = after;
            self.previous[after] = before;
            left -= 1;
            for neighbour in [before, after] {
                ears[neighbour] = self.is_ear(neighbour);
            }
            at = after;
        }
        triangles.push([self.previous[at], at, self.next[at]]);
        triangles
    }

    /// True if the triangle with both neighbours winds like the polygon and contains no other
    /// corner.
    fn is_ear(&self, at: usize) -> bool {
        let (before, after) = (self.previous[at], self.next[at]);
        let [a, b, c] = [before, at, after].map(|i| self.points[i]);
        if turn(a, b, c) <= 0.0 {
            return false;
        }
        let mut other = self.next[after];
        while other != before {
            let p = self.points[other];
            let inside = turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            // Corners that coincide with the triangle's own only touch it.
            if inside && p != a && p != b && p != c {
                return false;
            }
            other = self.next[other];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[Vec3], triangles: &[[usize; 3]]) -> (f32, bool) {
        let areas: Vec<f32> = triangles
            .iter()
            .map(|t| t.map(|i| polygon[i]))
            .map(|[a, b, c]| (b - a).cross(c - a).y / 2.0)
            .collect();
        (areas.iter().sum(), areas.iter().all(|a| *a >= 0.0))
    }

    /// On the ground, counter-clockwise from above.
    fn ground(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|[x, z]| Vec3::new(*x, 5.0, -z)).collect()
    }

    #[test]
    fn a_convex_polygon_is_a_fan() {
        let hexagon: Vec<[f32; 2]> = (0..6)
            .map(|i| (i as f32).to_radians() * 60.0)
            .map(|a| [a.cos(), a.sin()])
            .collect();
        let expected = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        assert_eq!(triangulate(&ground(&hexagon)), expected);
    }

    #[test]
    fn concave_polygons_are_covered_once_from_any_first_corner() {
        let arrow: &[[f32; 2]] = &[[0.0, 0.0], [2.0, -2.0], [0.0, 3.0], [-2.0, -2.0]];
        let star: Vec<[f32; 2]> = (0..10)
            .map(|i| ((i as f32 * 36.0).to_radians(), [3.0, 1.0][i % 2]))
            .map(|(a, r)| [r * a.cos(), r * a.sin()])
            .collect();
        let comb: &[[f32; 2]] = &[
            [0.0, 0.0],
            [5.0, 0.0],
            [5.0, 3.0],
            [4.0, 3.0],
            [4.0, 1.0],
            [3.0, 1.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        for (points, expected) in [(arrow, 6.0), (&star, 8.816_778), (comb, 11.0)] {
            for first in 0..points.len() {
                let mut points = points.to_vec();
                points.rotate_left(first);
                let polygon = ground(&points);
                let triangles = triangulate(&polygon);
                assert_eq!(triangles.len(), polygon.len() - 2);
                let (sum, none_turned) = area(&polygon, &triangles);
                assert!(none_turned, "{first}: {triangles:?}");
                assert!((sum - expected).abs() < 1e-4, "{first}: {sum}");
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_or_have_no_area_are_triangulated() {
        let mut crossing = ground(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.3, 2.0]]);
        for _ in 0..crossing.len() {
            crossing.rotate_left(1);
            assert_eq!(triangulate(&crossing).len(), 3);
        }
        assert_eq!(triangulate(&[Vec3::ONE; 9]).len(), 7);
        assert_eq!(
            triangulate(&[Vec3::MAX, Vec3::MIN, Vec3::ZERO, Vec3::MAX]).len(),
            2
        );
        assert_eq!(triangulate(&vec![Vec3::X; 100_000]).len(), 99_998);
    }
}
