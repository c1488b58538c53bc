//! Simulates many LRU caches in one pass: one stack of lines per set, for every number of sets.
//!
//! An LRU cache of `w` ways holds the `w` most recently used lines of a set. One stack as deep as
//! the largest associativity therefore answers all associativities: a line found at depth `d` hits
//! with more than `d` ways (Mattson et al. 1970). More sets split the lines of a set, so a line
//! that was the most recent in its set also was with more sets. The search ends there, with nothing
//! to move (Hill & Smith 1989).

use crate::memory::cache::EMPTY;
use crate::memory::policy::to_front;
use std::hint::select_unpredictable;

/// The stacks for one number of sets.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Stacks {
    /// Lines by set, most recently used first.
    lines: Vec<u32>,
    set_mask: u32,
    depth: usize,
}

impl Stacks {
    /// Moves the line to the front of its stack. Returns its previous depth, or the stack's depth if it was absent.
    #[inline(always)]
    fn access(&mut self, line: u32) -> u8 {
        let first = (line & self.set_mask) as usize * self.depth;
        to_front(&mut self.lines[first..first + self.depth], line) as u8
    }

    /// Accesses lines in stacks of the compile-time depth `N`.
    fn access_each<const N: usize>(
        &mut self,
        lines: impl Iterator<Item = u32>,
        depths: &mut Vec<u8>,
    ) {
        let (stacks, _) = self.lines.as_chunks_mut::<N>();
        let mask = self.set_mask;
        depths.extend(lines.map(|line| to_front_of(&mut stacks[(line & mask) as usize], line)));
    }
}

/// Branch-free: moves the line to the front of its stack and returns its previous depth, or `N` if it was absent.
#[inline(always)]
fn to_front_of<const N: usize>(stack: &mut [u32; N], line: u32) -> u8 {
    let old = *stack;
    let mut depth = N;
    for (at, tag) in old.iter().enumerate().rev() {
        depth = select_unpredictable(*tag == line, at, depth);
    }
    stack[0] = line;
    for at in 1..N {
        stack[at] = select_unpredictable(at <= depth, old[at - 1], old[at]);
    }
    depth as u8
}

/// LRU caches with several numbers of sets and ways, accessed by the same lines.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Forest {
    trees: Vec<Stacks>,
}

impl Forest {
    /// Empty caches. `trees` lists at least one number of sets (powers of two), each with its largest associativity
    /// (at most 255). Only [`Self::access_tree`] allows numbers of sets that do not ascend.
    pub fn new(trees: &[(u32, u32)]) -> Self {
        debug_assert!(!trees.is_empty());
        let stacks = |&(sets, ways): &(u32, u32)| Stacks {
            lines: vec![EMPTY; sets as usize * ways as usize],
            set_mask: sets - 1,
            depth: ways as usize,
        };
        Self {
            trees: trees.iter().map(stacks).collect(),
        }
    }

    /// Number of lines of all caches.
    pub fn lines(&self) -> usize {
        self.trees.iter().map(|tree| tree.lines.len()).sum()
    }

    /// Empties all caches.
    pub fn clear(&mut self) {
        self.trees
            .iter_mut()
            .for_each(|tree| tree.lines.fill(EMPTY));
    }

    /// Accesses lines until one lies at depth `ways` or deeper for any number of sets. Returns its
    /// index, or the number of lines. `depths` holds the result of [`Self::access`] for that line.
    #[inline(always)]
    pub fn access_all(&mut self, lines: &[u32], ways: u32, depths: &mut [u8]) -> usize {
        let ([coarsest, finer @ ..], [depth, depths @ ..]) = (&mut *self.trees, depths) else {
            return lines.len();
        };
        for (index, &line) in lines.iter().enumerate() {
            *depth = coarsest.access(line);
            if *depth == 0 {
                continue;
            }
            let finer = deepest(finer, line, depths);
            if u32::from(finer.max(*depth)) >= ways {
                return index;
            }
        }
        lines.len()
    }

    /// Accesses lines for one number of sets. `depths` receives each line's depth as from
    /// [`Self::access`]. Lines found on top need no access with more sets.
    pub fn access_tree(
        &mut self,
        tree: usize,
        lines: impl Iterator<Item = u32>,
        depths: &mut Vec<u8>,
    ) {
        depths.clear();
        let tree = &mut self.trees[tree];
        match tree.depth {
            1 => tree.access_each::<1>(lines, depths),
            2 => tree.access_each::<2>(lines, depths),
            4 => tree.access_each::<4>(lines, depths),
            _ => depths.extend(lines.map(|line| tree.access(line))),
        }
    }

    /// Accesses a line. `depths` receives its depth for each number of sets: a cache with more ways
    /// than that hits. Returns the first number of sets (by index) from which on the line was on
    /// top.
    #[inline(always)]
    pub fn access(&mut self, line: u32, depths: &mut [u8]) -> usize {
        let mut searched = self.trees.len();
        for (tree, (stacks, depth)) in self.trees.iter_mut().zip(depths.iter_mut()).enumerate() {
            *depth = stacks.access(line);
            if *depth == 0 {
                searched = tree;
                break;
            }
        }
        depths[searched..].fill(0);
        searched
    }
}

/// Accesses a line in trees with increasing numbers of sets. Returns the largest depth.
#[inline(always)]
fn deepest(trees: &mut [Stacks], line: u32, depths: &mut [u8]) -> u8 {
    let mut deepest = 0;
    let mut used_last = false;
    for (stacks, depth) in trees.iter_mut().zip(depths) {
        *depth = if used_last { 0 } else { stacks.access(line) };
        used_last = *depth == 0;
        deepest = deepest.max(*depth);
    }
    deepest
}
