//! Lens-matched shading: four viewports per eye that meet straight ahead. In each, the w of clip space grows
//! towards the edges: `w' = w + A |x| + A |y|`, where x and y are 0 straight ahead and w at the edge.
//!
//! This is a projective map of the picture. It keeps the pixels straight ahead and shades fewer towards the
//! edges, where the lens compresses the picture. Points in one direction keep the order of their depths, and
//! triangles remain triangles. A viewport is therefore a layer with another projection.

use crate::Mask;
use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};
use crate::plan::Filter;
use formats::view::TILE_SIZE_PX;
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// The coefficient A for both axes. Edges have 1/(1 + A)^2 of the pixels per axis, and the whole picture has
/// `(1 - 2/(1 + A) + 1/(1 + 2A)) / (2 A^2)` = 39.7 % of its pixels.
pub const WARP: f64 = 0.4;

/// One layer per quadrant. Viewports end at tiles and have a border of one pixel beyond the cuts, from which
/// the picture's pixels are interpolated.
pub(crate) fn patches(picture: &EyePicture) -> EyePatches {
    let ahead = picture.ahead_px();
    let cut = [0, 1].map(|axis: usize| {
        let tile = f64::from(TILE_SIZE_PX);
        let at = (ahead[axis] / tile).round() * tile;
        at.clamp(0.0, f64::from(picture.size_px[axis])) as u32
    });
    let mut patches = Vec::new();
    let mut rate_px = 0.0;
    for number in 0..4_u16 {
        let after = [number & 1 == 1, number & 2 == 2];
        let low = [0, 1].map(|axis| if after[axis] { cut[axis] } else { 0 });
        let high = [0, 1].map(|axis| {
            if after[axis] {
                picture.size_px[axis]
            } else {
                cut[axis]
            }
        });
        if low[0] < high[0] && low[1] < high[1] {
            let (patch, rate) = quadrant(picture, number, cut, after, [low, high]);
            patches.push(patch);
            rate_px += rate;
        }
    }
    EyePatches {
        patches,
        is_picture: false,
        rate_px,
    }
}

/// The layer of a quadrant, and the number of pixels to be shaded without its border.
fn quadrant(
    picture: &EyePicture,
    number: u16,
    cut: [u32; 2],
    after: [bool; 2],
    [low, high]: [[u32; 2]; 2],
) -> (Patch, f64) {
    let length = [0, 1].map(|axis| f64::from(high[axis] - low[axis]));
    let inner = length.map(|length| (length / (1.0 + WARP)).ceil() as u32);
    let size_px = inner.map(|inner| inner + 1);
    // Position of the cut in pixels of the layer: after or before a border of one pixel.
    let seam = [0, 1].map(|axis| {
        if after[axis] {
            1.0
        } else {
            f64::from(inner[axis])
        }
    });
    let grow = [0, 1].map(|axis| (if after[axis] { WARP } else { -WARP }) / length[axis]);
    let cut = cut.map(f64::from);
    let w = DVec3::new(grow[0], grow[1], 1.0 - grow[0] * cut[0] - grow[1] * cut[1]);
    let x = DVec3::new(1.0, 0.0, -cut[0]) + seam[0] * w;
    let y = DVec3::new(0.0, 1.0, -cut[1]) + seam[1] * w;
    let layer_from_px = DMat3::from_cols(x, y, w).transpose();

    let columns = size_px[0] as usize;
    let mut read = vec![false; columns * size_px[1] as usize];
    let mut rate = 0.0;
    for y in low[1]..high[1] {
        for x in low[0]..high[0] {
            if !picture.shows([x, y], [x + 1, y + 1]) {
                continue;
            }
            let at = layer_from_px * DVec3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 1.0);
            // The map keeps areas straight ahead, so its determinant there is 1.
            rate += at.z.powi(-3);
            let first = [at.x, at.y].map(|along| (along / at.z - 0.5).floor());
            let tap = |axis: usize, step: f64| {
                (first[axis] + step).clamp(0.0, f64::from(size_px[axis] - 1)) as usize
            };
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                read[tap(1, dy) * columns + tap(0, dx)] = true;
            }
        }
    }
    let patch = Patch {
        number,
        size_px,
        mask: Some(Arc::new(Mask::new(size_px, |x, y| {
            read[y as usize * columns + x as usize]
        }))),
        tiles: Some(Arc::new(Mask::new(picture.tiles(), |x, y| {
            let [first, _] = picture.tile_px([x, y]);
            (0..2).all(|axis| (low[axis]..high[axis]).contains(&first[axis]))
        }))),
        filter: Filter::Projective,
        layer_from_px: Some(layer_from_px),
        ..Patch::whole(picture, None)
    };
    (patch, rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::view::{Eye, EyeView, FovTangents, Hmd};
    use glam::Vec4;

    fn picture(size_px: [u32; 2]) -> EyePicture {
        let fov = FovTangents::new(1.0, 1.0, 1.0, 1.0);
        let hmd = Hmd {
            eye_size_px: size_px,
            fov: [fov; 2],
            ..Hmd::default()
        };
        EyePicture::new(&hmd, 0, None, [0.0; 2])
    }

    #[test]
    fn the_share_of_shaded_pixels_is_that_of_the_integral() {
        let made = patches(&picture([1024, 1024]));
        let whole = 1024.0 * 1024.0;
        let a = WARP;
        let share = (1.0 - 2.0 / (1.0 + a) + 1.0 / (1.0 + 2.0 * a)) / (2.0 * a * a);
        assert!(
            (made.rate_px / whole - share).abs() < 1e-4,
            "{}",
            made.rate_px / whole
        );
        let drawn: u64 = (made.patches.iter())
            .map(|patch| patch.mask.as_ref().unwrap().count())
            .sum();
        // Borders are one pixel wide.
        let border = drawn as f64 / whole - share;
        assert!((0.0..0.01).contains(&border), "{border}");
    }

    #[test]
    fn the_projection_and_the_map_of_pixels_agree() {
        let picture = picture([320, 192]);
        let view = EyeView::default();
        for patch in patches(&picture).patches {
            let layer = patch.layer(Eye::Left, &view, picture.size_px);
            let map = patch.layer_from_px.unwrap();
            let tiles = patch.tiles.as_ref().unwrap();
            for (x, y) in [
                (5.0, 7.0),
                (150.0, 40.0),
                (170.5, 180.0),
                (300.0, 100.0),
                (31.0, 150.0),
            ] {
                if !tiles.get(x as u32 / 16, y as u32 / 16) {
                    continue;
                }
                // A point of that pixel at a depth w of 3, in the clip space of the default view.
                let ndc = [x / 320.0 * 2.0 - 1.0, 1.0 - y / 192.0 * 2.0];
                let point = Vec4::new(ndc[0] * 3.0, ndc[1] * 3.0, 1.0, 3.0);
                let clip = layer.clip_from_world() * point;
                let at = [
                    (clip.x / clip.w + 1.0) / 2.0 * layer.size_px[0] as f32,
                    (1.0 - clip.y / clip.w) / 2.0 * layer.size_px[1] as f32,
                ];
                let expected = map * DVec3::new(f64::from(x), f64::from(y), 1.0);
                let expected = [expected.x / expected.z, expected.y / expected.z];
                for axis in 0..2 {
                    let off = f64::from(at[axis]) - expected[axis];
                    assert!(off.abs() < 1e-3, "{x} {y}: {at:?} {expected:?}");
                    assert!((0.0..=layer.size_px[axis] as f32).contains(&at[axis]));
                }
                // The order of depths is kept, and nothing additional is clipped.
                assert!(clip.w >= 3.0 && clip.z == 1.0);
            }
        }
    }

    #[test]
    fn quadrants_agree_along_their_cuts() {
        let made = patches(&picture([320, 192]));
        let at = |number: usize, x: f64, y: f64| {
            let patch = &made.patches[number];
            let at = patch.layer_from_px.unwrap() * DVec3::new(x, y, 1.0);
            // Distance from the cut of the other axis, in pixels of the layer.
            at.y / at.z
                - patch
                    .layer_from_px
                    .unwrap()
                    .mul_vec3(DVec3::new(160.0, 96.0, 1.0))
                    .y
        };
        for y in [0.0, 20.0, 90.0] {
            assert!((at(0, 160.0, y) - at(1, 160.0, y)).abs() < 1e-9);
        }
    }
}
