//! The picture of both eyes side by side.

use formats::container::AtomicFile;
use raster::capture::Pictures;
use std::io::Write;
use std::path::Path;

/// Writes both eyes side by side as a PNG into a temporary file beside `path`, to be persisted
/// there once everything else has succeeded.
///
/// # Errors
/// What the file system or the encoder reports.
pub fn prepare_side_by_side(
    path: &Path,
    pictures: &Pictures,
    size_px: [u32; 2],
) -> anyhow::Result<AtomicFile> {
    let [width, height] = size_px;
    let row_bytes = width as usize * 4;
    let mut pixels = Vec::with_capacity(2 * row_bytes * height as usize);
    for (left, right) in pictures[0]
        .chunks_exact(row_bytes)
        .zip(pictures[1].chunks_exact(row_bytes))
    {
        pixels.extend_from_slice(left);
        pixels.extend_from_slice(right);
    }
    let mut file = AtomicFile::create(path)?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut bytes,
        &pixels,
        2 * width,
        height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )?;
    file.write_all(bytes.get_ref())?;
    Ok(file)
}
