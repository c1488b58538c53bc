//! Text of Dinero: `LABEL HEXADDR` per line, or Dinero IV's extended form `LABEL HEXADDR HEXSIZE`.
//!
//! The traditional form has labels 0 (read), 1 (write) and 2 (instruction fetch) and no sizes. Dinero
//! assumes four aligned bytes, which are in the same line as their first byte. The extended form has labels
//! r, w and i. The rest of each line is ignored.
//!
//! Lines end in a line feed, a carriage return or both. Blank lines are skipped, as is a byte order mark.

use super::{AccessKind, BLOCK, Decoder, Fault, PlainAccess, shown};
use crate::error::Place;
use std::io::{self, Write};

/// Maximum length of a line.
const MOST_LINE_BYTES: usize = 64 << 10;

/// Writes a line of the traditional form.
pub(super) fn write(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let label = match access.kind {
        AccessKind::Read => 0,
        AccessKind::Write => 1,
        AccessKind::Fetch => 2,
    };
    writeln!(out, "{label} {:x}", access.address)
}

/// Byte order mark of UTF-8, which editors put in front of a text.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads both forms.
#[derive(Debug, Default)]
pub(super) struct Din {
    /// Lines read.
    lines: u64,
    /// Whether the start of the text was read.
    started: bool,
}

/// What a line holds.
enum Line {
    /// An access.
    Access(PlainAccess),
    /// Spaces at most.
    Blank,
    /// Neither.
    Wrong,
}

impl Decoder for Din {
    fn decode(
        &mut self,
        bytes: &[u8],
        ended: bool,
        out: &mut Vec<PlainAccess>,
    ) -> Result<usize, Fault> {
        let mut taken = 0;
        if !self.started {
            self.started = true;
            taken = if bytes.starts_with(MARK) {
                MARK.len()
            } else {
                0
            };
        }
        while out.len() < BLOCK {
            let rest = bytes.get(taken..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
            if let Some((access, length)) = quick_line(rest) {
                out.push(access);
                self.lines += 1;
                taken += length;
                continue;
            }
            let end = line_end(rest, ended);
            if end.is_none() && rest.len() <= MOST_LINE_BYTES {
                break;
            }
            let (text, length) = end.map_or((rest, rest.len()), |(end, length)| {
                (rest.get(..end).unwrap_or(rest), length)
            });
            match line(text) {
                Line::Access(access) if end.is_some() => out.push(access),
                Line::Blank if end.is_some() => {}
                _ => {
                    return Err(Fault {
                        place: Place::Line(self.lines + 1),
                        at: taken,
                        expected: format!(
                            "a label (0 read, 1 write, 2 fetch) and a hexadecimal address, or r, w or i, \
                             an address and a size of at most {:#x} bytes, all below 2^64",
                            PlainAccess::MOST_BYTES
                        ),
                        found: shown(text),
                    });
                }
            }
            self.lines += 1;
            taken += length;
        }
        Ok(taken)
    }
}

/// Length of the first line without and with its end; `None` if the line is incomplete.
fn line_end(bytes: &[u8], ended: bool) -> Option<(usize, usize)> {
    let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
    match (end, end.and_then(|end| bytes.get(end..))) {
        (Some(end), Some([b'\r', b'\n', ..])) => Some((end, end + 2)),
        // A line feed may follow in the next piece.
        (Some(_), Some([b'\r'])) if !ended => None,
        (Some(end), _) => Some((end, end + 1)),
        (None, _) => ended.then_some((bytes.len(), bytes.len())),
    }
}

/// Parses the common line `L HEXADDR` without searching its end first.
#[inline]
fn quick_line(bytes: &[u8]) -> Option<(PlainAccess, usize)> {
    let (&[label, b' '], digits) = bytes.split_first_chunk()? else {
        return None;
    };
    let kind = match label {
        b'0' => AccessKind::Read,
        b'1' => AccessKind::Write,
        b'2' => AccessKind::Fetch,
        _ => return None,
    };
    let mut address = 0_u64;
    for (count, &byte) in digits.iter().take(17).enumerate() {
        let Some(digit) = hex_digit(byte) else {
            let access = PlainAccess {
                address,
                bytes: 1,
                kind,
            };
            return (byte == b'\n' && count > 0).then_some((access, count + 3));
        };
        address = address << 4 | u64::from(digit);
    }
    None
}

#[inline]
fn hex_digit(byte: u8) -> Option<u8> {
    match byte {
        b'0'..=b'9' => Some(byte - b'0'),
        b'a'..=b'f' => Some(byte - b'a' + 10),
        b'A'..=b'F' => Some(byte - b'A' + 10),
        _ => None,
    }
}

/// Parses any line.
fn line(text: &[u8]) -> Line {
    let mut fields = text
        .split(u8::is_ascii_whitespace)
        .filter(|field| !field.is_empty());
    let Some(label) = fields.next() else {
        return Line::Blank;
    };
    access(label, fields).map_or(Line::Wrong, Line::Access)
}

/// The access of a label and the fields after it.
fn access<'a>(label: &[u8], mut fields: impl Iterator<Item = &'a [u8]>) -> Option<PlainAccess> {
    let (kind, has_size) = match label {
        b"0" => (AccessKind::Read, false),
        b"1" => (AccessKind::Write, false),
        b"2" => (AccessKind::Fetch, false),
        b"r" | b"R" => (AccessKind::Read, true),
        b"w" | b"W" => (AccessKind::Write, true),
        b"i" | b"I" => (AccessKind::Fetch, true),
        _ => return None,
    };
    let address = hexadecimal(fields.next()?)?;
    let size = if has_size {
        hexadecimal(fields.next()?)?
    } else {
        1
    };
    PlainAccess::checked(address, size, kind)
}

fn hexadecimal(field: &[u8]) -> Option<u64> {
    let digits = field
        .strip_prefix(b"0x")
        .or_else(|| field.strip_prefix(b"0X"))
        .unwrap_or(field);
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0_u64, |number, &byte| {
        let digit = hex_digit(byte)?;
        (number >> 60 == 0).then_some(number << 4 | u64::from(digit))
    })
}
