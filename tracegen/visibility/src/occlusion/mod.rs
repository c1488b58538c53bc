//! Occlusion culling in two phases without loss of visible draws.
//!
//! In the first phase, the draws that were visible in the last frame are drawn to get their depth. In the
//! second phase, the other draws are tested against this depth. A draw is hidden if the nearest point of its
//! box is behind the farthest depth of all pixels that the box may cover. The depth is that of existing draws
//! in their current poses, so no visible draw is lost. The result for the last frame affects only how many
//! draws are hidden. In the first frame, nothing is drawn in the first phase, so nothing is hidden.

mod pyramid;
#[cfg(test)]
mod tests;

pub use pyramid::Pyramid;

use glam::{DMat4, DVec4, Mat4, Vec3};

/// Share of a box's depth range by which a driver's depth may differ. Vertices are rounded to 1/256 pixel,
/// and depth is extrapolated over that distance.
const SLACK: f64 = 1.0 / 16.0;
/// Relative rounding error of a sum of products in the driver. A depth is the near plane's distance divided
/// by such a sum.
const ROUNDING: f64 = 16.0 * (f32::EPSILON as f64) / 2.0;

/// Visible draws of the last frame, by view.
#[derive(Clone, Debug, Default)]
pub struct Occlusion {
    visible: Vec<Vec<u32>>,
}

impl Occlusion {
    /// Draws of `kept` (ascending) that were visible in a view in the last frame. They must be drawn first.
    pub fn first(&self, view: usize, kept: &[u32]) -> Vec<u32> {
        let Some(visible) = self.visible.get(view) else {
            return Vec::new();
        };
        let mut first = kept.to_vec();
        first.retain(|draw| visible.binary_search(draw).is_ok());
        first
    }

    /// The draws of `kept` (ascending) that are not hidden by the depth of the first phase. They are stored
    /// for the next frame. Also returns the number of tested boxes.
    pub fn second(
        &mut self,
        view: usize,
        kept: &mut Vec<u32>,
        bounds: impl Fn(u32) -> [Vec3; 2],
        clip_from_world: Mat4,
        depth: &Pyramid,
    ) -> u64 {
        let tests = kept.len() as u64;
        let matrix = clip_from_world.as_dmat4();
        kept.retain(|&draw| !hidden(bounds(draw), &matrix, depth));
        if self.visible.len() <= view {
            self.visible.resize(view + 1, Vec::new());
        }
        self.visible[view].clone_from(kept);
        tests
    }
}

/// Whether nothing within the bounds is visible, because everything is behind the depth of the pixels that it
/// may cover. False in doubt, as for bounds that cross the near plane or are not finite.
fn hidden([low, high]: [Vec3; 2], clip_from_world: &DMat4, depth: &Pyramid) -> bool {
    let [low, high] = [low, high].map(Vec3::as_dvec3);
    let size_px = depth.size_px().map(f64::from);
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut rounding = 0.0_f64;
    for corner in 0..8 {
        let along = |axis: usize| {
            if corner >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        let corner = DVec4::new(along(0), along(1), along(2), 1.0);
        let clip = *clip_from_world * corner;
        // In front of the near plane, or NaN: the condition is false for NaN.
        if !(clip.z < clip.w && clip.w > 0.0) {
            return false;
        }
        let terms = clip_from_world.row(3).abs().dot(corner.abs());
        rounding = rounding.max(ROUNDING * (1.0 + terms / clip.w));
        let ndc = clip.truncate() / clip.w;
        let place = [
            (ndc.x + 1.0) / 2.0 * size_px[0],
            (1.0 - ndc.y) / 2.0 * size_px[1],
            ndc.z,
        ];
        for axis in 0..3 {
            least[axis] = least[axis].min(place[axis]);
            most[axis] = most[axis].max(place[axis]);
        }
    }
    // One more pixel on each side, because vertices are rounded to the rasteriser's grid.
    let range = |axis: usize| {
        let [first, last] = [least[axis] - 1.0, most[axis] + 1.0].map(f64::floor);
        (last >= 0.0 && first < size_px[axis])
            .then(|| [first.max(0.0) as u32, last.min(size_px[axis] - 1.0) as u32])
    };
    let (Some(columns), Some(rows)) = (range(0), range(1)) else {
        // Outside the picture. Culling handles this case.
        return false;
    };
    let nearest = most[2] + SLACK * (most[2] - least[2]) + rounding * most[2];
    nearest < f64::from(depth.farthest(columns, rows))
}
