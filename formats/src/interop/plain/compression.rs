//! gzip and Zstandard, detected by the first bytes when reading and by the file name when writing.

use flate2::GzBuilder;
use flate2::bufread::GzDecoder;
use flate2::write::GzEncoder;
use ruzstd::decoding::BlockDecodingStrategy;
use ruzstd::decoding::FrameDecoder;
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::{self, BufRead, Read, Write};

/// Compression methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Compression {
    /// gzip (RFC 1952).
    Gzip,
    /// Zstandard (RFC 8878).
    Zstd,
}

impl Compression {
    /// All methods.
    pub const ALL: [Self; 2] = [Self::Gzip, Self::Zstd];

    /// Name in flags and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }

    /// File name extension.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gzip => ".gz",
            Self::Zstd => ".zst",
        }
    }

    /// The compression of a file name's extension, if any.
    pub fn of_name(name: &str) -> Option<Self> {
        let ends = |compression: &Self| name.ends_with(compression.extension());
        Self::ALL.into_iter().find(ends)
    }

    /// The compression detected from a file's first bytes, if any.
    pub(super) fn of_content(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            // A frame, or one of the sixteen kinds of skippable frames.
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Some(Self::Zstd),
            _ => None,
        }
    }

    /// The decompressed content of `input`, with all its members or frames concatenated.
    pub(super) fn reader<'a>(self, input: impl BufRead + 'a) -> Box<dyn Read + 'a> {
        match self {
            Self::Gzip => Box::new(GzipReader {
                member: Some(GzDecoder::new(input)),
            }),
            Self::Zstd => Box::new(ZstdReader {
                input,
                frame: FrameDecoder::new(),
                in_frame: false,
            }),
        }
    }
}

/// Name and unpacking command of a compression or an archive that is not read, by a file's first bytes.
pub(super) fn foreign(head: &[u8]) -> Option<(&'static str, &'static str)> {
    match head {
        [0xfd, b'7', b'z', b'X', b'Z', 0, ..] => Some(("xz", "xz -dc")),
        [b'B', b'Z', b'h', b'1'..=b'9', b'1', b'A', b'Y', ..] => Some(("bzip2", "bzip2 -dc")),
        [0x04, 0x22, 0x4d, 0x18, ..] => Some(("LZ4", "lz4 -dc")),
        [b'P', b'K', 3, 4, ..] => Some(("ZIP", "unzip -p")),
        [b'7', b'z', 0xbc, 0xaf, 0x27, 0x1c, ..] => Some(("7z", "7z x -so")),
        [0x1f, 0x9d, ..] => Some(("compress", "uncompress -c")),
        _ => None,
    }
}

/// Decompresses consecutive members. Zeros after the last one are padding, as tapes and some programs write.
struct GzipReader<R> {
    member: Option<GzDecoder<R>>,
}

impl<R: BufRead> Read for GzipReader<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.member {
            let read = member.read(out)?;
            if read > 0 || out.is_empty() {
                return Ok(read);
            }
            let Some(mut input) = self.member.take().map(GzDecoder::into_inner) else {
                break;
            };
            let mut is_padded = false;
            loop {
                let next = input.fill_buf()?;
                if next.is_empty() {
                    return Ok(0);
                }
                let zeros = next.iter().take_while(|&&byte| byte == 0).count();
                if zeros == 0 {
                    break;
                }
                is_padded = true;
                input.consume(zeros);
            }
            if is_padded {
                return Err(invalid("bytes other than zero follow the padding"));
            }
            self.member = Some(GzDecoder::new(input));
        }
        Ok(0)
    }
}

/// Decompresses consecutive frames and checks their checksums.
struct ZstdReader<R> {
    input: R,
    frame: FrameDecoder,
    in_frame: bool,
}

impl<R: BufRead> Read for ZstdReader<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if out.is_empty() {
            return Ok(0);
        }
        loop {
            if !self.in_frame {
                if self.input.fill_buf()?.is_empty() {
                    return Ok(0);
                }
                self.begin()?;
                continue;
            }
            if self.frame.can_collect() > 0 {
                return self.frame.read(out);
            }
            if self.frame.is_finished() {
                self.in_frame = false;
                let (stored, counted) = (
                    self.frame.get_checksum_from_data(),
                    self.frame.get_calculated_checksum(),
                );
                if stored.is_some() && stored != counted {
                    return Err(invalid("the checksum of a frame is wrong"));
                }
                continue;
            }
            self.frame
                .decode_blocks(&mut self.input, BlockDecodingStrategy::UptoBlocks(1))
                .map_err(wrong_frame)?;
        }
    }
}

impl<R: BufRead> ZstdReader<R> {
    /// Reads the header of a frame, or skips a skippable frame.
    fn begin(&mut self) -> io::Result<()> {
        match self.frame.reset(&mut self.input) {
            Ok(()) => self.in_frame = true,
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                length,
                ..
            })) => {
                let skipped = io::copy(
                    &mut self.input.by_ref().take(length.into()),
                    &mut io::sink(),
                )?;
                if skipped < length.into() {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
            }
            Err(error) => return Err(wrong_frame(error)),
        }
        Ok(())
    }
}

fn wrong_frame(error: FrameDecoderError) -> io::Error {
    // Only the innermost error is useful; the outer ones repeat it in debug form.
    let mut cause: &(dyn std::error::Error + 'static) = &error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    match cause.downcast_ref::<io::Error>() {
        Some(io) if io.kind() == io::ErrorKind::UnexpectedEof => {
            io::ErrorKind::UnexpectedEof.into()
        }
        _ => invalid(&cause.to_string()),
    }
}

fn invalid(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, why.to_owned())
}

/// Uncompressed size of a frame.
const FRAME_BYTES: usize = 4 << 20;

/// Writes with optional compression.
pub enum CompressedWriter<W: Write> {
    /// Without compression.
    Plain(W),
    /// gzip.
    Gzip(GzEncoder<W>),
    /// Zstandard: the writer, and the bytes of the next frame.
    Zstd(W, Vec<u8>),
}

impl<W: Write> CompressedWriter<W> {
    /// Compresses into `out`. Equal input gives equal bytes.
    pub fn new(compression: Option<Compression>, out: W) -> Self {
        match compression {
            None => Self::Plain(out),
            // Neither name nor time, so that equal input gives equal bytes.
            Some(Compression::Gzip) => {
                Self::Gzip(GzBuilder::new().write(out, flate2::Compression::new(6)))
            }
            Some(Compression::Zstd) => Self::Zstd(out, Vec::with_capacity(FRAME_BYTES)),
        }
    }

    /// Writes the remaining bytes and returns the underlying writer.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn finish(self) -> io::Result<W> {
        match self {
            Self::Plain(out) => Ok(out),
            Self::Gzip(encoder) => encoder.finish(),
            Self::Zstd(mut out, rest) => {
                if !rest.is_empty() {
                    out.write_all(&compress_to_vec(rest.as_slice(), CompressionLevel::Fastest))?;
                }
                Ok(out)
            }
        }
    }
}

impl<W: Write> Write for CompressedWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Plain(out) => out.write(bytes),
            Self::Gzip(encoder) => encoder.write(bytes),
            Self::Zstd(out, frame) => {
                let room = FRAME_BYTES - frame.len();
                let (now, _) = bytes.split_at(bytes.len().min(room));
                frame.extend_from_slice(now);
                if frame.len() == FRAME_BYTES {
                    out.write_all(&compress_to_vec(
                        frame.as_slice(),
                        CompressionLevel::Fastest,
                    ))?;
                    frame.clear();
                }
                Ok(now.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Plain(out) | Self::Zstd(out, _) => out.flush(),
            Self::Gzip(encoder) => encoder.flush(),
        }
    }
}
