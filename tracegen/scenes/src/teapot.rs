//! Bezier patches of the Utah teapot, foot at y = 0, spout along +x.

use super::mesh_builder::MeshBuilder;
use glam::{Vec3, vec2, vec3};

/// Cells along a patch's edge: 32 patches of 2 x 15² triangles, minus those at the poles.
const CELLS: usize = 15;
/// Metres per unit of Newell's model.
const SCALE_M: f32 = 0.08;

/// The copies of a patch about the pot's axis.
#[derive(Clone, Copy, Debug)]
pub enum Copies {
    /// Four, each a quarter turn after the last.
    Turned,
    /// Four, turned the other way.
    TurnedBack,
    /// Two halves, mirrored at the plane through handle and spout.
    Mirrored,
}

/// A point of a bicubic Bezier patch.
fn bezier(patch: &[Vec3; 16], u: f32, v: f32) -> Vec3 {
    let basis = |t: f32| {
        let s = 1.0 - t;
        [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t]
    };
    let (bu, bv) = (basis(u), basis(v));
    let mut p = Vec3::ZERO;
    for (i, control) in patch.iter().enumerate() {
        p += *control * (bv[i / 4] * bu[i % 4]);
    }
    // Newell's z is up.
    vec3(p.x, p.z, -p.y) * SCALE_M
}

/// Adds a patch and its copies.
pub fn patches(m: &mut MeshBuilder, copies: Copies, mut patch: [Vec3; 16]) {
    let count = match copies {
        Copies::Mirrored => 2,
        Copies::Turned | Copies::TurnedBack => 4,
    };
    for _ in 0..count {
        m.surface(CELLS, CELLS, |u, v| {
            (bezier(&patch, u, v), vec2(u, v) * 0.2)
        });
        patch = match copies {
            Copies::Turned => patch.map(|p| vec3(p.y, -p.x, p.z)),
            Copies::TurnedBack => patch.map(|p| vec3(-p.y, p.x, p.z)),
            Copies::Mirrored => std::array::from_fn(|i| {
                let p = patch[i / 4 * 4 + 3 - i % 4];
                vec3(p.x, -p.y, p.z)
            }),
        };
    }
}
