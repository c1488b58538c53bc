//! Dinero's din text: `LABEL HEXADDR` a line, label 0 for a read.

use super::{Access, AccessSink};
use std::io::{self, BufRead, Write};

/// Writes din text.
#[derive(Debug)]
pub struct DinWriter<W>(pub W);

impl<W: Write> AccessSink for DinWriter<W> {
    fn write(&mut self, access: &Access) -> io::Result<()> {
        writeln!(self.0, "0 {:x}", access.address)
    }
}

/// One line of din text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DinAccess {
    /// 0 read, 1 write, 2 instruction fetch.
    pub label: u8,
    /// Byte address.
    pub address: u64,
}

/// Reads din text line by line; whatever follows the address is ignored, as Dinero does.
///
/// # Errors
/// Each item may be one: a line that cannot be read or is not `LABEL HEXADDR`, with its number.
pub fn read_din(input: impl BufRead) -> impl Iterator<Item = io::Result<DinAccess>> {
    input.lines().zip(1u64..).map(|(line, number)| {
        let line = line?;
        let mut fields = line.split_ascii_whitespace();
        let label = fields.next().and_then(|field| field.parse().ok());
        let address = fields.next().and_then(|field| {
            let digits = field.strip_prefix("0x").unwrap_or(field);
            u64::from_str_radix(digits, 16).ok()
        });
        match label.filter(|label| *label <= 2).zip(address) {
            Some((label, address)) => Ok(DinAccess { label, address }),
            None => Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!("line {number}: expected a label of 0 to 2 and a hexadecimal address, found {line:?}"),
            )),
        }
    })
}
