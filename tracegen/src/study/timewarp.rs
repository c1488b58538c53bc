//! Timewarp of a frame's pictures: what a runtime shows if no new frame is ready.

use formats::view::FrameViews;
use glam::DVec3;
use image_error::color::{linear_from_srgb, srgb8_from_linear};
use raster::capture::Pictures;
use rayon::prelude::*;
use std::sync::LazyLock;
use std::time::{Duration, Instant};
use techniques::timewarp::{ByDepth, before_from_now_px};

/// What a frame leaves for the next one at half rate.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Its number.
    pub number: u32,
    /// Its pictures.
    pub pictures: Pictures,
    /// Their depth, if it is needed.
    pub depths: Option<Vec<Vec<f32>>>,
}

/// A frame that was reprojected from the one before.
#[derive(Debug)]
pub struct Reprojected {
    /// Its pictures.
    pub pictures: Pictures,
    /// Bytes of pictures and depth that were read and written for it.
    pub bytes: u64,
    /// Its time.
    pub took: Duration,
}

/// Linear light of each sRGB code.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

/// Bytes of a pixel: sRGB RGBA8.
const PIXEL_BYTES: usize = 4;

/// Reprojects both eyes' pictures of a frame shown `before` to the head's pose `now`: rotated, and translated
/// if their depth is known.
pub fn reproject(
    shown: &Shown,
    before: &FrameViews,
    now: &FrameViews,
    size_px: [u32; 2],
) -> Reprojected {
    let start = Instant::now();
    let eyes = before.eyes.iter().zip(&now.eyes).zip(&shown.pictures);
    let pictures: Pictures = eyes
        .enumerate()
        .map(|(eye, ((before, now), picture))| match &shown.depths {
            Some(depths) => {
                let by_depth = ByDepth::new(before, now, &depths[eye], size_px);
                warp(picture, |at| by_depth.before_px(at), size_px)
            }
            None => {
                let turned = before_from_now_px(before, now, size_px);
                let before_px = |[x, y]: [f64; 2]| {
                    let at = turned * DVec3::new(x, y, 1.0);
                    [at.x / at.z, at.y / at.z]
                };
                warp(picture, before_px, size_px)
            }
        })
        .collect();
    // Neighbouring pixels read nearly the same pixels, so each is fetched once, with its depth, and each is
    // written once.
    let per_picture = if shown.depths.is_some() { 3 } else { 2 };
    let bytes = per_picture
        * pictures
            .iter()
            .map(|picture| picture.len() as u64)
            .sum::<u64>();
    Reprojected {
        pictures,
        bytes,
        took: start.elapsed(),
    }
}

/// A picture whose pixels sample the source at `before_px`, bilinearly in linear light. Beyond the edge, the
/// last pixels are repeated.
fn warp(
    picture: &[u8],
    before_px: impl Fn([f64; 2]) -> [f64; 2] + Sync,
    size_px: [u32; 2],
) -> Vec<u8> {
    let [width, height] = size_px.map(|size| size as usize);
    let mut out = vec![255; picture.len()];
    let row_bytes = PIXEL_BYTES * width;
    out.par_chunks_mut(row_bytes.max(1))
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.chunks_mut(PIXEL_BYTES).enumerate() {
                let [at_x, at_y] = before_px([x as f64 + 0.5, y as f64 + 0.5]);
                let along = |at: f64, size: usize| {
                    let last = size as f64 - 1.0;
                    let at = (at - 0.5).clamp(0.0, last);
                    let low = at.floor();
                    (
                        low as usize,
                        (low + 1.0).min(last) as usize,
                        (at - low) as f32,
                    )
                };
                let (x0, x1, tx) = along(at_x, width);
                let (y0, y1, ty) = along(at_y, height);
                for (channel, value) in pixel.iter_mut().take(3).enumerate() {
                    let light = |x: usize, y: usize| {
                        LINEAR[usize::from(picture[y * row_bytes + PIXEL_BYTES * x + channel])]
                    };
                    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
                    let top = mix(light(x0, y0), light(x1, y0), tx);
                    let bottom = mix(light(x0, y1), light(x1, y1), tx);
                    *value = srgb8_from_linear(mix(top, bottom, ty));
                }
            }
        });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::view::EyeView;
    use glam::Mat4;
    use glam::camera::rh::proj::directx::perspective;

    const SIZE_PX: [u32; 2] = [120, 80];

    fn views(yaw: f32) -> FrameViews {
        let eye = EyeView {
            world_to_eye: Mat4::from_rotation_y(yaw).inverse().to_cols_array_2d(),
            eye_to_clip: perspective(1.0, 1.5, 100.0, 0.1).to_cols_array_2d(),
            ..EyeView::default()
        };
        FrameViews {
            frame: 0,
            eyes: [eye; 2],
        }
    }

    fn shown(picture: Vec<u8>) -> Shown {
        Shown {
            number: 0,
            pictures: vec![picture.clone(), picture],
            depths: None,
        }
    }

    /// A world at infinity: light by direction, smooth enough for linear interpolation.
    fn sky(views: &FrameViews) -> Vec<u8> {
        let back = views.eyes[0].clip_from_world().inverse();
        let pixels = (0..80).flat_map(|y| (0..120).map(move |x| (x as f32, y as f32)));
        pixels
            .flat_map(|(x, y)| {
                let ndc = [(x + 0.5) / 60.0 - 1.0, 1.0 - (y + 0.5) / 40.0];
                let ahead = back
                    .project_point3(glam::Vec3::new(ndc[0], ndc[1], 0.5))
                    .normalize();
                let light = |a: f32| srgb8_from_linear(0.5 + 0.4 * (5.0 * a).sin());
                [
                    light(ahead.x),
                    light(ahead.y),
                    light(ahead.x + ahead.y),
                    255,
                ]
            })
            .collect()
    }

    #[test]
    fn a_world_at_infinity_is_shown_as_if_it_had_been_rendered() {
        let (before, now) = (views(0.00), views(0.05));
        let picture = sky(&before);
        let warped = reproject(&shown(picture), &before, &now, SIZE_PX);
        let expected = sky(&now);
        assert_eq!(warped.bytes, 2 * 2 * 120 * 80 * 4);
        for (pixel, (got, expected)) in warped.pictures[1].iter().zip(&expected).enumerate() {
            // The eye turned to the left by up to 6.3 px at the left edge, and rows there are 4 % farther apart:
            // what came in at the left, the top and the bottom was never rendered.
            let (x, y) = (pixel / 4 % 120, pixel / 4 / 120);
            let rendered = x >= 7 && (2..78).contains(&y);
            let off = got.abs_diff(*expected);
            assert!(!rendered || off <= 2, "{x}, {y}: {got} {expected}");
        }
        let moved = sky(&before)
            .iter()
            .zip(&expected)
            .filter(|(a, b)| a.abs_diff(**b) > 3)
            .count();
        assert!(moved > 5_000, "nothing to correct: {moved}");
    }

    /// A wall one metre ahead, seen by eyes `right_m` to the right.
    fn wall(right_m: f32) -> (FrameViews, Vec<u8>, f32) {
        let mut views = views(0.0);
        for eye in &mut views.eyes {
            eye.world_to_eye = Mat4::from_translation(-right_m * glam::Vec3::X).to_cols_array_2d();
        }
        let clip = Mat4::from_cols_array_2d(&views.eyes[0].eye_to_clip);
        let depth = clip.project_point3(glam::Vec3::NEG_Z).z;
        let pixels = (0..80).flat_map(|y| (0..120).map(move |x| (x as f32, y as f32)));
        let picture = pixels.flat_map(|(x, y)| {
            let ndc = glam::Vec3::new((x + 0.5) / 60.0 - 1.0, 1.0 - (y + 0.5) / 40.0, depth);
            let at = clip.inverse().project_point3(ndc) + right_m * glam::Vec3::X;
            let light = |a: f32| srgb8_from_linear(0.5 + 0.4 * (5.0 * a).sin());
            [light(at.x), light(at.y), light(at.x + at.y), 255]
        });
        (views, picture.collect(), depth)
    }

    #[test]
    fn a_head_that_moves_needs_depth() {
        let (before, picture, depth) = wall(0.0);
        let (now, expected, _) = wall(0.1);
        // A metre is 73 px, so 8 columns enter at the right edge.
        let worst = |shown: &Shown| {
            let warped = reproject(shown, &before, &now, SIZE_PX);
            let pixels = warped.pictures[0].iter().zip(&expected).enumerate();
            let rendered = pixels.filter(|(at, _)| at / 4 % 120 < 111);
            rendered
                .map(|(_, (got, expected))| got.abs_diff(*expected))
                .max()
        };
        let turned = shown(picture);
        let by_depth = Shown {
            depths: Some(vec![vec![depth; 120 * 80]; 2]),
            ..shown(turned.pictures[0].clone())
        };
        assert!(worst(&by_depth) <= Some(2), "{:?}", worst(&by_depth));
        // Without depth, light is off by up to 0.8 sin(0.25): 0.2 of linear light, over 30 codes of sRGB at
        // mid grey.
        assert!(worst(&turned) > Some(30), "{:?}", worst(&turned));
    }

    #[test]
    fn a_head_that_stays_is_shown_the_same_picture() {
        let here = views(0.3);
        let picture = sky(&here);
        let warped = reproject(&shown(picture.clone()), &here, &here, SIZE_PX);
        assert_eq!(warped.pictures, [picture.clone(), picture]);
    }
}
