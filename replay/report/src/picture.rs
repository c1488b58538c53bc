//! Rendered pictures embedded in a page.

use super::plots::data_uri;
use anyhow::Context;
use image::codecs::jpeg::JpegEncoder;
use image::{ImageReader, RgbImage};
use image_error::Picture;
use std::path::Path;

/// A picture of both eyes, re-encoded small enough for a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmbeddedPicture {
    /// Label of the trace that it belongs to.
    pub label: String,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    jpeg: Vec<u8>,
}

/// Wider pictures are scaled down to this width.
const WIDEST_PX: u32 = 1200;
const JPEG_QUALITY: u8 = 85;

/// Reads a PNG or JPEG file.
///
/// # Errors
/// The file is missing or is not a picture; the message names it.
pub fn read(path: &Path) -> anyhow::Result<RgbImage> {
    let picture = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .with_context(|| format!("{}: cannot read", path.display()))?
        .decode()
        .with_context(|| format!("{}: not a picture", path.display()))?;
    Ok(picture.to_rgb8())
}

impl EmbeddedPicture {
    /// Reads a PNG or JPEG file.
    ///
    /// # Errors
    /// The file is missing or is not a picture; the message names it.
    pub fn open(label: &str, path: &Path) -> anyhow::Result<Self> {
        Self::encode(label, read(path)?).with_context(|| path.display().to_string())
    }

    /// Encodes a computed picture.
    ///
    /// # Errors
    /// The picture is empty.
    pub fn of(label: &str, picture: &Picture) -> anyhow::Result<Self> {
        let [width, height] = picture.size_px;
        let bytes = picture.pixels.iter().flatten().copied().collect();
        let picture = RgbImage::from_raw(width, height, bytes);
        Self::encode(label, picture.unwrap_or_default()).with_context(|| label.to_owned())
    }

    fn encode(label: &str, picture: RgbImage) -> anyhow::Result<Self> {
        let (width, height) = picture.dimensions();
        anyhow::ensure!(width > 0 && height > 0, "the picture is empty");
        let picture = if width > WIDEST_PX {
            let scaled =
                (u64::from(height) * u64::from(WIDEST_PX) / u64::from(width)).max(1) as u32;
            image::imageops::resize(
                &picture,
                WIDEST_PX,
                scaled,
                image::imageops::FilterType::Triangle,
            )
        } else {
            picture
        };
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY)
            .encode_image(&picture)
            .context("cannot encode")?;
        Ok(Self {
            label: label.to_owned(),
            size_px: [picture.width(), picture.height()],
            jpeg,
        })
    }

    /// The picture as a `data:` address.
    pub(super) fn data_uri(&self) -> String {
        data_uri::jpeg(&self.jpeg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_picture_is_scaled_down_and_keeps_its_shape() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("both.png");
        image::RgbImage::new(1920, 1080).save(&path).unwrap();
        let picture = EmbeddedPicture::open("atrium", &path).unwrap();
        assert_eq!(picture.size_px, [1200, 675]);
        assert!(
            picture
                .data_uri()
                .starts_with("data:image/jpeg;base64,/9j/")
        );
    }

    #[test]
    fn a_file_that_is_not_a_picture_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        std::fs::write(&path, "no").unwrap();
        assert!(
            EmbeddedPicture::open("x", &path)
                .unwrap_err()
                .to_string()
                .contains("x.png: not a picture")
        );
    }
}
