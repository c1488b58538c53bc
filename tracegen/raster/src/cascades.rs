//! Cascaded shadow maps fitted to the head.
//!
//! Both eyes share one set of cascades, fitted to the union of their frusta, so that a world point
//! is shadowed from the same texels in both views. Each cascade is a square around the bounding
//! sphere of a slice of that union, snapped to its texel grid. It keeps its size when the head
//! turns, and its texels keep their positions in the world, so shadow edges are stable from frame
//! to frame.

use formats::view::EyeView;
use glam::camera::rh::{proj::directx::orthographic, view::look_at_mat4};
use glam::{Mat4, Vec3};

/// Edge length of a shadow cascade in texels (Z2 paper section 4.1: 4 x 2048^2, uncompressed).
pub const SHADOW_SIZE: u32 = 2048;

/// Weight of the logarithmic split against the uniform one (Zhang et al. 2006, practical split
/// scheme).
const LOG_WEIGHT: f32 = 0.75;

/// Radius of a cascade relative to its sphere, which leaves room for the taps of the filter.
const MARGIN: f32 = 1.01;

/// One cascade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade {
    /// World to the cascade's clip space, depth 0 to 1.
    pub clip_from_world: Mat4,
    /// Size of a texel in the world, metres.
    pub texel_m: f32,
}

/// Fits `count` cascades along `to_sun` to the frusta of `eyes` between `near_m` and `far_m` from
/// the head. `bounds` are the scene's, so that every caster lies within the depth range.
pub fn fit(
    eyes: &[EyeView],
    count: u32,
    to_sun: Vec3,
    bounds: (Vec3, Vec3),
    near_m: f32,
    far_m: f32,
) -> Vec<Cascade> {
    let up = if to_sun.y.abs() > 0.99 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    let light = look_at_mat4(Vec3::ZERO, -to_sun, up);
    let (depth_lo, depth_hi) = corners(bounds.0, bounds.1)
        .map(|p| -light.transform_point3(p).z)
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), d| {
            (lo.min(d), hi.max(d))
        });
    (0..count)
        .map(|k| {
            let slice = [k, k + 1].map(|edge| split(edge, count, near_m, far_m));
            let (center, radius) = slice_sphere(eyes, slice, radius_step_m(far_m));
            let half = radius * MARGIN;
            let texel = 2.0 * half / SHADOW_SIZE as f32;
            let c = light.transform_point3(center);
            let [x, y] = [c.x, c.y].map(|v| (v / texel).floor() * texel);
            // A flat scene that faces the sun has no depth.
            let range = (depth_hi - depth_lo).max(1e-5 * far_m);
            let projection = orthographic(
                x - half,
                x + half,
                y - half,
                y + half,
                depth_lo - 0.01 * range,
                depth_hi + 0.01 * range,
            );
            Cascade {
                clip_from_world: projection * light,
                texel_m: texel,
            }
        })
        .collect()
}

/// Distance of split `edge` of `count`.
fn split(edge: u32, count: u32, near_m: f32, far_m: f32) -> f32 {
    let t = edge as f32 / count as f32;
    let log = near_m * (far_m / near_m).powf(t);
    let uniform = near_m + (far_m - near_m) * t;
    LOG_WEIGHT * log + (1.0 - LOG_WEIGHT) * uniform
}

/// Radii of cascades are multiples of this, metres: 1/16 for a scene the size of a building, and in
/// proportion to `far_m` for much smaller or larger scenes.
fn radius_step_m(far_m: f32) -> f32 {
    let least = (far_m / 16384.0).log2().ceil().exp2();
    let most = (far_m / 32.0).log2().floor().exp2();
    (1.0_f32 / 16.0).max(least).min(most)
}

/// Sphere around the parts of all frusta at eye distances `slice`. The radius is rounded up to a
/// multiple of `step_m` so that rounding under head rotation does not change the texel size.
fn slice_sphere(eyes: &[EyeView], slice: [f32; 2], step_m: f32) -> (Vec3, f32) {
    let mut points = Vec::with_capacity(8 * eyes.len());
    for eye in eyes {
        let world_from_eye = Mat4::from_cols_array_2d(&eye.world_to_eye).inverse();
        let tangents = tangents(&Mat4::from_cols_array_2d(&eye.eye_to_clip));
        for distance in slice {
            for x in [tangents[0], tangents[1]] {
                for y in [tangents[2], tangents[3]] {
                    let corner = Vec3::new(x * distance, y * distance, -distance);
                    points.push(world_from_eye.transform_point3(corner));
                }
            }
        }
    }
    let center = points.iter().sum::<Vec3>() / points.len() as f32;
    let radius = points
        .iter()
        .map(|p| p.distance(center))
        .fold(0.0, f32::max);
    (center, (radius / step_m).ceil() * step_m)
}

/// Left, right, bottom and top tangents of a perspective projection.
fn tangents(p: &Mat4) -> [f32; 4] {
    [
        (p.z_axis.x - 1.0) / p.x_axis.x,
        (p.z_axis.x + 1.0) / p.x_axis.x,
        (p.z_axis.y - 1.0) / p.y_axis.y,
        (p.z_axis.y + 1.0) / p.y_axis.y,
    ]
}

fn corners(lo: Vec3, hi: Vec3) -> impl Iterator<Item = Vec3> {
    (0..8).map(move |i| {
        Vec3::new(
            if i & 1 == 0 { lo.x } else { hi.x },
            if i & 2 == 0 { lo.y } else { hi.y },
            if i & 4 == 0 { lo.z } else { hi.z },
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::camera::rh::proj::directx::perspective;

    fn eyes(target: Vec3) -> [EyeView; 2] {
        let eye = |x: f32| {
            let position = Vec3::new(x, 1.7, 0.0);
            EyeView {
                world_to_eye: look_at_mat4(position, position + target, Vec3::Y).to_cols_array_2d(),
                eye_to_clip: perspective(1.6, 0.9, 0.05, 100.0).to_cols_array_2d(),
                position: position.to_array(),
            }
        };
        [eye(-0.032), eye(0.032)]
    }

    #[test]
    fn every_point_of_both_frusta_lies_in_a_cascade() {
        let eyes = eyes(Vec3::new(0.3, -0.1, -1.0));
        let bounds = (Vec3::new(-40.0, -2.0, -40.0), Vec3::new(40.0, 20.0, 40.0));
        let cascades = fit(
            &eyes,
            4,
            Vec3::new(0.4, 0.8, 0.3).normalize(),
            bounds,
            0.1,
            30.0,
        );
        for eye in &eyes {
            let world = eye.clip_from_world().inverse();
            for i in 0..1000_u32 {
                let ndc = Vec3::new(
                    (i % 10) as f32 / 4.5 - 1.0,
                    (i / 10 % 10) as f32 / 4.5 - 1.0,
                    0.0,
                );
                let near = world.project_point3(ndc);
                let far = world.project_point3(ndc.with_z(0.9));
                let p = near.lerp(far, (i / 100) as f32 / 9.0);
                let depth = -Mat4::from_cols_array_2d(&eye.world_to_eye)
                    .transform_point3(p)
                    .z;
                let inside_scene = p.cmpge(bounds.0).all() && p.cmple(bounds.1).all();
                if inside_scene && (0.1..30.0).contains(&depth) {
                    assert!(
                        cascades.iter().any(|c| {
                            let q = c.clip_from_world.project_point3(p);
                            q.x.abs() < 1.0 && q.y.abs() < 1.0 && q.z > 0.0 && q.z < 1.0
                        }),
                        "{p} at depth {depth}"
                    );
                }
            }
        }
    }

    #[test]
    fn turning_the_head_keeps_the_texel_size() {
        let bounds = (Vec3::splat(-10.0), Vec3::splat(10.0));
        let size = |target| {
            let fitted = fit(&eyes(target), 4, Vec3::Y, bounds, 0.1, 20.0);
            fitted.iter().map(|c| c.texel_m).collect::<Vec<_>>()
        };
        assert_eq!(size(Vec3::NEG_Z), size(Vec3::new(0.6, 0.1, -0.8)));
    }
}
