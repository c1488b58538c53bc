//! Flicker: change between consecutive frames beyond the change in the reference.

use crate::motion::Motion;
use crate::{Mask, Picture};

/// Edge of the tiles in which changes are compared with the reference's. The sampling of edges between
/// pixels changes single pixels at random in both pictures; averaged over a tile, this effect cancels.
pub const TILE_PX: usize = 32;

/// Mean over the pixels of the change that a technique adds to the reference's, 0 (none) to 1, on sRGB
/// codes. A pixel's change is the mean over the channels of `|p_1(x) - p_0(x + v)| / 255`, where `v` leads
/// to the position of the same content in the previous reference. In each tile, the technique's changes
/// minus the reference's count if the difference is positive. An error that moves with an object therefore
/// does not flicker, although it changes every pixel it moves across; neither does blur. Only pixels inside
/// the mask in both frames count.
///
/// `frames` are two consecutive frames, each with the reference and the test, all of the mask's size.
/// `motion` is that of the references.
pub fn flicker(frames: [[&Picture; 2]; 2], motion: &Motion, mask: &Mask) -> f64 {
    let [[before_reference, before], [after_reference, after]] = frames;
    let (width, height) = (before.width(), before.height());
    let columns = width.div_ceil(TILE_PX);
    let mut excess = vec![0.0_f64; columns * height.div_ceil(TILE_PX)];
    let mut pixels = 0_u64;
    for (at, _) in mask
        .inside
        .iter()
        .enumerate()
        .filter(|(_, inside)| **inside)
    {
        let (x, y) = (at % width, at / width);
        let Some(source) = Source::new(motion.vector([x, y]), [x, y], [width, height]) else {
            continue;
        };
        if !source
            .taps
            .iter()
            .all(|(tap, weight)| *weight == 0.0 || mask.inside[*tap])
        {
            continue;
        }
        pixels += 1;
        let more =
            source.change(before, after, at) - source.change(before_reference, after_reference, at);
        excess[y / TILE_PX * columns + x / TILE_PX] += f64::from(more);
    }
    let sum: f64 = excess.iter().map(|more| more.max(0.0)).sum();
    sum / (255.0 * 3.0 * pixels.max(1) as f64)
}

/// Position of a pixel's content in the previous frame: the four nearest pixels and their weights.
struct Source {
    taps: [(usize, f32); 4],
}

impl Source {
    /// `None` if the position is outside the picture.
    fn new([dx, dy]: [f32; 2], [x, y]: [usize; 2], [width, height]: [usize; 2]) -> Option<Self> {
        let (was_x, was_y) = (x as f32 + dx, y as f32 + dy);
        let inside = (0.0..=(width - 1) as f32).contains(&was_x)
            && (0.0..=(height - 1) as f32).contains(&was_y);
        if !inside {
            return None;
        }
        let (x0, y0) = (was_x as usize, was_y as usize);
        let (x1, y1) = ((x0 + 1).min(width - 1), (y0 + 1).min(height - 1));
        let (tx, ty) = (was_x.fract(), was_y.fract());
        Some(Self {
            taps: [
                (y0 * width + x0, (1.0 - tx) * (1.0 - ty)),
                (y0 * width + x1, tx * (1.0 - ty)),
                (y1 * width + x0, (1.0 - tx) * ty),
                (y1 * width + x1, tx * ty),
            ],
        })
    }

    /// Difference of a pixel from its content in the previous frame, summed over channels, in codes.
    fn change(&self, before: &Picture, after: &Picture, at: usize) -> f32 {
        let code =
            |picture: &Picture, at: usize, channel: usize| f32::from(picture.pixels[at][channel]);
        (0..3)
            .map(|channel| {
                let was: f32 = (self.taps.iter())
                    .map(|(tap, weight)| weight * code(before, *tap, channel))
                    .sum();
                (code(after, at, channel) - was).abs()
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{noise, panned, scene_like, shifted};

    fn of(frames: [[&Picture; 2]; 2]) -> f64 {
        let motion = Motion::between(frames[0][0], frames[1][0]);
        flicker(frames, &motion, &Mask::everything(frames[0][0].size_px))
    }

    /// The change of the error at each pixel, without motion compensation.
    fn change_of_error([[r0, t0], [r1, t1]]: [[&Picture; 2]; 2]) -> f64 {
        let error = |r: &Picture, t: &Picture, i: usize, c: usize| {
            f64::from(t.pixels[i][c]) - f64::from(r.pixels[i][c])
        };
        let changes = (0..r0.pixels.len())
            .flat_map(|i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| (error(r1, t1, i, c) - error(r0, t0, i, c)).abs());
        changes.sum::<f64>() / (255.0 * 3.0 * r0.pixels.len() as f64)
    }

    #[test]
    fn an_error_that_stays_does_not_flicker() {
        let grey = |code| Picture::filled([8, 8], [code; 3]);
        let (a, b, a_test, b_test) = (grey(50), grey(90), grey(60), grey(100));
        assert_eq!(of([[&a, &a_test], [&b, &b_test]]), 0.0);
    }

    #[test]
    fn an_error_that_vanishes_for_a_frame_flickers_by_its_share_of_the_picture() {
        let still = Picture::filled([10, 10], [20; 3]);
        let mut gone = still.clone();
        gone.pixels[..10].fill([122; 3]);
        let value = of([[&still, &still], [&still, &gone]]);
        assert!((value - 0.1 * 102.0 / 255.0).abs() < 1e-6, "{value}");
    }

    #[test]
    fn a_correctly_shown_moving_scene_does_not_flicker() {
        let a = scene_like([40, 30]);
        let b = shifted(&a, 3);
        assert_eq!(of([[&a, &a], [&b, &b]]), 0.0);
        assert!(of([[&a, &a], [&b, &noise([40, 30], 1)]]) > 0.1);
    }

    /// Compares a technique that shifts everything by 0.7 pixels with one that does so only in every other
    /// frame.
    #[test]
    fn with_a_moving_head_a_steady_error_ranks_below_one_that_comes_and_goes() {
        let size_px = [160, 120];
        for pan in [[0.0, 0.0], [4.0, 0.0], [6.5, -2.25], [-12.3, 3.6]] {
            let picture =
                |frame: f32, aside: f32| panned(size_px, [pan[0] * frame + aside, pan[1] * frame]);
            let [before, after] = [picture(0.0, 0.0), picture(1.0, 0.0)];
            let [before_aside, after_aside] = [picture(0.0, 0.7), picture(1.0, 0.7)];
            let steady = [[&before, &before_aside], [&after, &after_aside]];
            let comes = [[&before, &before], [&after, &after_aside]];
            let (low, high) = (of(steady), of(comes));
            assert!(low < 0.2 * high, "{pan:?}: {low} {high}");
            // Without motion compensation, the constant error would flicker more as soon as the head moves.
            if pan[0] >= 4.0 {
                assert!(change_of_error(steady) > change_of_error(comes), "{pan:?}");
            }
        }
    }

    #[test]
    fn pixels_outside_the_mask_do_not_flicker() {
        let still = Picture::filled([10, 10], [20; 3]);
        let mut gone = still.clone();
        gone.pixels[..10].fill([122; 3]);
        let mut mask = Mask::everything([10, 10]);
        mask.inside[..10].fill(false);
        let motion = Motion::between(&still, &still);
        assert_eq!(
            flicker([[&still, &still], [&still, &gone]], &motion, &mask),
            0.0
        );
    }
}
