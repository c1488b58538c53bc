//! From bits to records.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Code, Codes};
use super::mode::{Departure, Mode};
use super::plane::{Plane, Quad};
use super::residual::{Pair, WIDE, add, class_bits, noise, small, sum, unfold};
use super::state::{State, group_of};
use super::{ESCAPE_PLACE, ESCAPE_SIZES, MASKS, STEPS};
use crate::textrace::bits::{BitReader, PEEK_BITS};
use crate::textrace::{PrimitiveRun, QuadRecord, Tile};
use crate::varint::{low_u32, unzigzag};

/// What was expected where the bits went wrong.
pub(super) type Outcome<T> = Result<T, &'static str>;

const SHORT: &str = "more bits";

/// Most bits of a place after which the sizes and small residuals of a quad, 11 + 8 + 16 bits, are
/// sure to lie in the same word.
const MOST_PLACE_BITS: u32 = PEEK_BITS - 35;

/// Where a record lies, the lanes that it covers, and its group.
struct Place {
    morton: u32,
    mask: u8,
    group: u8,
}

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
        let start = self.peek()?;
        let (place, used) = self.place(start)?;
        let Place {
            morton,
            mask,
            group,
        } = place;
        let (x, y) = position(morton)?;
        let quad = if self.state.has_seen(group) {
            // Place and residuals of most records lie in one word.
            let bits = if used <= MOST_PLACE_BITS {
                start >> used
            } else {
                self.bits.skip(used);
                self.peek()?
            };
            let before = if used <= MOST_PLACE_BITS { used } else { 0 };
            let known = group_of(&mut self.state.groups, group);
            let expected = known.plane.predict(x, y);
            let code = self.codes.sizes.get(known.noise).ok_or(SHORT)?;
            let (classes, length) = sizes(code, bits);
            known.noise = noise(classes);
            // A class of 3 is two set bits side by side.
            let residual = if classes & classes >> 1 & 0x55 == 0 {
                let (residual, all) = small_pairs(classes, bits >> length);
                self.bits.skip(before + length + all);
                residual
            } else {
                self.bits.skip(before + length);
                self.wide(classes)?
            };
            let known = group_of(&mut self.state.groups, group);
            add(&expected, &known.departure.read(x, y, &residual))
        } else {
            self.bits.skip(used);
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

    /// Place on the Morton curve, mask and group of the next record, and the bits that tell them.
    #[inline(always)]
    fn place(&self, mut bits: u64) -> Outcome<(Place, u32)> {
        let state = &self.state;
        let follow = state.follow();
        let mut used = 0;
        let mut before = state.morton;
        if state.first_of_run {
            let (apart, length) = self.codes.start.decode(bits);
            before = (state.morton_of_start ^ apart).wrapping_sub(1);
            used = length;
        } else if follow.same_quad {
            used = 1;
            if bits & 1 == 1 {
                let place = Place {
                    morton: state.morton,
                    mask: state.mask,
                    group: follow.group,
                };
                return Ok((place, used));
            }
        }
        bits >>= used;
        let context = state.place_context();
        let code = self.codes.place.get(context).ok_or(SHORT)?;
        let (symbol, length) = code.decode(bits);
        used += length;
        bits >>= length;
        if symbol == ESCAPE_PLACE {
            let [mask, group] = [low_u32(bits >> 6 & 15), low_u32(bits >> 10 & 15)];
            let place = Place {
                morton: before.wrapping_add(low_u32(bits & 63)),
                mask: mask.to_le_bytes()[0],
                group: group.to_le_bytes()[0],
            };
            return Ok((place, used + 14));
        }
        let mut step = 1 + symbol / MASKS;
        if step == STEPS {
            step = low_u32(bits & 63);
            used += 6;
        }
        let morton = before.wrapping_add(step);
        let mask = (1 + symbol % MASKS).to_le_bytes()[0];
        let place = Place {
            morton,
            mask: state.swap_mask(morton, mask),
            group: follow.group,
        };
        Ok((place, used))
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

/// The classes of a quad's residuals, and the bits that tell them.
#[inline(always)]
fn sizes(code: &Code, bits: u64) -> (u32, u32) {
    let (classes, length) = code.decode(bits);
    if classes == ESCAPE_SIZES {
        (low_u32(bits >> length & 255), length + 8)
    } else {
        (classes, length)
    }
}

/// Residuals none of which is wide, and their bits.
#[inline(always)]
fn small_pairs(classes: u32, mut bits: u64) -> (Quad, u32) {
    let mut used = 0;
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
    ([uv, dx, dy, cross], used)
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
