//! Rings: each 16x16 tile is shaded at the rate of its angle from the gaze.

use crate::Mask;
use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};
use crate::settings::Rates;

/// Columns and rows of the picture per shaded pixel, by ring: rates 1, 1/2, 1/4, 1/8, 1/16.
pub(crate) const COARSENESS: [[u32; 2]; 5] = [[1, 1], [2, 1], [2, 2], [4, 2], [4, 4]];

/// One layer per rate. Each covers the whole picture and is masked to its tiles.
pub(crate) fn patches(picture: &EyePicture, rates: &Rates) -> EyePatches {
    let rings = rings(picture, rates);
    let columns = picture.tiles()[0];
    let patches = (0..).zip(COARSENESS).map(|(ring, coarseness)| {
        let owned = Mask::new(picture.tiles(), |x, y| {
            rings[(y * columns + x) as usize] == Some(usize::from(ring))
        });
        Patch::of_tiles(picture, ring, coarseness, owned)
    });
    let rate_px = (0..)
        .zip(&rings)
        .filter_map(|(tile, ring)| {
            let [low, high] = picture.tile_px([tile % columns, tile / columns]);
            let [width, height] = COARSENESS[(*ring)?];
            let pixels = (high[0] - low[0]) * (high[1] - low[1]);
            Some(f64::from(pixels) / f64::from(width * height))
        })
        .sum();
    EyePatches {
        patches: patches.collect(),
        is_picture: false,
        rate_px,
    }
}

/// The ring of each tile, row by row; `None` for tiles outside the lens.
fn rings(picture: &EyePicture, rates: &Rates) -> Vec<Option<usize>> {
    let [columns, rows] = picture.tiles();
    let tiles = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
    tiles
        .map(|tile| {
            let [low, high] = picture.tile_px(tile);
            let angle = picture.least_angle_deg(low, high);
            let ring = (rates.edges_deg.iter())
                .filter(|edge| angle >= f64::from(**edge))
                .count();
            picture.shows(low, high).then_some(ring)
        })
        .collect()
}
