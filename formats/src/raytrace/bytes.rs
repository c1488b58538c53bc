//! Variable-length integers (LEB128) and checked reads.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use std::fmt::Display;

/// A reader's failure: the byte where it stood, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fail {
    pub offset: usize,
    pub expected: String,
    pub found: String,
}

/// Appends numbers.
#[derive(Default)]
pub(super) struct ByteWriter(Vec<u8>);

impl ByteWriter {
    pub fn byte(&mut self, value: u8) {
        self.0.push(value);
    }

    /// Seven bits a byte, the lowest first; the top bit says that more follow.
    pub fn wide(&mut self, mut value: u64) {
        loop {
            let low = (value & 0x7F) as u8;
            value >>= 7;
            if value == 0 {
                self.0.push(low);
                return;
            }
            self.0.push(low | 0x80);
        }
    }

    pub fn number(&mut self, value: u32) {
        self.wide(u64::from(value));
    }

    /// The wrapping difference from the previous value, small ones of either sign first.
    pub fn difference(&mut self, previous: &mut u32, value: u32) {
        let d = value.wrapping_sub(*previous).cast_signed();
        *previous = value;
        self.number((d << 1 ^ d >> 31).cast_unsigned());
    }

    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

/// Reads numbers.
pub(super) struct ByteReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> ByteReader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes not yet read.
    pub fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    /// A failure at the current byte.
    pub fn fail(&self, expected: &str, found: impl Display) -> Fail {
        Fail {
            offset: self.at,
            expected: expected.to_owned(),
            found: found.to_string(),
        }
    }

    pub fn byte(&mut self, what: &str) -> Result<u8, Fail> {
        let byte = self.bytes.get(self.at).copied();
        let byte = byte.ok_or_else(|| self.fail(what, "the end of the tile"))?;
        self.at += 1;
        Ok(byte)
    }

    pub fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], Fail> {
        let taken = self.at.checked_add(count);
        let taken = taken.and_then(|end| self.bytes.get(self.at..end));
        let taken = taken.ok_or_else(|| self.fail(what, format!("{} bytes", self.left())))?;
        self.at += count;
        Ok(taken)
    }

    pub fn wide(&mut self, what: &str) -> Result<u64, Fail> {
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte(what)?;
            let low = u64::from(byte & 0x7F);
            if shift == 63 && low > 1 {
                break;
            }
            value |= low << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(self.fail(what, "a number of more than 64 bits"))
    }

    pub fn number(&mut self, what: &str) -> Result<u32, Fail> {
        let wide = self.wide(what)?;
        u32::try_from(wide).map_err(|_| self.fail(what, wide))
    }

    pub fn difference(&mut self, previous: &mut u32, what: &str) -> Result<u32, Fail> {
        let code = self.number(what)?;
        let d = code >> 1 ^ (code & 1).wrapping_neg();
        *previous = previous.wrapping_add(d);
        Ok(*previous)
    }

    /// A value of 16 bits by its difference.
    pub fn short(&mut self, previous: &mut u32, what: &str) -> Result<u16, Fail> {
        let value = self.difference(previous, what)?;
        u16::try_from(value).map_err(|_| self.fail(what, value))
    }

    /// Fails unless everything was read.
    pub fn end(&self) -> Result<(), Fail> {
        match self.left() {
            0 => Ok(()),
            left => Err(self.fail("the end of the tile", format!("{left} more bytes"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_differences_come_back() {
        let values = [
            0u32,
            1,
            127,
            128,
            300,
            1 << 20,
            u32::MAX,
            0,
            u32::MAX - 5,
            7,
        ];
        let mut out = ByteWriter::default();
        let mut previous = 0;
        for v in values {
            out.number(v);
            out.difference(&mut previous, v);
            out.wide(u64::from(v) << 31 | 5);
        }
        let bytes = out.into_bytes();
        let mut input = ByteReader::new(&bytes);
        let mut previous = 0;
        for v in values {
            assert_eq!(input.number("number"), Ok(v));
            assert_eq!(input.difference(&mut previous, "difference"), Ok(v));
            assert_eq!(input.wide("wide"), Ok(u64::from(v) << 31 | 5));
        }
        assert_eq!(input.end(), Ok(()));
    }

    #[test]
    fn a_number_that_never_ends_is_refused() {
        let mut input = ByteReader::new(&[0xFF; 12]);
        let fail = input.number("a ray count").expect_err("refused");
        assert_eq!(fail.found, "a number of more than 64 bits");
    }
}
