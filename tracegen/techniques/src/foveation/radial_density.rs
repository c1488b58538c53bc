//! Radial density masking: in the periphery, every other 2x2 quad is left out and filled in from its
//! neighbours.

use crate::Mask;
use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};
use crate::plan::Filter;
use crate::settings::Rates;
use formats::view::TILE_SIZE_PX;
use std::sync::Arc;

/// One layer of full size: all pixels of the tiles within the first angle of the rates, and a checkerboard of
/// quads beyond.
pub(crate) fn patches(picture: &EyePicture, rates: &Rates) -> EyePatches {
    let [columns, rows] = picture.tiles();
    let tiles = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
    let full: Vec<bool> = tiles
        .map(|tile| {
            let [low, high] = picture.tile_px(tile);
            picture.least_angle_deg(low, high) < f64::from(rates.edges_deg[0])
        })
        .collect();
    let mask = Mask::new(picture.size_px, |x, y| {
        let tile = (y / TILE_SIZE_PX) * columns + x / TILE_SIZE_PX;
        let kept = full[tile as usize] || (x / 2 + y / 2) % 2 == 0;
        kept && picture.shows([x, y], [x + 1, y + 1])
    });
    EyePatches {
        rate_px: mask.count() as f64,
        patches: vec![Patch {
            filter: Filter::FillQuads,
            ..Patch::whole(picture, Some(Arc::new(mask)))
        }],
        is_picture: false,
    }
}
