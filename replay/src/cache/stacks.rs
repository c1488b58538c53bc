//! LRU caches of one number of sets and any associativity: a stack of lines for every set.
//!
//! An LRU cache of `w` ways holds the `w` lines of a set that were used last, so one stack, as deep
//! as the largest associativity asked for, answers all associativities: a line found at depth `d`
//! is a hit where there are more than `d` ways (Mattson et al. 1970).

use super::EMPTY;
use super::lru::to_front;

/// An access of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Its line.
    pub line: u32,
    /// The number of its footprint in the batch.
    pub footprint: u32,
}

/// The stacks of one number of sets.
#[derive(Clone, Debug)]
pub struct Stacks {
    /// Lines by cache and set, the one used last first.
    lines: Vec<u32>,
    set_mask: u32,
    depth: usize,
}

impl Stacks {
    /// Empty stacks of so many caches of `sets` sets (a power of two) and up to `ways` ways (at most 255).
    #[must_use]
    pub fn new(caches: usize, sets: u32, ways: u32) -> Self {
        Self {
            lines: vec![EMPTY; caches * sets as usize * ways as usize],
            set_mask: sets - 1,
            depth: ways as usize,
        }
    }

    /// Empties all caches.
    pub fn clear(&mut self) {
        self.lines.fill(EMPTY);
    }

    /// Moves the line to the front of its stack in the first cache: how deep it was; the stack's depth if it
    /// was not there.
    #[inline(always)]
    pub(super) fn access(&mut self, line: u32) -> u8 {
        let first = (line & self.set_mask) as usize * self.depth;
        to_front(&mut self.lines[first..first + self.depth], line) as u8
    }

    /// Accesses one line after another in the cache that `cache` names; `deeper` is told those that did not
    /// lie on top and how deep they lay. The others are taken out of the list: with more sets they lie on top, too
    /// (Hill & Smith 1989).
    #[inline]
    pub fn access_all(
        &mut self,
        accesses: &mut Vec<Access>,
        cache: impl Fn(&Access) -> usize,
        deeper: impl FnMut(&Access, u8),
    ) {
        match self.depth {
            1 => self.of_depth::<1>(accesses, cache, deeper),
            2 => self.of_depth::<2>(accesses, cache, deeper),
            4 => self.of_depth::<4>(accesses, cache, deeper),
            8 => self.of_depth::<8>(accesses, cache, deeper),
            16 => self.of_depth::<16>(accesses, cache, deeper),
            depth => {
                let sets = self.set_mask as usize + 1;
                let mask = self.set_mask;
                let lines = &mut *self.lines;
                retain(accesses, deeper, |access| {
                    let first = (cache(access) * sets + (access.line & mask) as usize) * depth;
                    to_front(&mut lines[first..first + depth], access.line) as u8
                });
            }
        }
    }

    /// The same for a depth that the compiler knows.
    #[inline]
    fn of_depth<const N: usize>(
        &mut self,
        accesses: &mut Vec<Access>,
        cache: impl Fn(&Access) -> usize,
        deeper: impl FnMut(&Access, u8),
    ) {
        let sets = self.set_mask as usize + 1;
        let mask = self.set_mask;
        let (stacks, _) = self.lines.as_chunks_mut::<N>();
        retain(accesses, deeper, |access| {
            let stack = &mut stacks[cache(access) * sets + (access.line & mask) as usize];
            to_front_of(stack, access.line)
        });
    }
}

/// Keeps the accesses that do not lie on top.
#[inline(always)]
fn retain(
    accesses: &mut Vec<Access>,
    mut deeper: impl FnMut(&Access, u8),
    mut depth: impl FnMut(&Access) -> u8,
) {
    let mut kept = 0;
    for index in 0..accesses.len() {
        let access = accesses[index];
        let depth = depth(&access);
        if depth > 0 {
            deeper(&access, depth);
            accesses[kept] = access;
            kept += 1;
        }
    }
    accesses.truncate(kept);
}

/// As [`to_front`], four tags at a time: among these, where a line lies is found and moved without branches.
#[inline(always)]
fn to_front_of<const N: usize>(stack: &mut [u32; N], line: u32) -> u8 {
    if N < 8 {
        return to_front(stack, line) as u8;
    }
    if stack[0] == line {
        return 0;
    }
    let mut carried = line;
    let (fours, _) = stack.as_chunks_mut::<4>();
    for (above, four) in (0..).step_by(4).zip(fours) {
        let [first, second, third, fourth] = *four;
        let found = four.map(|tag| tag == line);
        let in_front = found[0] | found[1];
        if !(in_front | found[2] | found[3]) {
            *four = [carried, first, second, third];
            carried = fourth;
            continue;
        }
        let second_kept = if found[0] { second } else { first };
        let third_kept = if in_front { third } else { second };
        let fourth_kept = if found[3] { third } else { fourth };
        *four = [carried, second_kept, third_kept, fourth_kept];
        let depth = 1 - u8::from(found[0]) + u8::from(!in_front) + u8::from(found[3]);
        return above + depth;
    }
    N as u8
}
