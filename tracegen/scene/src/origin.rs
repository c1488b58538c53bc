//! The point that a scene's coordinates are relative to.
//!
//! Renderers calculate in single precision, whose steps grow with the distance from zero: a metre
//! at 10^7 m. Loaders therefore read positions in double precision and subtract a point near the
//! scene before rounding. A scene near zero keeps the origin zero, so its coordinates are
//! unchanged.

use crate::{Instance, Mesh};
use glam::{Affine3A, DAffine3, DVec3, Vec3};

/// A scene is moved if its middle is further from zero than this many of its half extents. At most
/// five bits of single precision are then lost to its position.
const FAR: f64 = 16.0;

/// The origin for points within `[low, high]`: zero, or the middle if that is far from zero.
///
/// It lies on a grid of powers of two with a spacing of half of the extent. A scene moved by
/// multiples of that spacing therefore gets identical coordinates at every position, and
/// subtracting the origin from 32-bit numbers is exact.
pub(crate) fn of([low, high]: [DVec3; 2]) -> DVec3 {
    let half = (high - low).max_element() / 2.0;
    let middle = (low + high) / 2.0;
    let is_far = middle.abs().max_element() > FAR * half;
    if !(half.is_normal() && middle.is_finite() && is_far) {
        return DVec3::ZERO;
    }
    let grid = power_of_two_above(half);
    (middle / grid).round() * grid
}

/// The least power of two greater than a positive normal number.
fn power_of_two_above(value: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits((value.to_bits() & EXPONENT) + (1 << 52))
}

/// A point relative to the origin, rounded only at the end.
pub(crate) fn relative(point: DVec3, origin: DVec3) -> Vec3 {
    (point - origin).as_vec3()
}

/// A transform to the world, made relative to the origin and rounded only at the end.
pub(crate) fn relative_transform(mut transform: DAffine3, origin: DVec3) -> Affine3A {
    transform.translation -= origin;
    transform.as_affine3a()
}

/// The result of [`place`].
pub(crate) struct Placed {
    pub origin: DVec3,
    pub instances: Vec<Instance>,
    /// The offset by which each mesh's positions were moved.
    pub own: Vec<DVec3>,
}

/// Chooses the origin of placed meshes (each a mesh and its transform to the world) and makes
/// instances relative to it.
///
/// If the scene is moved, meshes whose vertices are far from their own zero are moved as well.
/// Otherwise large vertex coordinates would combine with large translations. Moving them is exact.
pub(crate) fn place(meshes: &mut [Mesh], placed: &[(usize, DAffine3)]) -> Placed {
    let boxes: Vec<[DVec3; 2]> = (meshes.iter())
        .map(|mesh| mesh.bounds().map(|corner| corner.as_dvec3()))
        .collect();
    let corners_in_world = (placed.iter())
        .filter(|(mesh, _)| boxes[*mesh][0].is_finite())
        .flat_map(|(mesh, transform)| {
            corners(boxes[*mesh]).map(|corner| transform.transform_point3(corner))
        });
    let origin = of(bounds(corners_in_world));
    let mut own = vec![DVec3::ZERO; meshes.len()];
    if origin != DVec3::ZERO {
        for ((own, mesh), bounds) in own.iter_mut().zip(meshes).zip(boxes) {
            *own = of(bounds);
            for position in &mut mesh.positions {
                *position = relative(position.as_dvec3(), *own);
            }
        }
    }
    let instance = |&(mesh, mut transform): &(usize, DAffine3)| {
        transform.translation += transform.matrix3 * own[mesh];
        Instance {
            mesh,
            transform: relative_transform(transform, origin),
        }
    };
    Placed {
        origin,
        instances: placed.iter().map(instance).collect(),
        own,
    }
}

/// The corners of a box.
pub(crate) fn corners([low, high]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |corner| {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low } else { high }[axis];
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// Bounds of points in double precision, for [`of`].
pub(crate) fn bounds(points: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    (points.into_iter()).fold(empty, |[low, high], p| [low.min(p), high.max(p)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(middle: DVec3, half: f64) -> [DVec3; 2] {
        [middle - half, middle + half]
    }

    #[test]
    fn a_scene_near_zero_keeps_its_coordinates() {
        for (middle, half) in [
            (DVec3::ZERO, 1.0),
            (DVec3::new(16.0, -3.0, 0.0), 1.0),
            (DVec3::new(0.0, 1e5, 0.0), 1e4),
            (DVec3::splat(1e-6), 1e-7),
        ] {
            assert_eq!(of(around(middle, half)), DVec3::ZERO, "{middle} {half}");
        }
        for nothing in [
            [DVec3::INFINITY, DVec3::NEG_INFINITY],
            around(DVec3::ONE, 0.0),
            around(DVec3::NAN, 1.0),
            around(DVec3::ZERO, f64::INFINITY),
        ] {
            assert_eq!(of(nothing), DVec3::ZERO, "{nothing:?}");
        }
    }

    #[test]
    fn a_scene_far_from_zero_has_its_origin_in_its_middle_at_any_scale() {
        for exponent in [-40, -20, 0, 20, 40] {
            let scale = 2f64.powi(exponent);
            for far in [1e3, 1e5, 1e6, 1e7, -1e7] {
                let middle = DVec3::new(far, 0.25, -2.0 * far) * scale;
                let expected = DVec3::new(far, 0.0, -2.0 * far) * scale;
                assert_eq!(of(around(middle, scale)), expected, "{far} x {scale}");
            }
        }
    }

    #[test]
    fn meshes_moved_by_their_vertices_or_by_their_node_are_equal() {
        let triangle = [Vec3::new(-1.0, 0.0, 0.5), Vec3::X, Vec3::Y];
        let far = Vec3::new(1e5, -1e5, 3e5);
        let mesh = |offset: Vec3| Mesh {
            positions: triangle.map(|p| p + offset).to_vec(),
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let mut meshes = [mesh(far), mesh(Vec3::ZERO)];
        let baked = DAffine3::IDENTITY;
        let moved = DAffine3::from_translation(far.as_dvec3());
        let Placed {
            origin, instances, ..
        } = place(&mut meshes, &[(0, baked), (1, moved)]);
        assert_eq!(origin, far.as_dvec3());
        assert_eq!(meshes[1].positions, triangle);
        for instance in &instances {
            let points = meshes[instance.mesh].positions.iter();
            let placed: Vec<Vec3> = points
                .map(|p| instance.transform.transform_point3(*p))
                .collect();
            assert_eq!(placed, triangle);
        }
        // At zero nothing changes, wherever the mesh's vertices are.
        let mut meshes = [mesh(Vec3::splat(64.0)), mesh(Vec3::ZERO)];
        let placed = place(&mut meshes, &[(0, baked), (1, baked)]);
        assert_eq!(placed.origin, DVec3::ZERO);
        assert_eq!(meshes[0].positions[1], Vec3::X + 64.0);
    }
}
