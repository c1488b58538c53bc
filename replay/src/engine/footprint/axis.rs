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
    /// Power of two: repeating is a mask.
    power_of_two: bool,
    /// Byte offset within the level of a texel's block, by texel.
    bytes: Vec<u32>,
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
            power_of_two: (size as u64).is_power_of_two(),
            bytes,
        }
    }

    /// Byte offsets of the two texels around a coordinate (bilinear filtering).
    #[inline(always)]
    pub fn linear(&self, coordinate: i32) -> (u32, u32) {
        let first = match self.step {
            Step::Shift(shift) => (i64::from(coordinate) - (1 << (shift - 1))) >> shift,
            Step::Ratio(steps) => {
                (2 * i64::from(coordinate) * self.size - steps).div_euclid(2 * steps)
            }
        };
        let first = first + self.offset;
        (self.byte(first), self.byte(first + 1))
    }

    /// Byte offset of the texel that holds a coordinate.
    #[inline(always)]
    pub fn nearest(&self, coordinate: i32) -> u32 {
        let texel = match self.step {
            Step::Shift(shift) => i64::from(coordinate) >> shift,
            Step::Ratio(steps) => (i64::from(coordinate) * self.size).div_euclid(steps),
        };
        self.byte(texel + self.offset)
    }

    #[inline(always)]
    fn byte(&self, texel: i64) -> u32 {
        self.bytes[self.wrapped(texel) as usize]
    }

    #[inline(always)]
    fn wrapped(&self, texel: i64) -> i64 {
        match self.wrap {
            Wrap::Repeat if self.power_of_two => texel & (self.size - 1),
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
