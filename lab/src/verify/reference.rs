//! The reference rasteriser: one tile at a time, triangle by triangle, pixel by pixel.

use super::geometry::Geometry;
use super::piece::{Piece, center};
use formats::view::TILE_SIZE_PX;
use glam::DVec2;
use raster::backend::Fragments;
use raster::draws::DrawMode;
use scene::TextureSlot;

const EDGE: usize = TILE_SIZE_PX as usize;

/// Margin by which a fragment of an alpha-masked draw passes the test, negative if it is discarded.
pub trait AlphaTest: Sync {
    /// The margin at a pixel of a piece.
    fn margin(&self, geometry: &Geometry<'_>, piece: &Piece, pixel: [u32; 2]) -> f64;
}

/// A fragment that is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// Index of the piece in the geometry.
    pub piece: u32,
}

/// Renders a tile; fragments come in submission order.
pub fn render_tile(
    geometry: &Geometry<'_>,
    tile: usize,
    alpha: &dyn AlphaTest,
    recorded: Fragments,
) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    let mut nearest = [geometry.order.farthest(); EDGE * EDGE];
    let origin = origin(geometry, tile);
    for (index, piece) in geometry.of_tile(tile).filter(|(_, piece)| !piece.dropped) {
        let Some(spans) = piece.span_px(geometry.size_px) else {
            continue;
        };
        let within = |axis: usize| {
            let [first, last] = spans[axis];
            first.max(origin[axis])..=last.min(origin[axis] + TILE_SIZE_PX - 1)
        };
        for y in within(1) {
            for x in within(0) {
                let pixel = [x, y];
                if !piece.covers(pixel) {
                    continue;
                }
                let slot = (y - origin[1]) as usize * EDGE + (x - origin[0]) as usize;
                let depth = piece.depth(center(pixel)) as f32;
                if depth >= nearest[slot] {
                    continue;
                }
                if recorded == Fragments::DepthTested && writes(geometry, piece, pixel, alpha) {
                    nearest[slot] = depth;
                }
                fragments.push(Fragment {
                    pixel,
                    piece: index,
                });
            }
        }
    }
    fragments
}

/// Column and row of a tile's first pixel.
pub(super) fn origin(geometry: &Geometry<'_>, tile: usize) -> [u32; 2] {
    let columns = geometry.tiles[0] as usize;
    [tile % columns, tile / columns].map(|t| t as u32 * TILE_SIZE_PX)
}

fn writes(geometry: &Geometry<'_>, piece: &Piece, pixel: [u32; 2], alpha: &dyn AlphaTest) -> bool {
    match geometry.call(piece).mode {
        DrawMode::Opaque => true,
        DrawMode::Masked => alpha.margin(geometry, piece, pixel) >= 0.0,
        DrawMode::Blended => false,
    }
}

// For scenes whose alpha is known without a sampler.
impl<F: Fn(&raster::draws::DrawCall, DVec2) -> bool + Sync> AlphaTest for F {
    fn margin(&self, geometry: &Geometry<'_>, piece: &Piece, pixel: [u32; 2]) -> f64 {
        let texture = geometry.material(piece).textures[TextureSlot::BaseColor];
        let uv = texture.map_or(DVec2::ZERO, |t| {
            geometry.coordinates(piece, &t).at(center(pixel))
        });
        if self(geometry.call(piece), uv) {
            1.0
        } else {
            -1.0
        }
    }
}
