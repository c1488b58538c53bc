//! Pictures for the metrics' tests.

use crate::Picture;
use formats::random::Random;

/// Uniform noise from a seed.
pub fn noise(size_px: [u32; 2], seed: u32) -> Picture {
    let mut random = Random(u64::from(seed));
    let mut picture = Picture::filled(size_px, [0; 3]);
    for channel in picture.pixels.iter_mut().flatten() {
        *channel = random.bits() as u8;
    }
    picture
}

/// Smooth colour, hard edges and fine lines.
pub fn scene_like(size_px: [u32; 2]) -> Picture {
    let mut picture = Picture::filled(size_px, [0; 3]);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = (i as u32 % size_px[0], i as u32 / size_px[0]);
        let disc = (x as i32 - 40).pow(2) + (y as i32 - 25).pow(2) < 200;
        *pixel = match (disc, y % 9) {
            (true, _) => [230, (3 * y) as u8, 20],
            (false, 0) => [15, 15, 15],
            _ => [(2 * x) as u8, 120, (255 - 2 * y) as u8],
        };
    }
    picture
}

/// The picture moved to the right by some pixels, with its left edge repeated.
pub fn shifted(picture: &Picture, by_px: usize) -> Picture {
    let width = picture.width();
    let mut out = picture.clone();
    for (i, pixel) in out.pixels.iter_mut().enumerate() {
        let x = i % width;
        *pixel = picture.pixels[i - x + x.saturating_sub(by_px)];
    }
    out
}

/// A window of an unbounded texture with its upper left corner at `pan`.
pub fn panned(size_px: [u32; 2], pan: [f32; 2]) -> Picture {
    let mut picture = Picture::filled(size_px, [0; 3]);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let x = (i as u32 % size_px[0]) as f32 + pan[0];
        let y = (i as u32 / size_px[0]) as f32 + pan[1];
        // Long waves have larger amplitudes than short ones, as in photographs. Their common period exceeds
        // the picture.
        let wave = |a: f32, b: f32| 0.15 / a.hypot(b) * (a * x + b * y).sin();
        let sum = wave(0.31, 0.17)
            + wave(-0.23, 0.41)
            + wave(0.071, 0.097)
            + wave(0.57, -0.13)
            + wave(-0.11, 0.05);
        let code = |scale: f32| (127.5 + scale * 30.0 * sum).round().clamp(0.0, 255.0) as u8;
        *pixel = [code(1.0), code(0.8), code(-0.6)];
    }
    picture
}
