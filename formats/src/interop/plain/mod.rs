//! Plain accesses, an address each: the forms of other simulators, read and written.
//!
//! Bytes become accesses in a decoder a form, which takes any piece of the input; where the bytes
//! come from, and how they are compressed, is [`AddressFile`]'s.
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

/// What an access does.
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

/// An access without what it was made for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlainAccess {
    /// Address of the first byte.
    pub address: u64,
    /// Bytes from there on, at least one; one where the form does not say. They end below 2^64.
    pub bytes: u32,
    /// What it does.
    pub kind: AccessKind,
}

impl PlainAccess {
    /// More bytes than any access of a real trace has; bounds the work that an access can ask for.
    pub const MOST_BYTES: u32 = 1 << 20;

    /// A read.
    #[must_use]
    pub fn read(address: u64, bytes: u32) -> Self {
        Self {
            address,
            bytes,
            kind: AccessKind::Read,
        }
    }

    /// The access if its bytes are not too many and do not leave the address space; no bytes count
    /// as one.
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

/// Form of a file of addresses that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AddressForm {
    /// 32-bit little-endian addresses of reads.
    U32,
    /// 64-bit ones.
    U64,
    /// Dinero's text.
    Din,
    /// gem5's packets.
    Gem5,
}

impl AddressForm {
    /// All, in the order in which they are listed.
    pub const ALL: [Self; 4] = [Self::U32, Self::U64, Self::Din, Self::Gem5];

    /// Name in flags and at the end of file names.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::Din => "din",
            Self::Gem5 => "gem5",
        }
    }

    /// The form that a file's name ends with, if any.
    fn of_name(name: &str) -> Option<Self> {
        let (_, end) = name.rsplit_once('.')?;
        Self::ALL.into_iter().find(|form| form.name() == end)
    }

    /// The form that the first bytes of a file show, if any; `whole` where there are no more.
    fn of_content(head: &[u8], whole: bool) -> Option<Self> {
        if head.starts_with(gem5::MAGIC) {
            return Some(Self::Gem5);
        }
        let mut accesses = Vec::new();
        let decoded = din::Din::default().decode(head, whole, &mut accesses);
        (decoded.is_ok() && !accesses.is_empty()).then_some(Self::Din)
    }
}

/// Turns bytes into accesses, piece by piece.
trait Decoder {
    /// Appends the accesses at the front of `bytes` until these end or [`BLOCK`] are there, and says
    /// how many bytes that took; none if the first access is not complete, which is a fault where
    /// the input `ended`.
    fn decode(
        &mut self,
        bytes: &[u8],
        ended: bool,
        out: &mut Vec<PlainAccess>,
    ) -> Result<usize, Fault>;

    /// What was read over but is no access.
    fn other_packets(&self) -> u64 {
        0
    }
}

/// Accesses that are decoded at once.
const BLOCK: usize = 4096;

/// No record of any form is longer, so a buffer of this size always holds a whole one.
const MOST_RECORD_BYTES: usize = 1 << 20;

/// Why bytes are not what a form asks for.
#[derive(Debug)]
struct Fault {
    place: crate::error::Place,
    /// Offset from the start of the bytes that were given.
    at: usize,
    expected: String,
    found: String,
}

/// Bytes as an error shows them, not too many.
fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 60;
    let text = String::from_utf8_lossy(bytes.get(..MOST).unwrap_or(bytes));
    let more = if bytes.len() > MOST { "..." } else { "" };
    format!("{text:?}{more}")
}
