//! Pictures as PNG files and as text for a page.

use super::Picture;
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use std::io::Write;
use std::path::Path;

/// A picture that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The encoder refused the picture.
    #[error("cannot encode a {width}x{height} picture as PNG: {source}")]
    Encode {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Why.
        source: image::ImageError,
    },
    /// The file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// File asked for.
        path: String,
        /// Why.
        source: std::io::Error,
    },
}

/// The picture's PNG file as bytes.
///
/// # Errors
/// `PngError::Encode` where the pixels do not fill the size.
pub fn encode(picture: &Picture) -> Result<Vec<u8>, PngError> {
    let [width, height] = picture.size_px;
    let bytes: Vec<u8> = picture.pixels.iter().flatten().copied().collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&bytes, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|source| PngError::Encode {
            width,
            height,
            source,
        })?;
    Ok(png)
}

/// Writes the picture beside its target and renames, so that no half-written file is ever seen.
///
/// # Errors
/// [`PngError`]; the target is then as it was.
pub fn write(picture: &Picture, path: &Path) -> Result<(), PngError> {
    let png = encode(picture)?;
    let failed = |source| PngError::Write {
        path: path.display().to_string(),
        source,
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    file.write_all(&png).map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// The picture as a `data:` address that a page can show without another file.
///
/// # Errors
/// As [`encode`].
pub fn data_url(picture: &Picture) -> Result<String, PngError> {
    Ok(format!(
        "data:image/png;base64,{}",
        base64(&encode(picture)?)
    ))
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            if i <= chunk.len() {
                let code = word >> (18 - 6 * i) & 63;
                text.push(char::from(ALPHABET[code as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::noise;
    use super::*;

    #[test]
    fn base64_matches_the_standards_examples() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn a_written_picture_reads_back_the_same() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("a.png");
        let picture = noise([13, 7], 9);
        write(&picture, &path).expect("written");
        let back = image::open(&path).expect("readable").into_rgb8();
        let pixels: Vec<[u8; 3]> = back.pixels().map(|p| p.0).collect();
        assert_eq!(pixels, picture.pixels);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
    }

    #[test]
    fn a_folder_that_does_not_exist_is_named() {
        let error = write(&noise([1, 1], 1), Path::new("no/such/folder/a.png")).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("cannot write no/such/folder/a.png")
        );
    }
}
