//! Flicker: what a technique changes from one frame to the next that the scene does not.

use crate::{Mask, Picture};

/// Mean over the pixels inside the mask and the channels of
/// `|(test_1 - test_0) - (reference_1 - reference_0)| / 255`, on sRGB codes: how far the change
/// between two frames is off, 0 (none) to 2. An error that stays as it is does not flicker; one
/// that comes and goes does.
///
/// `frames` are two frames in a row, each the reference and the test, all of the mask's size.
#[must_use]
pub fn flicker(frames: [[&Picture; 2]; 2], mask: &Mask) -> f64 {
    let [[before_reference, before], [after_reference, after]] = frames;
    let (mut sum, mut pixels) = (0u64, 0u64);
    let changes = before.pixels.iter().zip(&after.pixels);
    let expected = before_reference.pixels.iter().zip(&after_reference.pixels);
    let inside = mask.inside.iter();
    for (((before, after), (expected_before, expected_after)), inside) in
        changes.zip(expected).zip(inside)
    {
        if !inside {
            continue;
        }
        pixels += 1;
        for channel in 0..3 {
            let step = |a: &[u8; 3], b: &[u8; 3]| i32::from(b[channel]) - i32::from(a[channel]);
            let off = step(before, after) - step(expected_before, expected_after);
            sum += u64::from(off.unsigned_abs());
        }
    }
    sum as f64 / (255.0 * 3.0 * pixels.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_pictures::{noise, scene_like, shifted};

    #[test]
    fn an_error_that_stays_does_not_flicker() {
        let (a, b) = (
            Picture::filled([8, 8], [50; 3]),
            Picture::filled([8, 8], [90; 3]),
        );
        let (a_test, b_test) = (
            Picture::filled([8, 8], [60; 3]),
            Picture::filled([8, 8], [100; 3]),
        );
        let mask = Mask::everything([8, 8]);
        assert_eq!(flicker([[&a, &a_test], [&b, &b_test]], &mask), 0.0);
    }

    #[test]
    fn what_vanishes_for_a_frame_flickers_by_its_share_of_the_picture() {
        let still = Picture::filled([10, 10], [20; 3]);
        let mut gone = still.clone();
        gone.pixels[..10].fill([122; 3]);
        let mask = Mask::everything([10, 10]);
        let value = flicker([[&still, &still], [&still, &gone]], &mask);
        assert!((value - 0.1 * 102.0 / 255.0).abs() < 1e-12, "{value}");
    }

    #[test]
    fn a_moving_scene_that_is_shown_as_it_is_does_not_flicker() {
        let a = scene_like([40, 30]);
        let b = shifted(&a, 3);
        let mask = Mask::everything([40, 30]);
        assert_eq!(flicker([[&a, &a], [&b, &b]], &mask), 0.0);
        assert!(flicker([[&a, &a], [&b, &noise([40, 30], 1)]], &mask) > 0.1);
    }
}
