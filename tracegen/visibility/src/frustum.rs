//! Tests of frusta.

use glam::{Mat4, Vec3, Vec4};

/// Indices of the world-space bounds that are not completely outside one plane of the frustum.
///
/// The test is conservative: invisible bounds may be included, as are bounds with NaN.
pub fn visible(bounds: impl IntoIterator<Item = [Vec3; 2]>, clip_from_world: Mat4) -> Vec<u32> {
    let planes = frustum_planes(clip_from_world);
    (0_u32..)
        .zip(bounds)
        .filter(|(_, bounds)| !planes.iter().any(|plane| outside(*plane, *bounds)))
        .map(|(index, _)| index)
        .collect()
}

/// Restricts clip space to a region of a view of `size_px`. `crop(..) * clip_from_world` is the clip matrix
/// of the region enlarged by one pixel, because vertices are rounded to the rasteriser's grid.
pub fn crop(origin_px: [u32; 2], region_px: [u32; 2], size_px: [u32; 2]) -> Mat4 {
    let axis = |axis: usize| {
        let ndc = |px: f32| 2.0 * px / size_px[axis] as f32 - 1.0;
        let low = ndc(origin_px[axis] as f32 - 1.0);
        let high = ndc((origin_px[axis] + region_px[axis]) as f32 + 1.0);
        [2.0 / (high - low), -(high + low) / (high - low)]
    };
    let ([x_scale, x_shift], [y_scale, y_shift]) = (axis(0), axis(1));
    // Rows of pixels are numbered downwards; clip space points upwards.
    Mat4::from_cols(
        Vec4::new(x_scale, 0.0, 0.0, 0.0),
        Vec4::new(0.0, y_scale, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(x_shift, -y_shift, 0.0, 1.0),
    )
}

/// Planes whose positive side is inside, from the rows of the matrix (Gribb and Hartmann 2001).
pub(crate) fn frustum_planes(clip_from_world: Mat4) -> [Vec4; 6] {
    let row = |i| clip_from_world.row(i);
    [
        row(3) + row(0),
        row(3) - row(0),
        row(3) + row(1),
        row(3) - row(1),
        row(2),
        row(3) - row(2),
    ]
}

fn outside(plane: Vec4, [lo, hi]: [Vec3; 2]) -> bool {
    let normal = plane.truncate();
    let nearest = Vec3::select(normal.cmpge(Vec3::ZERO), hi, lo);
    let terms = normal * nearest;
    // A margin for rounding of this sum and in the vertex shader.
    let margin = 1e-5 * (terms.abs().element_sum() + plane.w.abs());
    terms.element_sum() + plane.w < -margin
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::Random;
    #[test]
    fn only_boxes_wholly_outside_a_plane_are_skipped() {
        let clip = glam::camera::rh::proj::directx::perspective(1.0, 1.0, 0.1, 100.0);
        let unit = |center: Vec3| [center - Vec3::ONE, center + Vec3::ONE];
        let boxes = [
            unit(Vec3::new(0.0, 0.0, 5.0)),
            unit(Vec3::new(0.0, 0.0, -5.0)),
            unit(Vec3::new(50.0, 0.0, -5.0)),
            unit(Vec3::new(0.0, 0.0, -200.0)),
            [Vec3::splat(-500.0), Vec3::splat(500.0)],
            [Vec3::splat(f32::NAN), Vec3::splat(f32::NAN)],
        ];
        assert_eq!(visible(boxes, clip), [1, 4, 5]);
    }

    #[test]
    fn a_point_is_visible_in_its_region_and_not_in_a_distant_one() {
        let clip = glam::camera::rh::proj::directx::perspective(1.2, 1.5, 0.1, 50.0);
        let size_px = [300, 200];
        let mut source = Random(5);
        let mut random = |below: u32| source.below(below);
        for _ in 0..2000 {
            let pixel = [random(300), random(200)];
            let center = [0, 1].map(|axis| (pixel[axis] as f32 + 0.5) / size_px[axis] as f32);
            let ndc = Vec3::new(2.0 * center[0] - 1.0, 1.0 - 2.0 * center[1], 0.9);
            let point = clip.inverse().project_point3(ndc);
            let seen = |origin_px: [u32; 2], region_px: [u32; 2]| {
                let cropped = crop(origin_px, region_px, size_px) * clip;
                visible([[point; 2]], cropped) == [0]
            };
            assert!(seen(pixel, [1, 1]), "{pixel:?}");
            assert!(seen([0, pixel[1]], [300, 1]), "{pixel:?}");
            assert_eq!(seen([0, 0], [300, 16]), pixel[1] <= 16, "{pixel:?}");
            assert_eq!(
                seen([100, 0], [300 - 100, 200]),
                pixel[0] >= 99,
                "{pixel:?}"
            );
        }
    }

    #[test]
    fn a_box_with_any_point_inside_is_never_skipped() {
        let clip = glam::camera::rh::proj::directx::perspective(1.2, 0.9, 0.1, 50.0)
            * glam::camera::rh::view::look_at_mat4(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y);
        let mut source = Random(1);
        let mut random = || source.unit_f32() * 40.0 - 20.0;
        let mut inside = 0;
        for _ in 0..2000 {
            let p = Vec3::new(random(), random(), random());
            let q = Vec3::new(random(), random(), random());
            let c = clip * p.extend(1.0);
            if c.x.abs() <= c.w && c.y.abs() <= c.w && c.z >= 0.0 && c.z <= c.w {
                inside += 1;
                assert_eq!(visible([[p.min(q), p.max(q)]], clip), [0]);
            }
        }
        assert!(inside > 50, "the test must see points inside, saw {inside}");
    }
}
