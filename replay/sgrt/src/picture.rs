//! The right image with bad pixels in yellow, as in the paper's figure 1.

use super::detect::Decision;
use image_error::Picture;

/// Colour of traced pixels, missing or rejected.
const BAD_PIXEL: [u8; 3] = [255, 230, 0];

/// The picture with every traced pixel yellow.
pub fn bad_pixels(decisions: &[Decision], picture: &Picture) -> Picture {
    let mut out = picture.clone();
    for (pixel, decision) in out.pixels.iter_mut().zip(decisions) {
        if !decision.class.is_reused() {
            *pixel = BAD_PIXEL;
        }
    }
    out
}
