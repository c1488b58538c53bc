//! Consecutive little-endian addresses of 32 or 64 bits.

use super::PlainAccess;
use std::io::{self, Write};

/// Writes an address of 32 bits.
pub(super) fn write_u32(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    let address = u32::try_from(access.address).map_err(|_| {
        let found = access.address;
        let message = format!("u32: expected addresses below 2^32, found {found:#x}; u64 holds it");
        io::Error::new(io::ErrorKind::InvalidInput, message)
    })?;
    out.write_all(&address.to_le_bytes())
}

/// Writes an address of 64 bits.
pub(super) fn write_u64(out: &mut impl Write, access: &PlainAccess) -> io::Result<()> {
    out.write_all(&access.address.to_le_bytes())
}
