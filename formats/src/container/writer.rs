//! Writes a container: streams chunks to a temporary file and renames it when complete.

use super::atomic::AtomicFile;
use super::header::{HEADER_BYTES, Header};
use super::{CHUNK_ALIGNMENT_BYTES, ChunkEntry, ChunkTag, Kind, MAJOR_1};
use crate::error::{Broken, FormatError, Result};
use crate::records;
use std::io::{Cursor, Seek, SeekFrom, Write};
use std::path::Path;

/// Writes a container chunk by chunk.
#[derive(Debug)]
pub struct ContainerWriter<W = AtomicFile> {
    file: String,
    sink: W,
    position: u64,
    header: Header,
    directory: Vec<ChunkEntry>,
    open: Option<(ChunkTag, u64, crc32fast::Hasher)>,
}

impl ContainerWriter<AtomicFile> {
    /// Starts a file of `kind`; [`Self::finish`] renames it to `path`.
    ///
    /// # Errors
    /// See [`AtomicFile::create`].
    pub fn create(path: &Path, kind: Kind) -> Result<Self> {
        let name = path.display().to_string();
        let sink =
            AtomicFile::create(path).map_err(|source| FormatError::io(&name, "write", source))?;
        Self::start(name, sink, kind)
    }

    /// Writes directory and header, and renames the file. Returns its size in bytes.
    ///
    /// # Errors
    /// Writing or renaming failed; no file is left.
    pub fn finish(mut self) -> Result<u64> {
        self.seal()?;
        self.sink
            .persist()
            .map_err(|source| FormatError::io(&self.file, "finish", source))?;
        Ok(self.position)
    }
}

impl ContainerWriter<Cursor<Vec<u8>>> {
    /// Starts a container in memory.
    ///
    /// # Errors
    /// None in practice; the signature matches that for files.
    pub fn in_memory(kind: Kind) -> Result<Self> {
        Self::start("memory".to_owned(), Cursor::new(Vec::new()), kind)
    }

    /// Writes directory and header, and returns the bytes.
    ///
    /// # Errors
    /// See [`Self::in_memory`].
    pub fn into_bytes(mut self) -> Result<Vec<u8>> {
        self.seal()?;
        Ok(self.sink.into_inner())
    }
}

impl<W: Write + Seek> ContainerWriter<W> {
    fn start(file: String, sink: W, kind: Kind) -> Result<Self> {
        let mut writer = Self {
            file,
            sink,
            position: 0,
            header: Header {
                version_major: MAJOR_1,
                kind,
                ..Header::default()
            },
            directory: Vec::new(),
            open: None,
        };
        // This placeholder is not a valid header, so an incomplete file is never accepted.
        writer.raw(&[0; HEADER_BYTES])?;
        Ok(writer)
    }

    /// Declares in the header that readers need a major version.
    pub(crate) fn require_major(&mut self, major: u16) {
        self.header.version_major = self.header.version_major.max(major);
    }

    /// Major version declared in the header.
    pub(crate) fn major(&self) -> u16 {
        self.header.version_major
    }

    /// Declares in the header a major version without minor ones.
    pub(crate) fn set_major(&mut self, major: u16) {
        self.header.version_major = major;
        self.header.version_minor = 0;
    }

    /// Declares in the header that readers need a minor version.
    pub(crate) fn require_minor(&mut self, minor: u16) {
        self.header.version_minor = self.header.version_minor.max(minor);
    }

    /// Writes a complete chunk.
    ///
    /// # Errors
    /// Writing failed.
    pub fn chunk(&mut self, tag: ChunkTag, bytes: &[u8]) -> Result<()> {
        self.begin_chunk(tag)?;
        self.append(bytes)?;
        self.end_chunk()
    }

    /// Starts a chunk for [`Self::append`].
    ///
    /// # Errors
    /// Writing failed, or the tag was used before.
    pub fn begin_chunk(&mut self, tag: ChunkTag) -> Result<()> {
        self.end_chunk()?;
        if self.directory.iter().any(|entry| entry.tag == tag) {
            let what = format!("chunk {tag}");
            return Err(Broken::new(what, "each tag once", "the same tag again").unwritable());
        }
        self.pad()?;
        self.open = Some((tag, self.position, crc32fast::Hasher::new()));
        Ok(())
    }

    /// Adds bytes to the open chunk.
    ///
    /// # Errors
    /// Writing failed, or no chunk is open.
    pub fn append(&mut self, bytes: &[u8]) -> Result<()> {
        let Some((_, _, crc32)) = &mut self.open else {
            let what = format!("{} bytes", bytes.len());
            return Err(Broken::new(what, "an open chunk", "none").unwritable());
        };
        crc32.update(bytes);
        self.raw(bytes)
    }

    /// Ends the open chunk, if any.
    ///
    /// # Errors
    /// None in practice.
    pub fn end_chunk(&mut self) -> Result<()> {
        if let Some((tag, offset_bytes, crc32)) = self.open.take() {
            self.directory.push(ChunkEntry {
                tag,
                crc32: crc32.finalize(),
                offset_bytes,
                length_bytes: self.position - offset_bytes,
            });
        }
        Ok(())
    }

    /// Number of bytes written so far, including the header.
    pub fn position_bytes(&self) -> u64 {
        self.position
    }

    fn seal(&mut self) -> Result<()> {
        self.end_chunk()?;
        self.pad()?;
        let mut directory = Vec::new();
        for entry in &self.directory {
            records::write(MAJOR_1, entry, &mut directory)?;
        }
        self.header.directory_offset = self.position;
        self.header.directory_count = u32::try_from(self.directory.len()).unwrap_or(u32::MAX);
        self.header.directory_crc32 = crc32fast::hash(&directory);
        self.raw(&directory)?;
        self.header.file_bytes = self.position;
        let header = self.header.to_bytes()?;
        self.sink
            .seek(SeekFrom::Start(0))
            .and_then(|_| self.sink.write_all(&header))
            .and_then(|()| self.sink.flush())
            .map_err(|source| FormatError::io(&self.file, "write the header of", source))
    }

    fn pad(&mut self) -> Result<()> {
        let padding = self.position.next_multiple_of(CHUNK_ALIGNMENT_BYTES) - self.position;
        self.raw(&[0; CHUNK_ALIGNMENT_BYTES as usize][..padding as usize])
    }

    fn raw(&mut self, bytes: &[u8]) -> Result<()> {
        self.sink
            .write_all(bytes)
            .map_err(|source| FormatError::io(&self.file, "write", source))?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}
