//! A folder written by `tracegen techniques`: its manifest and the files that it names.

use super::check::{Fault, check};
use super::manifest::Manifest;
use formats::container::{check_regular, checksum, open_regular, read_regular};
use formats::view::Eye;
use image::{ImageFormat, ImageReader, Limits};
use image_error::{Mask, Picture};
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// Size limit of a manifest.
const LONGEST_MANIFEST_BYTES: u64 = 256 << 20;

/// An error in a folder; always names the file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct FolderError {
    path: PathBuf,
    problem: Problem,
}

#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("expected at most {LONGEST_MANIFEST_BYTES} bytes of JSON, found more")]
    TooLong,
    #[error("expected a manifest of techniques: {0}")]
    Json(#[from] serde_json::Error),
    #[error(transparent)]
    Fault(#[from] Fault),
    #[error("not a PNG picture: {0}")]
    Picture(#[from] image::ImageError),
    #[error("expected {}x{} pixels, found {}x{}", expected[0], expected[1], found[0], found[1])]
    Size { expected: [u32; 2], found: [u32; 2] },
    #[error(
        "expected the checksum {expected} of the manifest, found {found}: not the file that the study wrote"
    )]
    Checksum { expected: String, found: String },
    #[error("expected a file inside {0}, found a link to {1}")]
    Outside(String, String),
}

/// A folder with a checked manifest.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    /// The manifest.
    pub manifest: Manifest,
    /// Visible pixels of the left and the right eye.
    pub masks: [Mask; 2],
}

impl Folder {
    /// Reads and checks the manifest of a folder.
    ///
    /// # Errors
    /// A missing manifest, or one that breaks a rule; the error names the file and the key.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let file = path.join("manifest.json");
        let manifest = read(&file).map_err(|problem| FolderError {
            path: file,
            problem,
        })?;
        let mask = |eye: usize| {
            let (lens, fov) = (manifest.lens[eye], manifest.hmd.fov[eye]);
            Mask::of_lens(manifest.size_px, &fov, &lens)
        };
        Ok(Self {
            path: path.to_owned(),
            masks: [mask(0), mask(1)],
            manifest,
        })
    }

    /// Name of the folder itself.
    pub fn name(&self) -> String {
        let whole = self.path.canonicalize();
        let path = whole.as_deref().unwrap_or(&self.path);
        let name = path.file_name().unwrap_or(self.path.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// Every file that is read from the folder.
    ///
    /// # Errors
    /// See [`Self::file`].
    pub fn files(&self) -> Result<Vec<PathBuf>, FolderError> {
        let rows = &self.manifest.rows;
        let images = rows.iter().flat_map(|r| &r.frames).flat_map(|f| &f.images);
        let traces = rows.iter().filter_map(|row| row.trace.as_ref());
        let named = images.chain(traces).map(|relative| self.file(relative));
        let manifest = std::iter::once(Ok(self.path.join("manifest.json")));
        manifest.chain(named).collect()
    }

    /// A file that the manifest names.
    ///
    /// # Errors
    /// The file does not exist, is not a regular file, or is a link to a file outside the folder.
    pub fn file(&self, relative: &str) -> Result<PathBuf, FolderError> {
        let path = self.path.join(relative);
        let resolve = || -> Result<(), Problem> {
            let (whole, folder) = (path.canonicalize()?, self.path.canonicalize()?);
            if !whole.starts_with(&folder) {
                let text = |path: &Path| path.display().to_string();
                return Err(Problem::Outside(text(&folder), text(&whole)));
            }
            check_regular(&whole)?;
            Ok(())
        };
        match resolve() {
            Ok(()) => Ok(path),
            Err(problem) => Err(FolderError { path, problem }),
        }
    }

    /// The bytes of an eye's picture in a frame of a row; row and frame are indices.
    ///
    /// # Errors
    /// The file cannot be read, or is not the one that the study wrote.
    pub(super) fn picture_file(
        &self,
        row: usize,
        frame: usize,
        eye: Eye,
    ) -> Result<PictureFile<'_>, FolderError> {
        let frame = &self.manifest.rows[row].frames[frame];
        let path = self.file(&frame.images[eye as usize])?;
        let expected = frame.image_checksums.as_ref().map(|of| &of[eye as usize]);
        let read = || -> Result<Vec<u8>, Problem> {
            let bytes = read_regular(&path)?;
            matches_checksum(expected, || checksum(&bytes))?;
            Ok(bytes)
        };
        match read() {
            Ok(bytes) => Ok(PictureFile {
                folder: self,
                path,
                bytes,
            }),
            Err(problem) => Err(FolderError { path, problem }),
        }
    }

    /// Checks that a row's trace is the one that the study wrote.
    ///
    /// # Errors
    /// A content checksum other than the manifest's.
    pub fn check_trace(&self, row: usize, found: &str) -> Result<(), FolderError> {
        let row = &self.manifest.rows[row];
        let expected = row.trace_checksum.as_ref();
        matches_checksum(expected, || found.to_owned()).map_err(|problem| FolderError {
            path: self.path.join(row.trace.as_deref().unwrap_or_default()),
            problem,
        })
    }
}

/// A picture file, read but not decoded.
#[derive(Debug)]
pub struct PictureFile<'a> {
    folder: &'a Folder,
    path: PathBuf,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

/// Compares with the manifest's checksum, which is missing in folders of earlier versions.
fn matches_checksum(
    expected: Option<&String>,
    found: impl FnOnce() -> String,
) -> Result<(), Problem> {
    let Some(expected) = expected else {
        return Ok(());
    };
    let found = found();
    if found == *expected {
        return Ok(());
    }
    Err(Problem::Checksum {
        expected: expected.clone(),
        found,
    })
}

impl PictureFile<'_> {
    /// Decodes the picture.
    ///
    /// # Errors
    /// Not a PNG, or its size differs from the manifest's.
    pub fn decode(&self) -> Result<Picture, FolderError> {
        let expected = self.folder.manifest.size_px;
        decode(&self.bytes, expected).map_err(|problem| FolderError {
            path: self.path.clone(),
            problem,
        })
    }
}

fn decode(bytes: &[u8], expected: [u32; 2]) -> Result<Picture, Problem> {
    let reader = || ImageReader::with_format(std::io::Cursor::new(bytes), ImageFormat::Png);
    let (width, height) = reader().into_dimensions()?;
    let found = [width, height];
    if found != expected {
        return Err(Problem::Size { expected, found });
    }
    let mut reader = reader();
    let mut limits = Limits::default();
    // Sixteen bits in each of four channels, and the same amount for the decoder.
    limits.max_alloc = Some(16 * u64::from(width) * u64::from(height) + (1 << 20));
    reader.limits(limits);
    let picture = reader.decode()?.into_rgb8();
    Ok(Picture {
        size_px: found,
        pixels: picture.pixels().map(|pixel| pixel.0).collect(),
    })
}

fn read(path: &Path) -> Result<Manifest, Problem> {
    let mut text = Vec::new();
    BufReader::new(open_regular(path)?)
        .take(LONGEST_MANIFEST_BYTES + 1)
        .read_to_end(&mut text)?;
    if text.len() as u64 > LONGEST_MANIFEST_BYTES {
        return Err(Problem::TooLong);
    }
    let manifest: Manifest = serde_json::from_slice(&text)?;
    check(&manifest)?;
    Ok(manifest)
}
