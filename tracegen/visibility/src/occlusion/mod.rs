//! Occlusion culling in two phases, with nothing visible lost.
//!
//! First the draws that the last frame found visible are drawn for their depth alone. Then every
//! draw that is left to judge is held against that depth: it is hidden where the nearest point of
//! its box lies behind the farthest depth of all pixels that the box may cover. The depth holds
//! this frame's poses and only draws that are truly there, so whatever it hides, it hides rightly;
//! what the last frame found decides how much is hidden, and nothing else. The first frame draws
//! nothing first, and so hides nothing.

mod pyramid;
#[cfg(test)]
mod tests;

pub use pyramid::Pyramid;

use glam::{DMat4, DVec4, Mat4, Vec3};

/// Part of a box's range of depths that a driver may be off by within it: a triangle is drawn on a
/// grid of 1/256 pixel, and its depth extrapolated by as much.
const SLACK: f64 = 1.0 / 16.0;
/// Rounding of a depth from 0 to 1 in the driver.
const ROUNDING: f64 = 16.0 * (f32::EPSILON as f64) / 2.0;

/// Visible draws of the last frame, by view.
#[derive(Clone, Debug, Default)]
pub struct Occlusion {
    visible: Vec<Vec<u32>>,
}

impl Occlusion {
    /// Draws of `kept` (ascending) that the last frame found visible in a view: to be drawn first.
    #[must_use]
    pub fn first(&self, view: usize, kept: &[u32]) -> Vec<u32> {
        let Some(visible) = self.visible.get(view) else {
            return Vec::new();
        };
        let mut first = kept.to_vec();
        first.retain(|draw| visible.binary_search(draw).is_ok());
        first
    }

    /// Leaves those draws of `kept` (ascending) that the depth of the first ones does not hide, and
    /// remembers them for the next frame. Tells how many boxes were tested.
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

/// Whether nothing within the bounds can be seen: everything lies behind the depth of the pixels
/// that it may cover. False in doubt, as for bounds that cross the near plane or are not finite.
fn hidden([low, high]: [Vec3; 2], clip_from_world: &DMat4, depth: &Pyramid) -> bool {
    let [low, high] = [low, high].map(Vec3::as_dvec3);
    let size_px = depth.size_px().map(f64::from);
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in 0..8 {
        let along = |axis: usize| {
            if corner >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        let clip = *clip_from_world * DVec4::new(along(0), along(1), along(2), 1.0);
        // Before the near plane, or nowhere: written so that NaN is.
        if !(clip.z > 0.0 && clip.w > 0.0) {
            return false;
        }
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
    // A pixel around it, for the rounding of vertices to the raster's grid.
    let range = |axis: usize| {
        let [first, last] = [least[axis] - 1.0, most[axis] + 1.0].map(f64::floor);
        (last >= 0.0 && first < size_px[axis])
            .then(|| [first.max(0.0) as u32, last.min(size_px[axis] - 1.0) as u32])
    };
    let (Some(columns), Some(rows)) = (range(0), range(1)) else {
        // Beside the picture: for culling to judge.
        return false;
    };
    let nearest = least[2] - SLACK * (most[2] - least[2]) - ROUNDING;
    nearest > f64::from(depth.farthest(columns, rows))
}
