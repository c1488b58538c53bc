//! One axis of a mip level: fixed-point coordinate to texels to byte offsets.

use formats::texture::Wrap;

/// Everything about one axis of one level of a texture under one sampler.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Texels.
    size: i64,
    wrap: Wrap,
    /// Texel offset of the sample.
    offset: i64,
    step: Step,
    /// Repeating a power of two is a mask.
    repeat_mask: Option<usize>,
    /// Byte offset within the level of a texel's block, by texel.
    bytes: Vec<u32>,
}

/// What `f` makes of each lane. The library's `map` is not inlined here, which costs a fifth of a
/// replay.
#[inline(always)]
fn each<T>([a, b, c, d]: [i32; 4], f: impl Fn(i32) -> T) -> [T; 4] {
    [f(a), f(b), f(c), f(d)]
}

/// How many fixed-point steps a texel has.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// `1 << n` steps: the usual case, since sizes in a group differ by powers of two.
    Shift(u32),
    /// `numerator / size` steps.
    Ratio(i64),
}

impl Axis {
    /// `steps` fixed-point steps are one unit of the texture coordinate; `bytes` has an entry for
    /// each of the level's texels.
    pub fn new(steps: i64, wrap: Wrap, offset: i8, bytes: Vec<u32>) -> Self {
        let size = bytes.len() as i64;
        let exact =
            steps % size == 0 && ((steps / size) as u64).is_power_of_two() && steps / size > 1;
        Self {
            size,
            wrap,
            offset: offset.into(),
            step: if exact {
                Step::Shift((steps / size).ilog2())
            } else {
                Step::Ratio(steps)
            },
            repeat_mask: (wrap == Wrap::Repeat && bytes.len().is_power_of_two())
                .then(|| bytes.len() - 1),
            bytes,
        }
    }

    /// For each lane, byte offsets of the two texels around its coordinate (bilinear filtering).
    ///
    /// All four lanes at once, whether they are covered or not: the choice of arithmetic is made
    /// once, and what remains has no branches.
    #[inline(always)]
    pub fn linear(&self, coordinates: [i32; 4]) -> [[u32; 2]; 4] {
        match self.step {
            Step::Shift(shift) => {
                let half = 1_i64 << (shift - 1);
                let first = |c: i32| ((i64::from(c) - half) >> shift) + self.offset;
                if let Some(mask) = self.repeat_mask {
                    return each(coordinates, |c| {
                        let texel = first(c) as usize;
                        [
                            self.bytes[texel & mask],
                            self.bytes[texel.wrapping_add(1) & mask],
                        ]
                    });
                }
                each(coordinates, |c| self.pair(first(c)))
            }
            Step::Ratio(steps) => each(coordinates, |c| {
                let twice = 2 * i64::from(c) * self.size - steps;
                self.pair(twice.div_euclid(2 * steps) + self.offset)
            }),
        }
    }

    /// For each lane, byte offset of the texel that holds its coordinate.
    #[inline(always)]
    pub fn nearest(&self, coordinates: [i32; 4]) -> [u32; 4] {
        each(coordinates, |c| {
            let texel = match self.step {
                Step::Shift(shift) => i64::from(c) >> shift,
                Step::Ratio(steps) => (i64::from(c) * self.size).div_euclid(steps),
            };
            self.byte(texel + self.offset)
        })
    }

    /// Texels of the level.
    pub fn texels(&self) -> u32 {
        self.size as u32
    }

    /// Byte offsets of a texel and the next, before the sample's offset and wrapping.
    pub fn pair_at(&self, texel: i64) -> [u32; 2] {
        self.pair(texel + self.offset)
    }

    #[inline(always)]
    fn pair(&self, first: i64) -> [u32; 2] {
        [self.byte(first), self.byte(first + 1)]
    }

    #[inline(always)]
    fn byte(&self, texel: i64) -> u32 {
        self.bytes[self.wrapped(texel) as usize]
    }

    #[inline(always)]
    fn wrapped(&self, texel: i64) -> i64 {
        match self.wrap {
            Wrap::Repeat if (texel as u64) < self.size as u64 => texel,
            Wrap::Repeat => texel.rem_euclid(self.size),
            Wrap::MirroredRepeat => {
                let there_and_back = texel.rem_euclid(2 * self.size);
                there_and_back.min(2 * self.size - 1 - there_and_back)
            }
            Wrap::ClampToEdge => texel.clamp(0, self.size - 1),
        }
    }
}
