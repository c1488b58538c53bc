//! A triangle on the screen: its coverage, depth, and barycentric coordinates.

use super::vertex_error::VertexError;
use glam::{DVec2, DVec3, DVec4};

/// Steps per pixel to which vertices are snapped; every driver here has 8 bits.
const SNAP: f64 = 256.0;

/// A vertex in clip space, or a point between vertices where a primitive was clipped.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClipVertex {
    pub clip: DVec4,
    /// Its weights of the primitive's three vertices.
    pub weights: DVec3,
    pub error: VertexError,
}

/// A vertex on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Pixels, y down.
    pub at: DVec2,
    /// Error in single precision, pixels.
    pub moves_px: DVec2,
    /// 1/256 pixels.
    snapped: [i64; 2],
    /// Ascending with the distance.
    depth: f64,
    /// Error of the depth in single precision.
    depth_error: f64,
    pub inverse_w: f64,
    /// Relative error of `inverse_w`.
    pub inverse_w_error: f64,
    pub weights: DVec3,
}

/// Where a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Inside of all edges.
    Inside,
    /// So near an edge that rounding decides.
    Border,
    /// Outside of an edge.
    Outside,
}

/// A primitive, or a part of it after clipping, as a triangle that winds clockwise on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    corners: [Corner; 3],
    /// Index into the draw list.
    pub draw: u32,
    /// Number of the primitive in its draw.
    pub number: u32,
    /// It crosses the near or the far plane.
    pub clipped: bool,
    /// Its primitive winds counter-clockwise on the screen, with y up.
    pub counter_clockwise: bool,
    /// Its primitive faces away and is not drawn, or has no area after rounding.
    pub dropped: bool,
}

/// How depth grows in a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthOrder {
    /// From 0 at the near plane to 1 at the far plane.
    Ascending,
    /// From 1 at the near plane to 0 at the far plane.
    Reversed,
}

impl DepthOrder {
    /// The order of a projection, column by column, that looks along -z.
    pub fn of(eye_to_clip: &[[f32; 4]; 4]) -> Self {
        // At distance d the depth is the last column's number over d, plus a constant.
        if eye_to_clip[3][2] > 0.0 {
            Self::Reversed
        } else {
            Self::Ascending
        }
    }

    /// A depth, changed such that it ascends with the distance; exact in any precision.
    fn ascending(self, depth: f64) -> f64 {
        match self {
            Self::Ascending => depth,
            Self::Reversed => -depth,
        }
    }

    /// What the depth buffer holds at first, in ascending order: the depth of the far plane.
    pub fn farthest(self) -> f32 {
        match self {
            Self::Ascending => 1.0,
            Self::Reversed => 0.0,
        }
    }
}

/// The pieces of a primitive: up to three triangles if planes cut corners off.
pub(super) fn pieces(
    vertices: [DVec4; 3],
    errors: [VertexError; 3],
    (size_px, order): ([u32; 2], DepthOrder),
    draw: u32,
    number: u32,
    shows: impl Fn(bool) -> bool,
) -> Vec<Piece> {
    let weights = [DVec3::X, DVec3::Y, DVec3::Z];
    let vertex = |i: usize| ClipVertex {
        clip: vertices[i],
        weights: weights[i],
        error: errors[i],
    };
    let corners = clip_to_depth_range(&[vertex(0), vertex(1), vertex(2)]);
    let clipped = corners.len() != 3 || (0..3).any(|i| corners[i].clip != vertices[i]);
    let projected: Vec<Corner> = (corners.iter().map(|v| project(v, size_px, order))).collect();
    let triangle = |fan: usize| {
        let mut corners = [projected[0], projected[fan - 1], projected[fan]];
        let area = area(&corners);
        // Counter-clockwise with y up is clockwise with y down: a negative area here.
        let dropped = area == 0 || !shows(area < 0);
        if area < 0 {
            corners.swap(1, 2);
        }
        Piece {
            corners,
            draw,
            number,
            clipped,
            counter_clockwise: area < 0,
            dropped,
        }
    };
    (2..projected.len()).map(triangle).collect()
}

/// The part of a polygon where `distance` is not negative (Sutherland and Hodgman 1974). `between` gives the vertex at a
/// fraction of the way between two others.
fn clip<V: Copy>(
    polygon: &[V],
    distance: impl Fn(&V) -> f64,
    between: impl Fn(&V, &V, f64) -> V,
) -> Vec<V> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, current) in polygon.iter().enumerate() {
        let previous = &polygon[(i + polygon.len() - 1) % polygon.len()];
        let (dp, dc) = (distance(previous), distance(current));
        if (dp < 0.0) != (dc < 0.0) {
            kept.push(between(previous, current, dp / (dp - dc)));
        }
        if dc >= 0.0 {
            kept.push(*current);
        }
    }
    kept
}

/// Clips a triangle to `0 <= z <= w`.
fn clip_to_depth_range(triangle: &[ClipVertex; 3]) -> Vec<ClipVertex> {
    let near = |v: &ClipVertex| v.clip.z;
    let far = |v: &ClipVertex| v.clip.w - v.clip.z;
    let mut polygon = triangle.to_vec();
    for distance in [&near as &dyn Fn(&ClipVertex) -> f64, &far] {
        polygon = clip(&polygon, distance, |previous, current, t| ClipVertex {
            clip: previous.clip.lerp(current.clip, t),
            weights: previous.weights.lerp(current.weights, t),
            error: previous.error.between(current.error),
        });
    }
    // Vertices that are not finite are on neither side.
    polygon.retain(|v| v.clip.is_finite() && v.clip.w > 0.0);
    polygon
}

/// Clips a triangle on the screen to the screen's borders; corners in the same order.
fn clip_to_screen(triangle: &[Corner; 3], size_px: [u32; 2]) -> Vec<Corner> {
    let size = size_px.map(f64::from);
    let inside: [&dyn Fn(DVec2) -> f64; 4] =
        [&|at| at.x, &|at| size[0] - at.x, &|at| at.y, &|at| {
            size[1] - at.y
        }];
    let mut polygon = triangle.to_vec();
    for distance in inside {
        polygon = clip(&polygon, |corner| distance(corner.at), Corner::toward);
    }
    polygon
}

impl Corner {
    /// The point at a fraction of the way to another corner on the screen.
    fn toward(&self, other: &Self, share: f64) -> Self {
        let inverse_w = self.inverse_w + share * (other.inverse_w - self.inverse_w);
        // The same errors in clip space move a point further if w is smaller.
        let moves = |of: &Self| of.moves_px * (inverse_w / of.inverse_w).max(1.0);
        let at = self.at.lerp(other.at, share);
        let over_w = (self.weights * self.inverse_w).lerp(other.weights * other.inverse_w, share);
        Self {
            at,
            moves_px: moves(self).max(moves(other)),
            snapped: at.to_array().map(|v| (v * SNAP).round_ties_even() as i64),
            depth: self.depth + share * (other.depth - self.depth),
            depth_error: self.depth_error.max(other.depth_error),
            inverse_w,
            inverse_w_error: self.inverse_w_error.max(other.inverse_w_error)
                * (inverse_w / self.inverse_w.min(other.inverse_w)),
            weights: over_w / inverse_w,
        }
    }
}

fn project(vertex: &ClipVertex, size_px: [u32; 2], order: DepthOrder) -> Corner {
    let inverse_w = 1.0 / vertex.clip.w;
    let ndc = vertex.clip * inverse_w;
    let at = DVec2::new(
        (ndc.x * 0.5 + 0.5) * f64::from(size_px[0]),
        (0.5 - ndc.y * 0.5) * f64::from(size_px[1]),
    );
    Corner {
        at,
        snapped: at.to_array().map(|v| (v * SNAP).round_ties_even() as i64),
        depth: order.ascending(ndc.z),
        depth_error: vertex.error.depth(vertex.clip),
        moves_px: vertex.error.moves_px(vertex.clip, size_px, at),
        inverse_w,
        inverse_w_error: vertex.error.inverse_w(vertex.clip),
        weights: vertex.weights,
    }
}

/// Twice the area of the snapped triangle, positive for clockwise on a screen with y down.
fn area(t: &[Corner; 3]) -> i128 {
    edge(t[0].snapped, t[1].snapped, t[2].snapped)
}

fn edge(a: [i64; 2], b: [i64; 2], p: [i64; 2]) -> i128 {
    let wide = |v: i64| i128::from(v);
    wide(b[0] - a[0]) * wide(p[1] - a[1]) - wide(b[1] - a[1]) * wide(p[0] - a[0])
}

/// The centre of a pixel.
pub fn center(pixel: [u32; 2]) -> DVec2 {
    DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5
}

/// The centre of the top left pixel of a pixel's quad.
pub fn quad_center(pixel: [u32; 2]) -> DVec2 {
    center(pixel.map(|v| v & !1))
}

impl Piece {
    /// Its corners, clockwise.
    pub(super) fn corners(&self) -> &[Corner; 3] {
        &self.corners
    }

    /// First and last column, then row, of the pixels that it may touch; `None` if off the screen.
    pub(super) fn span_px(&self, size_px: [u32; 2]) -> Option<[[u32; 2]; 2]> {
        let axis = |axis: usize| {
            let values = self.corners.map(|v| v.snapped[axis].div_euclid(256));
            let low = values.iter().min().copied()?.max(0);
            let high = values
                .iter()
                .max()
                .copied()?
                .min(i64::from(size_px[axis]) - 1);
            (low <= high).then_some([low as u32, high as u32])
        };
        Some([axis(0)?, axis(1)?])
    }

    /// The edge functions at a pixel's centre: all positive inside.
    fn edges(&self, pixel: [u32; 2]) -> [(i128, [i64; 2]); 3] {
        let center = pixel.map(|v| i64::from(v) * 256 + 128);
        [0, 1, 2].map(|i| {
            let (a, b) = (self.corners[i].snapped, self.corners[(i + 1) % 3].snapped);
            (edge(a, b, center), [b[0] - a[0], b[1] - a[1]])
        })
    }

    /// Whether a pixel's centre is covered, by the top-left rule.
    pub fn covers(&self, pixel: [u32; 2]) -> bool {
        self.edges(pixel).into_iter().all(|(value, [x, y])| {
            let (top, left) = (y == 0 && x > 0, y < 0);
            value > 0 || (value == 0 && (top || left))
        })
    }

    /// Distance in pixels of a pixel's centre to the nearest edge's line, negative outside.
    pub fn distance_px(&self, pixel: [u32; 2]) -> f64 {
        let distance = |(value, [x, y]): (i128, [i64; 2])| {
            let length = (x as f64).hypot(y as f64).max(1.0);
            value as f64 / length / SNAP
        };
        self.edges(pixel)
            .map(distance)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// The side of a pixel's centre, where edges within `margin_px` and the errors of their ends do not
    /// decide.
    pub(super) fn side(&self, pixel: [u32; 2], margin_px: f64) -> Side {
        let at = center(pixel);
        let mut side = Side::Inside;
        for (i, (value, [x, y])) in self.edges(pixel).into_iter().enumerate() {
            let (a, b) = (&self.corners[i], &self.corners[(i + 1) % 3]);
            let length = (x as f64).hypot(y as f64).max(1.0);
            let distance = value as f64 / length / SNAP;
            let along = (at - a.at).dot(b.at - a.at) / (b.at - a.at).length_squared();
            let along = if along.is_finite() {
                along.clamp(0.0, 1.0)
            } else {
                0.5
            };
            let moves = a.moves_px.lerp(b.moves_px, along).max_element();
            let tolerance = margin_px + moves;
            if distance < -tolerance {
                return Side::Outside;
            }
            if distance <= tolerance {
                side = Side::Border;
            }
        }
        side
    }

    /// Shortest height in pixels; below 1/256, rounding of the vertices decides what is drawn.
    pub fn height_px(&self) -> f64 {
        let [a, b, c] = self.corners.map(|c| c.at);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        ((b - a).perp_dot(c - a) / longest.max(f64::MIN_POSITIVE)).abs()
    }

    /// Largest distance of its corners from the screen's upper left corner along an axis.
    pub fn largest_px(&self) -> f64 {
        let largest = self.corners.map(|c| c.at.abs().max_element());
        largest.into_iter().fold(0.0, f64::max)
    }

    /// The piece with one corner moved, as if the vertex were rounded differently.
    pub fn moved(&self, corner: usize, by_px: DVec2) -> Self {
        let mut moved = *self;
        moved.corners[corner].at += by_px;
        moved
    }

    /// Weights of the corners at a point of the screen, linear in it.
    pub(super) fn screen_weights(&self, p: DVec2) -> [f64; 3] {
        let cross = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a);
        let [a, b, c] = self.corners.map(|c| c.at);
        let total = (b - a).perp_dot(c - a);
        [cross(b, c), cross(c, a), cross(a, b)].map(|w| w / total)
    }

    /// The triangles that a driver may draw instead of it at the screen's border: drivers clip there, and
    /// each triangulates the rest in its own order. Only triangles that may contain a point, within 1/128
    /// pixel.
    pub fn cut_at_border(&self, size_px: [u32; 2], p: DVec2) -> Vec<Self> {
        let polygon = clip_to_screen(&self.corners, size_px);
        let mut found = Vec::new();
        for c in 2..polygon.len() {
            for b in 1..c {
                for a in 0..b {
                    let corners = [polygon[a], polygon[b], polygon[c]];
                    let triangle = Self { corners, ..*self };
                    if triangle.may_hold(p) {
                        found.push(triangle);
                    }
                }
            }
        }
        found
    }

    /// Whether a point is inside, or within 1/128 pixel of an edge.
    fn may_hold(&self, p: DVec2) -> bool {
        let [a, b, c] = self.corners.map(|corner| corner.at);
        let inside = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a) >= -(b - a).length() / 128.0;
        (b - a).perp_dot(c - a) > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)
    }

    /// Depth at a point of the screen, 0 to 1.
    pub fn depth(&self, p: DVec2) -> f64 {
        let weights = self.screen_weights(p);
        weights
            .iter()
            .zip(&self.corners)
            .map(|(w, c)| w * c.depth)
            .sum()
    }

    /// Error in single precision of the depth at a point: a few units in the last place of the largest term
    /// of the plane's equation, and the errors of the vertices' depths and places.
    pub fn depth_error(&self, p: DVec2) -> f64 {
        let here = self.depth(p);
        let slope = DVec2::new(
            self.depth(p + DVec2::X) - here,
            self.depth(p + DVec2::Y) - here,
        );
        let slope = slope.abs();
        let terms =
            here.abs() + slope.dot(DVec2::new(self.farthest_px(p, 0), self.farthest_px(p, 1)));
        let weights = self.screen_weights(p).map(f64::abs);
        let of_vertices = weights.iter().zip(&self.corners);
        let of_vertices = of_vertices.map(|(w, c)| w * (c.depth_error + slope.dot(c.moves_px)));
        16.0 * f64::from(f32::EPSILON) * terms + of_vertices.sum::<f64>()
    }

    /// Distance to the corner that is farthest from a point along an axis.
    pub fn farthest_px(&self, p: DVec2, axis: usize) -> f64 {
        let away = self.corners.map(|c| (c.at[axis] - p[axis]).abs());
        away.into_iter().fold(0.0, f64::max)
    }

    /// Weights of the primitive's vertices over w at a point of the screen: linear in the point, and
    /// perspective-correct weights when divided by their sum.
    pub fn weights_over_w(&self, p: DVec2) -> DVec3 {
        let weights = self.screen_weights(p);
        (weights.iter().zip(&self.corners))
            .map(|(weight, corner)| corner.weights * (weight * corner.inverse_w))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle from pixels, with depth 0.5 and w 1 or the given values.
    fn piece(corners: [[f64; 2]; 3], w: [f64; 3], size: u32) -> Piece {
        let vertex = |i: usize| {
            let [x, y] = corners[i].map(|v| v / f64::from(size) * 2.0 - 1.0);
            DVec4::new(x, -y, 0.5, 1.0) * w[i]
        };
        let found = pieces(
            [vertex(0), vertex(1), vertex(2)],
            Default::default(),
            ([size; 2], DepthOrder::Ascending),
            0,
            0,
            |_| true,
        );
        assert_eq!(found.len(), 1);
        found[0]
    }

    #[test]
    fn two_triangles_of_a_square_cover_each_of_its_pixels_once() {
        // The diagonal and the right and lower edges go through pixel centres.
        let a = piece([[0.5, 0.5], [4.5, 0.5], [4.5, 4.5]], [1.0; 3], 8);
        let b = piece([[0.5, 0.5], [4.5, 4.5], [0.5, 4.5]], [1.0; 3], 8);
        for y in 0..8 {
            for x in 0..8 {
                let covered = [a, b].iter().filter(|p| p.covers([x, y])).count();
                assert_eq!(covered, usize::from(x < 4 && y < 4), "{x} {y}");
            }
        }
        assert_eq!(a.distance_px([2, 2]), 0.0);
        assert_eq!(a.distance_px([6, 2]), -2.0);
    }

    #[test]
    fn weights_are_perspective_correct() {
        // The point half way between depths of 1 and 3 has weight 3/4 of the nearer one.
        let t = piece([[0.0, 0.0], [8.0, 0.0], [0.0, 8.0]], [1.0, 3.0, 1.0], 8);
        let over_w = t.weights_over_w(DVec2::new(4.0, 0.0));
        let weights = over_w / over_w.element_sum();
        assert!(
            (weights - DVec3::new(0.75, 0.25, 0.0)).length() < 1e-12,
            "{weights}"
        );
    }

    #[test]
    fn a_triangle_over_the_border_is_cut_into_triangles_that_keep_its_coordinates() {
        let t = piece([[3.0, 6.0], [5.0, -2.0], [7.0, 6.0]], [1.0, 3.0, 2.0], 8);
        let p = DVec2::new(5.0, 2.0);
        let whole = t.weights_over_w(p);
        let parts = t.cut_at_border([8; 2], p);
        assert!(parts.len() >= 2, "{parts:?}");
        for part in &parts {
            for corner in part.corners {
                assert!(corner.at.min_element() >= -1e-9 && corner.at.max_element() <= 8.0 + 1e-9);
            }
            assert!((part.weights_over_w(p) - whole).length() < 1e-12);
        }
        let outside = DVec2::new(1.0, 7.0);
        assert_eq!(t.cut_at_border([8; 2], outside).len(), 0);
    }

    #[test]
    fn a_primitive_behind_the_eye_is_cut_at_the_near_plane() {
        let vertices = [
            [-1.0, -1.0, 0.2, 1.0],
            [1.0, -1.0, 0.2, 1.0],
            [0.0, 1.0, -0.2, 0.6],
        ];
        let found = pieces(
            vertices.map(DVec4::from),
            Default::default(),
            ([64; 2], DepthOrder::Ascending),
            0,
            0,
            |_| true,
        );
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|p| p.clipped && !p.dropped));
    }
}
