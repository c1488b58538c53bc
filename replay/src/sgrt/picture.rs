//! The right image with its bad pixels in yellow, as the paper's figure 1 shows them.

use super::detect::{Decision, PixelClass};
use super::frame::Frame;
use crate::image::Picture;

/// Traced pixels, missing or rejected.
pub const BAD_PIXEL: [u8; 3] = [255, 230, 0];

/// The picture with every pixel yellow of which any sample is traced.
#[must_use]
pub fn bad_pixels(frame: &Frame, decisions: &[Decision], picture: &Picture) -> Picture {
    marked(frame, decisions, picture, |class| {
        (!class.is_reused()).then_some(BAD_PIXEL)
    })
}

/// The picture darkened and tinted by class: missing red, rejected yellow, overlapped blue.
#[must_use]
pub fn classes(frame: &Frame, decisions: &[Decision], picture: &Picture) -> Picture {
    marked(frame, decisions, picture, |class| match class {
        PixelClass::Reused => None,
        PixelClass::Overlapped => Some([86, 180, 233]),
        PixelClass::Missing => Some([213, 94, 0]),
        PixelClass::Bad => Some(BAD_PIXEL),
    })
}

fn marked(
    frame: &Frame,
    decisions: &[Decision],
    picture: &Picture,
    color: impl Fn(PixelClass) -> Option<[u8; 3]>,
) -> Picture {
    let mut out = picture.clone();
    let spp = frame.samples_per_px as usize;
    for (pixel, samples) in out.pixels.iter_mut().zip(decisions.chunks_exact(spp)) {
        if let Some(mark) = samples.iter().find_map(|d| color(d.class)) {
            *pixel = mark;
        }
    }
    out
}
