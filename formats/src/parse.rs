//! Checked reads with a located error, for all readers of the crate.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::error::{Broken, FormatError, Place, Result};
use nom::bytes::complete::take;
use nom::number::complete;
use std::fmt::Display;

/// A reader's failure: its position and reason. [`parse_all`] turns it into a `FormatError`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault<'a> {
    rest: &'a [u8],
    expected: String,
    found: String,
}

impl<'a> Fault<'a> {
    /// A fault at the start of `rest`.
    #[cold]
    pub fn new(rest: &'a [u8], expected: impl Display, found: impl Display) -> Self {
        Self {
            rest,
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// Fewer bytes are left than something takes.
    #[cold]
    pub fn short(rest: &'a [u8], expected: impl Display) -> Self {
        Self::new(rest, expected, format_args!("{} bytes left", rest.len()))
    }

    /// The same fault of data to be written.
    pub fn broken(self, what: &str) -> Broken {
        Broken::new(what, self.expected, self.found)
    }
}

/// A value read from a [`Cursor`].
pub type Taken<'a, T = ()> = Result<T, Fault<'a>>;

/// The bytes after a value, and the value.
pub type Parsed<'a, T> = Taken<'a, (&'a [u8], T)>;

/// A number in its little-endian form, or an array of numbers.
pub trait Number: Copy {
    /// Zero.
    const ZERO: Self;
    /// Appends the number.
    fn put(self, out: &mut Vec<u8>);
    /// Takes the number from the front of the bytes; `None` if there are too few.
    fn take(bytes: &mut &[u8]) -> Option<Self>;
}

macro_rules! numbers {
    ($($number:ident $parser:ident)*) => {$(
        impl Number for $number {
            const ZERO: Self = 0 as Self;

            #[inline]
            fn put(self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            #[inline]
            fn take(bytes: &mut &[u8]) -> Option<Self> {
                let (rest, number) = complete::$parser::<_, ()>(*bytes).ok()?;
                *bytes = rest;
                Some(number)
            }
        }
    )*};
}
numbers!(u8 le_u8 i8 le_i8 u16 le_u16 i16 le_i16 u32 le_u32 i32 le_i32 u64 le_u64 f32 le_f32);

impl<T: Number, const N: usize> Number for [T; N] {
    const ZERO: Self = [T::ZERO; N];

    #[inline]
    fn put(self, out: &mut Vec<u8>) {
        self.into_iter().for_each(|number| number.put(out));
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let mut numbers = Self::ZERO;
        for number in &mut numbers {
            *number = T::take(bytes)?;
        }
        Some(numbers)
    }
}

/// Remaining bytes of an input.
#[derive(Clone, Copy, Debug)]
pub struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    /// Starts at the front of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The bytes that are left.
    pub fn rest(&self) -> &'a [u8] {
        self.0
    }

    /// Runs a parser and advances past the bytes it used.
    ///
    /// # Errors
    /// Errors of the parser.
    #[inline]
    pub fn parse<T>(&mut self, parser: impl FnOnce(&'a [u8]) -> Parsed<'a, T>) -> Taken<'a, T> {
        let (rest, value) = parser(self.0)?;
        self.0 = rest;
        Ok(value)
    }

    /// The next number of fixed size, or array of them.
    ///
    /// # Errors
    /// The bytes end.
    #[inline]
    pub fn fixed<N: Number>(&mut self, what: &str) -> Taken<'a, N> {
        N::take(&mut self.0).ok_or_else(|| Fault::short(self.0, what))
    }

    /// The next bytes.
    ///
    /// # Errors
    /// The bytes end.
    pub fn bytes(&mut self, what: &str, count: usize) -> Taken<'a, &'a [u8]> {
        let taken = take::<_, _, ()>(count)(self.0);
        let (rest, bytes) = taken.map_err(|_| Fault::short(self.0, what))?;
        self.0 = rest;
        Ok(bytes)
    }

    /// A count, in four bytes, of items that take at least `item_bytes` each. Counts that the remaining bytes
    /// cannot hold are refused before any allocation.
    ///
    /// # Errors
    /// The bytes end, or are too few for the items.
    pub fn count(&mut self, what: &str, item_bytes: usize) -> Taken<'a, usize> {
        let at = *self;
        let count: u32 = self.fixed(what)?;
        let most = self.0.len() / item_bytes.max(1);
        let expected = format_args!("{what} of at most {most}, for which there are bytes");
        at.check(count as usize <= most, expected, count)?;
        Ok(count as usize)
    }

    /// A failure at the next byte.
    #[cold]
    pub fn fault(&self, expected: impl Display, found: impl Display) -> Fault<'a> {
        Fault::new(self.0, expected, found)
    }

    /// Fails at the next byte unless `holds`.
    ///
    /// # Errors
    /// It does not hold.
    #[inline]
    pub fn check(&self, holds: bool, expected: impl Display, found: impl Display) -> Taken<'a> {
        match holds {
            true => Ok(()),
            false => Err(self.fault(expected, found)),
        }
    }
}

/// Runs `parser` over all of `bytes`, which start at `offset` of the file.
pub fn parse_all<'a, T>(
    file: &str,
    place: Place,
    offset: u64,
    bytes: &'a [u8],
    parser: impl FnOnce(&'a [u8]) -> Parsed<'a, T>,
) -> Result<T> {
    let fault = match parser(bytes) {
        Ok(([], value)) => return Ok(value),
        Ok((rest, _)) => Fault::new(rest, "the end", format_args!("{} more bytes", rest.len())),
        Err(fault) => fault,
    };
    let consumed = bytes.len().saturating_sub(fault.rest.len());
    let offset = offset.saturating_add(consumed as u64);
    Err(FormatError::malformed(
        file,
        place,
        offset,
        fault.expected,
        fault.found,
    ))
}
