//! Computes a lower bound of the texture derivatives of a mesh in a view.
//!
//! The map from pixels to texture coordinates of a triangle is projective. The three lanes of a quad that
//! determine both derivatives therefore span the area, in texels,
//!
//! ```text
//! |du x dv| = A_uv / |det V| * w_a w_b w_c
//! ```
//!
//! where A_uv is twice the triangle's area in texels, V is a matrix with the vertices' clip x, y (in pixels)
//! and w as rows, and w_a, w_b, w_c are w on the triangle's plane at the lanes. The longer derivative is at
//! least the square root of this area in any norm. It is smallest where w is smallest, at the nearest point
//! of the triangle. This gives a lower bound for the level of detail before anything is drawn.

use glam::{Affine3A, DVec2, DVec3, Mat4, Vec2, Vec3};

/// Maximum distance in pixels from a covered lane to the other lanes of its quad, with a margin for the
/// rasteriser's grid.
const LANE_PX: f64 = 1.1;

/// A view and its size in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    /// World to clip space.
    pub clip_from_world: Mat4,
    /// Width and height.
    pub size_px: [u32; 2],
    /// Smallest w of visible geometry: the distance of the near plane in perspective, 1 in a parallel view.
    pub least_w: f32,
}

/// A lower bound of the squared length of the longer derivative, in units of `uv` per pixel, over all pixels
/// in which the view may sample the mesh. Infinity if there are none; 0 if no bound is known. Multiply it by
/// the number of texels of a texture (width times height) to get the bound in texels.
pub fn least_derivative_squared(
    positions: &[Vec3],
    indices: &[u32],
    uv: impl Fn(usize) -> Vec2,
    world_from_object: &Affine3A,
    pixels: &Pixels,
) -> f64 {
    let clip = pixels.clip_from_world * Mat4::from(*world_from_object);
    let half = DVec2::new(pixels.size_px[0].into(), pixels.size_px[1].into()) / 2.0;
    // Clip x and y in pixels, w, and one bit for each plane that the vertex is outside of.
    let vertices: Vec<(DVec3, u8)> = positions
        .iter()
        .map(|p| {
            let c = (clip * p.extend(1.0)).as_dvec4();
            let w = c.w;
            let planes = [w + c.x, w - c.x, w + c.y, w - c.y, c.z, w - c.z];
            // Margin of one pixel around the view, plus a margin for rounding.
            let margin =
                (1.0 / half.min_element() + 1e-4) * (c.x.abs() + c.y.abs() + c.z.abs() + w.abs());
            let outside = (0..6).map(|i| u8::from(planes[i] < -margin) << i).sum();
            (DVec3::new(c.x * half.x, c.y * half.y, w), outside)
        })
        .collect();
    let mut least = f64::INFINITY;
    for triangle in indices.chunks_exact(3) {
        let corners = [triangle[0], triangle[1], triangle[2]].map(|i| i as usize);
        let [Some(a), Some(b), Some(c)] = corners.map(|i| vertices.get(i)) else {
            return 0.0;
        };
        if a.1 & b.1 & c.1 != 0 {
            continue;
        }
        let [ua, ub, uc] = corners.map(|i| uv(i).as_dvec2());
        let area_uv = (ub - ua).perp_dot(uc - ua).abs();
        let bound = area_uv * spread([a.0, b.0, c.0], pixels.least_w.into());
        // NaN also means that no bound is known.
        least = if bound >= 0.0 { least.min(bound) } else { 0.0 };
        if least == 0.0 {
            break;
        }
    }
    least
}

/// Smallest `w_a w_b w_c / |det V|` of a triangle's quads.
fn spread([a, b, c]: [DVec3; 3], least_w: f64) -> f64 {
    let normals = [b.cross(c), c.cross(a), a.cross(b)];
    let det = a.dot(normals[0]).abs();
    if det == 0.0 {
        // A triangle that is seen edge-on covers no pixels.
        return f64::INFINITY;
    }
    // 1/w is linear in the picture. Compute its slopes, and its largest value where the triangle is visible.
    let slopes = (normals[0] + normals[1] + normals[2]) / det;
    let nearest = a.z.min(b.z).min(c.z).max(least_w);
    let largest = 1.0 / nearest + LANE_PX * (slopes.x.abs() + slopes.y.abs());
    1.0 / (det * largest.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::units;
    use glam::camera::rh::{
        proj::directx::{orthographic, perspective},
        view::look_at_mat4,
    };

    /// Texture coordinates where the ray through a pixel meets a triangle's plane; `None` if it does not.
    fn uv_at(
        view: &Pixels,
        triangle: &[Vec3; 3],
        uv: &[Vec2; 3],
        px: DVec2,
    ) -> Option<(DVec2, bool)> {
        let size = DVec2::new(view.size_px[0].into(), view.size_px[1].into());
        let ndc = px / size * 2.0 - 1.0;
        let world = view.clip_from_world.as_dmat4().inverse();
        let [from, to] = [0.0, 1.0].map(|depth| world.project_point3(ndc.extend(depth)));
        let [a, b, c] = triangle.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        let along = (to - from).dot(normal);
        let t = (a - from).dot(normal) / along;
        let p = from + t * (to - from);
        let weight =
            |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal) / normal.length_squared();
        let weights = [weight(b, c), weight(c, a), weight(a, b)];
        let [ua, ub, uc] = uv.map(|u| u.as_dvec2());
        let value = weights[0] * ua + weights[1] * ub + weights[2] * uc;
        let inside = weights.iter().all(|w| *w >= 0.0) && (0.0..=1.0).contains(&t);
        value.is_finite().then_some((value, inside))
    }

    #[test]
    fn the_bound_is_below_the_derivatives_of_random_triangles_and_often_close() {
        let mut random = units(11);
        let look = look_at_mat4(Vec3::new(0.3, 1.0, 0.0), Vec3::new(0.0, 0.8, -1.0), Vec3::Y);
        let views = [
            (perspective(1.5, 0.9, 0.1, 50.0), 0.1),
            (orthographic(-4.0, 4.0, -4.0, 4.0, 0.0, 30.0), 1.0),
        ]
        .map(|(projection, least_w)| Pixels {
            clip_from_world: projection * look,
            size_px: [90, 100],
            least_w,
        });
        let (mut quads, mut near) = (0, 0);
        for number in 0..4000 {
            let view = &views[number % 2];
            let center = Vec3::new(4.0 * random() - 2.0, 2.0 * random(), 1.0 - 12.0 * random());
            let size = 0.2 + 6.0 * random();
            let mut point = || center + (Vec3::new(random(), random(), random()) - 0.5) * size;
            let triangle = [point(), point(), point()];
            let uv = [(); 3].map(|()| Vec2::new(random(), random()) * 3.0);
            let bound = least_derivative_squared(
                &triangle,
                &[0, 1, 2],
                |i| uv[i],
                &Affine3A::IDENTITY,
                view,
            );
            let mut least = f64::INFINITY;
            for _ in 0..400 {
                let corner = DVec2::new(
                    (random() * 45.0).floor().into(),
                    (random() * 50.0).floor().into(),
                ) * 2.0
                    + 0.5;
                let lanes = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
                    .map(|lane| uv_at(view, &triangle, &uv, corner + DVec2::from_array(lane)));
                let [Some(a), Some(right), Some(below), Some(last)] = lanes else {
                    continue;
                };
                if [a, right, below, last].iter().any(|lane| lane.1) {
                    let longer = (right.0 - a.0)
                        .length_squared()
                        .max((below.0 - a.0).length_squared());
                    quads += 1;
                    assert!(
                        longer >= bound * (1.0 - 1e-4),
                        "{longer} {bound} in {number}"
                    );
                    least = least.min(longer);
                }
            }
            near += usize::from(least < 16.0 * bound);
        }
        assert!(
            quads > 20_000 && near > 200,
            "{quads} quads, {near} near their bound"
        );
    }

    #[test]
    fn the_bound_of_a_wall_follows_from_its_distance() {
        let view = Pixels {
            clip_from_world: perspective(std::f32::consts::FRAC_PI_2, 1.0, 0.1, 50.0),
            size_px: [100, 100],
            least_w: 0.1,
        };
        // 50 pixels per metre at 1 m; one unit of texture coordinates per metre.
        for distance in [2.0_f32, 4.0, 8.0] {
            let wall =
                [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]].map(|[x, y]| Vec3::new(x, y, -distance));
            let bound = least_derivative_squared(
                &wall,
                &[0, 1, 2],
                |i| wall[i].truncate(),
                &Affine3A::IDENTITY,
                &view,
            );
            let expected = (f64::from(distance) / 50.0).powi(2);
            assert!((bound / expected - 1.0).abs() < 1e-3, "{bound} {expected}");
        }
        let behind = [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)];
        let bound = least_derivative_squared(
            &behind,
            &[0, 1, 2],
            |_| Vec2::ONE,
            &Affine3A::IDENTITY,
            &view,
        );
        assert_eq!(bound, f64::INFINITY);
    }

    #[test]
    fn constant_texture_coordinates_have_a_bound_of_zero() {
        let view = Pixels {
            clip_from_world: Mat4::IDENTITY,
            size_px: [64, 64],
            least_w: 1.0,
        };
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let of = |uv: Vec2| {
            least_derivative_squared(&triangle, &[0, 1, 2], |_| uv, &Affine3A::IDENTITY, &view)
        };
        assert_eq!(of(Vec2::ONE), 0.0);
        assert_eq!(of(Vec2::NAN), 0.0);
    }
}
