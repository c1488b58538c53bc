//! Plain addresses of every form and compression.
//!
//! The first byte of an input chooses the form, the rest is the file.

use crate::Change;
use flate2::read::GzDecoder;
use formats::FormatError;
use formats::interop::plain::{
    AddressFile, AddressForm, Block, CompressedWriter, Compression, Found,
};
use replay::addresses::{KindSet, replay};
use replay::config::RunConfig;
use std::io::{Read, Write};

/// Bytes that are changed of what an input holds compressed: zeros shrink to a thousandth.
const MOST_BYTES: u64 = 1 << 20;

/// Accesses that are read: compressed, a small file holds any number.
const MOST_ACCESSES: usize = 1 << 20;

/// Bytes that are replayed: each access may be of a megabyte.
const MOST_REPLAYED: u64 = 1 << 24;

/// Hands over few bytes at a time, as pipes do.
struct Dripping<'a>(&'a [u8], usize);

impl Read for Dripping<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let most = out.len().min(self.1);
        self.0.read(&mut out[..most])
    }
}

fn form(bytes: &[u8]) -> (Option<AddressForm>, &[u8]) {
    let Some((choice, rest)) = bytes.split_first() else {
        return (None, bytes);
    };
    (AddressForm::ALL.get(usize::from(choice % 8)).copied(), rest)
}

/// Why a reader stopped.
#[derive(Debug, PartialEq)]
struct Stopped(String);

impl From<FormatError> for Stopped {
    fn from(error: FormatError) -> Self {
        Self(error.to_string())
    }
}

/// What a reader of accesses saw.
#[derive(Debug, PartialEq)]
struct Seen {
    found: Found,
    /// Bytes of all accesses.
    bytes: u64,
    /// Depends on every access and on their order.
    sum: u64,
}

fn read(bytes: &[u8], form: Option<AddressForm>, drip: usize) -> Result<Seen, Stopped> {
    let (mut sum, mut count, mut accessed) = (0_u64, 0, 0);
    let file = AddressFile::of_stream("input".to_owned(), form, Dripping(bytes, drip))?;
    let found = file.for_blocks(|block| {
        let mut add = |value: u64| sum = sum.rotate_left(5) ^ value;
        count += match block {
            Block::U32(words) => {
                words
                    .iter()
                    .for_each(|w| add(u32::from_le_bytes(*w).into()));
                words.len()
            }
            Block::U64(words) => {
                words.iter().for_each(|w| add(u64::from_le_bytes(*w)));
                accessed += 8 * words.len() as u64;
                words.len()
            }
            Block::Accesses(accesses) => {
                for access in accesses {
                    let last = access.address.checked_add(u64::from(access.bytes) - 1);
                    assert!(last.is_some(), "{access:?} ends beyond 2^64");
                    accessed += u64::from(access.bytes);
                    add(access.address);
                    add(u64::from(access.bytes) << 2 | access.kind as u64);
                }
                accesses.len()
            }
        };
        match count <= MOST_ACCESSES {
            true => Ok(()),
            false => Err(Stopped("enough".to_owned())),
        }
    })?;
    Ok(Seen {
        found,
        bytes: accessed,
        sum,
    })
}

/// Bytes behind a compression, as far as they are read.
fn inflated(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut inside = Vec::new();
    let reader = GzDecoder::new(bytes);
    reader.take(MOST_BYTES).read_to_end(&mut inside).ok()?;
    Some(inside)
}

/// Reads the accesses in large and in small pieces, which must not matter, and replays them.
pub fn run(bytes: &[u8]) {
    let (form, bytes) = form(bytes);
    let all = read(bytes, form, usize::MAX);
    let dripped = read(bytes, form, 7);
    assert!(
        all == dripped,
        "{all:?} in one piece, {dripped:?} in pieces"
    );
    if !all.is_ok_and(|seen| seen.bytes <= MOST_REPLAYED) {
        return;
    }
    let file = AddressFile::of_stream("input".to_owned(), form, bytes);
    let config = RunConfig::default();
    let mut small = config;
    small.level.l1.size_bytes = 1024;
    let file = file.expect("it was opened before");
    if let Ok(outcome) = replay(file, &[config, small], KindSet::ALL) {
        for point in &outcome.points {
            let [lookups, misses] = [point.l1.line_lookups(), point.l1.line_misses()];
            assert!(misses <= lookups && outcome.unique_lines <= lookups);
            assert!(outcome.unique_lines <= misses);
        }
    }
}

/// Changes the file, or what is compressed in it.
pub fn mutate(bytes: &[u8], most_bytes: usize, seed: u32, change: Change<'_>) -> Vec<u8> {
    let inside = match bytes {
        [_, rest @ ..] if !seed.is_multiple_of(4) => inflated(rest),
        _ => None,
    };
    let Some(mut inside) = inside else {
        return crate::plain(bytes, most_bytes, seed, change);
    };
    let most = inside.len().max(most_bytes);
    change(&mut inside, most);
    let mut writer = CompressedWriter::new(Some(Compression::Gzip), Vec::new());
    let written = writer.write_all(&inside).and_then(|()| writer.finish());
    let mut changed = vec![bytes[0]];
    changed.extend(written.expect("in memory"));
    changed
}
