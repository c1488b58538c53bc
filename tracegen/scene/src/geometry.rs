//! Geometry that a file leaves out of a mesh (normals, tangents, the triangles of strips and fans),
//! and bounding boxes.

use crate::Mesh;
use glam::{Affine3A, Vec2, Vec3, Vec4};

/// Area-weighted vertex normals.
///
/// A vertex that no triangle of non-zero area uses gets +y.
pub fn vertex_normals(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i as usize]);
        // The cross product's length is twice the area, so the sum is area-weighted.
        let weighted = (b - a).cross(c - a);
        for &i in t {
            normals[i as usize] += weighted;
        }
    }
    for n in &mut normals {
        *n = unit_or(*n, Vec3::Y);
    }
    normals
}

/// Computes missing normals and tangents, and replaces those that are not unit vectors.
pub(crate) fn complete_vertices(mesh: &mut Mesh, normal_map_uv: Option<u32>) {
    if mesh.normals.is_empty() {
        mesh.normals = vertex_normals(&mesh.positions, &mesh.indices);
    } else if !mesh.normals.iter().all(|n| is_direction(*n)) {
        let computed = vertex_normals(&mesh.positions, &mesh.indices);
        for (n, computed) in mesh.normals.iter_mut().zip(computed) {
            if !is_direction(*n) {
                *n = computed;
            }
        }
    }
    for n in &mut mesh.normals {
        *n = n.normalize();
    }
    let usable = |t: &Vec4| t.is_finite() && is_direction(t.truncate());
    if mesh.tangents.is_empty() || !mesh.tangents.iter().all(usable) {
        mesh.tangents = match normal_map_uv {
            Some(1) if !mesh.uv1.is_empty() => {
                vertex_tangents(&mesh.positions, &mesh.normals, &mesh.uv1, &mesh.indices)
            }
            Some(_) => vertex_tangents(&mesh.positions, &mesh.normals, &mesh.uv0, &mesh.indices),
            // No texture reads these tangents, so any perpendicular will do.
            None => (mesh.normals.iter())
                .map(|n| n.any_orthonormal_vector().extend(1.0))
                .collect(),
        };
    }
}

/// True if a vector is long enough to have a direction and short enough to be measured.
fn is_direction(v: Vec3) -> bool {
    let length_squared = v.length_squared();
    length_squared > 1e-12 && length_squared.is_finite()
}

/// Lowest and highest coordinates. Without points, the box is inverted and infinite.
pub fn bounding_box(points: impl IntoIterator<Item = Vec3>) -> [Vec3; 2] {
    let empty = [Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY)];
    points
        .into_iter()
        .fold(empty, |[low, high], p| [low.min(p), high.max(p)])
}

/// [`bounding_box`] of transformed points. `object_box` is the box of the untransformed points.
///
/// If the transform maps axes to axes, only the box's corners are transformed. The result is the
/// same to the last bit, because adding zeros changes no rounding, and scaling and adding keep the
/// order of numbers.
pub fn transformed_box(points: &[Vec3], object_box: [Vec3; 2], transform: &Affine3A) -> [Vec3; 2] {
    let m = &transform.matrix3;
    let one_axis = |v: glam::Vec3A| v.cmpeq(glam::Vec3A::ZERO).bitmask().count_ones() >= 2;
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    if columns.into_iter().all(one_axis) && m.determinant() != 0.0 && !points.is_empty() {
        return bounding_box(object_box.map(|p| transform.transform_point3(p)));
    }
    bounding_box(points.iter().map(|p| transform.transform_point3(*p)))
}

/// The direction of `v`, even if its squared length overflows `f32`; `fallback` if it has none.
pub fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    if v.length_squared().is_normal() {
        return v.normalize_or(fallback);
    }
    (v / v.abs().max_element()).normalize_or(fallback)
}

/// Per-vertex tangents by accumulating each triangle's dP/du (Lengyel), made perpendicular to the
/// normal; w is the sign of the bitangent `cross(normal, tangent) * w`.
///
/// glTF's normal maps have +y up in the image while v grows downwards, so the bitangent points
/// against dP/dv and w is +1 where the image is not mirrored.
///
/// Where the texture coordinates define no direction, the tangent is an arbitrary perpendicular of
/// the normal.
pub fn vertex_tangents(
    positions: &[Vec3],
    normals: &[Vec3],
    uv: &[Vec2],
    indices: &[u32],
) -> Vec<Vec4> {
    let mut along_u = vec![Vec3::ZERO; positions.len()];
    let mut along_v = vec![Vec3::ZERO; positions.len()];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| i as usize);
        let (e1, e2) = (positions[b] - positions[a], positions[c] - positions[a]);
        let (d1, d2) = (uv[b] - uv[a], uv[c] - uv[a]);
        let area = d1.perp_dot(d2);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        // Multiplied by |area| instead of divided by area: larger triangles weigh more.
        let sign = area.signum();
        let (du, dv) = (
            (e1 * d2.y - e2 * d1.y) * sign,
            (e2 * d1.x - e1 * d2.x) * sign,
        );
        for i in [a, b, c] {
            along_u[i] += du;
            along_v[i] += dv;
        }
    }
    normals
        .iter()
        .zip(along_u.iter().zip(&along_v))
        .map(|(&n, (&u, &v))| {
            let t = (u - n * n.dot(u)).normalize_or_zero();
            if t == Vec3::ZERO {
                return n.any_orthonormal_vector().extend(1.0);
            }
            let sign = if n.cross(t).dot(v) > 0.0 { -1.0 } else { 1.0 };
            t.extend(sign)
        })
        .collect()
}

/// Three indices per triangle of a strip. Every other triangle is reversed to keep the winding.
pub fn triangulate_strip(strip: &[u32]) -> Vec<u32> {
    strip
        .windows(3)
        .enumerate()
        .flat_map(|(i, w)| match i % 2 {
            0 => [w[0], w[1], w[2]],
            _ => [w[1], w[0], w[2]],
        })
        .collect()
}

/// Three indices per triangle of a fan.
pub fn triangulate_fan(fan: &[u32]) -> Vec<u32> {
    let Some((&centre, rim)) = fan.split_first() else {
        return Vec::new();
    };
    rim.windows(2).flat_map(|w| [centre, w[0], w[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::Random;

    #[test]
    fn a_larger_triangle_weighs_more_in_a_vertex_normal() {
        let positions = [
            Vec3::ZERO,
            Vec3::X * 10.0,
            Vec3::Z * -10.0,
            Vec3::Z * -0.1,
            Vec3::Y * 0.1,
        ];
        let n = vertex_normals(&positions, &[0, 1, 2, 0, 3, 4])[0];
        assert!(n.y > 0.99, "{n}");
    }

    #[test]
    fn directions_of_tiny_and_huge_vectors_are_unit_vectors() {
        for scale in [1e-44, 1e-30, 1e-19, 1.0, 1e20, 1e38] {
            assert!(unit_or(Vec3::new(1.0, 2.0, 2.0) * scale, Vec3::Y).is_normalized());
        }
        for none in [
            Vec3::ZERO,
            Vec3::NAN,
            Vec3::INFINITY,
            Vec3::new(f32::INFINITY, 1.0, 0.0),
        ] {
            assert_eq!(unit_or(none, Vec3::Y), Vec3::Y);
        }
    }

    #[test]
    fn normals_of_degenerate_triangles_are_still_unit_vectors() {
        let n = vertex_normals(&[Vec3::ONE; 3], &[0, 1, 2]);
        assert!(n.iter().all(|n| n.is_normalized()));
    }

    #[test]
    fn the_tangent_follows_u_and_its_sign_marks_mirrored_coordinates() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let normals = [Vec3::Z; 3];
        let uv = [Vec2::Y, Vec2::ONE, Vec2::ZERO];
        let plain = vertex_tangents(&positions, &normals, &uv, &[0, 1, 2]);
        assert_eq!(plain[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
        let flipped = uv.map(|c| Vec2::new(c.x, 1.0 - c.y));
        let mirrored = vertex_tangents(&positions, &normals, &flipped, &[0, 1, 2]);
        assert_eq!(mirrored[0], Vec4::new(1.0, 0.0, 0.0, -1.0));
    }

    #[test]
    fn a_transformed_box_is_the_box_of_the_transformed_points_to_the_last_bit() {
        let mut source = Random(3);
        let mut random = || source.unit_f32() * 40.0 - 20.0;
        let axes = [
            Vec3::X,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Z,
        ];
        for i in 0..300 {
            let points: Vec<Vec3> = (0..9)
                .map(|_| Vec3::new(random(), random(), random()))
                .collect();
            let matrix = match i % 3 {
                // Axes map to axes, scaled and mirrored; or all to one plane; or arbitrarily.
                0 => {
                    let [a, b] = [axes[i % 6], axes[(i + 1) % 6]];
                    glam::Mat3::from_cols(a * random(), b * random(), a.cross(b) * random())
                }
                1 => glam::Mat3::from_cols(Vec3::X * random(), Vec3::X * random(), Vec3::Z),
                _ => glam::Mat3::from_rotation_x(random()) * glam::Mat3::from_rotation_y(random()),
            };
            let translation = Vec3::new(random(), random(), random());
            let transform = Affine3A::from_mat3_translation(matrix, translation);
            let expected = bounding_box(points.iter().map(|p| transform.transform_point3(*p)));
            let object_box = bounding_box(points.iter().copied());
            assert_eq!(transformed_box(&points, object_box, &transform), expected);
        }
        assert_eq!(
            transformed_box(&[], bounding_box([]), &Affine3A::IDENTITY),
            bounding_box([])
        );
    }

    #[test]
    fn strips_and_fans_keep_the_winding_of_their_first_triangle() {
        assert_eq!(triangulate_strip(&[0, 1, 2, 3]), [0, 1, 2, 2, 1, 3]);
        assert_eq!(triangulate_fan(&[0, 1, 2, 3]), [0, 1, 2, 0, 2, 3]);
        assert!(triangulate_fan(&[]).is_empty() && triangulate_strip(&[1, 2]).is_empty());
    }
}
