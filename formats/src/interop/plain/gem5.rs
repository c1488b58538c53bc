//! Packet traces of gem5: `gem5`, then protocol-buffer messages, each after its length. The first is a
//! header; the others are packets, one per access (`src/proto/packet.proto` and `src/proto/protoio.hh` of
//! gem5).
//!
//! Commands are the numbers of `MemCmd::Command` since gem5 version 22; earlier versions numbered atomic
//! swaps differently. Requests that read or write data are accesses, including write-backs of a cache
//! above. Responses, fences, upgrades, other packets without data, and requests that bypass caches are not.

use super::{AccessKind, BLOCK, Decoder, Fault, MOST_RECORD_BYTES, PlainAccess};
use crate::error::Place;
use crate::varint::put;
use std::io::{self, Write};

/// First bytes of every trace.
pub(super) const MAGIC: &[u8] = b"gem5";

/// `MemCmd::ReadReq` and `MemCmd::WriteReq`, which are the same in all versions.
const READ: u64 = 1;
const WRITE: u64 = 4;

/// Flag bits of a request.
const FETCH_FLAG: u64 = 0x100;
const UNCACHEABLE_FLAG: u64 = 0x400;

/// Kind of the data transfer of a command's request.
fn kind_of(command: u64, flags: u64) -> Option<AccessKind> {
    if flags & UNCACHEABLE_FLAG != 0 {
        return None;
    }
    match command {
        // Reads, prefetches, reads for ownership or by a cache, load-linked, locked reads.
        READ | 11..=13 | 20 | 22 | 24..=26 | 30 if flags & FETCH_FLAG != 0 => {
            Some(AccessKind::Fetch)
        }
        READ | 11..=13 | 20 | 22 | 24..=26 | 30 => Some(AccessKind::Read),
        // Writes, write-backs, whole lines, store-conditional, locked writes, swaps.
        WRITE | 7..=9 | 16 | 27 | 28 | 32 | 34 => Some(AccessKind::Write),
        _ => None,
    }
}

/// Writes the magic number and the header.
pub(super) fn write_header(out: &mut impl Write) -> io::Result<()> {
    // The tick is the number of the access, with the usual 10^12 ticks per second.
    let mut header = Vec::new();
    put_field(&mut header, 1, 2);
    put(8, &mut header);
    header.extend_from_slice(b"parallax");
    put_field(&mut header, 3, 0);
    put(1_000_000_000_000, &mut header);
    out.write_all(MAGIC)?;
    put_message(out, &header)
}

/// Writes a packet.
pub(super) fn write(out: &mut impl Write, access: &PlainAccess, tick: u64) -> io::Result<()> {
    let command = match access.kind {
        AccessKind::Read | AccessKind::Fetch => READ,
        AccessKind::Write => WRITE,
    };
    let flags = (access.kind == AccessKind::Fetch).then_some((5, FETCH_FLAG));
    let fields = [
        (1, tick),
        (2, command),
        (3, access.address),
        (4, access.bytes.into()),
    ];
    let mut packet = Vec::with_capacity(40);
    for (number, value) in fields.into_iter().chain(flags) {
        put_field(&mut packet, number, 0);
        put(value, &mut packet);
    }
    put_message(out, &packet)
}

fn put_message(out: &mut impl Write, message: &[u8]) -> io::Result<()> {
    let mut length = Vec::with_capacity(2);
    put(message.len() as u64, &mut length);
    out.write_all(&length)?;
    out.write_all(message)
}

fn put_field(out: &mut Vec<u8>, number: u8, wire_type: u8) {
    out.push(number << 3 | wire_type);
}

/// Reads packets.
#[derive(Debug, Default)]
pub(super) struct Gem5 {
    has_magic: bool,
    has_header: bool,
    /// Number of packets read, including those that are not accesses.
    packets: u64,
    other_packets: u64,
}

impl Gem5 {
    fn place(&self) -> Place {
        if self.has_header {
            Place::Packet(self.packets + 1)
        } else {
            Place::Header
        }
    }

    /// Takes the next message from the front of `rest`. Returns its bytes and its size including the length
    /// prefix; `None` if it is incomplete.
    fn message<'a>(&self, rest: &'a [u8], ended: bool) -> Result<Option<(&'a [u8], usize)>, Fault> {
        let fault = |expected: String, found: String| Fault {
            place: self.place(),
            at: 0,
            expected,
            found,
        };
        let mut cursor = rest;
        let length = match varint(&mut cursor) {
            Some(length) => length,
            None if rest.len() < 10 && !ended => return Ok(None),
            None => {
                let found = match rest.len() {
                    0..10 => "the end",
                    _ => "a number of more than 64 bits",
                };
                return Err(fault(
                    "the length of a message".to_owned(),
                    found.to_owned(),
                ));
            }
        };
        let length = usize::try_from(length)
            .ok()
            .filter(|length| *length <= MOST_RECORD_BYTES / 2)
            .ok_or_else(|| {
                let most = MOST_RECORD_BYTES / 2;
                fault(
                    format!("a message of at most {most} bytes"),
                    length.to_string(),
                )
            })?;
        let Some(message) = cursor.get(..length) else {
            if ended {
                return Err(fault(
                    format!("a message of {length} bytes"),
                    format!("the end after {}", cursor.len()),
                ));
            }
            return Ok(None);
        };
        Ok(Some((message, rest.len() - cursor.len() + length)))
    }

    fn packet(&self, message: &[u8]) -> Result<Option<PlainAccess>, Fault> {
        let fault = |expected: &str, found: String| Fault {
            place: self.place(),
            at: 0,
            expected: expected.to_owned(),
            found,
        };
        let fields = fields(message)
            .ok_or_else(|| fault("the fields of a packet", "other bytes".to_owned()))?;
        let [Some(command), Some(address), Some(bytes)] = fields.needed else {
            let names = ["cmd", "addr", "size"];
            let missing = names.iter().zip(fields.needed).filter(|(_, f)| f.is_none());
            let missing: Vec<&str> = missing.map(|(name, _)| *name).collect();
            return Err(fault(
                "cmd, addr and size",
                format!("no {}", missing.join(", no ")),
            ));
        };
        let Some(kind) = kind_of(command, fields.flags) else {
            return Ok(None);
        };
        PlainAccess::checked(address, bytes, kind)
            .map(Some)
            .ok_or_else(|| {
                fault(
                    "at most 1 MiB that ends below 2^64",
                    format!("{bytes} bytes at {address:#x}"),
                )
            })
    }
}

impl Decoder for Gem5 {
    fn decode(
        &mut self,
        bytes: &[u8],
        ended: bool,
        out: &mut Vec<PlainAccess>,
    ) -> Result<usize, Fault> {
        let mut taken = 0;
        if !self.has_magic {
            if bytes.len() < MAGIC.len() && !ended {
                return Ok(0);
            }
            if !bytes.starts_with(MAGIC) {
                return Err(Fault {
                    place: Place::Header,
                    at: 0,
                    expected: "the magic number gem5".to_owned(),
                    found: super::shown(bytes.get(..MAGIC.len()).unwrap_or(bytes)),
                });
            }
            self.has_magic = true;
            taken = MAGIC.len();
        }
        while out.len() < BLOCK {
            let rest = bytes.get(taken..).unwrap_or_default();
            if rest.is_empty() && (self.has_header || !ended) {
                break;
            }
            let at = |fault: Fault| Fault { at: taken, ..fault };
            let Some((message, length)) = self.message(rest, ended).map_err(at)? else {
                break;
            };
            if self.has_header {
                match self.packet(message).map_err(at)? {
                    Some(access) => out.push(access),
                    None => self.other_packets += 1,
                }
                self.packets += 1;
            }
            self.has_header = true;
            taken += length;
        }
        Ok(taken)
    }

    fn other_packets(&self) -> u64 {
        self.other_packets
    }
}

/// The relevant fields of a packet: command, address and size; flags, 0 if absent.
struct Fields {
    needed: [Option<u64>; 3],
    flags: u64,
}

/// Parses the fields; `None` if the message is malformed.
fn fields(mut message: &[u8]) -> Option<Fields> {
    let mut found = Fields {
        needed: [None; 3],
        flags: 0,
    };
    let bytes = &mut message;
    while !bytes.is_empty() {
        let tag = varint(bytes)?;
        match tag & 7 {
            0 => {
                let value = varint(bytes)?;
                let [command, address, size] = &mut found.needed;
                match tag >> 3 {
                    0 => return None,
                    2 => *command = Some(value),
                    3 => *address = Some(value),
                    4 => *size = Some(value),
                    5 => found.flags = value,
                    _ => {}
                }
            }
            1 => skip(bytes, 8)?,
            2 => {
                let length = varint(bytes)?;
                skip(bytes, length)?;
            }
            5 => skip(bytes, 4)?,
            _ => return None,
        }
    }
    Some(found)
}

fn skip(bytes: &mut &[u8], count: u64) -> Option<()> {
    *bytes = bytes.get(usize::try_from(count).ok()?..)?;
    Some(())
}

/// Takes a number with seven bits per byte; `None` if it does not end or exceeds 64 bits.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for index in 0..10 {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        let part = u64::from(byte & 0x7f);
        if index == 9 && part > 1 {
            return None;
        }
        value |= part << (7 * index);
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}
