//! From bits to records.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Code, Codes};
use super::plane::{Plane, Quad};
use super::residual::{Pair, WIDE, class_bits, noise, small, sum, unfold};
use super::state::State;
use super::{ESCAPE_PLACE, ESCAPE_SIZES, MASKS};
use crate::textrace::bits::BitReader;
use crate::textrace::{PrimitiveRun, QuadRecord, Tile};
use crate::varint::low_u32;

/// What was expected where the bits went wrong.
pub(super) type Outcome<T> = Result<T, &'static str>;

const SHORT: &str = "more bits";

pub(super) struct Decoder<'a> {
    bits: BitReader<'a>,
    codes: &'static Codes,
    state: State,
}

impl<'a> Decoder<'a> {
    pub fn new(input: &'a [u8]) -> Self {
        Self {
            bits: BitReader::new(input),
            codes: Codes::get(),
            state: State::new(),
        }
    }

    /// The bits that follow.
    pub fn bits(&self) -> &BitReader<'a> {
        &self.bits
    }

    /// Reads the runs and their records.
    pub fn tile(&mut self, runs: u32, records: u32, tile: &mut Tile) -> Outcome<()> {
        let mut next_primitive = 0u64;
        let mut draw = 0;
        let mut first = 0u32;
        for _ in 0..runs {
            let primitive = next_primitive + self.gamma()? - 1;
            let primitive = u32::try_from(primitive).map_err(|_| "a primitive below 2^32")?;
            if self.take(1)? == 1 {
                draw = u32::try_from(self.gamma()? - 1).map_err(|_| "a draw below 2^32")?;
            }
            let count = u32::try_from(self.gamma()?).unwrap_or(u32::MAX);
            if count > records - first {
                return Err("a run of no more records than the index tells");
            }
            let run = PrimitiveRun {
                primitive,
                draw,
                first,
                count,
            };
            tile.runs.push(run);
            self.state.start_run(&run);
            for _ in 0..count {
                tile.records.push(self.record(count)?);
            }
            first += count;
            next_primitive = u64::from(primitive) + 1;
        }
        if first != records {
            return Err("runs of as many records as the index tells");
        }
        Ok(())
    }

    #[inline(always)]
    fn peek(&self) -> Outcome<u64> {
        self.bits.peek().ok_or(SHORT)
    }

    /// A number of at most 32 bits.
    #[inline(always)]
    fn take(&mut self, count: u32) -> Outcome<u64> {
        let bits = self.peek()?;
        self.bits.skip(count);
        Ok(bits & ((1 << count) - 1))
    }

    /// A number from 1 to 2^33 - 1 in Elias's gamma code.
    fn gamma(&mut self) -> Outcome<u64> {
        let zeros = self.peek()?.trailing_zeros();
        if zeros > 32 {
            return Err("a number below 2^33");
        }
        self.bits.skip(zeros + 1);
        Ok(1 << zeros | self.take(zeros)?)
    }

    #[inline(always)]
    fn record(&mut self, count: u32) -> Outcome<QuadRecord> {
        let (morton, mask, group) = self.place()?;
        let (x, y) = position(morton)?;
        let quad = if self.state.has_seen(group) {
            let expected = self.state.group_mut(group).plane.predict(x, y);
            self.residuals(group, &expected)?
        } else {
            self.first(group, x, y, count)?
        };
        self.state.note_place(morton, mask, group);
        let [uv, dx, dy, cross] = quad;
        Ok(QuadRecord {
            x,
            y,
            mask,
            group,
            uv,
            dx,
            dy,
            cross,
        })
    }

    /// Place on the Morton curve, mask and group of the next record.
    #[inline(always)]
    fn place(&mut self) -> Outcome<(u32, u8, u8)> {
        let state = &self.state;
        let follow = state.follow();
        let mut bits = self.bits.peek().ok_or(SHORT)?;
        let mut used = 0;
        let mut before = state.morton;
        if state.first_of_run {
            before = low_u32(bits & 63).wrapping_sub(1);
            used = 6;
        } else if follow.same_quad {
            used = 1;
            if bits & 1 == 1 {
                self.bits.skip(1);
                return Ok((state.morton, state.mask, follow.group));
            }
        }
        bits >>= used;
        let context = state.place_context();
        let code = self.codes.place.get(context).ok_or(SHORT)?;
        let (symbol, length) = code.decode(bits);
        used += length;
        if symbol == ESCAPE_PLACE {
            bits >>= length;
            self.bits.skip(used + 14);
            let [mask, group] = [low_u32(bits >> 6 & 15), low_u32(bits >> 10 & 15)];
            let morton = before.wrapping_add(low_u32(bits & 63));
            return Ok((morton, mask.to_le_bytes()[0], group.to_le_bytes()[0]));
        }
        self.bits.skip(used);
        let morton = before.wrapping_add(1 + symbol / MASKS);
        let mask = (1 + symbol % MASKS).to_le_bytes()[0];
        Ok((morton, state.swap_mask(morton, mask), follow.group))
    }

    /// What a plane leaves over, added to what it says.
    #[inline(always)]
    fn residuals(&mut self, group: u8, expected: &Quad) -> Outcome<Quad> {
        let mut bits = self.bits.peek().ok_or(SHORT)?;
        let known = self.state.group_mut(group);
        let code = self.codes.sizes.get(known.noise).ok_or(SHORT)?;
        let (mut classes, mut used) = code.decode(bits);
        bits >>= used;
        if classes == ESCAPE_SIZES {
            classes = low_u32(bits & 255);
            bits >>= 8;
            used += 8;
        }
        known.noise = noise(classes);
        let [uv, dx, dy, cross] = *expected;
        // A class of 3 is two set bits side by side.
        if classes & classes >> 1 & 0x55 != 0 {
            self.bits.skip(used);
            return self.wide(classes, expected);
        }
        let mut next = |class: u32| {
            let pair = small(class & 3, bits);
            let width = class_bits(class & 3);
            bits >>= width;
            used += width;
            pair
        };
        let quad = [
            sum(dx, next(classes)),
            sum(dy, next(classes >> 2)),
            sum(cross, next(classes >> 4)),
            sum(uv, next(classes >> 6)),
        ];
        self.bits.skip(used);
        let [dx, dy, cross, uv] = quad;
        Ok([uv, dx, dy, cross])
    }

    /// Residuals one of which is wide at least.
    fn wide(&mut self, classes: u32, expected: &Quad) -> Outcome<Quad> {
        let [uv, dx, dy, cross] = *expected;
        let mut next = |class: u32, expected: Pair| -> Outcome<Pair> {
            let class = class & 3;
            let pair = if class == WIDE {
                self.pair(&self.codes.later)?
            } else {
                let bits = self.take(class_bits(class))?;
                small(class, bits)
            };
            Ok(sum(expected, pair))
        };
        let dx = next(classes, dx)?;
        let dy = next(classes >> 2, dy)?;
        let cross = next(classes >> 4, cross)?;
        Ok([next(classes >> 6, uv)?, dx, dy, cross])
    }

    /// A pair whose width a code tells.
    #[inline]
    fn pair(&mut self, code: &Code) -> Outcome<Pair> {
        let bits = self.peek()?;
        let (width, length) = code.decode(bits);
        self.bits.skip(length);
        Ok([unfold(self.take(width)?), unfold(self.take(width)?)])
    }

    /// The first quad of a run in a group, and its plane.
    #[inline(never)]
    fn first(&mut self, group: u8, x: u8, y: u8, count: u32) -> Outcome<Quad> {
        let back = usize::try_from(self.gamma()? - 1).unwrap_or(usize::MAX);
        let parent = self.state.parent(group, back);
        let parent = parent.ok_or("an earlier run of the group")?;
        let expected = self.state.expect(&parent, x, y);
        let [dx_code, dy_code, cross_code, uv_code] = &self.codes.first;
        let [dx, dy] = expected.slopes();
        let dx = sum(dx, self.pair(dx_code)?);
        let dy = sum(dy, self.pair(dy_code)?);
        let cross = sum(expected.cross(dx, dy), self.pair(cross_code)?);
        let uv = sum(expected.uv(), self.pair(uv_code)?);
        let quad = [uv, dx, dy, cross];
        let tilt = self.state.tilt(x, y, &quad, &expected);
        let level = self.level(count)?;
        let plane = if level == 0 {
            Plane::through(x, y, &quad, tilt)
        } else {
            let mut by = Quad::default();
            for (pair, code) in by.iter_mut().zip(&self.codes.correction) {
                *pair = self.pair(code)?;
            }
            Plane::corrected(x, y, &quad, tilt, level, &by)
        };
        self.state
            .start_plane(group, plane, super::first_noise(level));
        Ok(quad)
    }

    /// How fine the correction of a plane is; a lone record has none.
    fn level(&mut self, count: u32) -> Outcome<u32> {
        let Some(context) = super::level_context(count) else {
            return Ok(0);
        };
        let code = self.codes.level.get(context).ok_or(SHORT)?;
        let (level, length) = code.decode(self.peek()?);
        self.bits.skip(length);
        Ok(level)
    }
}

/// Column and row of a place on the Morton curve.
#[inline(always)]
fn position(morton: u32) -> Outcome<(u8, u8)> {
    if morton > 63 {
        return Err("a quad inside the tile");
    }
    // Bits 0, 2 and 4 to 0, 1 and 2.
    let gather = |m: u32| (m & 1 | m >> 1 & 2 | m >> 2 & 4).to_le_bytes()[0];
    Ok((gather(morton), gather(morton >> 1)))
}
