//! Tests whether any triangle of a mesh may be visible.

use crate::frustum::frustum_planes;
use glam::{Affine3A, Mat4, Vec3, Vec4};

/// False only if each triangle is completely outside one plane of the frustum. This is more exact than
/// testing the box around a mesh that spans the scene. True in doubt, as for coordinates with NaN.
pub fn any_inside(
    positions: &[Vec3],
    indices: &[u32],
    world_from_object: &Affine3A,
    clip_from_world: Mat4,
) -> bool {
    let planes = frustum_planes(clip_from_world);
    let outside: Vec<u8> = (positions.iter())
        .map(|p| planes_outside(&planes, world_from_object, *p))
        .collect();
    let at = |index: u32| outside.get(index as usize).copied().unwrap_or(0);
    (indices.chunks_exact(3)).any(|t| at(t[0]) & at(t[1]) & at(t[2]) == 0)
}

/// One bit per plane that the point is outside of.
fn planes_outside(planes: &[Vec4; 6], world_from_object: &Affine3A, p: Vec3) -> u8 {
    let m = &world_from_object.matrix3;
    let world = world_from_object.transform_point3(p);
    // Magnitude of the terms of `world`, to which the rounding errors are proportional.
    let terms = Vec3::from(m.x_axis.abs()) * p.x.abs()
        + Vec3::from(m.y_axis.abs()) * p.y.abs()
        + Vec3::from(m.z_axis.abs()) * p.z.abs()
        + Vec3::from(world_from_object.translation.abs());
    let mut bits = 0;
    for (bit, plane) in planes.iter().enumerate() {
        let normal = plane.truncate();
        // A margin for rounding of these sums and in the vertex shader.
        let margin = 1e-5 * (normal.abs().dot(terms) + plane.w.abs());
        bits |= u8::from(normal.dot(world) + plane.w < -margin) << bit;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::Random;
    use glam::camera::rh::{proj::directx::perspective, view::look_at_mat4};

    fn clip() -> Mat4 {
        perspective(1.2, 0.9, 0.1, 50.0)
            * look_at_mat4(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y)
    }

    #[test]
    fn a_mesh_around_the_frustum_without_a_triangle_inside_is_invisible() {
        let far_left = [
            Vec3::new(-90.0, 0.0, 0.0),
            Vec3::new(-90.0, 1.0, 0.0),
            Vec3::new(-91.0, 0.0, 1.0),
        ];
        let far_right = far_left.map(|p| p + Vec3::X * 180.0);
        let positions = [far_left, far_right].concat();
        let seen = |indices: &[u32]| any_inside(&positions, indices, &Affine3A::IDENTITY, clip());
        // The box around both triangles contains the whole view.
        assert!(!seen(&[0, 1, 2, 3, 4, 5]));
        // A triangle across the view.
        assert!(seen(&[0, 1, 3]));
    }

    #[test]
    fn meshes_with_a_point_in_view_or_nan_coordinates_are_visible() {
        let mut source = Random(1);
        let mut random = || source.unit_f32() * 40.0 - 20.0;
        let moved = Affine3A::from_rotation_y(0.7) * Affine3A::from_translation(Vec3::splat(3.0));
        let mut inside = 0;
        for _ in 0..4000 {
            let triangle = [(); 3].map(|()| Vec3::new(random(), random(), random()));
            let any = triangle.iter().any(|p| {
                let c = clip() * moved.transform_point3(*p).extend(1.0);
                c.x.abs() <= c.w && c.y.abs() <= c.w && c.z >= 0.0 && c.z <= c.w
            });
            if any {
                inside += 1;
                assert!(any_inside(&triangle, &[0, 1, 2], &moved, clip()));
            }
        }
        assert!(inside > 50, "the test must see points inside, saw {inside}");
        let nowhere = [Vec3::splat(f32::NAN); 3];
        assert!(any_inside(&nowhere, &[0, 1, 2], &moved, clip()));
    }
}
