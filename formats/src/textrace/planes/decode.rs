//! From bits to records.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Code, Codes};
use super::mode::{Departure, Mode};
use super::plane::{Plane, Quad};
use super::residual::{Pair, WIDE, add, class_bits, noise, small, sum, unfold};
use super::state::State;
use super::{ESCAPE_PLACE, ESCAPE_SIZES, MASKS, STEPS};
use crate::textrace::bits::{BitReader, PEEK_BITS};
use crate::textrace::{PrimitiveRun, QuadRecord, Tile};
use crate::varint::{low_u32, unzigzag};

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
            let (step, draw_changed) = self.header()?;
            let primitive = next_primitive + step - 1;
            let primitive = u32::try_from(primitive).map_err(|_| "a primitive below 2^32")?;
            if draw_changed {
                draw = u32::try_from(self.gamma()? - 1).map_err(|_| "a draw below 2^32")?;
            }
            let count = u32::try_from(self.number(&self.codes.count)?).unwrap_or(u32::MAX);
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
        if self.bits.overrun() {
            return Err(SHORT);
        }
        Ok(())
    }

    #[inline(always)]
    fn peek(&self) -> Outcome<u64> {
        self.bits.peek_unpadded().ok_or(SHORT)
    }

    /// A number of at most 32 bits.
    #[inline(always)]
    fn take(&mut self, count: u32) -> Outcome<u64> {
        let bits = self.peek()?;
        self.bits.skip(count);
        Ok(bits & ((1 << count) - 1))
    }

    /// A number from 1 to 2^33 - 1: a code tells its highest bit.
    #[inline]
    fn number(&mut self, code: &Code) -> Outcome<u64> {
        let (power, length) = code.decode(self.peek()?);
        self.bits.skip(length);
        Ok(1 << power | self.take(power)?)
    }

    /// The step to a run's primitive, and whether its draw is another.
    #[inline]
    fn header(&mut self) -> Outcome<(u64, bool)> {
        let (symbol, length) = self.codes.header.decode(self.peek()?);
        self.bits.skip(length);
        let power = symbol >> 1;
        Ok((1 << power | self.take(power)?, symbol & 1 == 1))
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
            let residual = self.residual(group)?;
            let departure = &mut self.state.group_mut(group).departure;
            add(&expected, &departure.read(x, y, &residual))
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
        let mut bits = self.bits.peek_unpadded().ok_or(SHORT)?;
        let mut used = 0;
        let mut before = state.morton;
        if state.first_of_run {
            let (apart, length) = self.codes.start.decode(bits);
            before = (state.morton_of_start ^ apart).wrapping_sub(1);
            used = length;
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
        let mut step = 1 + symbol / MASKS;
        if step == STEPS {
            step = low_u32(bits >> length & 63);
            used += 6;
        }
        self.bits.skip(used);
        let morton = before.wrapping_add(step);
        let mask = (1 + symbol % MASKS).to_le_bytes()[0];
        Ok((morton, state.swap_mask(morton, mask), follow.group))
    }

    /// What a plane leaves over.
    #[inline(always)]
    fn residual(&mut self, group: u8) -> Outcome<Quad> {
        let mut bits = self.bits.peek_unpadded().ok_or(SHORT)?;
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
        // A class of 3 is two set bits side by side.
        if classes & classes >> 1 & 0x55 != 0 {
            self.bits.skip(used);
            return self.wide(classes);
        }
        let mut next = |class: u32| {
            let pair = small(class & 3, bits);
            let width = class_bits(class & 3);
            bits >>= width;
            used += width;
            pair
        };
        let dx = next(classes);
        let dy = next(classes >> 2);
        let cross = next(classes >> 4);
        let uv = next(classes >> 6);
        self.bits.skip(used);
        Ok([uv, dx, dy, cross])
    }

    /// Residuals one of which is wide at least.
    fn wide(&mut self, classes: u32) -> Outcome<Quad> {
        let mut next = |class: u32| -> Outcome<Pair> {
            let class = class & 3;
            if class == WIDE {
                return self.pair(&self.codes.later);
            }
            let bits = self.take(class_bits(class))?;
            Ok(small(class, bits))
        };
        let dx = next(classes)?;
        let dy = next(classes >> 2)?;
        let cross = next(classes >> 4)?;
        Ok([next(classes >> 6)?, dx, dy, cross])
    }

    /// A pair whose width a code tells.
    #[inline]
    fn pair(&mut self, code: &Code) -> Outcome<Pair> {
        let bits = self.peek()?;
        let (width, length) = code.decode(bits);
        self.numbers(bits, length, width)
    }

    /// Two numbers of a width, after `used` of the next bits.
    #[inline(always)]
    fn numbers(&mut self, bits: u64, used: u32, width: u32) -> Outcome<Pair> {
        let all = used + 2 * width;
        if all <= PEEK_BITS {
            self.bits.skip(all);
            let (bits, low) = (bits >> used, (1 << width) - 1);
            return Ok([unfold(bits & low), unfold(bits >> width & low)]);
        }
        self.bits.skip(used);
        Ok([unfold(self.take(width)?), unfold(self.take(width)?)])
    }

    /// A pair whose width a code tells as the difference from another, zigzag; and its width.
    #[inline]
    fn pair_after(&mut self, code: &Code, before: u32) -> Outcome<(u32, Pair)> {
        let bits = self.peek()?;
        let (symbol, length) = code.decode(bits);
        let width = i64::from(before) + unzigzag(symbol.into());
        let width = u32::try_from(width).ok().filter(|width| *width <= 32);
        let width = width.ok_or("a width of at most 32 bits")?;
        Ok((width, self.numbers(bits, length, width)?))
    }

    /// The first quad of a run in a group, and its plane.
    #[inline(never)]
    fn first(&mut self, group: u8, x: u8, y: u8, count: u32) -> Outcome<Quad> {
        let back = self.number(&self.codes.parent)? - 1;
        let back = usize::try_from(back).unwrap_or(usize::MAX);
        let parent = self.state.parent(group, back);
        let parent = parent.ok_or("an earlier run of the group")?;
        let expected = self.state.expect(&parent, x, y);
        let [dx_code, dy_code, cross_code, uv_code] = &self.codes.first;
        let [dx, dy] = expected.slopes();
        let (width, left) = self.pair_after(dx_code, 0)?;
        let dx = sum(dx, left);
        let (width, left) = self.pair_after(dy_code, width)?;
        let dy = sum(dy, left);
        let (width, left) = self.pair_after(cross_code, width)?;
        let cross = sum(expected.cross(dx, dy), left);
        let (_, left) = self.pair_after(uv_code, width)?;
        let uv = sum(expected.uv(), left);
        let quad = [uv, dx, dy, cross];
        let tilt = self.state.tilt(x, y, &quad, &expected);
        let (mode, level) = self.level(count)?;
        let plane = if level == 0 {
            Plane::through(x, y, &quad, tilt)
        } else {
            let mut by = Quad::default();
            for (pair, code) in by.iter_mut().zip(&self.codes.correction) {
                *pair = self.pair(code)?;
            }
            Plane::corrected(x, y, &quad, tilt, level, &by)
        };
        let departure = Departure::start(mode, x, y);
        self.state
            .start_plane(group, plane, super::first_noise(level), departure);
        Ok(quad)
    }

    /// How residuals are told, and how fine the correction of the plane is; a lone record has
    /// neither.
    fn level(&mut self, count: u32) -> Outcome<(Mode, u32)> {
        let Some(context) = super::level_context(count) else {
            return Ok((Mode::Plain, 0));
        };
        let code = self.codes.level.get(context).ok_or(SHORT)?;
        let (symbol, length) = code.decode(self.peek()?);
        self.bits.skip(length);
        let mode = Mode::of(symbol >> 3).ok_or("one of three modes")?;
        Ok((mode, symbol & 7))
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
