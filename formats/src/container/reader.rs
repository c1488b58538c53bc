//! Reads a container through a memory map.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::header::{DIRECTORY_ENTRY_BYTES, HEADER_BYTES, Header};
use super::{CHUNK_ALIGNMENT_BYTES, ChunkEntry, ChunkTag, Kind};
use crate::error::{Broken, FormatError, Place, Result};
use crate::parse::{Parsed, parse_all};
use crate::records::parse_records;
use memmap2::Mmap;
use serde_json::Value;
use std::fmt::{Arguments, Display};
use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// A file's bytes, mapped or owned.
#[derive(Debug)]
enum Bytes {
    Mapped(Mmap),
    Owned(Vec<u8>),
}

impl Bytes {
    fn as_slice(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Owned(bytes) => bytes,
        }
    }
}

/// Largest trace that can be read from a pipe. Pipes cannot be mapped.
const MAX_STREAM_BYTES: u64 = 1 << 30;

/// Reads a trace from a pipe: first the header, which has the file size, then the rest.
fn read_stream(name: &str, mut stream: impl Read) -> Result<Vec<u8>> {
    let io = |source| FormatError::io(name, "read", source);
    let mut bytes = Vec::new();
    let mut header = stream.by_ref().take(HEADER_BYTES as u64);
    header.read_to_end(&mut bytes).map_err(io)?;
    let header = parse_all(name, Place::Header, 0, &bytes, Header::parse)?;
    if header.file_bytes > MAX_STREAM_BYTES {
        let expected = format!("at most {MAX_STREAM_BYTES} bytes from a pipe: save it as a file");
        let found = header.file_bytes;
        return Err(FormatError::malformed(
            name,
            Place::Header,
            24,
            expected,
            found,
        ));
    }
    // Read one extra byte to detect a longer stream.
    let rest = header.file_bytes.saturating_sub(HEADER_BYTES as u64) + 1;
    stream.take(rest).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

/// Standard input, once.
fn standard_input() -> io::Result<File> {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    let stdin = io::stdin();
    if stdin.is_terminal() {
        return Err(io::Error::other(
            "expected a file or a pipe, found a terminal",
        ));
    }
    if TAKEN.swap(true, Ordering::Relaxed) {
        return Err(io::Error::other("standard input was read already"));
    }
    #[cfg(unix)]
    let file = std::os::fd::AsFd::as_fd(&stdin)
        .try_clone_to_owned()?
        .into();
    #[cfg(windows)]
    let file = std::os::windows::io::AsHandle::as_handle(&stdin)
        .try_clone_to_owned()?
        .into();
    Ok(file)
}

/// An open trace file with checked header, directory and padding.
///
/// A chunk's checksum is computed when the file is opened and compared when the chunk is requested.
#[derive(Debug)]
pub struct Container {
    file: String,
    bytes: Bytes,
    header: Header,
    directory: Vec<ChunkEntry>,
    /// Computed CRC-32 of each chunk, to be compared with the directory's.
    crc32s: Vec<u32>,
}

impl Container {
    /// Maps a file, or reads a pipe into memory, and checks header, directory and padding. `-` is standard
    /// input, which may be a pipe or a file.
    ///
    /// # Errors
    /// The file cannot be read or is not a valid container.
    pub fn open(path: &Path) -> Result<Self> {
        let is_stdin = path == Path::new("-");
        let name = match is_stdin {
            true => "standard input".to_owned(),
            false => path.display().to_string(),
        };
        let io = |action| {
            let name = name.clone();
            move |source| FormatError::io(&name, action, source)
        };
        let file = match is_stdin {
            true => standard_input(),
            false => File::open(path),
        };
        let file = file.map_err(io("open"))?;
        let metadata = file.metadata().map_err(io("read the size of"))?;
        if metadata.is_dir() {
            return Err(io("read")(std::io::ErrorKind::IsADirectory.into()));
        }
        if !metadata.is_file() {
            let bytes = read_stream(&name, file)?;
            return Self::from_named_bytes(name, Bytes::Owned(bytes));
        }
        if metadata.len() == 0 {
            // An empty file cannot be mapped; the header parser then reports the missing header.
            return Self::from_named_bytes(name, Bytes::Owned(Vec::new()));
        }
        // SAFETY: the map is read-only. Traces are written under a temporary name and renamed, so the
        // writer never changes an open file.
        let map = unsafe { Mmap::map(&file) }.map_err(io("map"))?;
        Self::from_named_bytes(name, Bytes::Mapped(map))
    }

    /// Reads a container from memory.
    ///
    /// # Errors
    /// The bytes are not a valid container.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        Self::from_named_bytes("memory".to_owned(), Bytes::Owned(bytes))
    }

    fn from_named_bytes(file: String, bytes: Bytes) -> Result<Self> {
        let all = bytes.as_slice();
        let malformed = |place, offset, expected: String, found: String| {
            FormatError::malformed(&file, place, offset, expected, found)
        };
        let header_bytes = all.get(..HEADER_BYTES).unwrap_or(all);
        let header = parse_all(&file, Place::Header, 0, header_bytes, Header::parse)?;
        let file_bytes = all.len() as u64;
        if header.file_bytes != file_bytes {
            return Err(malformed(
                Place::Header,
                24,
                format!("a file of {} bytes", header.file_bytes),
                format!("{file_bytes} bytes"),
            ));
        }
        let at = header.directory_offset;
        let directory_bytes = usize::try_from(at)
            .ok()
            .filter(|at| *at >= HEADER_BYTES)
            .and_then(|at| all.get(at..))
            .filter(|rest| {
                (rest.len() as u64)
                    == u64::from(header.directory_count) * DIRECTORY_ENTRY_BYTES as u64
            })
            .ok_or_else(|| {
                malformed(
                    Place::Header,
                    16,
                    format!(
                        "a directory of {} entries that ends with the file",
                        header.directory_count
                    ),
                    format!("offset {at}"),
                )
            })?;
        let crc32 = crc32fast::hash(directory_bytes);
        if crc32 != header.directory_crc32 {
            return Err(malformed(
                Place::Directory,
                at,
                format!("CRC-32 {:08x}", header.directory_crc32),
                format!("{crc32:08x}"),
            ));
        }
        let directory: Vec<ChunkEntry> =
            parse_all(&file, Place::Directory, at, directory_bytes, |input| {
                parse_records(header.version_major, input)
            })?;
        check_placement(&file, all, at, &directory)?;
        let crc32_of = |entry| crc32fast::hash(slice(all, entry).unwrap_or_default());
        let crc32s = directory.iter().map(crc32_of).collect();
        Ok(Self {
            file,
            bytes,
            header,
            directory,
            crc32s,
        })
    }

    /// Name for error messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The kind of trace.
    pub fn kind(&self) -> Kind {
        self.header.kind
    }

    /// Major and minor version.
    pub fn version(&self) -> (u16, u16) {
        (self.header.version_major, self.header.version_minor)
    }

    /// Size of the file.
    pub fn file_bytes(&self) -> u64 {
        self.header.file_bytes
    }

    /// The chunks in file order.
    pub fn directory(&self) -> &[ChunkEntry] {
        &self.directory
    }

    /// Checks that the file is of `kind`.
    ///
    /// # Errors
    /// The file is of another kind.
    pub fn expect_kind(&self, kind: Kind) -> Result<()> {
        if self.kind() == kind {
            return Ok(());
        }
        let (expected, found) = (format_args!("a {kind}"), format_args!("a {}", self.kind()));
        Err(FormatError::malformed(
            &self.file,
            Place::Header,
            12,
            expected,
            found,
        ))
    }

    /// The directory entry of a required chunk.
    ///
    /// # Errors
    /// The chunk is missing.
    pub fn entry(&self, tag: ChunkTag) -> Result<&ChunkEntry> {
        self.directory
            .iter()
            .find(|entry| entry.tag == tag)
            .ok_or_else(|| {
                let at = self.header.directory_offset;
                let expected = format_args!("an entry for chunk {tag}");
                FormatError::malformed(&self.file, Place::Directory, at, expected, "none")
            })
    }

    /// Bytes of a chunk, with its CRC checked.
    ///
    /// # Errors
    /// The chunk is missing or damaged.
    pub fn chunk(&self, tag: ChunkTag) -> Result<&[u8]> {
        let mut of_tag = self.directory.iter().zip(&self.crc32s);
        if let Some((entry, crc32)) = of_tag.find(|(entry, _)| entry.tag == tag)
            && entry.crc32 != *crc32
        {
            let expected = format!("CRC-32 {:08x}", entry.crc32);
            return Err(self.malformed(tag, 0, expected, format!("{crc32:08x}")));
        }
        self.chunk_unchecked(tag)
    }

    /// Checks the CRC of every chunk, including unknown chunks.
    ///
    /// # Errors
    /// The first damaged chunk.
    pub fn check_chunks(&self) -> Result<()> {
        let mut tags = self.directory.iter().map(|entry| entry.tag);
        tags.try_for_each(|tag| self.chunk(tag).map(|_| ()))
    }

    /// Checks that the chunks of `tags` are present in this order; other chunks may be between them.
    ///
    /// # Errors
    /// A chunk is missing or out of order.
    pub fn expect_order(&self, tags: &[ChunkTag]) -> Result<()> {
        let mut previous = None;
        for tag in tags {
            let entry = self.entry(*tag)?;
            if let Some((before, offset)) = previous
                && offset > entry.offset_bytes
            {
                let expected = format!("chunk {tag} behind chunk {before}");
                return Err(self.malformed(*tag, 0, expected, "it before"));
            }
            previous = Some((tag, entry.offset_bytes));
        }
        Ok(())
    }

    /// Bytes of a chunk whose parts have their own checksums; its CRC is not checked.
    ///
    /// # Errors
    /// The chunk is missing.
    pub fn chunk_unchecked(&self, tag: ChunkTag) -> Result<&[u8]> {
        let entry = self.entry(tag)?;
        // Placement was checked when the file was opened.
        Ok(slice(self.bytes.as_slice(), entry).unwrap_or_default())
    }

    /// An error located at byte `offset_in_chunk` of a chunk.
    pub fn malformed(
        &self,
        tag: ChunkTag,
        offset_in_chunk: u64,
        expected: impl Display,
        found: impl Display,
    ) -> FormatError {
        let start = self.entry(tag).map_or(0, |entry| entry.offset_bytes);
        let offset = start.saturating_add(offset_in_chunk);
        FormatError::malformed(&self.file, Place::Chunk(tag), offset, expected, found)
    }

    /// An error for the request of something that the trace does not have.
    pub(crate) fn out_of_range(&self, what: &'static str, index: u64, count: u64) -> FormatError {
        FormatError::OutOfRange {
            file: self.file.clone(),
            what,
            index,
            count,
        }
    }

    /// A violated rule at byte `offset_in_chunk` of a chunk.
    pub(crate) fn broken(
        &self,
        tag: ChunkTag,
        offset_in_chunk: u64,
        broken: Broken,
    ) -> FormatError {
        let expected = format!("{}: {}", broken.what, broken.expected);
        self.malformed(tag, offset_in_chunk, expected, broken.found)
    }

    /// Checks that a file with `what`, which is in a chunk, has the minor version that introduced it.
    pub(crate) fn expect_minor(&self, least: u16, tag: ChunkTag, what: &str) -> Result<()> {
        let (major, minor) = self.version();
        if minor >= least {
            return Ok(());
        }
        let expected = format!("version {major}.{least} for {what}");
        Err(self.malformed(tag, 0, expected, format_args!("{major}.{minor}")))
    }

    /// Runs a parser over a complete checked chunk.
    ///
    /// # Errors
    /// The chunk is missing, damaged, or rejected by the parser.
    pub fn parse_chunk<'a, T>(
        &'a self,
        tag: ChunkTag,
        parser: impl FnOnce(&'a [u8]) -> Parsed<'a, T>,
    ) -> Result<T> {
        let bytes = self.chunk(tag)?;
        let offset = self.entry(tag)?.offset_bytes;
        parse_all(&self.file, Place::Chunk(tag), offset, bytes, parser)
    }

    /// CRC-32 of the content of a trace, which identifies it in results: every chunk except the
    /// description, and the description without the keys about the capture itself (FORMAT.md, Content
    /// checksum).
    pub(crate) fn content_checksum(&self, description: ChunkTag) -> u32 {
        /// Keys of the description, or of its `trace`, that are not part of the content.
        const ANNOTATIONS: [&str; 6] = [
            "tool",
            "command_line",
            "scene",
            "backend",
            "driver",
            "techniques",
        ];
        let mut crc32 = crc32fast::Hasher::new();
        for entry in self
            .directory
            .iter()
            .filter(|entry| entry.tag != description)
        {
            crc32.update(&entry.tag.0);
            crc32.update(&entry.length_bytes.to_le_bytes());
            crc32.update(&entry.crc32.to_le_bytes());
        }
        let bytes = self.chunk_unchecked(description).unwrap_or_default();
        // A trace can only be opened if its description is JSON.
        let mut value: Value = serde_json::from_slice(bytes).unwrap_or_default();
        if let Some(trace) = value.get_mut("trace") {
            without(trace, &ANNOTATIONS);
        }
        without(&mut value, &ANNOTATIONS);
        value.sort_all_objects();
        crc32.update(value.to_string().as_bytes());
        crc32.finalize()
    }

    /// CRC-32 of the whole file.
    ///
    /// Combines the chunks' checksums with those of the few bytes around them.
    pub fn file_checksum(&self) -> u32 {
        let all = self.bytes.as_slice();
        let mut crc32 = crc32fast::Hasher::new();
        let mut end = 0;
        for (entry, of_chunk) in self.directory.iter().zip(&self.crc32s) {
            let start = usize::try_from(entry.offset_bytes).unwrap_or(usize::MAX);
            crc32.update(all.get(end..start).unwrap_or_default());
            let length = entry.length_bytes;
            crc32.combine(&crc32fast::Hasher::new_with_initial_len(*of_chunk, length));
            end = start.saturating_add(usize::try_from(length).unwrap_or(usize::MAX));
        }
        crc32.update(all.get(end..).unwrap_or_default());
        crc32.finalize()
    }
}

/// Removes keys of an object.
fn without(object: &mut Value, keys: &[&str]) {
    if let Some(object) = object.as_object_mut() {
        object.retain(|key, _| !keys.contains(&key.as_str()));
    }
}

fn slice<'a>(all: &'a [u8], entry: &ChunkEntry) -> Option<&'a [u8]> {
    let start = usize::try_from(entry.offset_bytes).ok()?;
    let length = usize::try_from(entry.length_bytes).ok()?;
    all.get(start..start.checked_add(length)?)
}

/// Checks that the chunks are consecutive and aligned, with only zero padding between them: no overlap, no
/// hidden bytes, no chunk past the end, no duplicate tag.
fn check_placement(
    file: &str,
    all: &[u8],
    directory_offset: u64,
    directory: &[ChunkEntry],
) -> Result<()> {
    let check = |holds: bool, at: u64, expected: Arguments<'_>, found: Arguments<'_>| match holds {
        true => Ok(()),
        false => Err(FormatError::malformed(
            file,
            Place::Directory,
            at,
            expected,
            found,
        )),
    };
    let check_padding = |end: u64, start: u64| {
        let range = usize::try_from(end).ok().zip(usize::try_from(start).ok());
        let padding = range.and_then(|(end, start)| all.get(end..start));
        let is_zero = padding.is_some_and(|bytes| bytes.iter().all(|byte| *byte == 0));
        check(
            is_zero,
            end,
            format_args!("zero padding"),
            format_args!("{padding:02x?}"),
        )
    };
    let mut end = HEADER_BYTES as u64;
    for (index, entry) in directory.iter().enumerate() {
        let at = directory_offset + (index * DIRECTORY_ENTRY_BYTES) as u64;
        let ChunkEntry {
            tag,
            offset_bytes,
            length_bytes,
            ..
        } = *entry;
        let is_ascii = tag.0.iter().all(u8::is_ascii_graphic);
        check(
            is_ascii,
            at,
            format_args!("a tag of printable ASCII"),
            format_args!("{tag}"),
        )?;
        let is_new = directory
            .iter()
            .take(index)
            .all(|earlier| earlier.tag != tag);
        check(
            is_new,
            at,
            format_args!("each tag once"),
            format_args!("{tag} twice"),
        )?;
        let start = end.next_multiple_of(CHUNK_ALIGNMENT_BYTES);
        check(
            offset_bytes == start,
            at + 8,
            format_args!("chunk {tag} at byte {start}"),
            format_args!("offset {offset_bytes}"),
        )?;
        check_padding(end, start)?;
        let room = directory_offset.saturating_sub(start);
        check(
            length_bytes <= room,
            at + 16,
            format_args!("chunk {tag} of at most {room} bytes"),
            format_args!("{length_bytes} bytes"),
        )?;
        end = start.saturating_add(length_bytes);
    }
    let start = end.next_multiple_of(CHUNK_ALIGNMENT_BYTES);
    check(
        start == directory_offset,
        directory_offset,
        format_args!("the directory at byte {start}, after the last chunk"),
        format_args!("it at {directory_offset}"),
    )?;
    check_padding(end, start)
}
