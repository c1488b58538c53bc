//! Many LRU caches in one pass: a stack of lines for every set of every number of sets.
//!
//! An LRU cache of `w` ways holds the `w` lines of a set that were used last, so one stack, as deep
//! as the largest associativity asked for, answers all associativities: a line found at depth `d`
//! is a hit where there are more than `d` ways (Mattson et al. 1970). The lines of a set are those
//! of some sets of a cache with fewer sets, so a line that was used last in its set was so with
//! more sets, too, and the search ends there, with nothing to move (Hill & Smith 1989).

/// Marks a place in a stack that holds nothing.
const EMPTY: u32 = super::EMPTY;

/// The stacks of one number of sets.
#[derive(Clone, Debug)]
struct Stacks {
    /// Lines by set, the one used last first.
    lines: Vec<u32>,
    set_mask: u32,
    depth: usize,
}

impl Stacks {
    #[inline(always)]
    fn first(&self, line: u32) -> usize {
        (line & self.set_mask) as usize * self.depth
    }

    /// Moves the line to the front of its stack: how deep it was; the stack's depth if it was not
    /// there.
    #[inline(always)]
    fn access(&mut self, line: u32) -> usize {
        let first = self.first(line);
        match self.depth {
            4 => to_front(&mut self.lines[first..first + 4], line),
            depth => to_front(&mut self.lines[first..first + depth], line),
        }
    }
}

/// Shifts the stack back until the line is found or falls off the end.
#[inline(always)]
fn to_front(stack: &mut [u32], line: u32) -> usize {
    let mut carried = line;
    for (depth, place) in stack.iter_mut().enumerate() {
        let found = std::mem::replace(place, carried);
        if found == line {
            return depth;
        }
        carried = found;
    }
    stack.len()
}

/// LRU caches of several numbers of sets and ways that see the same lines.
#[derive(Clone, Debug)]
pub struct Forest {
    /// By number of sets, ascending.
    trees: Vec<Stacks>,
}

impl Forest {
    /// Empty caches. `trees` has numbers of sets (powers of two), ascending, each with the largest
    /// associativity that is asked for (at most 255); there is at least one.
    #[must_use]
    pub fn new(trees: &[(u32, u32)]) -> Self {
        debug_assert!(!trees.is_empty() && trees.is_sorted_by(|a, b| a.0 < b.0));
        let stacks = |&(sets, ways): &(u32, u32)| Stacks {
            lines: vec![EMPTY; sets as usize * ways as usize],
            set_mask: sets - 1,
            depth: ways as usize,
        };
        Self {
            trees: trees.iter().map(stacks).collect(),
        }
    }

    /// How many of `lines`, from the first on, were each the last one used in its set, whatever
    /// the number of sets: hits that change nothing.
    #[inline(always)]
    #[must_use]
    pub fn repeats(&self, lines: &[u32]) -> usize {
        let Some(coarsest) = self.trees.first() else {
            return lines.len();
        };
        let mut index = 0;
        while index < lines.len() && coarsest.lines[coarsest.first(lines[index])] == lines[index] {
            index += 1;
        }
        index
    }

    /// Accesses a line. `depths` gets, for each number of sets, how deep the line lay in its
    /// stack: a cache of more ways than that had it.
    #[inline(always)]
    pub fn access(&mut self, line: u32, depths: &mut [u8]) {
        let mut used_last = false;
        for (stacks, depth) in self.trees.iter_mut().zip(depths) {
            if used_last {
                *depth = 0;
                continue;
            }
            *depth = stacks.access(line) as u8;
            used_last = *depth == 0;
        }
    }
}
