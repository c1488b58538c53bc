//! Encodes pictures as PNG.

use crate::Picture;
use image::ImageEncoder;
use image::codecs::png::PngEncoder;

/// Error for a picture that the encoder refused.
#[derive(Debug, thiserror::Error)]
#[error("cannot encode a {width}x{height} picture as PNG: {source}")]
pub struct PngError {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The encoder's reason.
    pub source: image::ImageError,
}

/// The picture's PNG file as bytes.
///
/// # Errors
/// [`PngError`] if the number of pixels does not match the size.
pub fn encode(picture: &Picture) -> Result<Vec<u8>, PngError> {
    let [width, height] = picture.size_px;
    let bytes: Vec<u8> = picture.pixels.iter().flatten().copied().collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&bytes, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|source| PngError {
            width,
            height,
            source,
        })?;
    Ok(png)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::noise;

    #[test]
    fn an_encoded_picture_decodes_to_the_same_pixels() {
        let picture = noise([13, 7], 9);
        let png = encode(&picture).expect("encodes");
        let back = image::load_from_memory(&png).expect("decodes").into_rgb8();
        let pixels: Vec<[u8; 3]> = back.pixels().map(|p| p.0).collect();
        assert_eq!(pixels, picture.pixels);
    }

    #[test]
    fn a_picture_without_pixels_is_refused_with_its_size() {
        let error = encode(&Picture::filled([0, 3], [0; 3])).unwrap_err();
        assert!(error.to_string().contains("0x3"), "{error}");
    }
}
