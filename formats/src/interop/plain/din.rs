//! Text of Dinero: `LABEL HEXADDR` per line, or Dinero IV's extended form `LABEL HEXADDR HEXSIZE`.
//!
//! The traditional form has labels 0 (read), 1 (write) and 2 (instruction fetch) and no sizes. Dinero
//! assumes four aligned bytes, which are in the same line as their first byte. The extended form has labels
//! r, w and i. The rest of each line is ignored.

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

/// Reads both forms.
#[derive(Debug, Default)]
pub(super) struct Din {
    /// Lines read.
    lines: u64,
}

impl Decoder for Din {
    fn decode(
        &mut self,
        bytes: &[u8],
        ended: bool,
        out: &mut Vec<PlainAccess>,
    ) -> Result<usize, Fault> {
        let mut taken = 0;
        while out.len() < BLOCK {
            let rest = bytes.get(taken..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
            let Some((access, length)) = quick_line(rest).or_else(|| line(rest, ended)) else {
                let end = rest.iter().position(|&byte| byte == b'\n');
                if end.is_none() && !ended && rest.len() <= MOST_LINE_BYTES {
                    break;
                }
                return Err(Fault {
                    place: Place::Line(self.lines + 1),
                    at: taken,
                    expected: format!(
                        "a label (0 read, 1 write, 2 fetch) and a hexadecimal address, or r, w or i, an \
                         address and a size of at most {:#x} bytes, all below 2^64",
                        PlainAccess::MOST_BYTES
                    ),
                    found: shown(rest.get(..end.unwrap_or(rest.len())).unwrap_or(rest)),
                });
            };
            out.push(access);
            self.lines += 1;
            taken += length;
        }
        Ok(taken)
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

/// Parses any line and returns its length; `None` if it is wrong or incomplete.
fn line(bytes: &[u8], ended: bool) -> Option<(PlainAccess, usize)> {
    let end = bytes.iter().position(|&byte| byte == b'\n');
    if end.is_none() && !ended {
        return None;
    }
    let text = bytes.get(..end.unwrap_or(bytes.len()))?;
    let mut fields = text
        .split(u8::is_ascii_whitespace)
        .filter(|field| !field.is_empty());
    let (kind, has_size) = match fields.next()? {
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
    let access = PlainAccess::checked(address, size, kind)?;
    Some((access, text.len() + usize::from(end.is_some())))
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
