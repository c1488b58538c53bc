//! What a file leaves out of a mesh: normals, tangents, and the triangles of strips and fans.

use glam::{Vec2, Vec3, Vec4};

/// Area-weighted vertex normals.
///
/// A vertex that no triangle of non-zero area uses gets +y.
#[must_use]
pub fn vertex_normals(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i as usize]);
        // The cross product's length is twice the area: the weight comes for free.
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

/// The direction of `v`, also where its length squared is beyond `f32`; `fallback` where it has none.
#[must_use]
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
/// Where the texture coordinates say nothing, the tangent is some perpendicular of the normal.
#[must_use]
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

/// Three indices a triangle from a strip; every other triangle is turned to keep the winding.
#[must_use]
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

/// Three indices a triangle from a fan.
#[must_use]
pub fn triangulate_fan(fan: &[u32]) -> Vec<u32> {
    let Some((&centre, rim)) = fan.split_first() else {
        return Vec::new();
    };
    rim.windows(2).flat_map(|w| [centre, w[0], w[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_tangent_follows_u_and_its_sign_tells_mirrored_coordinates() {
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
    fn strips_and_fans_keep_the_winding_of_their_first_triangle() {
        assert_eq!(triangulate_strip(&[0, 1, 2, 3]), [0, 1, 2, 2, 1, 3]);
        assert_eq!(triangulate_fan(&[0, 1, 2, 3]), [0, 1, 2, 0, 2, 3]);
        assert!(triangulate_fan(&[]).is_empty() && triangulate_strip(&[1, 2]).is_empty());
    }
}
