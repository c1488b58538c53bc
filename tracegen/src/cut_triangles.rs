//! Triangles inside a view that its near or far plane cuts away.

use formats::view::EyeView;
use glam::{DVec2, DVec4, Mat4};
use raster::draws::{DrawCall, DrawList};
use scene::Scene;

/// Least w that is divided by.
const LEAST_W: f64 = 1e-9;

/// What the near and far planes of a frame's views cut away.
#[derive(Clone, Copy, Debug, Default)]
pub struct CutTriangles {
    near: Plane,
    far: Plane,
    pixels: f64,
}

/// What lies beyond one plane.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    /// Distance of the plane, metres.
    metres: f64,
    triangles: u64,
    area_px: f64,
    /// The first mesh.
    mesh: Option<usize>,
}

impl CutTriangles {
    /// Adds the triangles of a view.
    pub fn look(&mut self, scene: &Scene, draws: &DrawList, view: &EyeView, size_px: [u32; 2]) {
        let clip_from_world = view.clip_from_world_f64();
        // Depth is 1 at the near plane and 0 at the far plane.
        let [scale, shift] = [2, 3].map(|column| f64::from(view.eye_to_clip[column][2]));
        self.near.metres = shift / (1.0 + scale);
        self.far.metres = shift / scale;
        let size = DVec2::new(size_px[0].into(), size_px[1].into());
        self.pixels += size.x * size.y;
        for call in &draws.calls {
            let clip_from_object = clip_from_world * Mat4::from(call.transform).as_dmat4();
            let mesh = &scene.meshes[call.mesh];
            let double_sided = scene.materials[call.material].double_sided;
            let clip: Vec<DVec4> = (mesh.positions.iter())
                .map(|p| clip_from_object * p.as_dvec3().extend(1.0))
                .collect();
            for triangle in mesh.indices.chunks_exact(3) {
                let corners = [0, 1, 2].map(|i| clip[triangle[i] as usize]);
                self.near
                    .add(&corners, |c| c.z - c.w, call, double_sided, size);
                self.far.add(&corners, |c| -c.z, call, double_sided, size);
            }
        }
    }

    /// A warning for each plane that cuts away at least a pixel.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        let of = |plane: &Plane, which: &str, advice: &str| {
            let mesh = plane.mesh.filter(|_| plane.area_px >= 1.0)?;
            Some(format!(
                "{} triangles of the view lie wholly or partly beyond the {which} plane at {} m and are cut off there \
                 (first in mesh '{}'), up to {:.1} % of the picture: {advice}",
                plane.triangles,
                plane.metres as f32,
                scene.meshes[mesh].name,
                100.0 * (plane.area_px / self.pixels).min(1.0),
            ))
        };
        let near = of(&self.near, "near", "--near sets another distance");
        let far = of(&self.far, "far", "the camera of the file has this plane");
        near.into_iter().chain(far).collect()
    }
}

impl Plane {
    /// Adds the part of a triangle for which `beyond` is positive, if it is in the picture.
    fn add(
        &mut self,
        corners: &[DVec4; 3],
        beyond: impl Fn(&DVec4) -> f64,
        call: &DrawCall,
        double_sided: bool,
        size: DVec2,
    ) {
        if !corners.iter().any(|corner| beyond(corner) > 0.0) {
            return;
        }
        let sides: [&dyn Fn(&DVec4) -> f64; 6] = [
            &beyond,
            &|c| c.w - LEAST_W,
            &|c| c.w + c.x,
            &|c| c.w - c.x,
            &|c| c.w + c.y,
            &|c| c.w - c.y,
        ];
        let mut polygon = corners.to_vec();
        for side in sides {
            polygon = clipped(&polygon, side);
        }
        let on_screen = |c: &DVec4| DVec2::new(0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w) * size;
        let places: Vec<DVec2> = polygon.iter().map(on_screen).collect();
        let next = places.iter().cycle().skip(1);
        let area: f64 = (places.iter().zip(next))
            .map(|(a, b)| 0.5 * a.perp_dot(*b))
            .sum();
        // On the screen y points down.
        let shows_front = (area < 0.0) != call.mirrored;
        if area.is_finite() && area != 0.0 && (double_sided || shows_front) {
            self.triangles += 1;
            self.area_px += area.abs();
            self.mesh = self.mesh.or(Some(call.mesh));
        }
    }
}

/// The part of a convex polygon on the positive side of a plane.
fn clipped(polygon: &[DVec4], distance: impl Fn(&DVec4) -> f64) -> Vec<DVec4> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (number, corner) in polygon.iter().enumerate() {
        let next = &polygon[(number + 1) % polygon.len()];
        let [here, there] = [distance(corner), distance(next)];
        if here >= 0.0 {
            kept.push(*corner);
        }
        if (here >= 0.0) != (there >= 0.0) {
            kept.push(corner.lerp(*next, here / (here - there)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Camera, cameras, hmd};

    /// Warnings of the atrium's first camera with these planes.
    fn warnings(near: f32, far: f32) -> Vec<String> {
        let scene = scenes::load("atrium").unwrap();
        let draws = DrawList::new(&scene, 0).unwrap();
        let camera = Camera {
            near,
            far,
            ..scene.cameras[0].clone()
        };
        let hmd = hmd::preset("symmetric-100").unwrap();
        let mut cut = CutTriangles::default();
        for eye in cameras::eye_views(&camera, &hmd) {
            cut.look(&scene, &draws, &eye, hmd.eye_size_px);
        }
        cut.warnings(&scene)
    }

    #[test]
    fn planes_that_cut_what_is_in_the_picture_are_named() {
        assert_eq!(warnings(0.05, f32::INFINITY), [""; 0]);
        let near = warnings(3.0, f32::INFINITY);
        assert!(
            near.len() == 1 && near[0].contains("near plane at 3 m"),
            "{near:?}"
        );
        let far = warnings(0.05, 5.0);
        assert!(
            far.len() == 1 && far[0].contains("far plane at 5 m"),
            "{far:?}"
        );
    }
}
