//! Types and functions that all nom parsers of the crate share: a located error and checked reads.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::error::{FormatError, Place};
use nom::error::{ContextError, ErrorKind, ParseError};
use nom::{IResult, Parser};
use std::fmt::Display;

/// A parser's failure: its position and reason. [`locate`] turns it into a `FormatError`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault<'a> {
    rest: &'a [u8],
    expected: String,
    found: String,
}

/// Result of a parser in this crate.
pub type Parsed<'a, T> = IResult<&'a [u8], T, Fault<'a>>;

impl<'a> Fault<'a> {
    /// A fault at the start of `rest`.
    pub fn new(rest: &'a [u8], expected: impl Into<String>, found: impl Display) -> Self {
        Self {
            rest,
            expected: expected.into(),
            found: found.to_string(),
        }
    }
}

impl<'a> ParseError<&'a [u8]> for Fault<'a> {
    fn from_error_kind(input: &'a [u8], kind: ErrorKind) -> Self {
        Self::new(
            input,
            kind.description(),
            format_args!("{} bytes left", input.len()),
        )
    }

    fn append(_: &'a [u8], _: ErrorKind, other: Self) -> Self {
        other
    }
}

impl<'a> ContextError<&'a [u8]> for Fault<'a> {
    fn add_context(_: &'a [u8], context: &'static str, other: Self) -> Self {
        Self {
            expected: context.to_owned(),
            ..other
        }
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
    pub fn parse<T>(
        &mut self,
        mut parser: impl Parser<&'a [u8], Output = T, Error = Fault<'a>>,
    ) -> Result<T, nom::Err<Fault<'a>>> {
        let (rest, value) = parser.parse(self.0)?;
        self.0 = rest;
        Ok(value)
    }

    /// A failure at the next byte.
    #[cold]
    pub fn fault(&self, expected: impl Into<String>, found: impl Display) -> nom::Err<Fault<'a>> {
        nom::Err::Failure(Fault::new(self.0, expected, found))
    }
}

/// Fails at `at` if `holds` is false.
pub fn ensure<'a>(
    at: &'a [u8],
    holds: bool,
    expected: impl FnOnce() -> String,
    found: impl Display,
) -> Result<(), nom::Err<Fault<'a>>> {
    if holds {
        Ok(())
    } else {
        Err(nom::Err::Failure(Fault::new(at, expected(), found)))
    }
}

/// A `u32` count of items that take at least `item_bytes` each. Counts that the remaining bytes cannot hold
/// are refused before any allocation.
pub fn count<'a>(
    what: &'static str,
    item_bytes: usize,
) -> impl Parser<&'a [u8], Output = usize, Error = Fault<'a>> {
    move |input: &'a [u8]| {
        let (rest, count) =
            nom::error::context(what, nom::number::complete::le_u32).parse(input)?;
        let most = rest.len() / item_bytes.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= most => Ok((rest, count)),
            _ => Err(nom::Err::Failure(Fault::new(
                input,
                format!("{what} of at most {most}, for which there are bytes"),
                count,
            ))),
        }
    }
}

/// Reserved bytes. They must be zero, so that a later version can define them.
pub fn zero(input: &[u8], bytes: usize) -> Parsed<'_, ()> {
    let (rest, reserved) =
        nom::error::context("reserved bytes", nom::bytes::complete::take(bytes)).parse(input)?;
    ensure(
        input,
        reserved.iter().all(|byte| *byte == 0),
        || "zero in reserved bytes".to_owned(),
        format_args!("{reserved:02x?}"),
    )?;
    Ok((rest, ()))
}

/// Runs `parser` over all of `bytes`, which start at `offset` of the file.
pub fn parse_all<'a, T>(
    file: &str,
    place: Place,
    offset: u64,
    bytes: &'a [u8],
    parser: impl FnOnce(&'a [u8]) -> Parsed<'a, T>,
) -> Result<T, FormatError> {
    let outcome = match parser(bytes) {
        Ok(([], value)) => return Ok(value),
        Ok((rest, _)) => Fault::new(rest, "the end", format_args!("{} more bytes", rest.len())),
        Err(nom::Err::Error(fault) | nom::Err::Failure(fault)) => fault,
        // Only streaming parsers ask for more input, and none is used here.
        Err(nom::Err::Incomplete(_)) => Fault::new(&[], "more bytes", "the end"),
    };
    let consumed = bytes.len().saturating_sub(outcome.rest.len());
    Err(FormatError::Malformed {
        file: file.to_owned(),
        place,
        offset: offset.saturating_add(consumed as u64),
        expected: outcome.expected,
        found: outcome.found,
    })
}
