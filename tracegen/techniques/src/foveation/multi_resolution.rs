//! Multi-resolution shading: 3x3 viewports, of which the outer ones have half the resolution per axis.

use crate::Mask;
use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};
use crate::plan::Filter;
use formats::view::TILE_SIZE_PX;
use std::sync::Arc;

/// Share of the picture's width and height with full resolution. With half resolution in the rest, (0.4 + 0.6
/// / 2)^2 = 49 % of the pixels are shaded.
const CENTER_SHARE: f64 = 0.4;
/// Columns or rows of the picture per pixel of an outer viewport.
const COARSE: u32 = 2;

/// One layer per viewport, with a border of one pixel towards the other viewports, from which the picture's
/// pixels are interpolated. Viewports end at tiles.
pub(crate) fn patches(picture: &EyePicture) -> EyePatches {
    let gaze = picture.gaze_px();
    let cuts = [0, 1].map(|axis: usize| cuts(picture.size_px[axis], gaze[axis]));
    let mut patches = Vec::new();
    let mut rate_px = 0.0;
    for row in 0..3 {
        for column in 0..3 {
            let at = [column, row];
            let low = [0, 1].map(|axis: usize| cuts[axis][at[axis]]);
            let high = [0, 1].map(|axis: usize| cuts[axis][at[axis] + 1]);
            if low[0] == high[0] || low[1] == high[1] {
                continue;
            }
            let coarseness = at.map(|place| if place == 1 { 1 } else { COARSE });
            let number = (3 * row + column) as u16;
            let patch = viewport(picture, number, low, high, coarseness);
            let pixels = f64::from((high[0] - low[0]) * (high[1] - low[1]));
            rate_px += pixels / f64::from(coarseness[0] * coarseness[1]);
            patches.push(patch);
        }
    }
    EyePatches {
        patches,
        is_picture: false,
        rate_px,
    }
}

/// Edges of the three parts of an axis. The middle part, around the gaze, has a share of [`CENTER_SHARE`].
fn cuts(size_px: u32, gaze_px: f64) -> [u32; 4] {
    let tile = f64::from(TILE_SIZE_PX);
    let tiles = f64::from(size_px.div_ceil(TILE_SIZE_PX));
    let length = (f64::from(size_px) * CENTER_SHARE / tile)
        .round()
        .clamp(1.0, tiles);
    let first = (gaze_px / tile - length / 2.0)
        .round()
        .clamp(0.0, tiles - length);
    let edge = |tile: f64| (tile as u32 * TILE_SIZE_PX).min(size_px);
    [0, edge(first), edge(first + length), size_px]
}

/// The viewport for a rectangle of the picture; `high` is its end.
fn viewport(
    picture: &EyePicture,
    number: u16,
    low: [u32; 2],
    high: [u32; 2],
    coarseness: [u32; 2],
) -> Patch {
    let owned = Mask::new(picture.tiles(), |x, y| {
        let [first, _] = picture.tile_px([x, y]);
        (0..2).all(|axis| (low[axis]..high[axis]).contains(&first[axis]))
    });
    if coarseness == [1, 1] {
        // Use the eye's own projection, because a narrowed one rounds differently, which moves edges.
        return Patch::of_tiles(picture, number, coarseness, owned);
    }
    // A border of one pixel of the layer at each edge where pixels are interpolated and a neighbour exists.
    let border = coarseness.map(|n| if n > 1 { n } else { 0 });
    let origin_px = [0, 1].map(|axis: usize| low[axis].saturating_sub(border[axis]));
    let end = [0, 1].map(|axis: usize| (high[axis] + border[axis]).min(picture.size_px[axis]));
    let cover = Patch {
        number,
        origin_px,
        coarseness,
        size_px: [0, 1].map(|axis| (end[axis] - origin_px[axis]).div_ceil(coarseness[axis])),
        tiles: Some(Arc::new(owned)),
        filter: Filter::Bilinear,
        ..Patch::whole(picture, None)
    };
    let mask = picture.lens.map(|_| {
        let shown = Mask::new(cover.size_px, |x, y| {
            let [low, high] = cover.covered_px(picture, [x, y]);
            picture.shows(low, high)
        });
        Arc::new(shown.grown(coarseness.map(|n| u32::from(n > 1))))
    });
    Patch { mask, ..cover }
}
