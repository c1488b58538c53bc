//! gzip and Zstandard, by the first bytes of what is read and the names of what is written.

use flate2::GzBuilder;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;
use ruzstd::decoding::BlockDecodingStrategy;
use ruzstd::decoding::FrameDecoder;
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::{self, BufRead, Read, Write};

/// How bytes are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Compression {
    /// gzip (RFC 1952).
    Gzip,
    /// Zstandard (RFC 8878).
    Zstd,
}

impl Compression {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Gzip, Self::Zstd];

    /// Name in flags and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }

    /// What names of compressed files end with.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gzip => ".gz",
            Self::Zstd => ".zst",
        }
    }

    /// The compression that a file's name asks for, if any.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let ends = |compression: &Self| name.ends_with(compression.extension());
        Self::ALL.into_iter().find(ends)
    }

    /// The compression that a file's first bytes show, if any.
    pub(super) fn of_content(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            // A frame, or one of the sixteen kinds that are skipped.
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Some(Self::Zstd),
            _ => None,
        }
    }

    /// What `input` holds, decompressed; all of its members or frames, one after another.
    pub(super) fn reader<'a>(self, input: impl BufRead + 'a) -> Box<dyn Read + 'a> {
        match self {
            Self::Gzip => Box::new(MultiGzDecoder::new(input)),
            Self::Zstd => Box::new(ZstdReader {
                input,
                frame: FrameDecoder::new(),
                in_frame: false,
            }),
        }
    }
}

/// Decompresses frames one after another and compares their checksums.
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
                let (told, counted) = (
                    self.frame.get_checksum_from_data(),
                    self.frame.get_calculated_checksum(),
                );
                if told.is_some() && told != counted {
                    return Err(invalid("a frame's checksum is wrong"));
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
    /// Reads the header of a frame, or all of one that is to be skipped.
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
    // What happened lies deep inside; what is around it repeats it in the words of a debugger.
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

/// Bytes that one frame holds: frames are compressed whole.
const FRAME_BYTES: usize = 4 << 20;

/// Compresses what is written to it, or hands it on.
pub enum CompressedWriter<W: Write> {
    /// As it is.
    Plain(W),
    /// gzip.
    Gzip(GzEncoder<W>),
    /// Zstandard: the writer, and what is not yet a frame.
    Zstd(W, Vec<u8>),
}

impl<W: Write> CompressedWriter<W> {
    /// Compresses into `out`; the same bytes for the same input.
    pub fn new(compression: Option<Compression>, out: W) -> Self {
        match compression {
            None => Self::Plain(out),
            // No name and no time.
            Some(Compression::Gzip) => {
                Self::Gzip(GzBuilder::new().write(out, flate2::Compression::new(6)))
            }
            Some(Compression::Zstd) => Self::Zstd(out, Vec::with_capacity(FRAME_BYTES)),
        }
    }

    /// Writes what is left, and gives back the writer below.
    ///
    /// # Errors
    /// Those of the writer below.
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
