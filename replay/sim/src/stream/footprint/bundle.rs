//! The footprints of a quad at one level of one sample, as cache lines.

use std::hint::select_unpredictable;

/// Footprints of up to four lanes at one level.
///
/// Lines are relative to the texture, so that all textures of a material with the same size share the computation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bundle {
    /// Mip level.
    pub level: u8,
    /// Footprints (lanes).
    pub count: u8,
    /// Bit `i` is set if footprint `i` has the same lines as the footprint before it.
    repeats: u8,
    /// Distinct lines of each footprint, 1 to 4.
    lens: [u8; 4],
    lines: [[u32; 4]; 4],
    /// Filled if requested.
    distinct: DistinctLines,
}

impl Bundle {
    /// Empties the bundle for a new level.
    #[inline(always)]
    pub fn begin(&mut self, level: u8) {
        self.level = level;
        self.count = 0;
        self.repeats = 0;
    }

    /// Distinct lines of a footprint, in texel order.
    #[inline(always)]
    pub fn lines_of(&self, index: usize) -> &[u32] {
        let len = usize::from(self.lens[index & 3]).min(4);
        &self.lines[index & 3][..len]
    }

    /// The footprints whose lines differ from those of the footprint before, each with its index and its
    /// number of consecutive lanes.
    #[inline(always)]
    pub fn runs(&self) -> impl Iterator<Item = (usize, u32)> + use<> {
        runs(self.count, self.repeats)
    }

    /// A bundle of level 0 with these footprints.
    #[cfg(test)]
    pub fn of(footprints: &[[u32; 4]]) -> Self {
        let mut bundle = Self::default();
        let mut last = [0; 4];
        for &texels in footprints {
            bundle.push(texels, &mut last);
        }
        bundle.list_distinct();
        bundle
    }

    /// Fills the list for [`Self::distinct`].
    #[inline(always)]
    pub(super) fn list_distinct(&mut self) {
        let distinct = &mut self.distinct;
        distinct.begin();
        for (index, times) in runs(self.count, self.repeats) {
            let users = ((1_u32 << times) - 1) << index;
            let len = usize::from(self.lens[index & 3]).min(4);
            distinct.add(self.lines[index & 3], len, users);
        }
    }

    /// The distinct lines, if they were requested from [`Footprints::scratch`](super::Footprints::scratch).
    #[inline(always)]
    pub fn distinct(&self) -> &DistinctLines {
        &self.distinct
    }

    /// Adds a footprint, given the lines of its four texels (top left, top right, bottom left, bottom
    /// right). `last` keeps the footprint before.
    ///
    /// Uses registers and no branches: whether a footprint crosses a line is unpredictable, and data stored
    /// by word cannot be loaded as a whole directly afterwards.
    #[inline(always)]
    pub fn push(&mut self, texels: [u32; 4], last: &mut [u32; 4]) {
        let [a, b, c, d] = texels;
        let index = usize::from(self.count & 3);
        let new_b = b != a;
        let new_c = (c != a) & (c != b);
        let new_d = (d != a) & (d != b) & (d != c);
        // Unused entries repeat the first line, so that whole arrays can be compared.
        let d = if new_d { d } else { a };
        let c_or_d = if new_c { c } else { d };
        let lines = [
            a,
            if new_b { b } else { c_or_d },
            if new_b & new_c {
                c
            } else if new_b | new_c {
                d
            } else {
                a
            },
            if new_b & new_c { d } else { a },
        ];
        let [e, f, g, h] = *last;
        let [_, second, third, fourth] = lines;
        let same = (a == e) & (second == f) & (third == g) & (fourth == h);
        self.repeats |= u8::from((index > 0) & same) << index;
        self.lines[index] = lines;
        self.lens[index] = 1 + u8::from(new_b) + u8::from(new_c) + u8::from(new_d);
        self.count += 1;
        *last = lines;
    }
}

/// See [`Bundle::runs`].
#[inline(always)]
fn runs(count: u8, repeats: u8) -> impl Iterator<Item = (usize, u32)> {
    // One bit for the first lane of each run, and one after the last lane.
    let all = 1_u32 << count;
    let mut firsts = (all - 1) & !u32::from(repeats) | all;
    std::iter::from_fn(move || {
        let first = firsts.trailing_zeros();
        firsts &= firsts - 1;
        (firsts != 0).then(|| (first as usize, firsts.trailing_zeros() - first))
    })
}

/// The distinct lines of a bundle, in order of last use.
#[derive(Clone, Copy, Debug, Default)]
pub struct DistinctLines {
    count: usize,
    /// Total lines of footprints that do not repeat the footprint before.
    listed: u32,
    /// Line look-ups of all footprints.
    lookups: u32,
    /// The lowest and the highest line.
    span: [u32; 2],
    lines: [DistinctLine; Self::MOST],
}

/// A line of a bundle, packed into one word.
///
/// | bits | content |
/// | --- | --- |
/// | 0 to 31 | line relative to the texture |
/// | 32 to 47 | footprints of the bundle that use it, one bit each |
/// | 48 to 63 | index of its first occurrence among the lines of footprints that do not repeat the footprint before |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DistinctLine(u64);

impl DistinctLine {
    /// Line relative to the texture.
    #[inline(always)]
    pub fn line(self) -> u32 {
        self.0 as u32
    }

    /// Footprints of the bundle that use it, one bit each.
    #[inline(always)]
    pub fn users(self) -> u32 {
        (self.0 >> 32) as u32 & 0xffff
    }

    /// Index of its first occurrence among the lines of footprints that do not repeat the footprint before.
    #[inline(always)]
    pub fn first(self) -> u32 {
        (self.0 >> 48) as u32
    }
}

impl DistinctLines {
    /// Four lanes with four texels each.
    const MOST: usize = 16;

    #[inline(always)]
    fn begin(&mut self) {
        (self.count, self.listed, self.lookups) = (0, 0, 0);
        self.span = [u32::MAX, 0];
    }

    /// Adds the first `len` lines of some footprints; the others repeat the first one.
    ///
    /// Branches on the number of lines so far, but not on whether lines recur, which is unpredictable.
    #[inline(always)]
    fn add(&mut self, lines: [u32; 4], len: usize, users: u32) {
        let [a, b, c, d] = lines;
        let [lowest, highest] = self.span;
        self.span = [
            lowest.min(a).min(b).min(c.min(d)),
            highest.max(a).max(b).max(c.max(d)),
        ];
        let users_bits = u64::from(users) << 32;
        let new = |line: u32, number: u32| {
            u64::from(line) | users_bits | u64::from(self.listed + number) << 48
        };
        let mut new = [new(a, 0), new(b, 1), new(c, 2), new(d, 3)];
        let mut kept = 0;
        for at in 0..self.count.min(Self::MOST - 4) {
            let before = self.lines[at];
            let mut again = false;
            for new in &mut new {
                let same = *new as u32 == before.line();
                again |= same;
                *new = select_unpredictable(same, before.0 | users_bits, *new);
            }
            self.lines[kept] = before;
            kept += usize::from(!again);
        }
        for (number, new) in new.into_iter().enumerate() {
            self.lines[kept + number] = DistinctLine(new);
        }
        self.count = kept + len;
        self.listed += len as u32;
        self.lookups += len as u32 * users.count_ones();
    }

    /// All lines, in chunks of four with the number in use.
    #[inline(always)]
    pub fn chunks(&self) -> impl Iterator<Item = ([DistinctLine; 4], usize)> {
        let count = self.count;
        let chunks = self.lines.as_chunks::<4>().0.iter();
        let counts = (0..count.min(Self::MOST))
            .step_by(4)
            .map(move |at| (count - at).min(4));
        chunks.copied().zip(counts)
    }

    /// Line look-ups of all footprints.
    #[inline(always)]
    pub fn lookups(&self) -> u32 {
        self.lookups
    }

    /// The lowest and the highest line.
    #[inline(always)]
    pub fn span(&self) -> [u32; 2] {
        self.span
    }

    /// Total lines of footprints that do not repeat the footprint before.
    #[inline(always)]
    pub fn listed(&self) -> u32 {
        self.listed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_footprint_are_distinct_and_in_texel_order() {
        for (texels, lines) in [
            ([5, 5, 5, 5], &[5][..]),
            ([5, 6, 5, 6], &[5, 6]),
            ([5, 5, 2, 2], &[5, 2]),
            ([5, 6, 7, 5], &[5, 6, 7]),
            ([5, 6, 6, 7], &[5, 6, 7]),
            ([9, 3, 7, 1], &[9, 3, 7, 1]),
        ] {
            assert_eq!(Bundle::of(&[texels]).lines_of(0), lines);
        }
    }

    #[test]
    fn only_equal_consecutive_footprints_are_repeats() {
        let footprints = [[1, 2, 1, 2], [1, 2, 1, 2], [2, 1, 2, 1], [1, 2, 1, 2]];
        for (count, runs) in [
            (0, &[][..]),
            (1, &[(0, 1)]),
            (2, &[(0, 2)]),
            (4, &[(0, 2), (2, 1), (3, 1)]),
        ] {
            assert!(
                Bundle::of(&footprints[..count])
                    .runs()
                    .eq(runs.iter().copied())
            );
        }
    }
}
