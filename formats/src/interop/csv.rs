//! Accesses as CSV with a header line.

use super::{Access, AccessSink};
use std::io::{self, Write};

/// Column names, in order.
const HEADER: &str = "address,pass,tile,draw,primitive,pixel_x,pixel_y,texture,layer,level,x,y";

/// Writes CSV; the address is hexadecimal with `0x`.
#[derive(Debug)]
pub struct CsvWriter<W>(W);

impl<W: Write> CsvWriter<W> {
    /// Writes the header line.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(out, "{HEADER}")?;
        Ok(Self(out))
    }
}

impl<W: Write> AccessSink for CsvWriter<W> {
    fn write(&mut self, access: &Access) -> io::Result<()> {
        let Access {
            address,
            bytes: _,
            pass,
            tile,
            draw,
            primitive,
            pixel_x,
            pixel_y,
            texture,
            layer,
            level,
            x,
            y,
        } = access;
        writeln!(
            self.0,
            "{address:#x},{pass},{tile},{draw},{primitive},{pixel_x},{pixel_y},{texture},{layer},{level},{x},{y}"
        )
    }
}
