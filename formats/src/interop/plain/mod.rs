//! Plain accesses, one address each: reads and writes the forms of other simulators.
//!
//! Each form has a decoder, which accepts the input in pieces of any size. [`AddressFile`] reads and
//! decompresses the input.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

mod champsim;
mod compression;
mod din;
mod file;
mod gem5;
mod ramulator;
#[cfg(test)]
#[allow(clippy::indexing_slicing, clippy::cast_possible_truncation)]
mod tests;
mod words;
mod writer;

pub use champsim::CHAMPSIM_BASE;
pub use compression::{CompressedWriter, Compression};
pub use file::{AddressFile, Block, Found};
pub use writer::{PlainForm, PlainWriter};

/// Kinds of accesses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccessKind {
    /// Reads data.
    #[default]
    Read,
    /// Writes data.
    Write,
    /// Fetches an instruction.
    Fetch,
}

/// An access, without its texture or ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlainAccess {
    /// Address of the first byte.
    pub address: u64,
    /// Number of bytes, at least one; one if the form has no sizes. They end below 2^64.
    pub bytes: u32,
    /// Kind of the access.
    pub kind: AccessKind,
}

impl PlainAccess {
    /// Size limit of an access, which bounds the work per access.
    pub const MOST_BYTES: u32 = 1 << 20;

    /// A read.
    pub fn read(address: u64, bytes: u32) -> Self {
        Self {
            address,
            bytes,
            kind: AccessKind::Read,
        }
    }

    /// The access, if it is not too large and stays in the address space. A size of zero counts as one.
    fn checked(address: u64, bytes: u64, kind: AccessKind) -> Option<Self> {
        let bytes = u32::try_from(bytes.max(1)).ok()?;
        let last = address.checked_add(u64::from(bytes) - 1);
        (bytes <= Self::MOST_BYTES && last.is_some()).then_some(Self {
            address,
            bytes,
            kind,
        })
    }
}

/// Forms of address files that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AddressForm {
    /// Read addresses, 32 bits, little-endian.
    U32,
    /// Read addresses, 64 bits, little-endian.
    U64,
    /// Text of Dinero.
    Din,
    /// Packets of gem5.
    Gem5,
}

impl AddressForm {
    /// All forms, in the order of help texts.
    pub const ALL: [Self; 4] = [Self::U32, Self::U64, Self::Din, Self::Gem5];

    /// Name in flags, and file name extension.
    pub const fn name(self) -> &'static str {
        match self {
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::Din => "din",
            Self::Gem5 => "gem5",
        }
    }

    /// The form of a file name's extension, if any.
    fn of_name(name: &str) -> Option<Self> {
        let (_, end) = name.rsplit_once('.')?;
        Self::ALL.into_iter().find(|form| form.name() == end)
    }

    /// The form detected from the first bytes of a file, if any; `whole` if these are all bytes.
    fn of_content(head: &[u8], whole: bool) -> Option<Self> {
        if head.starts_with(gem5::MAGIC) {
            return Some(Self::Gem5);
        }
        let mut accesses = Vec::new();
        let decoded = din::Din::default().decode(head, whole, &mut accesses);
        (decoded.is_ok() && !accesses.is_empty()).then_some(Self::Din)
    }
}

/// Decodes bytes to accesses, piece by piece.
trait Decoder {
    /// Appends accesses from the front of `bytes` until they end or there are [`BLOCK`] accesses, and
    /// returns the number of bytes used. Returns 0 if the first access is incomplete, which is an error if
    /// the input `ended`.
    fn decode(
        &mut self,
        bytes: &[u8],
        ended: bool,
        out: &mut Vec<PlainAccess>,
    ) -> Result<usize, Fault>;

    /// Number of packets skipped because they are not accesses.
    fn other_packets(&self) -> u64 {
        0
    }
}

/// Number of accesses decoded per call.
const BLOCK: usize = 4096;

/// Longest record of any form, so a buffer of this size always holds a complete one.
const MOST_RECORD_BYTES: usize = 1 << 20;

/// An error in the form of bytes.
#[derive(Debug)]
struct Fault {
    place: crate::error::Place,
    /// Offset from the start of the given bytes.
    at: usize,
    expected: String,
    found: String,
}

/// The first bytes, formatted for an error.
fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 60;
    let text = String::from_utf8_lossy(bytes.get(..MOST).unwrap_or(bytes));
    let more = if bytes.len() > MOST { "..." } else { "" };
    format!("{text:?}{more}")
}
