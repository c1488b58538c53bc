//! Converts accesses to cache lines, in blocks.

use super::AddressError;
use super::names::Names;
use formats::interop::plain::{AccessKind, AddressFile, Block, PlainAccess};

/// Maximum lines per block.
pub(super) const BLOCK: usize = 4096;

/// A set of access kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindSet([bool; 3]);

impl KindSet {
    /// All kinds.
    pub const ALL: Self = Self([true; 3]);

    /// These kinds.
    pub fn of(kinds: &[AccessKind]) -> Self {
        let has = |kind| kinds.contains(&kind);
        Self([AccessKind::Read, AccessKind::Write, AccessKind::Fetch].map(has))
    }

    fn has(self, kind: AccessKind) -> bool {
        self.0[kind as usize]
    }
}

/// Consecutive line look-ups.
#[derive(Clone, Copy, Debug)]
pub struct LineBlock<'a> {
    /// Line numbers. Lines beyond 2^32 are renumbered: equal lines stay equal, low bits stay, and
    /// `u32::MAX` is never used.
    pub lines: &'a [u32],
    /// Kind of each look-up; empty if all are reads.
    pub kinds: &'a [AccessKind],
}

/// Totals of the input. Arrays are by kind: reads, writes, fetches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Accesses.
    pub accesses: [u64; 3],
    /// Line look-ups: an access that straddles lines looks up each line.
    pub lookups: [u64; 3],
    /// Accesses of kinds that were not selected.
    pub left_out: u64,
    /// gem5 packets that are not accesses.
    pub other_packets: u64,
}

/// The current block, and the conversion from addresses to lines.
struct Lines<V> {
    shift: u32,
    names: Names,
    kinds: KindSet,
    lines: Vec<u32>,
    line_kinds: Vec<AccessKind>,
    totals: Totals,
    visit: V,
}

impl<V: FnMut(LineBlock<'_>)> Lines<V> {
    fn block(&mut self, block: Block<'_>) -> Option<()> {
        match block {
            Block::U32(words) => self.words(words, |words, shift, _, lines| {
                // At least four bits are shifted out, so no line is `u32::MAX`.
                lines.extend(words.iter().map(|word| u32::from_le_bytes(*word) >> shift));
                Some(())
            }),
            Block::U64(words) => self.words(words, |words, shift, names, lines| {
                for word in words {
                    lines.push(names.name(u64::from_le_bytes(*word) >> shift)?);
                }
                Some(())
            }),
            Block::Accesses(accesses) => accesses.iter().try_for_each(|a| self.access(a)),
        }
    }

    /// Adds reads of one line each.
    fn words<T>(
        &mut self,
        words: &[T],
        lines_of: impl Fn(&[T], u32, &mut Names, &mut Vec<u32>) -> Option<()>,
    ) -> Option<()> {
        let count = words.len() as u64;
        if !self.kinds.has(AccessKind::Read) {
            self.totals.left_out += count;
            return Some(());
        }
        for words in words.chunks(BLOCK) {
            self.lines.clear();
            lines_of(words, self.shift, &mut self.names, &mut self.lines)?;
            (self.visit)(LineBlock {
                lines: &self.lines,
                kinds: &[],
            });
        }
        self.totals.accesses[AccessKind::Read as usize] += count;
        self.totals.lookups[AccessKind::Read as usize] += count;
        Some(())
    }

    fn access(&mut self, access: &PlainAccess) -> Option<()> {
        if !self.kinds.has(access.kind) {
            self.totals.left_out += 1;
            return Some(());
        }
        let last = access.address + u64::from(access.bytes.max(1) - 1);
        let lines = access.address >> self.shift..=last >> self.shift;
        let kind = access.kind as usize;
        self.totals.accesses[kind] += 1;
        for line in lines {
            self.totals.lookups[kind] += 1;
            self.lines.push(self.names.name(line)?);
            self.line_kinds.push(access.kind);
            if self.lines.len() == BLOCK {
                self.flush_block();
            }
        }
        Some(())
    }

    fn flush_block(&mut self) {
        (self.visit)(LineBlock {
            lines: &self.lines,
            kinds: &self.line_kinds,
        });
        self.lines.clear();
        self.line_kinds.clear();
    }
}

/// Passes the lines of all accesses of `kinds` to `visit`, in blocks of at most 4096, in order and with all
/// repeats. `line_bytes` is a power of two from 16 on. The bits that select among up to `most_sets` sets (a
/// power of two up to 2^24) are preserved.
///
/// # Errors
/// Unreadable or malformed input; no access, or none of `kinds`; accesses so sparse that 32 bits cannot
/// number the lines.
pub fn for_line_blocks(
    file: AddressFile<'_>,
    line_bytes: u32,
    most_sets: u32,
    kinds: KindSet,
    visit: impl FnMut(LineBlock<'_>),
) -> Result<Totals, AddressError> {
    let name = file.name().to_owned();
    let mut lines = Lines {
        shift: line_bytes.ilog2(),
        names: Names::new(most_sets),
        kinds,
        lines: Vec::with_capacity(BLOCK),
        line_kinds: Vec::with_capacity(BLOCK),
        totals: Totals::default(),
        visit,
    };
    let found = file.for_blocks(|block| {
        let done = lines.block(block);
        done.ok_or_else(|| AddressError::TooManyRanges {
            file: name.clone(),
            most: lines.names.most_ranges(),
            range_bytes: lines.names.range_lines() * u64::from(line_bytes),
        })
    })?;
    if !lines.line_kinds.is_empty() {
        lines.flush_block();
    }
    let totals = Totals {
        other_packets: found.other_packets,
        ..lines.totals
    };
    if totals.accesses == [0; 3] {
        return Err(AddressError::NoneOfKinds { file: name });
    }
    Ok(totals)
}

/// Passes the lines of all accesses to `visit`, as [`for_line_blocks`] does, without their kinds.
///
/// # Errors
/// As [`for_line_blocks`].
pub fn for_lines(
    file: AddressFile<'_>,
    line_bytes: u32,
    most_sets: u32,
    mut visit: impl FnMut(&[u32]),
) -> Result<Totals, AddressError> {
    for_line_blocks(file, line_bytes, most_sets, KindSet::ALL, |block| {
        visit(block.lines)
    })
}
