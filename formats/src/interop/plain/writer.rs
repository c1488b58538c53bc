//! Writes plain accesses in any form.

use super::{PlainAccess, champsim, din, gem5, ramulator, words};
use std::io::{self, Write};

/// Forms that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PlainForm {
    /// Addresses, 32 bits, little-endian.
    U32,
    /// Addresses, 64 bits, little-endian.
    U64,
    /// Text of Dinero.
    Din,
    /// Packets of gem5.
    Gem5,
    /// Text for `LoadStoreTrace` of Ramulator 2.
    Ramulator,
    /// Text for `SimpleO3` of Ramulator 2.
    RamulatorO3,
    /// Instruction records of ChampSim.
    Champsim,
}

impl PlainForm {
    /// Whether it is text, which may be printed on a terminal.
    pub const fn is_text(self) -> bool {
        matches!(self, Self::Din | Self::Ramulator | Self::RamulatorO3)
    }
}

/// Writes plain accesses.
#[derive(Debug)]
pub struct PlainWriter<W> {
    form: PlainForm,
    out: W,
    accesses: u64,
}

impl<W: Write> PlainWriter<W> {
    /// Writes the header of the form.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn new(form: PlainForm, mut out: W) -> io::Result<Self> {
        if form == PlainForm::Gem5 {
            gem5::write_header(&mut out)?;
        }
        Ok(Self {
            form,
            out,
            accesses: 0,
        })
    }

    /// The underlying writer.
    pub fn into_inner(self) -> W {
        self.out
    }

    /// Writes an access.
    ///
    /// # Errors
    /// An address that the form cannot hold, or errors of the underlying writer.
    pub fn access(&mut self, access: &PlainAccess) -> io::Result<()> {
        let out = &mut self.out;
        let number = self.accesses;
        self.accesses += 1;
        match self.form {
            PlainForm::U32 => words::write_u32(out, access),
            PlainForm::U64 => words::write_u64(out, access),
            PlainForm::Din => din::write(out, access),
            PlainForm::Gem5 => gem5::write(out, access, number),
            PlainForm::Ramulator => ramulator::write(out, access),
            PlainForm::RamulatorO3 => ramulator::write_o3(out, access),
            PlainForm::Champsim => champsim::write(out, access),
        }
    }
}
