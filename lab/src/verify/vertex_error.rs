//! Error of a vertex in single precision.

use glam::{DMat4, DVec2, DVec3, DVec4};

/// Half a unit in the last place of 1, the error of an operation in single precision.
pub(super) const UNIT: f64 = f32::EPSILON as f64 / 2.0;

/// Roundings of a clip-space coordinate: three products of a matrix with a vector or matrix, of four products
/// and three sums each (12), and its position in a region of the picture (4).
const CLIP_ROUNDINGS: f64 = 16.0;

/// Error of a vertex in single precision.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct VertexError {
    /// Sums of the magnitudes of the terms of its clip-space coordinates.
    pub terms: DVec4,
}

impl VertexError {
    /// Of a vertex that three matrices transform.
    pub fn new(matrices: &[DMat4; 3], position: DVec3) -> Self {
        let magnitudes = |m: &DMat4, v: DVec4| {
            let columns = [m.x_axis, m.y_axis, m.z_axis, m.w_axis];
            let terms = columns.into_iter().zip(v.to_array());
            terms.map(|(column, v)| column.abs() * v).sum::<DVec4>()
        };
        let [clip, eye, world] = matrices;
        let start = position.abs().extend(1.0);
        Self {
            terms: magnitudes(clip, magnitudes(eye, magnitudes(world, start))),
        }
    }

    /// Of a point between two vertices: the same fraction is used for its position and its coordinates.
    pub fn between(self, other: Self) -> Self {
        Self {
            terms: self.terms.max(other.terms),
        }
    }

    /// Error on the screen in pixels.
    pub fn moves_px(&self, clip: DVec4, size_px: [u32; 2], at: DVec2) -> DVec2 {
        let half = DVec2::new(size_px[0].into(), size_px[1].into()) / 2.0;
        let ndc = (clip.truncate().truncate() / clip.w).abs();
        let terms = self.terms.truncate().truncate() + ndc * self.terms.w;
        UNIT * (half * (CLIP_ROUNDINGS * terms / clip.w.abs() + 3.0 * ndc) + at.abs())
    }

    /// Error of the depth.
    pub fn depth(&self, clip: DVec4) -> f64 {
        let depth = (clip.z / clip.w).abs();
        let terms = self.terms.z + depth * self.terms.w;
        UNIT * (CLIP_ROUNDINGS * terms / clip.w.abs() + 3.0 * depth)
    }

    /// Relative error of 1/w.
    pub fn inverse_w(&self, clip: DVec4) -> f64 {
        UNIT * (CLIP_ROUNDINGS * self.terms.w / clip.w.abs() + 2.0)
    }
}
