//! Hidden-area mask: pixels outside the lens are not drawn.

use crate::Mask;
use crate::eye::EyePicture;
use crate::patch::{EyePatches, Patch};
use std::sync::Arc;

/// The picture with a mask of the pixels that the lens shows. A pixel is drawn if any point of its square is
/// inside the circle.
pub(crate) fn patches(picture: &EyePicture) -> EyePatches {
    let all = f64::from(picture.size_px[0]) * f64::from(picture.size_px[1]);
    let mask = picture.lens.map(|_| {
        Arc::new(Mask::new(picture.size_px, |x, y| {
            picture.shows([x, y], [x + 1, y + 1])
        }))
    });
    EyePatches {
        rate_px: mask.as_ref().map_or(all, |mask| mask.count() as f64),
        patches: vec![Patch::whole(picture, mask)],
        is_picture: true,
    }
}
