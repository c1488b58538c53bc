//! Finds the tiles that each primitive enters before any depth test, for the primitive lists of a tile-based
//! renderer.

use formats::view::TILE_SIZE_PX;
use glam::{Affine3A, DMat4, DVec2, DVec4, Mat4, Vec3};

/// Margin of tiles and pixel centres within which a primitive counts as touching them. Drivers round vertices
/// to 1/256 pixel and compute in single precision.
const MARGIN_PX: f64 = 1.0 / 64.0;

/// A view whose tiles primitives are assigned to.
#[derive(Clone, Copy, Debug)]
pub struct BinnedView {
    /// World to clip space; depth 0 to 1, y up.
    pub clip_from_world: Mat4,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
}

/// The triangles of one draw.
#[derive(Clone, Copy, Debug)]
pub struct BinnedDraw<'a> {
    /// Vertex positions in object space.
    pub positions: &'a [Vec3],
    /// Three indices for each triangle.
    pub indices: &'a [u32],
    /// Object to world.
    pub world_from_object: Affine3A,
    /// Whether both faces are drawn; otherwise only counterclockwise ones.
    pub double_sided: bool,
    /// Whether the transform mirrors, so that front faces are clockwise.
    pub mirrored: bool,
    /// Number of the first primitive.
    pub first_primitive: u32,
}

/// Appends (tile, primitive) for each tile that each triangle of a draw enters. Primitives ascend, and so do
/// the tiles of each primitive.
pub fn bin(view: &BinnedView, draw: &BinnedDraw<'_>, out: &mut Vec<(u32, u32)>) {
    let world = DMat4::from_cols_array(
        &Mat4::from(draw.world_from_object)
            .to_cols_array()
            .map(f64::from),
    );
    let clip = DMat4::from_cols_array(&view.clip_from_world.to_cols_array().map(f64::from));
    let clip_from_object = clip * world;
    let vertices: Vec<DVec4> = (draw.positions.iter())
        .map(|p| clip_from_object * p.as_dvec3().extend(1.0))
        .collect();
    let culled = (!draw.double_sided).then_some(if draw.mirrored { -1.0 } else { 1.0 });
    let at = |index: u32| vertices.get(index as usize).copied().unwrap_or(DVec4::NAN);
    for (primitive, triangle) in (draw.first_primitive..).zip(draw.indices.chunks_exact(3)) {
        let clipped = Clipped::new([at(triangle[0]), at(triangle[1]), at(triangle[2])]);
        let polygon = clipped.on_screen(view.size_px);
        tiles(&polygon[..clipped.len], culled, view.size_px, |tile| {
            out.push((tile, primitive))
        });
    }
}

/// A triangle clipped at the near plane: up to four corners in clip space.
struct Clipped {
    corners: [DVec4; 4],
    len: usize,
}

impl Clipped {
    fn new(triangle: [DVec4; 3]) -> Self {
        let mut clipped = Self {
            corners: [DVec4::ZERO; 4],
            len: 0,
        };
        let outside = |plane: fn(&DVec4) -> f64| triangle.iter().all(|c| plane(c) < 0.0);
        let planes: [fn(&DVec4) -> f64; 6] = [
            |c| c.w + c.x,
            |c| c.w - c.x,
            |c| c.w + c.y,
            |c| c.w - c.y,
            |c| c.z,
            |c| c.w - c.z,
        ];
        if planes.into_iter().any(outside) || !triangle.iter().all(|c| c.is_finite()) {
            return clipped;
        }
        for (index, &corner) in triangle.iter().enumerate() {
            let next = triangle[(index + 1) % 3];
            // Depth is 1 at the near plane.
            let [before, after] = [corner, next].map(|c| c.w - c.z);
            if before >= 0.0 {
                clipped.push(corner);
            }
            if (before >= 0.0) != (after >= 0.0) {
                clipped.push(corner + (next - corner) * (before / (before - after)));
            }
        }
        clipped
    }

    fn push(&mut self, corner: DVec4) {
        // A triangle clipped by one plane has at most four corners.
        if let Some(place) = self.corners.get_mut(self.len) {
            *place = corner;
            self.len += 1;
        }
    }

    /// Corners in pixels from the top left.
    fn on_screen(&self, size_px: [u32; 2]) -> [DVec2; 4] {
        let half = DVec2::new(f64::from(size_px[0]), f64::from(size_px[1])) / 2.0;
        // w is 1 in orthographic views. In other views, it is positive at the near plane.
        self.corners
            .map(|c| DVec2::new(1.0 + c.x / c.w, 1.0 - c.y / c.w) * half)
    }
}

/// Calls `visit` for each tile that a convex polygon enters. `front` is the sign of the area of faces that
/// are kept; counterclockwise faces on the screen are positive.
fn tiles(polygon: &[DVec2], front: Option<f64>, size_px: [u32; 2], mut visit: impl FnMut(u32)) {
    if polygon.len() < 3 {
        return;
    }
    let edges = || (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]));
    // Positive if the corners are counterclockwise on the screen, where y points down.
    let area: f64 = -edges().map(|(a, b)| a.perp_dot(b)).sum::<f64>();
    let is_kept = front.map_or(area != 0.0, |front| area * front > 0.0);
    if !is_kept || !area.is_finite() {
        return;
    }
    let low = polygon.iter().copied().fold(DVec2::INFINITY, DVec2::min) - MARGIN_PX;
    let high = polygon
        .iter()
        .copied()
        .fold(DVec2::NEG_INFINITY, DVec2::max)
        + MARGIN_PX;
    // First and last pixel whose centre is inside the box.
    let range = |axis: usize| {
        let last = f64::from(size_px[axis]) - 1.0;
        let first = (low[axis] - 0.5).ceil().max(0.0);
        let end = (high[axis] - 0.5).floor().min(last);
        (first <= end).then_some(first as u32 / TILE_SIZE_PX..=end as u32 / TILE_SIZE_PX)
    };
    let (Some(columns), Some(rows)) = (range(0), range(1)) else {
        return;
    };
    let row_tiles = size_px[0].div_ceil(TILE_SIZE_PX);
    let inward = if area > 0.0 { -1.0 } else { 1.0 };
    let tile_px = f64::from(TILE_SIZE_PX);
    for row in rows {
        for column in columns.clone() {
            let centre = (DVec2::new(f64::from(column), f64::from(row)) + 0.5) * tile_px;
            let outside = edges().any(|(a, b)| {
                let normal = (b - a).perp() * inward;
                // Extent of the tile towards the inside of the edge.
                let reach = (tile_px / 2.0) * (normal.x.abs() + normal.y.abs())
                    + MARGIN_PX * normal.length();
                normal.dot(centre - a) + reach < 0.0
            });
            if !outside {
                visit(row * row_tiles + column);
            }
        }
    }
}

#[cfg(test)]
mod tests;
