//! Text for Ramulator 2: `LD 0xADDR` or `ST 0xADDR` per line (`LoadStoreTrace`), and `BUBBLES LOAD [STORE]`
//! per line in decimal (`SimpleO3`, which has its own cache).
//!
//! The third form, `ReadWriteTrace`, lists channel, rank, bank, row and column, which depend on the DRAM's
//! organisation and mapping. It is not supported.

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

/// Writes a line for `SimpleO3`: a load without instructions before it. For a store, the line is loaded
/// first.
pub(super) fn write_o3(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let address = access.address;
    match access.kind {
        AccessKind::Read | AccessKind::Fetch => writeln!(out, "0 {address}"),
        AccessKind::Write => writeln!(out, "0 {address} {address}"),
    }
}
