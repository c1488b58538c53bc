//! Binary records: one list of fields writes a record and reads it.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::error::{Broken, Result};
use crate::parse::{Cursor, Number, Parsed, Taken};
use std::fmt::Display;

/// A type with a list of binary fields.
pub trait Record: Clone + Default {
    /// Passes every field to the codec, in the order of the bytes. The default value has the fewest bytes.
    ///
    /// # Errors
    /// A length that its field cannot hold, or bytes that are no value of the field.
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a>;
}

/// Appends each field to an output, or replaces it with that of an input.
#[derive(Debug)]
pub struct Codec<'a> {
    /// Major version of the file.
    pub major: u16,
    /// The record that the next fields belong to, for errors.
    pub record: &'static str,
    out: Option<&'a mut Vec<u8>>,
    input: Cursor<'a>,
    /// Start of the last field.
    at: Cursor<'a>,
}

impl<'a> Codec<'a> {
    /// A number or an array of numbers.
    pub fn number<N: Number>(&mut self, number: &mut N) -> Taken<'a> {
        self.named(self.record, number)
    }

    /// A number with a name of its own in errors.
    pub fn named<N: Number>(&mut self, what: &str, number: &mut N) -> Taken<'a> {
        self.at = self.input;
        match &mut self.out {
            Some(out) => number.put(out),
            None => *number = self.input.fixed(what)?,
        }
        Ok(())
    }

    /// A value by its number in a table of all values.
    pub fn id<N: Number + PartialEq + Display, E: Copy + PartialEq>(
        &mut self,
        what: &str,
        all: &[(N, E)],
        value: &mut E,
    ) -> Taken<'a> {
        let known = all.iter().find(|(_, other)| other == value);
        let mut number = known.map_or(N::ZERO, |(number, _)| *number);
        self.named(what, &mut number)?;
        let found = all.iter().find(|(other, _)| *other == number);
        *value = found.ok_or_else(|| self.at.fault(what, number))?.1;
        Ok(())
    }

    /// Reserved bytes. They must be zero, so that a later version can define them.
    pub fn reserved<const N: usize>(&mut self) -> Taken<'a> {
        let mut found = [0u8; N];
        self.named("reserved bytes", &mut found)?;
        let is_zero = found == [0; N];
        self.check(
            is_zero,
            "zero in reserved bytes",
            format_args!("{found:02x?}"),
        )
    }

    /// The length of a list or a text, in two bytes.
    pub fn length(&mut self, what: &'static str, length: usize) -> Taken<'a, usize> {
        let mut number = u16::try_from(length).map_err(|_| {
            self.record = what;
            self.at.fault("a length that fits its field", length)
        })?;
        self.named(what, &mut number)?;
        Ok(number.into())
    }

    /// A text after its length.
    pub fn name(&mut self, name: &mut String) -> Taken<'a> {
        let length = self.length("a name's length", name.len())?;
        if let Some(out) = &mut self.out {
            out.extend_from_slice(name.as_bytes());
            return Ok(());
        }
        self.at = self.input;
        let bytes = self.input.bytes("a name", length)?;
        let text = std::str::from_utf8(bytes).map_err(|error| self.at.fault("a UTF-8 name", error));
        *name = text?.to_owned();
        Ok(())
    }

    /// Records without their number before them.
    pub fn items<T: Record>(&mut self, number: usize, items: &mut Vec<T>) -> Taken<'a> {
        if self.out.is_some() {
            return items.iter_mut().try_for_each(|item| item.fields(self));
        }
        for _ in 0..number {
            let mut item = T::default();
            item.fields(self)?;
            items.push(item);
        }
        Ok(())
    }

    /// Fails at the last field unless `holds`.
    pub fn check(&self, holds: bool, expected: impl Display, found: impl Display) -> Taken<'a> {
        self.at.check(holds, expected, found)
    }
}

/// Appends a record of a file of this major version.
///
/// # Errors
/// A length that its field cannot hold.
pub fn write<T: Record>(major: u16, record: &T, out: &mut Vec<u8>) -> Result<()> {
    let end = Cursor::new(&[]);
    let mut codec = Codec {
        major,
        record: "record",
        out: Some(out),
        input: end,
        at: end,
    };
    let written = record.clone().fields(&mut codec);
    written.map_err(|fault| fault.broken(codec.record).unwritable())
}

/// Reads a record of a file of this major version.
pub fn parse<T: Record>(major: u16, input: &[u8]) -> Parsed<'_, T> {
    let input = Cursor::new(input);
    let mut codec = Codec {
        major,
        record: "a record",
        out: None,
        input,
        at: input,
    };
    let mut record = T::default();
    record.fields(&mut codec)?;
    Ok((codec.input.rest(), record))
}

/// Reads as many records as the bytes have.
pub fn parse_records<T: Record>(major: u16, mut input: &[u8]) -> Parsed<'_, Vec<T>> {
    let mut records = Vec::with_capacity(input.len() / least_bytes::<T>(major).max(1));
    while !input.is_empty() {
        let (rest, record) = parse(major, input)?;
        records.push(record);
        input = rest;
    }
    Ok((input, records))
}

/// Size of a record with the shortest lists and texts.
pub fn least_bytes<T: Record>(major: u16) -> usize {
    let mut out = Vec::new();
    write(major, &T::default(), &mut out).map_or(0, |()| out.len())
}

/// A table: the number of its records, and the records.
///
/// # Errors
/// See [`write`].
pub fn write_table<T: Record>(major: u16, table: &[T]) -> Result<Vec<u8>> {
    let mut out = Vec::with_capacity(4 + table.len() * least_bytes::<T>(major));
    put_count("table", table.len(), &mut out)?;
    table
        .iter()
        .try_for_each(|record| write(major, record, &mut out))?;
    Ok(out)
}

/// Reads a table; `what` is the number of its records, for errors.
pub fn parse_table<'a, T: Record>(major: u16, what: &str, input: &'a [u8]) -> Parsed<'a, Vec<T>> {
    let mut input = Cursor::new(input);
    let count = input.count(what, least_bytes::<T>(major))?;
    let mut records = Vec::new();
    for _ in 0..count {
        records.push(input.parse(|input| parse(major, input))?);
    }
    Ok((input.rest(), records))
}

/// Appends the number of items of a list, in four bytes.
///
/// # Errors
/// More than fit.
pub fn put_count(what: &str, items: usize, out: &mut Vec<u8>) -> Result<()> {
    let count = u32::try_from(items)
        .map_err(|_| Broken::new(what, "fewer than 2^32", items).unwritable())?;
    count.put(out);
    Ok(())
}
