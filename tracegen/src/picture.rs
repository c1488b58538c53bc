//! The picture of all views side by side.

use formats::container::AtomicFile;
use std::io::Write;
use std::path::Path;

/// Writes all views side by side as a PNG into a temporary file beside `path`, to be persisted
/// there once everything else has succeeded.
///
/// # Errors
/// What the file system or the encoder reports.
pub fn prepare_side_by_side(
    path: &Path,
    pictures: &[Vec<u8>],
    size_px: [u32; 2],
) -> anyhow::Result<AtomicFile> {
    let [width, height] = size_px;
    let row_bytes = width as usize * 4;
    let mut pixels = Vec::with_capacity(pictures.len() * row_bytes * height as usize);
    for row in 0..height as usize {
        for picture in pictures {
            pixels.extend_from_slice(&picture[row * row_bytes..][..row_bytes]);
        }
    }
    let mut file = AtomicFile::create(path)?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut bytes,
        &pixels,
        pictures.len() as u32 * width,
        height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )?;
    file.write_all(bytes.get_ref())?;
    Ok(file)
}
