//! Writing plain accesses in any form.

use super::{PlainAccess, champsim, din, gem5, ramulator, words};
use crate::interop::{Access, AccessSink};
use std::io::{self, Write};

/// A form that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PlainForm {
    /// 32-bit little-endian addresses.
    U32,
    /// 64-bit ones.
    U64,
    /// Dinero's text.
    Din,
    /// gem5's packets.
    Gem5,
    /// Text for Ramulator 2's `LoadStoreTrace`.
    Ramulator,
    /// Text for Ramulator 2's `SimpleO3`.
    RamulatorO3,
    /// ChampSim's instruction records.
    Champsim,
}

impl PlainForm {
    /// True if it can go to a terminal.
    #[must_use]
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
    /// Writes what comes before the first access.
    ///
    /// # Errors
    /// Those of the writer below.
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

    /// The writer below.
    pub fn into_inner(self) -> W {
        self.out
    }

    /// Writes an access.
    ///
    /// # Errors
    /// An address that the form cannot hold; those of the writer below.
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

impl<W: Write> AccessSink for PlainWriter<W> {
    fn write(&mut self, access: &Access) -> io::Result<()> {
        self.access(&PlainAccess::read(access.address, access.bytes))
    }
}
