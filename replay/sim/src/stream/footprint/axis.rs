//! One axis of a mip level: converts fixed-point coordinates to texels and byte offsets.

use formats::texture::Wrap;

/// One axis of a level of a texture with a given sampler.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Number of texels, below 2^31, because a layer has fewer bytes.
    size: i32,
    wrap: Wrap,
    /// Texel offset of the sample.
    offset: i32,
    step: Step,
    /// Byte offset of each texel's block within the level.
    bytes: Vec<u32>,
}

/// Applies `f` to each lane. The library's `map` is not inlined here, which costs a fifth of a replay's time.
#[inline(always)]
fn each<A: Copy, T>([a, b, c, d]: [A; 4], f: impl Fn(A) -> T) -> [T; 4] {
    [f(a), f(b), f(c), f(d)]
}

/// Fixed-point steps per texel.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// `1 << n` steps, n from 2 to 31. The common case, because sizes in a group differ by powers of two.
    Shift(u32),
    /// `numerator / size` steps.
    Ratio(i64),
}

impl Axis {
    /// `steps` fixed-point steps make one unit of the texture coordinate; `bytes` has one entry per texel of the level.
    pub fn new(steps: i64, wrap: Wrap, offset: i8, bytes: Vec<u32>) -> Self {
        let size = bytes.len() as i64;
        let of_texel = steps / size;
        let shifts = 4..=1 << (i32::BITS - 1);
        let exact =
            steps % size == 0 && (of_texel as u64).is_power_of_two() && shifts.contains(&of_texel);
        Self {
            size: size as i32,
            wrap,
            offset: offset.into(),
            step: if exact {
                Step::Shift(of_texel.ilog2())
            } else {
                Step::Ratio(steps)
            },
            bytes,
        }
    }

    /// Byte offsets of the two texels around each lane's coordinate (bilinear filtering).
    ///
    /// Computes all four lanes, covered or not. The arithmetic is selected once, so the rest has no branches.
    #[inline(always)]
    pub fn linear(&self, coordinates: [i32; 4]) -> [[u32; 2]; 4] {
        let shift = match self.step {
            Step::Shift(shift) => shift,
            Step::Ratio(steps) => return self.linear_by_ratio(steps, coordinates),
        };
        // The coordinate minus half a texel, in texels. Rounding to half texels first avoids overflow.
        let first = each(coordinates, |c| {
            (((c >> (shift - 1)) - 1) >> 1) + self.offset
        });
        let last = self.size - 1;
        match self.wrap {
            Wrap::Repeat if self.size & last == 0 => self.pairs(first, |texel| texel & last),
            Wrap::Repeat => self.pairs(first, |texel| texel.rem_euclid(self.size)),
            Wrap::MirroredRepeat => self.pairs(first, |texel| mirrored(texel.into(), self.size)),
            Wrap::ClampToEdge => self.pairs(first, |texel| texel.max(0).min(last)),
            // Textures with a border are sampled by `general`.
            Wrap::ClampToBorder | Wrap::MirrorClampToEdge => {
                self.pairs(first, |texel| self.wrapped(texel.into()))
            }
        }
    }

    /// Byte offsets of each texel and the next, after `wrapped`.
    #[inline(always)]
    fn pairs(&self, first: [i32; 4], wrapped: impl Fn(i32) -> i32) -> [[u32; 2]; 4] {
        let bytes = &self.bytes[..];
        each(first, |texel| {
            [
                bytes[wrapped(texel) as usize],
                bytes[wrapped(texel + 1) as usize],
            ]
        })
    }

    #[inline(never)]
    fn linear_by_ratio(&self, steps: i64, coordinates: [i32; 4]) -> [[u32; 2]; 4] {
        each(coordinates, |c| {
            let twice = 2 * i64::from(c) * i64::from(self.size) - steps;
            self.pair_at(twice.div_euclid(2 * steps))
        })
    }

    /// Byte offset of the texel at each lane's coordinate.
    #[inline(always)]
    pub fn nearest(&self, coordinates: [i32; 4]) -> [u32; 4] {
        each(coordinates, |c| {
            let texel = match self.step {
                Step::Shift(shift) => i64::from(c >> shift),
                Step::Ratio(steps) => (i64::from(c) * i64::from(self.size)).div_euclid(steps),
            };
            self.byte(texel + i64::from(self.offset))
        })
    }

    /// Byte offsets of two texels of the level.
    pub fn bytes_of(&self, texels: [u32; 2]) -> [u32; 2] {
        texels.map(|texel| self.bytes[texel as usize])
    }

    /// Number of texels of the level.
    pub fn texels(&self) -> u32 {
        self.size as u32
    }

    /// Byte offsets of a texel and the next, before sample offset and wrapping.
    pub fn pair_at(&self, texel: i64) -> [u32; 2] {
        let texel = texel + i64::from(self.offset);
        [self.byte(texel), self.byte(texel + 1)]
    }

    #[inline(always)]
    fn byte(&self, texel: i64) -> u32 {
        self.bytes[self.wrapped(texel) as usize]
    }

    #[inline(always)]
    fn wrapped(&self, texel: i64) -> i32 {
        let size = i64::from(self.size);
        match self.wrap {
            Wrap::Repeat => texel.rem_euclid(size) as i32,
            Wrap::MirroredRepeat => mirrored(texel, self.size),
            Wrap::ClampToEdge | Wrap::ClampToBorder => texel.clamp(0, size - 1) as i32,
            Wrap::MirrorClampToEdge => texel.max(-1 - texel).min(size - 1) as i32,
        }
    }
}

/// Mirrored repetition over `size` texels.
#[inline(always)]
fn mirrored(texel: i64, size: i32) -> i32 {
    let size = i64::from(size);
    let there_and_back = texel.rem_euclid(2 * size);
    there_and_back.min(2 * size - 1 - there_and_back) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares texels of any size with those of a division, including coordinates at the ends of the range.
    #[test]
    fn shifts_equal_divisions_for_every_extent() {
        let bytes: Vec<u32> = (0..8).collect();
        let coordinates = [i32::MIN, -1_234_567_891, -1, 0];
        for bits in 3..46 {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                let steps = 1_i64 << bits;
                let axis = Axis::new(steps, wrap, -3, bytes.clone());
                for of in [coordinates, coordinates.map(|c| !c), [7, 8, 9, 1_000_003]] {
                    assert_eq!(axis.linear(of), axis.linear_by_ratio(steps, of), "{bits}");
                    let nearest = of.map(|c| axis.byte((8 * i64::from(c)).div_euclid(steps) - 3));
                    assert_eq!(axis.nearest(of), nearest, "{bits}");
                }
            }
        }
    }
}
