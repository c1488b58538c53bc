//! Reads plain accesses from a file, a pipe or standard input.

use super::compression::foreign;
use super::{AddressForm, Compression, Decoder, MOST_RECORD_BYTES, PlainAccess, din, gem5};
use crate::container::kind_of;
use crate::error::{FormatError, Place};
use memmap2::Mmap;
use std::fs::File;
use std::io::{self, BufReader, Cursor, IsTerminal, Read};
use std::path::Path;

/// Number of bytes used to detect the form.
const HEAD_BYTES: usize = 4096;

/// Size of the read buffer.
const BUFFER_BYTES: usize = 2 * MOST_RECORD_BYTES;

enum Bytes<'a> {
    Mapped(Mmap),
    Stream(Box<dyn Read + 'a>),
}

/// A source of plain accesses that can be read once.
pub struct AddressFile<'a> {
    name: String,
    form: AddressForm,
    compression: Option<Compression>,
    bytes: Bytes<'a>,
}

/// Consecutive accesses.
#[derive(Clone, Copy, Debug)]
pub enum Block<'a> {
    /// Read addresses of 4 bytes each.
    U32(&'a [[u8; 4]]),
    /// Read addresses of 8 bytes each.
    U64(&'a [[u8; 8]]),
    /// Accesses with kind and size.
    Accesses(&'a [PlainAccess]),
}

/// Counts of a file's content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Number of accesses, at least one.
    pub accesses: u64,
    /// Packets skipped because they neither read nor write cacheable data.
    pub other_packets: u64,
}

impl AddressFile<'static> {
    /// Opens a file, a pipe, or standard input if the path is `-`. Compression is detected by the first
    /// bytes. Without a `form`, it is taken from the name's extension (before .gz or .zst), or else
    /// detected by the first bytes.
    ///
    /// # Errors
    /// Unreadable input (a folder, a device, a terminal), empty input, or an unknown form.
    pub fn open(path: &Path, form: Option<AddressForm>) -> Result<Self, FormatError> {
        let name = path.display().to_string();
        let io = |action| {
            let name = name.clone();
            move |source| FormatError::io(&name, action, source)
        };
        if name == "-" {
            let stdin = io::stdin();
            if stdin.is_terminal() {
                return Err(wanted(&name, "a file or a pipe", "a terminal"));
            }
            return Self::of_stream("standard input".to_owned(), form, stdin);
        }
        let mut file = File::open(path).map_err(io("open"))?;
        let metadata = file.metadata().map_err(io("read the size of"))?;
        if let kind @ ("a folder" | "a device") = kind_of(&metadata) {
            return Err(wanted(&name, "a file or a pipe", kind));
        }
        if !metadata.is_file() || metadata.len() == 0 {
            return Self::of_stream(name, form, file);
        }
        let mut magic = Vec::new();
        Read::take(&mut file, 4)
            .read_to_end(&mut magic)
            .map_err(io("read"))?;
        if Compression::of_content(&magic).is_some() {
            return Self::of_stream(name, form, Cursor::new(magic).chain(file));
        }
        // SAFETY: the map is read-only, and programs that write traces do not change them while others
        // read. This program writes under a temporary name and renames.
        let map = unsafe { Mmap::map(&file) }.map_err(io("map"))?;
        let head = map.get(..HEAD_BYTES).unwrap_or(&map);
        let form = detect_form(&name, form, head, map.len() <= HEAD_BYTES)?;
        Ok(Self {
            name,
            form,
            compression: None,
            bytes: Bytes::Mapped(map),
        })
    }
}

impl<'a> AddressFile<'a> {
    /// Reads a stream like a pipe in [`Self::open`]; `name` identifies it in errors.
    ///
    /// # Errors
    /// See [`Self::open`].
    pub fn of_stream(
        name: String,
        form: Option<AddressForm>,
        stream: impl Read + 'a,
    ) -> Result<Self, FormatError> {
        let plain = |(source, at)| unreadable(&name, None, at, source);
        let (magic, stream) = head_of(stream, 4).map_err(plain)?;
        let compression = Compression::of_content(&magic);
        let stream: Box<dyn Read + 'a> = match compression {
            None => Box::new(stream),
            Some(compression) => compression.reader(BufReader::with_capacity(1 << 16, stream)),
        };
        let read = |(source, at)| unreadable(&name, compression, at, source);
        let (head, stream) = head_of(stream, HEAD_BYTES).map_err(read)?;
        let form = detect_form(&name, form, &head, head.len() < HEAD_BYTES)?;
        Ok(Self {
            name,
            form,
            compression,
            bytes: Bytes::Stream(Box::new(stream)),
        })
    }

    /// Name in errors.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Form of the accesses.
    pub fn form(&self) -> AddressForm {
        self.form
    }

    /// Compression of the file.
    pub fn compression(&self) -> Option<Compression> {
        self.compression
    }

    /// Calls `visit` with all accesses in order, until it fails.
    ///
    /// # Errors
    /// Unreadable or malformed input, with the place; a file without accesses; errors of `visit`.
    pub fn for_blocks<E: From<FormatError>>(
        self,
        mut visit: impl FnMut(Block<'_>) -> Result<(), E>,
    ) -> Result<Found, E> {
        let name = self.name.clone();
        let found = match self.form {
            AddressForm::U32 => self.words(|words| visit(Block::U32(words))),
            AddressForm::U64 => self.words(|words| visit(Block::U64(words))),
            AddressForm::Din => self.records(din::Din::default(), visit),
            AddressForm::Gem5 => self.records(gem5::Gem5::default(), visit),
        }?;
        if found.accesses == 0 {
            let found = match found.other_packets {
                0 => "none".to_owned(),
                others => format!("none among {others} packets"),
            };
            let expected = "at least one access";
            return Err(FormatError::malformed(&name, Place::Contents, 0, expected, found).into());
        }
        Ok(found)
    }

    fn words<const N: usize, E: From<FormatError>>(
        self,
        mut visit: impl FnMut(&[[u8; N]]) -> Result<(), E>,
    ) -> Result<Found, E> {
        let mut found = Found::default();
        let name = self.name.clone();
        self.pieces::<E>(|piece, at, ended| {
            let (words, rest) = piece.as_chunks::<N>();
            let taken = piece.len() - rest.len();
            found.accesses += words.len() as u64;
            if ended && !rest.is_empty() {
                let place = Place::Access(found.accesses + 1);
                let (at, expected) = (at + taken as u64, format_args!("{N} bytes"));
                return Err(FormatError::malformed(&name, place, at, expected, rest.len()).into());
            }
            visit(words)?;
            Ok(taken)
        })?;
        Ok(found)
    }

    fn records<E: From<FormatError>>(
        self,
        mut decoder: impl Decoder,
        mut visit: impl FnMut(Block<'_>) -> Result<(), E>,
    ) -> Result<Found, E> {
        let mut found = Found::default();
        let name = self.name.clone();
        let mut accesses = Vec::new();
        self.pieces::<E>(|piece, at, ended| {
            let mut taken = 0;
            loop {
                accesses.clear();
                let rest = piece.get(taken..).unwrap_or_default();
                let decoded = decoder.decode(rest, ended, &mut accesses);
                taken += decoded.map_err(|fault| {
                    let at = at + (taken + fault.at) as u64;
                    FormatError::malformed(&name, fault.place, at, fault.expected, fault.found)
                })?;
                if accesses.is_empty() {
                    return Ok(taken);
                }
                found.accesses += accesses.len() as u64;
                visit(Block::Accesses(&accesses))?;
            }
        })?;
        found.other_packets = decoder.other_packets();
        Ok(found)
    }

    /// Calls `take` with consecutive pieces, their offset and whether the piece is the last. `take` returns
    /// the number of bytes used; the others are passed again.
    fn pieces<E: From<FormatError>>(
        self,
        mut take: impl FnMut(&[u8], u64, bool) -> Result<usize, E>,
    ) -> Result<(), E> {
        let (name, compression) = (self.name, self.compression);
        let mut stream = match self.bytes {
            Bytes::Mapped(map) => return take(&map, 0, true).map(|_| ()),
            Bytes::Stream(stream) => stream,
        };
        let mut buffer = Vec::with_capacity(BUFFER_BYTES);
        let mut at = 0;
        loop {
            let room = (BUFFER_BYTES - buffer.len()) as u64;
            let read = stream.by_ref().take(room).read_to_end(&mut buffer);
            let read = read.map_err(|source| {
                unreadable(&name, compression, at + buffer.len() as u64, source)
            })?;
            let ended = (read as u64) < room;
            let taken = take(&buffer, at, ended)?;
            if ended {
                return Ok(());
            }
            buffer.drain(..taken);
            at += taken as u64;
        }
    }
}

/// The first bytes of a stream (at most `count`) and the stream including them, or an error and the number
/// of bytes before it.
fn head_of<R: Read>(mut stream: R, count: usize) -> Result<(Vec<u8>, impl Read), (io::Error, u64)> {
    let mut head = Vec::new();
    let read = stream.by_ref().take(count as u64).read_to_end(&mut head);
    read.map_err(|source| (source, head.len() as u64))?;
    Ok((head.clone(), Cursor::new(head).chain(stream)))
}

/// The given form, or else that of the name, or else that of the first bytes.
fn detect_form(
    name: &str,
    given: Option<AddressForm>,
    head: &[u8],
    whole: bool,
) -> Result<AddressForm, FormatError> {
    let compression = Compression::of_name(name);
    let plain = compression.and_then(|c| name.strip_suffix(c.extension()));
    let named = given.or_else(|| AddressForm::of_name(plain.unwrap_or(name)));
    // Words may begin with any bytes.
    let words = matches!(named, Some(AddressForm::U32 | AddressForm::U64));
    if let (false, Some((kind, unpack))) = (words, foreign(head)) {
        let expected = format_args!(
            "addresses without compression, or with gzip or Zstandard (unpack with `{unpack}` and pipe \
             the result into `--addresses -`)"
        );
        return Err(FormatError::malformed(
            name,
            Place::Contents,
            0,
            expected,
            kind,
        ));
    }
    named
        .or_else(|| AddressForm::of_content(head, whole))
        .ok_or_else(|| {
            let found = match head {
                [] => "nothing".to_owned(),
                _ => super::shown(head.get(..16).unwrap_or(head)),
            };
            let expected = "din text, a gem5 trace, or a name that ends in .u32, .u64, .din or .gem5 \
                            (--address-form tells)";
            FormatError::malformed(name, Place::Contents, 0, expected, found)
        })
}

fn wanted(name: &str, expected: &str, found: &str) -> FormatError {
    let message = format!("expected {expected}, found {found}");
    FormatError::io(name, "read", io::Error::other(message))
}

/// An error after `at` bytes of content.
fn unreadable(
    name: &str,
    compression: Option<Compression>,
    at: u64,
    source: io::Error,
) -> FormatError {
    let action = match compression {
        None => "read",
        Some(Compression::Gzip) => "decompress (gzip)",
        Some(Compression::Zstd) => "decompress (zstd)",
    };
    let why = match source.kind() {
        io::ErrorKind::UnexpectedEof => "expected more, found the end".to_owned(),
        _ => source.to_string(),
    };
    let why = format!("after {at} bytes of content: {why}");
    FormatError::io(name, action, io::Error::new(source.kind(), why))
}
