//! Rows as CSV with a header line.

use super::columns::{Get, Tabular};
use std::io::{self, Write};
use std::marker::PhantomData;

/// Writes CSV. Addresses are hexadecimal with `0x`.
#[derive(Debug)]
pub struct CsvWriter<W, R> {
    out: W,
    line: Vec<u8>,
    rows: PhantomData<fn(&R)>,
}

impl<W: Write, R: Tabular> CsvWriter<W, R> {
    /// Writes the header line.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn new(mut out: W) -> io::Result<Self> {
        let names: Vec<&str> = R::FIELDS.iter().map(|field| field.name).collect();
        writeln!(out, "{}", names.join(","))?;
        Ok(Self {
            out,
            line: Vec::new(),
            rows: PhantomData,
        })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn write(&mut self, row: &R) -> io::Result<()> {
        self.line.clear();
        for field in R::FIELDS {
            if !self.line.is_empty() {
                self.line.push(b',');
            }
            match &field.get {
                Get::U64(get) => write!(self.line, "{:#x}", get(row))?,
                _ => field.write_text(row, &mut self.line)?,
            }
        }
        self.line.push(b'\n');
        self.out.write_all(&self.line)
    }
}
