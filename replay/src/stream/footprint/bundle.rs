//! The footprints of one quad at one level of one sample, as cache lines.

/// Footprints of up to four lanes at one level.
///
/// Lines are relative to the texture, so that all textures of a material with the same size share
/// one computation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bundle {
    /// Mip level.
    pub level: u8,
    /// Footprints (lanes).
    pub count: u8,
    /// Bit `i`: footprint `i` has the same lines as the one before.
    repeats: u8,
    /// Distinct lines of each footprint, 1 to 4.
    lens: [u8; 4],
    lines: [[u32; 4]; 4],
}

impl Bundle {
    /// Empties the bundle for a level.
    #[inline(always)]
    pub fn begin(&mut self, level: u8) {
        self.level = level;
        self.count = 0;
        self.repeats = 0;
    }

    /// Distinct lines of a footprint, in the order in which its texels ask for them.
    #[inline(always)]
    #[must_use]
    pub fn lines_of(&self, index: usize) -> &[u32] {
        let len = usize::from(self.lens[index & 3]).min(4);
        &self.lines[index & 3][..len]
    }

    /// The footprints that do not have the same lines as the one before: of each its index, and how many
    /// lanes in a row have it.
    #[inline(always)]
    pub fn runs(&self) -> impl Iterator<Item = (usize, u32)> + use<> {
        // A bit for the first of each run, and one after the last lane.
        let all = 1_u32 << self.count;
        let mut firsts = (all - 1) & !u32::from(self.repeats) | all;
        std::iter::from_fn(move || {
            let first = firsts.trailing_zeros();
            firsts &= firsts - 1;
            (firsts != 0).then(|| (first as usize, firsts.trailing_zeros() - first))
        })
    }

    /// Adds the footprint of the lines of its four texels (top left, top right, bottom left,
    /// bottom right).
    #[inline(always)]
    pub fn push(&mut self, texels: [u32; 4]) {
        let [a, b, c, d] = texels;
        let index = usize::from(self.count & 3);
        // Unused entries repeat the first line, so that whole arrays can be compared. No branches:
        // whether a footprint crosses a line is a coin toss to the processor.
        let mut lines = [a; 4];
        let new_b = b != a;
        lines[1] = b;
        let mut len = 1 + usize::from(new_b);
        let new_c = (c != a) & (c != b);
        lines[len] = if new_c { c } else { a };
        len += usize::from(new_c);
        let new_d = (d != a) & (d != b) & (d != c);
        lines[len & 3] = if new_d { d } else { lines[len & 3] };
        len += usize::from(new_d);
        let repeats = (index > 0) & (self.lines[index.wrapping_sub(1) & 3] == lines);
        self.repeats |= u8::from(repeats) << index;
        self.lines[index] = lines;
        self.lens[index] = len as u8;
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bundle(footprints: &[[u32; 4]]) -> Bundle {
        let mut bundle = Bundle::default();
        bundle.begin(0);
        footprints.iter().for_each(|&texels| bundle.push(texels));
        bundle
    }

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
            assert_eq!(bundle(&[texels]).lines_of(0), lines);
        }
    }

    #[test]
    fn only_equal_neighbours_are_repeats() {
        let footprints = [[1, 2, 1, 2], [1, 2, 1, 2], [2, 1, 2, 1], [1, 2, 1, 2]];
        for (count, runs) in [
            (0, &[][..]),
            (1, &[(0, 1)]),
            (2, &[(0, 2)]),
            (4, &[(0, 2), (2, 1), (3, 1)]),
        ] {
            assert!(bundle(&footprints[..count]).runs().eq(runs.iter().copied()));
        }
    }
}
