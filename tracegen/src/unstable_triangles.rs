//! Finds triangles whose visibility depends on rounding: thinner than the rasteriser's grid, or closer
//! together than the depth buffer resolves.
//!
//! The search works on the screen: it considers triangles of an eye's picture that no clip plane cuts and
//! that may cover a pixel's centre. Coplanar surfaces with different triangulations are not found.

use formats::view::EyeView;
use glam::{DMat4, DVec2, DVec3, Mat4};
use raster::draws::{DrawCall, DrawList, DrawMode};
use scene::Scene;
use std::collections::HashMap;

/// Vertices are rounded to a grid of this size in pixels before rasterisation.
const GRID_PX: f64 = 1.0 / 256.0;

/// Depths that differ by at most this many steps of 32 bits may change their order, because interpolation
/// rounds.
const DEPTH_STEPS: f64 = 4.0;

/// The step of 32-bit depths relative to a depth, at most.
const DEPTH_STEP: f64 = 1.0 / (1 << 24) as f64;

/// Share of fragments that may be wrong without a warning. Captures have errors of this size at edges.
const SHARE: f64 = 0.002;

/// Vertices of coincident triangles are closer together than this.
const SAME_PLACE_PX: f64 = 1.0 / 16.0;

/// Number of depths at one place that a triangle is compared with. Foliage and decals are a few layers deep.
/// Without a limit, time would grow with the square of the number of layers.
const MOST_DEPTHS: usize = 64;

/// A kind of unstable triangles in a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Kind {
    triangles: u64,
    area_px: f64,
    /// The mesh of the first triangle.
    mesh: Option<usize>,
}

impl Kind {
    fn add(&mut self, area_px: f64, mesh: usize) {
        self.triangles += 1;
        self.area_px += area_px;
        self.mesh.get_or_insert(mesh);
    }
}

/// Unstable triangles of some views.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnstableTriangles {
    thin: Kind,
    coincident: Kind,
}

/// Relation of a triangle to another one at the same place on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Against {
    /// At another place, or distinguishable by depth.
    Apart,
    /// Identical vertices and winding: the first one is visible.
    Same,
    /// Rounding decides which of the two is visible.
    Upon,
}

/// A triangle on the screen.
struct Shown {
    /// Pixels, and depth from 0 to 1.
    corners: [DVec3; 3],
    mesh: usize,
    double_sided: bool,
}

impl UnstableTriangles {
    /// Adds the triangles of a view.
    pub fn look(&mut self, scene: &Scene, draws: &DrawList, view: &EyeView, size_px: [u32; 2]) {
        let clip_from_world = view.clip_from_world_f64();
        let mut places = Places::default();
        for call in &draws.calls {
            let of_draw = on_screen(scene, call, clip_from_world, size_px);
            for (shown, area_px) in of_draw {
                if shown.height_px() < GRID_PX {
                    self.thin.add(area_px, shown.mesh);
                    continue;
                }
                // Blended draws hide nothing.
                if call.mode == DrawMode::Blended {
                    continue;
                }
                if places.add(shown.placed()) == Against::Upon {
                    self.coincident.add(area_px, shown.mesh);
                }
            }
        }
    }

    /// Warnings, if unstable triangles may affect more than a share of the `fragments`.
    pub fn warnings(&self, scene: &Scene, fragments: u64) -> Vec<String> {
        let mut warnings = Vec::new();
        let name = |kind: &Kind| {
            kind.mesh
                .map_or("", |mesh| scene.meshes[mesh].name.as_str())
        };
        let share = |kind: &Kind| kind.area_px / fragments.max(1) as f64;
        let percent = |kind: &Kind| 100.0 * share(kind).min(1.0);
        if share(&self.thin) > SHARE {
            let Kind { triangles, .. } = self.thin;
            warnings.push(format!(
                "{triangles} triangles are thinner than 1/256 pixel (first in mesh '{}'), about {:.1} % of the fragments: \
                 the rounding of their vertices decides which of them are drawn",
                name(&self.thin),
                percent(&self.thin),
            ));
        }
        if share(&self.coincident) > SHARE {
            let Kind { triangles, .. } = self.coincident;
            warnings.push(format!(
                "{triangles} triangles lie upon others, closer than the depth buffer tells apart (first in mesh '{}'), \
                 about {:.1} % of the fragments: rounding decides which of both are seen",
                name(&self.coincident),
                percent(&self.coincident),
            ));
        }
        warnings
    }
}

/// The triangles of a draw that no clip plane cuts or hides, with their pixels inside the picture.
fn on_screen(
    scene: &Scene,
    call: &DrawCall,
    clip_from_world: DMat4,
    size_px: [u32; 2],
) -> impl Iterator<Item = (Shown, f64)> {
    let mesh = &scene.meshes[call.mesh];
    let double_sided = scene.materials[call.material].double_sided;
    let clip_from_object = clip_from_world * Mat4::from(call.transform).as_dmat4();
    let size = DVec2::new(size_px[0].into(), size_px[1].into());
    let project = move |p: &glam::Vec3| {
        let clip = clip_from_object * p.as_dvec3().extend(1.0);
        let inside = clip.w > 0.0 && clip.z >= 0.0 && clip.z <= clip.w;
        inside.then(|| {
            let [x, y, z] = (clip.truncate() / clip.w).to_array();
            (DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y) * size).extend(z)
        })
    };
    let corners: Vec<Option<DVec3>> = mesh.positions.iter().map(project).collect();
    let mirrored = call.mirrored;
    let index = call.mesh;
    mesh.indices.chunks_exact(3).filter_map(move |triangle| {
        let corner = |i: usize| corners[triangle[i] as usize];
        let shown = Shown {
            corners: [corner(0)?, corner(1)?, corner(2)?],
            mesh: index,
            double_sided,
        };
        let area = shown.signed_area_px();
        // On the screen y points down.
        let shows_front = (area < 0.0) != mirrored;
        let seen = area != 0.0 && (double_sided || shows_front);
        let inside = shown.share_inside(size);
        (seen && inside > 0.0 && shown.may_cover()).then(|| (shown, area.abs() * inside))
    })
}

impl Shown {
    fn signed_area_px(&self) -> f64 {
        let [a, b, c] = self.corners.map(DVec3::truncate);
        0.5 * (b - a).perp_dot(c - a)
    }

    /// Height above the longest side.
    fn height_px(&self) -> f64 {
        let [a, b, c] = self.corners.map(DVec3::truncate);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        2.0 * self.signed_area_px().abs() / longest
    }

    /// Whether the bounding box contains a pixel's centre.
    fn may_cover(&self) -> bool {
        let [a, b, c] = self.corners.map(|corner| corner.truncate() - 0.5);
        let (low, high) = (a.min(b).min(c).ceil(), a.max(b).max(c).floor());
        low.cmple(high).all()
    }

    /// Share of the bounding box that is inside the picture, as an estimate of the triangle's share.
    fn share_inside(&self, size: DVec2) -> f64 {
        let [a, b, c] = self.corners.map(DVec3::truncate);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let whole = (high - low).max(DVec2::splat(1e-9));
        let inside = high.min(size) - low.max(DVec2::ZERO);
        (inside.max(DVec2::ZERO).min(whole) / whole)
            .to_array()
            .iter()
            .product()
    }

    fn placed(&self) -> Placed {
        let mut corners = self.corners;
        let at = |v: &DVec3| (place(v), v.z);
        corners.sort_by(|a, b| at(a).0.cmp(&at(b).0).then(at(a).1.total_cmp(&at(b).1)));
        Placed {
            corners,
            wound_up: self.signed_area_px() > 0.0,
            double_sided: self.double_sided,
        }
    }
}

/// A triangle at a place on the screen.
struct Placed {
    /// In an order that is independent of the first vertex and of the winding.
    corners: [DVec3; 3],
    wound_up: bool,
    double_sided: bool,
}

impl Placed {
    fn place(&self) -> [[i32; 2]; 3] {
        self.corners.map(|corner| place(&corner))
    }

    fn against(&self, other: &Self) -> Against {
        let wound_alike = self.wound_up == other.wound_up;
        if self.corners == other.corners && wound_alike {
            return Against::Same;
        }
        debug_assert!(wound_alike || (self.double_sided && other.double_sided));
        let near = |(a, b): (&DVec3, &DVec3)| {
            (a.z - b.z).abs() <= DEPTH_STEPS * DEPTH_STEP * a.z.abs().max(b.z.abs())
        };
        match self.corners.iter().zip(&other.corners).all(near) {
            true => Against::Upon,
            false => Against::Apart,
        }
    }
}

/// Triangles by their place.
#[derive(Default)]
struct Places(HashMap<[[i32; 2]; 3], Vec<Placed>>);

impl Places {
    /// Adds a triangle and returns its relation to the triangles at its place.
    fn add(&mut self, new: Placed) -> Against {
        let others = self.0.entry(new.place()).or_default();
        let against = others.iter().map(|other| new.against(other)).max();
        let against = against.unwrap_or(Against::Apart);
        if against == Against::Apart && others.len() < MOST_DEPTHS {
            others.push(new);
        }
        against
    }
}

fn place(corner: &DVec3) -> [i32; 2] {
    [corner.x, corner.y].map(|px| (px / SAME_PLACE_PX).round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(corners: [[f64; 3]; 3]) -> Shown {
        Shown {
            corners: corners.map(DVec3::from),
            mesh: 0,
            double_sided: true,
        }
    }

    const A: [f64; 3] = [10.0, 10.0, 0.5];
    const B: [f64; 3] = [20.0, 10.0, 0.6];
    const C: [f64; 3] = [10.0, 30.0, 0.7];

    #[test]
    fn a_triangle_is_upon_another_unless_depth_or_place_tells_them_apart() {
        let placed = |corners| shown(corners).placed();
        let one = placed([A, B, C]);
        let lifted = |by: f64| placed([A, B, C].map(|[x, y, z]| [x, y, z + by]));
        assert_eq!(placed([B, C, A]).against(&one), Against::Same);
        let other_way = placed([A, C, B]);
        assert_eq!(other_way.against(&one), Against::Upon);
        assert_eq!(lifted(DEPTH_STEP).against(&one), Against::Upon);
        assert_eq!(lifted(100.0 * DEPTH_STEP).against(&one), Against::Apart);
        let aside = placed([A, B, C].map(|[x, y, z]| [x + 0.2, y, z]));
        assert_ne!(aside.place(), one.place());
        assert_eq!(lifted(1e-6).place(), one.place());
    }

    #[test]
    fn stacks_of_any_height_keep_few_triangles() {
        let mut places = Places::default();
        let place = shown([A, B, C]).placed().place();
        for _ in 0..1_000 {
            places.add(shown([A, B, C]).placed());
        }
        assert_eq!(places.0[&place].len(), 1);
        for layer in 1..1_000 {
            let apart = shown([A, B, C].map(|[x, y, z]| [x, y, z + 1e-4 * f64::from(layer)]));
            assert_eq!(places.add(apart.placed()), Against::Apart);
        }
        assert_eq!(places.0[&place].len(), MOST_DEPTHS);
        assert_eq!(places.add(shown([A, C, B]).placed()), Against::Upon);
    }

    #[test]
    fn height_and_share_of_the_picture() {
        let one = shown([A, B, C]);
        assert_eq!(one.signed_area_px(), 100.0);
        assert!((one.height_px() - 200.0 / 500_f64.sqrt()).abs() < 1e-12);
        assert_eq!(one.share_inside(DVec2::splat(100.0)), 1.0);
        assert_eq!(one.share_inside(DVec2::new(15.0, 100.0)), 0.5);
        assert_eq!(one.share_inside(DVec2::splat(5.0)), 0.0);
    }

    #[test]
    fn few_unstable_pixels_are_no_warning() {
        let mut unstable = UnstableTriangles::default();
        unstable.thin.add(1.0, 0);
        let scene = Scene {
            meshes: vec![scene::Mesh::default()],
            ..Scene::default()
        };
        assert!(unstable.warnings(&scene, 1_000_000).is_empty());
        let warnings = unstable.warnings(&scene, 100);
        assert!(
            warnings[0].contains("1 triangles are thinner than 1/256 pixel"),
            "{warnings:?}"
        );
    }
}
