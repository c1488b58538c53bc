//! An independent search of hits in `f64`, for scenes that are too large for brute force.
//!
//! It shares no code with the traversal: the tree splits triangles at the median, boxes and
//! triangles are tested in `f64`, and every node whose box the line meets is visited nearest last
//! or first without regard to the order. Only rays that pass an edge within rounding may differ.

use glam::DVec3;

type Triangle = [DVec3; 3];

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// Relative widening of boxes, far above the rounding of their test.
const WIDENED: f64 = 1e-12;

/// A box with the range of its triangles, or, if the range is empty, with two children: the next
/// node and `second`.
struct Node {
    min: DVec3,
    max: DVec3,
    triangles: std::ops::Range<usize>,
    second: usize,
}

/// A hit, or a triangle close to a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Number of the triangle.
    pub primitive: u32,
    /// Distance to the triangle's plane, in lengths of the direction.
    pub t: f64,
}

/// Triangles in a tree.
pub struct ReferenceTree {
    nodes: Vec<Node>,
    /// In the order of leaves.
    triangles: Vec<(u32, Triangle)>,
}

impl ReferenceTree {
    /// Builds a tree over triangles, which are numbered in their order.
    pub fn new(triangles: &[[[f32; 3]; 3]]) -> Self {
        let exact = triangles.iter().map(exact);
        let mut tree = Self {
            nodes: Vec::new(),
            triangles: (0..).zip(exact).collect(),
        };
        tree.split(0..triangles.len());
        tree
    }

    /// Adds the node of a range of triangles and all below.
    fn split(&mut self, range: std::ops::Range<usize>) {
        let part = &mut self.triangles[range.clone()];
        let ends = |points: &mut dyn Iterator<Item = DVec3>| {
            points.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| {
                (low.min(p), high.max(p))
            })
        };
        let (min, max) = ends(&mut part.iter().flat_map(|(_, corners)| *corners));
        let wider = WIDENED * min.abs().max(max.abs());
        let here = self.nodes.len();
        self.nodes.push(Node {
            min: min - wider,
            max: max + wider,
            triangles: range.clone(),
            second: 0,
        });
        if part.len() <= LEAF {
            return;
        }
        let middle = |triangle: &Triangle| triangle[0] + triangle[1] + triangle[2];
        let (low, high) = ends(&mut part.iter().map(|(_, corners)| middle(corners)));
        let axis = (high - low).max_position();
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |a, b| {
            let of = |triangle: &(u32, Triangle)| middle(&triangle.1)[axis];
            of(a).total_cmp(&of(b)).then(a.0.cmp(&b.0))
        });
        self.nodes[here].triangles = 0..0;
        self.split(range.start..range.start + half);
        self.nodes[here].second = self.nodes.len();
        self.split(range.start + half..range.end);
    }

    /// The nearest triangle beyond the origin that a ray hits.
    pub fn closest(&self, origin: DVec3, direction: DVec3) -> Option<Crossing> {
        let mut nearest: Option<Crossing> = None;
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            let node = &self.nodes[at];
            let limit = nearest.map_or(f64::INFINITY, |hit| hit.t);
            if !meets(node, origin, direction, limit) {
                continue;
            }
            if node.second != 0 {
                open.extend([node.second, at + 1]);
                continue;
            }
            for (primitive, corners) in &self.triangles[node.triangles.clone()] {
                let Some(t) = hit(corners, origin, direction) else {
                    continue;
                };
                let found = Crossing {
                    primitive: *primitive,
                    t,
                };
                let nearer = |n: Crossing| (t, found.primitive) < (n.t, n.primitive);
                if t > 0.0 && nearest.is_none_or(nearer) {
                    nearest = Some(found);
                }
            }
        }
        nearest
    }
}

/// The corners of a triangle in `f64`.
pub fn exact(triangle: &[[f32; 3]; 3]) -> Triangle {
    triangle.map(|corner| DVec3::from(corner.map(f64::from)))
}

fn meets(node: &Node, origin: DVec3, direction: DVec3, limit: f64) -> bool {
    let (mut enter, mut leave) = (0.0, limit);
    for axis in 0..3 {
        let (o, d) = (origin[axis], direction[axis]);
        let (low, high) = (node.min[axis] - o, node.max[axis] - o);
        if d == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / d, high / d);
        enter = a.min(b).max(enter);
        leave = a.max(b).min(leave);
    }
    enter <= leave * (1.0 + WIDENED)
}

/// Distance to a triangle if the line passes through it, by signed volumes.
fn hit(corners: &Triangle, origin: DVec3, direction: DVec3) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| corner - origin);
    let volume = |p: DVec3, q: DVec3| p.cross(q).dot(direction);
    let v = [volume(b, c), volume(c, a), volume(a, b)];
    let one_side = v.iter().all(|x| *x >= 0.0) || v.iter().all(|x| *x <= 0.0);
    let t = distance(corners, origin, direction);
    (one_side && t.is_finite()).then_some(t)
}

/// Distance to a triangle's plane.
fn distance(corners: &Triangle, origin: DVec3, direction: DVec3) -> f64 {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a);
    normal.dot(a - origin) / normal.dot(direction)
}

/// Why two searches may differ at a triangle that only one of them found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The line passes an edge within the tolerance.
    Edge,
    /// The triangle contains the origin within the tolerance.
    Start,
    /// Another triangle lies at the same distance within the tolerance.
    Tie,
}

/// The cause of a difference at `triangle`, which only one search found. `other` is what the other
/// one found, if anything. `tolerance` is a length: what rounding may displace.
pub fn cause(
    triangle: &Triangle,
    other: Option<&Triangle>,
    origin: DVec3,
    direction: DVec3,
    tolerance: f64,
) -> Option<Cause> {
    let direction = direction.normalize();
    let reach = |triangle: &Triangle| {
        let [a, b, c] = *triangle;
        let slope = (b - a).cross(c - a).normalize_or_zero().dot(direction);
        (
            distance(triangle, origin, direction),
            tolerance / slope.abs(),
        )
    };
    let (t, within) = reach(triangle);
    if edge_near(triangle, origin, direction, tolerance) {
        return Some(Cause::Edge);
    }
    if t.abs() <= within {
        return Some(Cause::Start);
    }
    let (other_t, other_within) = reach(other?);
    ((t - other_t).abs() <= within + other_within).then_some(Cause::Tie)
}

/// True if a line passes an edge within the tolerance. Seen along the line, which is then a point.
fn edge_near(triangle: &Triangle, origin: DVec3, direction: DVec3, tolerance: f64) -> bool {
    let flat = triangle.map(|corner| {
        let to = corner - origin;
        to - direction * to.dot(direction)
    });
    (0..3).any(|i| {
        let (p, along) = (flat[i], flat[(i + 1) % 3] - flat[i]);
        let squared = along.length_squared();
        let s = if squared > 0.0 {
            (-p.dot(along) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p + along * s).length() <= tolerance
    })
}

// A bench without a test harness leaves the tests out, not their imports.
#[cfg(test)]
#[allow(unused_imports)]
mod tests {
    use super::*;
    use lab::traversal::reference::{Random, Reference, TestMesh, Verdict};

    #[test]
    fn hits_are_those_of_brute_force() {
        let mesh = TestMesh::torus(48, 20);
        let triangles = mesh.rounded(DVec3::ZERO);
        let tree = ReferenceTree::new(&triangles);
        let brute = Reference::new(&mesh);
        let mut random = Random(3);
        let mut hits = 0;
        for _ in 0..2000 {
            let origin = random.in_ball() * 20.0;
            let direction = (random.in_ball() * 8.0 - origin).normalize();
            let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
            let found = tree.closest(origin, direction);
            match brute.verdict(origin, direction, 1e-5) {
                Verdict::Hit(at) => {
                    let t = found.expect("a hit").t;
                    if let Some((distance, shift)) = at {
                        assert!((t - distance).abs() < 1e-5 + shift, "{t} for {distance}");
                    }
                    hits += 1;
                }
                Verdict::Miss => assert_eq!(found, None),
                Verdict::Borderline => {}
            }
        }
        assert!(hits > 800, "{hits}");
    }

    #[test]
    fn a_difference_has_a_cause_only_within_the_tolerance() {
        let at = |z: f64| [[-1.0, -1.0, z], [1.0, -1.0, z], [0.0, 1.0, z]].map(DVec3::from);
        let find = |x: f64, origin_z: f64, other: Option<f64>| {
            let other = other.map(at);
            let origin = DVec3::new(x, 0.0, origin_z);
            cause(&at(0.0), other.as_ref(), origin, DVec3::Z, 1e-3)
        };
        assert_eq!(find(0.0, -5.0, None), None);
        assert_eq!(find(0.5001, -5.0, None), Some(Cause::Edge));
        assert_eq!(find(0.49, -5.0, None), None);
        assert_eq!(find(0.0, -0.0005, None), Some(Cause::Start));
        assert_eq!(find(0.0, -5.0, Some(0.001)), Some(Cause::Tie));
        assert_eq!(find(0.0, -5.0, Some(0.01)), None);
    }
}
