//! ChampSim's instruction records (`input_instr` in its `inc/trace_instruction.h`), 64 bytes each,
//! little-endian: instruction pointer (8), is a branch (1), is taken (1), destination registers (2),
//! source registers (4), destination addresses (2 x 8), source addresses (4 x 8).

use super::{AccessKind, PlainAccess};
use std::io::{self, Write};

/// Offset of all addresses, because an address of zero means no access. It exceeds the addresses of every
/// texture layout and does not change cache sets.
pub const CHAMPSIM_BASE: u64 = 1 << 40;

/// Instruction pointer of all accesses.
const INSTRUCTION_POINTER: u64 = 0x40_0000;

/// Writes an instruction with one access.
pub(super) fn write(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let Some(address) = access.address.checked_add(CHAMPSIM_BASE) else {
        let found = access.address;
        let message = format!("champsim: expected addresses below 2^64 - 2^40, found {found:#x}");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    };
    let is_write = access.kind == AccessKind::Write;
    let (destination, source) = if is_write { (address, 0) } else { (0, address) };
    let words = [INSTRUCTION_POINTER, 0, destination, 0, source, 0, 0, 0];
    words
        .iter()
        .try_for_each(|word| out.write_all(&word.to_le_bytes()))
}
