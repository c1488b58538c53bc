//! Finds out which of several nested volumes are looked up, to skip invisible shadow cascades.

use crate::frustum::frustum_planes;
use glam::{Affine3A, Mat4, Vec3, Vec4};

/// A volume around the head. A look-up at a point uses the finest volume that contains the point.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// World to the volume's clip space.
    pub clip_from_world: Mat4,
    /// Distance from the side planes, in clip space, ...
    pub margin: f32,
    /// ... and from the far plane. A point inside by these distances is certainly looked up in this volume or
    /// in a finer one.
    pub end_margin: f32,
}

/// Determines for each of `volumes`, the finest first, whether it may be looked up at a triangle that is
/// visible in `clip_from_world`. True in doubt, as for coordinates with NaN.
#[derive(Clone, Debug)]
pub struct Receivers {
    view: [Vec4; 6],
    /// Side planes of each volume.
    sides: Vec<[Vec4; 4]>,
    /// For each volume, the planes of the space in which points are certainly inside.
    insides: Vec<[Vec4; 5]>,
    /// Whether each volume was found so far.
    found: Vec<bool>,
}

/// Position of a point: for the view and for each volume, one bit per plane that the point is outside of; one
/// bit per volume that certainly contains it.
#[derive(Clone, Copy)]
struct PointCode {
    outside_view: u8,
    outside: u32,
    inside: u32,
}

/// Maximum number of volumes.
const MAX_VOLUMES: usize = 8;

impl Receivers {
    /// Starts with no volume found.
    ///
    /// # Panics
    /// More than 8 volumes.
    pub fn new(volumes: &[Volume]) -> Self {
        assert!(
            volumes.len() <= MAX_VOLUMES,
            "at most {MAX_VOLUMES} volumes"
        );
        let planes = |volume: &Volume| frustum_planes(volume.clip_from_world);
        let inner = |volume: &Volume| {
            // Planes of an orthographic clip space, moved inwards.
            let [left, right, bottom, top, _, far] = planes(volume);
            let sides = [left, right, bottom, top].map(|plane| plane - Vec4::W * volume.margin);
            let [left, right, bottom, top] = sides;
            [left, right, bottom, top, far - Vec4::W * volume.end_margin]
        };
        Self {
            view: [Vec4::ZERO; 6],
            sides: volumes
                .iter()
                .map(planes)
                .map(|[l, r, b, t, ..]| [l, r, b, t])
                .collect(),
            insides: volumes.iter().map(inner).collect(),
            found: vec![false; volumes.len()],
        }
    }

    /// Continues with another view.
    pub fn look(&mut self, clip_from_world: Mat4) {
        self.view = frustum_planes(clip_from_world);
    }

    /// Whether every volume has been found.
    pub fn all(&self) -> bool {
        self.found.iter().all(|found| *found)
    }

    /// Whether each volume has been found so far.
    pub fn found(&self) -> &[bool] {
        &self.found
    }

    /// Adds a mesh with the given world-space bounds.
    pub fn add(
        &mut self,
        bounds: [Vec3; 2],
        positions: &[Vec3],
        indices: &[u32],
        world_from_object: &Affine3A,
    ) {
        let [low, high] = bounds;
        let corner = |i: u8| {
            let high_on = [i & 1 != 0, i & 2 != 0, i & 4 != 0];
            Vec3::select(high_on.into(), high, low)
        };
        let places: Vec<PointCode> = (0..8).map(|i| self.place(corner(i), 0.0)).collect();
        if !self.is_new(&places) {
            return;
        }
        let m = &world_from_object.matrix3;
        let places: Vec<PointCode> = positions
            .iter()
            .map(|p| {
                // Rounding errors of the world position are proportional to the magnitude of its terms.
                let terms = Vec3::from(m.x_axis.abs()) * p.x.abs()
                    + Vec3::from(m.y_axis.abs()) * p.y.abs()
                    + Vec3::from(m.z_axis.abs()) * p.z.abs()
                    + Vec3::from(world_from_object.translation.abs());
                self.place(world_from_object.transform_point3(*p), terms.max_element())
            })
            .collect();
        let anywhere = PointCode {
            outside_view: 0,
            outside: 0,
            inside: 0,
        };
        let at = |index: u32| places.get(index as usize).copied().unwrap_or(anywhere);
        for triangle in indices.chunks_exact(3) {
            let corners = [at(triangle[0]), at(triangle[1]), at(triangle[2])];
            if self.is_new(&corners) {
                self.find(&corners);
                if self.all() {
                    return;
                }
            }
        }
    }

    /// Whether the hull of `places` may be looked up in a volume that has not been found.
    fn is_new(&self, places: &[PointCode]) -> bool {
        (self.looked_up(places) & self.missing()) != 0
    }

    fn find(&mut self, places: &[PointCode]) {
        let bits = self.looked_up(places);
        for (number, found) in self.found.iter_mut().enumerate() {
            *found |= bits >> number & 1 == 1;
        }
    }

    fn missing(&self) -> u32 {
        (0..)
            .zip(&self.found)
            .map(|(bit, found)| u32::from(!found) << bit)
            .sum()
    }

    /// One bit per volume in which the hull of `places` may be looked up.
    fn looked_up(&self, places: &[PointCode]) -> u32 {
        let outside_view = places.iter().fold(!0, |all, p| all & p.outside_view);
        if outside_view != 0 {
            return 0;
        }
        let outside = places.iter().fold(!0, |all, p| all & p.outside);
        let inside = places.iter().fold(!0, |all, p| all & p.inside);
        let mut bits = 0;
        for number in 0..self.found.len() {
            if outside >> (4 * number) & 15 == 0 {
                bits |= 1 << number;
            }
            if inside >> number & 1 == 1 {
                // All points are looked up in this volume or a finer one.
                break;
            }
        }
        bits
    }

    fn place(&self, point: Vec3, terms: f32) -> PointCode {
        let distance = |plane: &Vec4| plane.truncate().dot(point) + plane.w;
        // For rounding of these sums and in the shader.
        let rounding = |plane: &Vec4| {
            let magnitude = plane
                .truncate()
                .abs()
                .dot(point.abs().max(Vec3::splat(terms)));
            1e-5 * (magnitude + plane.w.abs())
        };
        let bits = |planes: &[Vec4]| {
            let outside = |plane: &Vec4| distance(plane) < -rounding(plane);
            (0..)
                .zip(planes)
                .map(|(bit, plane)| u32::from(outside(plane)) << bit)
                .sum::<u32>()
        };
        let inside =
            |planes: &[Vec4; 5]| planes.iter().all(|plane| distance(plane) > rounding(plane));
        PointCode {
            outside_view: bits(&self.view) as u8,
            outside: (0..)
                .zip(&self.sides)
                .map(|(n, sides)| bits(sides) << (4 * n))
                .sum(),
            inside: (0..)
                .zip(&self.insides)
                .map(|(n, planes)| u32::from(inside(planes)) << n)
                .sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::units;
    use glam::camera::rh::{
        proj::directx::{orthographic, perspective},
        view::look_at_mat4,
    };

    const MARGIN: f32 = 0.05;

    /// Nested squares with these half widths and distances ahead, seen from above.
    fn volumes(squares: &[(f32, f32)]) -> Vec<Volume> {
        let light = look_at_mat4(Vec3::ZERO, Vec3::NEG_Y, Vec3::Z);
        let volume = |&(z, half): &(f32, f32)| {
            let c = light.transform_point3(Vec3::new(0.0, 0.0, z));
            let projection = orthographic(
                c.x - half,
                c.x + half,
                c.y - half,
                c.y + half,
                -100.0,
                100.0,
            );
            Volume {
                clip_from_world: projection * light,
                margin: MARGIN,
                end_margin: 0.01,
            }
        };
        squares.iter().map(volume).collect()
    }

    fn view() -> Mat4 {
        perspective(1.2, 1.0, 0.1, 60.0) * look_at_mat4(Vec3::Y, Vec3::new(0.0, 1.0, -1.0), Vec3::Y)
    }

    fn found(volumes: &[Volume], triangles: &[Vec3]) -> Vec<bool> {
        let mut receivers = Receivers::new(volumes);
        receivers.look(view());
        let indices: Vec<u32> = (0..triangles.len() as u32).collect();
        let low = triangles.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = triangles
            .iter()
            .copied()
            .fold(Vec3::NEG_INFINITY, Vec3::max);
        receivers.add([low, high], triangles, &indices, &Affine3A::IDENTITY);
        receivers.found().to_vec()
    }

    #[test]
    fn a_far_volume_is_looked_up_only_where_no_finer_one_contains_the_visible_point() {
        let volumes = volumes(&[(-2.0, 3.0), (-8.0, 10.0), (-30.0, 40.0)]);
        let at = |z: f32| {
            [
                Vec3::new(-0.3, 1.0, z),
                Vec3::new(0.3, 1.0, z),
                Vec3::new(0.0, 1.4, z),
            ]
        };
        assert_eq!(found(&volumes, &at(-2.0)), [true, false, false]);
        assert_eq!(found(&volumes, &at(-9.0)), [false, true, false]);
        assert_eq!(found(&volumes, &at(-30.0)), [false, false, true]);
        // Within the margin of a side plane, both may be looked up.
        assert_eq!(found(&volumes, &at(-4.95)), [true, true, false]);
        // Points behind the viewer are invisible.
        assert_eq!(found(&volumes, &at(2.0)), [false; 3]);
        // A triangle across all volumes.
        let long = [
            Vec3::new(0.0, 0.9, -1.0),
            Vec3::new(0.2, 0.9, -1.0),
            Vec3::new(0.0, 0.9, -50.0),
        ];
        assert_eq!(found(&volumes, &long), [true; 3]);
        assert_eq!(found(&volumes, &[Vec3::NAN; 3]), [true; 3]);
    }

    #[test]
    fn every_visible_point_is_looked_up_in_a_found_volume() {
        let mut random = units(3);
        let (mut looked_up, mut unused) = (0, 0);
        for _ in 0..3000 {
            let volumes = volumes(&[
                (-2.0, 1.0 + 3.0 * random()),
                (-9.0, 6.0 + 4.0 * random()),
                (-25.0, 35.0),
            ]);
            let center = Vec3::new(8.0 * random() - 4.0, 2.0 * random(), -30.0 * random());
            let size = 6.0 * random();
            let mut point = || center + (Vec3::new(random(), random(), random()) - 0.5) * size;
            let triangle = [point(), point(), point()];
            let found = found(&volumes, &triangle);
            unused += found.iter().filter(|f| !**f).count();
            for _ in 0..20 {
                let (a, b) = (random(), random());
                let (a, b) = if a + b > 1.0 {
                    (1.0 - a, 1.0 - b)
                } else {
                    (a, b)
                };
                let p =
                    triangle[0] + a * (triangle[1] - triangle[0]) + b * (triangle[2] - triangle[0]);
                let seen = view().project_point3(p);
                let ahead = (view() * p.extend(1.0)).w > 0.0;
                if !(ahead
                    && seen.truncate().abs().max_element() < 1.0
                    && (0.0..1.0).contains(&seen.z))
                {
                    continue;
                }
                // A look-up uses the finest volume that contains the point. The boundary may be anywhere
                // within the margin.
                let line = 1.0 - MARGIN * random();
                let holds = |v: &Volume| {
                    let q = v.clip_from_world.project_point3(p);
                    q.truncate().abs().max_element() < line
                };
                if let Some(number) = volumes.iter().position(holds) {
                    looked_up += 1;
                    assert!(found[number], "{p} in {number}: {found:?}");
                }
            }
        }
        assert!(
            looked_up > 1000 && unused > 1000,
            "{looked_up} lookups, {unused} volumes without"
        );
    }
}
