//! Compares the precision and speed of a simple ray tracer in single and double precision with the
//! ray tracer of the crate `rays`.
//!
//! The simple ray tracer uses a tree of boxes split at medians, a slab test, and signed volumes of
//! the ray with a triangle's edges. Each edge is calculated identically for both of its triangles.

use super::reference::{Random, Reference, TestMesh, Verdict};
use formats::raytrace::TraversalKind;
use glam::DVec3;
use rays::bvh::count::NoCounter;
use rays::bvh::{AllOpaque, Bvh, TraversalStack};
use rays::ray::Ray;
use std::ops::{Add, Div, Mul, Sub};
use std::time::{Duration, Instant};

/// The arithmetic.
trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    const ZERO: Self;
    const MAX: Self;
    /// Relative margin of a box's exit, for rounding.
    const PADDED: Self;
    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

macro_rules! real {
    ($type:ident) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const MAX: Self = $type::MAX;
            const PADDED: Self = 1.0 + 8.0 * $type::EPSILON;
            fn of(value: f64) -> Self {
                value as $type
            }
            fn to_f64(self) -> f64 {
                self.into()
            }
        }
    };
}

real!(f32);
real!(f64);

type V<T> = [T; 3];

fn minus<T: Real>(a: V<T>, b: V<T>) -> V<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross<T: Real>(a: V<T>, b: V<T>) -> V<T> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot<T: Real>(a: V<T>, b: V<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn rounded<T: Real>(v: DVec3) -> V<T> {
    v.to_array().map(T::of)
}

struct Node<T> {
    low: V<T>,
    high: V<T>,
    /// A leaf's triangles, or nothing.
    triangles: std::ops::Range<usize>,
    /// An inner node's second child. The first child directly follows the node.
    second: usize,
}

struct Tree<T> {
    vertices: Vec<V<T>>,
    triangles: Vec<[u32; 3]>,
    nodes: Vec<Node<T>>,
}

impl<T: Real> Tree<T> {
    /// Builds the tree of a mesh whose vertices are rounded as given.
    fn new(mesh: &TestMesh) -> Self {
        let mut tree = Self {
            vertices: mesh.vertices.iter().map(|v| rounded(*v)).collect(),
            triangles: mesh.triangles.clone(),
            nodes: Vec::new(),
        };
        tree.build(0..mesh.triangles.len());
        tree
    }

    fn corners(&self, triangle: [u32; 3]) -> [V<T>; 3] {
        triangle.map(|v| self.vertices[v as usize])
    }

    fn build(&mut self, range: std::ops::Range<usize>) -> usize {
        let (mut low, mut high) = ([T::MAX; 3], [T::ZERO - T::MAX; 3]);
        for triangle in &self.triangles[range.clone()] {
            for corner in self.corners(*triangle) {
                for axis in 0..3 {
                    low[axis] = if corner[axis] < low[axis] {
                        corner[axis]
                    } else {
                        low[axis]
                    };
                    high[axis] = if corner[axis] > high[axis] {
                        corner[axis]
                    } else {
                        high[axis]
                    };
                }
            }
        }
        let index = self.nodes.len();
        let leaf = range.len() <= 4;
        let triangles = if leaf { range.clone() } else { 0..0 };
        self.nodes.push(Node {
            low,
            high,
            triangles,
            second: 0,
        });
        if leaf {
            return index;
        }
        let extent = minus(high, low);
        let longer = |a: usize, b: usize| if extent[b] > extent[a] { b } else { a };
        let axis = longer(longer(0, 1), 2);
        let vertices = &self.vertices;
        let center = |t: &[u32; 3]| {
            t.map(|v| vertices[v as usize][axis].to_f64())
                .iter()
                .sum::<f64>()
        };
        self.triangles[range.clone()].sort_by(|a, b| center(a).total_cmp(&center(b)));
        let middle = range.start + range.len() / 2;
        self.build(range.start..middle);
        self.nodes[index].second = self.build(middle..range.end);
        index
    }

    /// Distance of the nearest hit, in units of the direction's length.
    fn closest(&self, origin: V<T>, direction: V<T>, stack: &mut Vec<usize>) -> Option<T> {
        let mut nearest = T::MAX;
        stack.clear();
        stack.push(0);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            if !node.is_hit(origin, direction, nearest) {
                continue;
            }
            if node.triangles.is_empty() {
                stack.extend([node.second, index + 1]);
            }
            for triangle in &self.triangles[node.triangles.clone()] {
                if let Some(t) = self.hit(*triangle, origin, direction)
                    && t < nearest
                {
                    nearest = t;
                }
            }
        }
        (nearest < T::MAX).then_some(nearest)
    }

    fn hit(&self, index: [u32; 3], origin: V<T>, direction: V<T>) -> Option<T> {
        let corners = self.corners(index).map(|corner| minus(corner, origin));
        let volume = |p: usize, q: usize| {
            if index[p] < index[q] {
                dot(cross(corners[p], corners[q]), direction)
            } else {
                T::ZERO - dot(cross(corners[q], corners[p]), direction)
            }
        };
        let volumes = [volume(1, 2), volume(2, 0), volume(0, 1)];
        let inside = volumes.iter().all(|v| *v >= T::ZERO) || volumes.iter().all(|v| *v <= T::ZERO);
        let [a, b, c] = corners;
        let normal = cross(minus(b, a), minus(c, a));
        let slope = dot(normal, direction);
        if !inside || slope == T::ZERO {
            return None;
        }
        Some(dot(normal, a) / slope).filter(|t| *t > T::ZERO)
    }
}

impl<T: Real> Node<T> {
    fn is_hit(&self, origin: V<T>, direction: V<T>, nearest: T) -> bool {
        let (mut enter, mut leave) = (T::ZERO, nearest);
        for axis in 0..3 {
            if direction[axis] == T::ZERO {
                if origin[axis] < self.low[axis] || origin[axis] > self.high[axis] {
                    return false;
                }
                continue;
            }
            let at = |plane: T| (plane - origin[axis]) / direction[axis];
            let (a, b) = (at(self.low[axis]), at(self.high[axis]));
            let (first, last) = if a < b { (a, b) } else { (b, a) };
            enter = if first > enter { first } else { enter };
            leave = if last * T::PADDED < leave {
                last * T::PADDED
            } else {
                leave
            };
        }
        enter <= leave
    }
}

/// Results of one arithmetic at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// The arithmetic.
    pub arithmetic: &'static str,
    /// Distance from the origin on the diagonal's axes, metres.
    pub at_m: f64,
    /// Rays whose answer is certain.
    pub rays: u64,
    /// Percentage of these that hit instead of missing, or miss instead of hitting.
    pub wrong_pct: f64,
    /// 99th percentile of the relative error of the distance, parts per million.
    pub distance_ppm: f64,
    /// Time relative to double precision.
    pub time_ratio: f64,
}

/// Names of the arithmetics. Times are relative to the first.
pub const ARITHMETICS: [&str; 4] = [
    "double precision",
    "single precision",
    "single, recentred",
    "tracegen rays (single, recentred)",
];

/// Traces `count` rays against a mesh whose centre is at `(at_m, 0.7 at_m, -0.9 at_m)`.
///
/// # Panics
/// If the mesh has too many triangles for a hierarchy.
pub fn measure(mesh: &TestMesh, at_m: f64, count: usize) -> [Precision; 4] {
    /// Displacement that rounding to single precision may cause, as in the tests of `rays`.
    const TOLERANCE: f64 = 1e-5;
    let place = DVec3::new(1.0, 0.7, -0.9) * at_m;
    let mut random = Random(11);
    let reference = Reference::new(mesh);
    // Rays from outside, at random points, at vertices and at edges, in double precision.
    let rays: Vec<(DVec3, DVec3)> = (0..count)
        .map(|i| {
            let origin =
                random.in_ball().normalize_or(glam::Vec3::X) * (18.0 + 10.0 * random.unit());
            let corners = mesh.corners(random.below(mesh.triangles.len()));
            let aim = match i % 3 {
                0 => random.in_ball().as_dvec3() * 12.0,
                1 => corners[random.below(3)],
                _ => corners[0].lerp(corners[1], f64::from(random.unit())),
            };
            (
                origin.as_dvec3(),
                (aim - origin.as_dvec3()).normalize_or(DVec3::Z),
            )
        })
        .collect();
    let verdicts: Vec<Verdict> = (rays.iter())
        .map(|(origin, direction)| reference.verdict(*origin, *direction, TOLERANCE))
        .collect();
    let moved = mesh.translated(place);
    let answers = [
        traced::<f64>(&moved, &rays, place),
        traced::<f32>(&moved, &rays, place),
        traced::<f32>(
            &moved.translated(-moved.center()),
            &rays,
            place - moved.center(),
        ),
        traced_by_rays(&moved, &rays, place),
    ];
    let reference_time = answers[0].1.as_secs_f64().max(1e-9);
    std::array::from_fn(|index| {
        let (found, time) = &answers[index];
        let (mut known, mut wrong, mut off) = (0_u64, 0_u64, Vec::new());
        for (verdict, found) in verdicts.iter().zip(found) {
            let hits = match verdict {
                Verdict::Borderline => continue,
                Verdict::Hit(_) => true,
                Verdict::Miss => false,
            };
            known += 1;
            wrong += u64::from(found.is_some() != hits);
            if let (Verdict::Hit(Some((distance, _))), Some(found)) = (verdict, found) {
                off.push((found / distance - 1.0).abs() * 1e6);
            }
        }
        off.sort_by(f64::total_cmp);
        let p99 = off.get(off.len().saturating_sub(1) * 99 / 100);
        Precision {
            arithmetic: ARITHMETICS[index],
            at_m,
            rays: known,
            wrong_pct: 100.0 * wrong as f64 / known.max(1) as f64,
            distance_ppm: p99.copied().unwrap_or(0.0),
            time_ratio: time.as_secs_f64() / reference_time,
        }
    })
}

/// Distances by ray, and the time of the fastest of five passes.
type Answers = (Vec<Option<f64>>, Duration);

fn fastest(mut pass: impl FnMut() -> Vec<Option<f64>>) -> Answers {
    let mut best = Duration::MAX;
    let mut found = Vec::new();
    for _ in 0..5 {
        let start = Instant::now();
        found = pass();
        best = best.min(start.elapsed());
    }
    (found, best)
}

fn traced<T: Real>(mesh: &TestMesh, rays: &[(DVec3, DVec3)], place: DVec3) -> Answers {
    let tree = Tree::<T>::new(mesh);
    let rays: Vec<(V<T>, V<T>)> = (rays.iter())
        .map(|(origin, direction)| (rounded(*origin + place), rounded(*direction)))
        .collect();
    let mut stack = Vec::new();
    fastest(|| {
        let hits = rays.iter().map(|(origin, direction)| {
            Some(tree.closest(*origin, *direction, &mut stack)?.to_f64())
        });
        hits.collect()
    })
}

/// The ray tracer of `rays`, on a mesh recentred in the same way as scenes.
fn traced_by_rays(mesh: &TestMesh, rays: &[(DVec3, DVec3)], place: DVec3) -> Answers {
    let center = mesh.center();
    let bvh = Bvh::build(&mesh.rounded(center), |_| false).expect("a test mesh is small");
    let rays: Vec<Ray> = (rays.iter())
        .map(|(origin, direction)| {
            Ray::new((*origin + place - center).as_vec3(), direction.as_vec3())
        })
        .collect();
    let mut stack = TraversalStack::default();
    fastest(|| {
        let hits = rays.iter().map(|ray| {
            let hit = bvh.closest(
                TraversalKind::Bvh2,
                ray,
                &mut stack,
                &mut NoCounter,
                &AllOpaque,
            );
            hit.map(|hit| f64::from(hit.t))
        });
        hits.collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_and_recentred_single_precision_are_correct_at_any_distance_and_plain_single_is_not() {
        let mesh = TestMesh::sphere(3);
        for at_m in [0.0, 1e6] {
            let [double, single, recentred, rays] = measure(&mesh, at_m, 600);
            assert!(double.rays > 400, "{double:?}");
            for right in [double, recentred, rays] {
                assert_eq!(right.wrong_pct, 0.0, "{right:?}");
                assert!(right.distance_ppm < 30.0, "{right:?}");
            }
            assert!(double.distance_ppm < 0.01, "{double:?}");
            assert_eq!(single.wrong_pct > 1.0, at_m > 0.0, "{single:?}");
        }
    }
}
