//! Distances to what is seen of a scene, along single rays: a tree of boxes split at medians.

use super::super::Scene;
use glam::{Vec3, Vec3A};

/// Scenes with more triangles are not probed.
const MAX_TRIANGLES: usize = 1 << 22;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Surfaces along a vertical line.
const MAX_SURFACES: usize = 32;

/// Shares of the triangles, in one horizontal axis, between which columns stand.
const QUANTILES: [f32; 5] = [0.5, 0.3, 0.7, 0.15, 0.85];

/// A triangle, counter-clockwise from its front.
#[derive(Clone, Copy)]
struct Triangle {
    corners: [Vec3; 3],
    double_sided: bool,
}

/// A box around the triangles `first..first + count`. The first of two children follows it.
struct Node {
    low: Vec3A,
    high: Vec3A,
    first: u32,
    count: u32,
    /// Index of the second child; 0 for a leaf.
    second: u32,
}

/// A scene's triangles where they are at rest.
pub(super) struct Probe {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
    /// Horizontal positions by quantile.
    columns: [[f32; QUANTILES.len()]; 2],
    /// Ends of the scene in height.
    heights: [f32; 2],
}

/// A surface that a vertical line meets.
pub(super) struct Surface {
    pub y: f32,
    /// Whether one can stand on it.
    pub is_floor: bool,
}

impl Probe {
    /// `None` for a scene without triangles or with too many.
    pub fn new(scene: &Scene) -> Option<Self> {
        let count = usize::try_from(scene.triangle_count()).ok()?;
        if count == 0 || count > MAX_TRIANGLES {
            return None;
        }
        let mut triangles = Vec::with_capacity(count);
        for instance in &scene.instances {
            let mesh = scene.meshes.get(instance.mesh)?;
            let double_sided = scene
                .materials
                .get(mesh.material)
                .is_some_and(|m| m.double_sided);
            for indices in mesh.indices.chunks_exact(3) {
                let corner = |i: usize| {
                    let at = mesh.positions.get(indices[i] as usize)?;
                    Some(instance.transform.transform_point3(*at))
                };
                let mut corners = [corner(0)?, corner(1)?, corner(2)?];
                if instance.mirrored() {
                    corners.swap(1, 2);
                }
                triangles.push(Triangle {
                    corners,
                    double_sided,
                });
            }
        }
        let columns = [0, 2].map(|axis| {
            let mut middles: Vec<f32> = triangles.iter().map(|t| t.middle(axis)).collect();
            middles.sort_by(f32::total_cmp);
            QUANTILES.map(|share| middles[(share * (middles.len() - 1) as f32) as usize])
        });
        let (low, high) = scene.bounds()?;
        let mut probe = Self {
            nodes: Vec::new(),
            triangles,
            columns,
            heights: [low.y, high.y],
        };
        probe.split(0, probe.triangles.len());
        Some(probe)
    }

    /// Adds the tree of a range of triangles, which are sorted for it.
    fn split(&mut self, first: usize, count: usize) {
        let range = &mut self.triangles[first..first + count];
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in range.iter().flat_map(|t| t.corners) {
            (low, high) = (low.min(corner), high.max(corner));
        }
        let node = self.nodes.len();
        self.nodes.push(Node {
            low: low.into(),
            high: high.into(),
            first: first as u32,
            count: count as u32,
            second: 0,
        });
        if count <= LEAF {
            return;
        }
        let axis = (high - low).max_position();
        let half = count / 2;
        range.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
        self.split(first, half);
        self.nodes[node].second = self.nodes.len() as u32;
        self.split(first + half, count - half);
    }

    /// Horizontal positions, the most central first.
    pub fn columns(&self) -> impl Iterator<Item = [f32; 2]> {
        let [x, z] = self.columns;
        let mut places: Vec<[usize; 2]> = (0..QUANTILES.len())
            .flat_map(|i| (0..QUANTILES.len()).map(move |k| [i, k]))
            .collect();
        places.sort_by_key(|[i, k]| i + k);
        places.into_iter().map(move |[i, k]| [x[i], z[k]])
    }

    /// Surfaces along a vertical line from the top.
    pub fn surfaces_below(&self, x: f32, z: f32) -> Vec<Surface> {
        let [bottom, top] = self.heights;
        let range = (top - bottom).max(f32::MIN_POSITIVE);
        let step = range * 1e-5;
        let mut y = top + step;
        let mut surfaces = Vec::new();
        while surfaces.len() < MAX_SURFACES {
            let Some((distance, normal)) = self.hit(Vec3::new(x, y, z), Vec3::NEG_Y, true) else {
                break;
            };
            y -= distance;
            surfaces.push(Surface {
                y,
                is_floor: normal.y.abs() > 0.7 * normal.length(),
            });
            y -= step;
        }
        surfaces
    }

    /// Distance to what is seen in a direction of unit length.
    pub fn distance(&self, from: Vec3, direction: Vec3) -> Option<f32> {
        self.hit(from, direction, false)
            .map(|(distance, _)| distance)
    }

    /// Distance and normal of the nearest triangle; of those seen from their front, or of `all`.
    fn hit(&self, from: Vec3, direction: Vec3, all: bool) -> Option<(f32, Vec3)> {
        let (start, inverse) = (Vec3A::from(from), Vec3A::from(direction).recip());
        let mut nearest: Option<(f32, Vec3)> = None;
        let mut open = vec![0_u32];
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            let [a, b] = [node.low, node.high].map(|side| (side - start) * inverse);
            // NaN where the ray lies in a side: such a box counts as met.
            let (enter, leave) = (a.min(b), a.max(b));
            let most = nearest.map_or(f32::INFINITY, |(distance, _)| distance);
            let enter = enter.max_element().max(0.0);
            if enter > leave.min_element() * 1.000_01 || enter > most {
                continue;
            }
            if node.second > 0 {
                open.extend([node.second, index + 1]);
                continue;
            }
            let first = node.first as usize;
            for triangle in &self.triangles[first..first + node.count as usize] {
                let hit = triangle.hit(from, direction, all);
                let is_nearer =
                    |(distance, _): &(f32, Vec3)| nearest.is_none_or(|n| *distance < n.0);
                if let Some(hit) = hit.filter(is_nearer) {
                    nearest = Some(hit);
                }
            }
        }
        nearest
    }
}

impl Triangle {
    fn middle(&self, axis: usize) -> f32 {
        self.corners.iter().map(|corner| corner[axis] / 3.0).sum()
    }

    /// Distance and normal (Möller and Trumbore 1997).
    fn hit(&self, from: Vec3, direction: Vec3, all: bool) -> Option<(f32, Vec3)> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let facing = -direction.dot(normal);
        if facing == 0.0 || (facing < 0.0 && !all && !self.double_sided) {
            return None;
        }
        let offset = from - a;
        let across = offset.cross(direction);
        let (u, v) = (ac.dot(across) / facing, -ab.dot(across) / facing);
        let distance = offset.dot(normal) / facing;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
        (inside && distance.is_finite()).then_some((distance, normal))
    }
}
