//! Ramulator 2's text: `LD 0xADDR` or `ST 0xADDR` a line (its `LoadStoreTrace`), and
//! `BUBBLES LOAD [STORE]` a line in decimal (its `SimpleO3`, which has a cache of its own).
//!
//! Its third form, `ReadWriteTrace`, lists channel, rank, bank, row and column, which only a DRAM's
//! organisation and mapping give.

use super::{AccessKind, PlainAccess};
use std::io::{self, Write};

/// Writes a line for `LoadStoreTrace`.
pub(super) fn write(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let operation = match access.kind {
        AccessKind::Read | AccessKind::Fetch => "LD",
        AccessKind::Write => "ST",
    };
    writeln!(out, "{operation} {:#x}", access.address)
}

/// Writes a line for `SimpleO3`: no instruction between, and a load; a store's line is loaded first.
pub(super) fn write_o3(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let address = access.address;
    match access.kind {
        AccessKind::Read | AccessKind::Fetch => writeln!(out, "0 {address}"),
        AccessKind::Write => writeln!(out, "0 {address} {address}"),
    }
}
