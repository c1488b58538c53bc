//! From bits to records, run by run: places and planes from the front, departures from the back. The
//! two readers do not wait for each other, nor does either wait for what the planes say.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Code, Codes, sizes_context};
use super::mode::{Departure, Mode};
use super::parents::{Expected, Lineage, first_noise, level_context, tilt_of_run};
use super::places::{Last, Places};
use super::plane::{Plane, Quad};
use super::residual::{
    CLASS_NUMBER_BITS, Classes, ESCAPE_SIZES, Pair, WIDE, small_pairs, sum, unfold,
};
use super::{GROUPS, SHORT};
use crate::textrace::bits::{BitReader, PEEK_BITS};
use crate::textrace::{PrimitiveRun, QuadRecord, Tile};
use crate::varint::{low_u32, unzigzag};

/// What was expected where the bits went wrong.
pub(super) type Outcome<T> = Result<T, &'static str>;

/// A group of a run.
#[derive(Clone, Copy)]
struct Told {
    group: u8,
    plane: Plane,
    departure: Departure,
    noise: usize,
}

pub(super) struct Decoder<'a> {
    front: BitReader<'a>,
    back: BitReader<'a, true>,
    codes: &'static Codes,
    lineage: Lineage,
    /// The groups of a run.
    told: Vec<Told>,
}

impl<'a> Decoder<'a> {
    pub fn new(input: &'a [u8]) -> Self {
        Self {
            front: BitReader::new(input),
            back: BitReader::new(input),
            codes: Codes::get(),
            lineage: Lineage::new(),
            told: vec![],
        }
    }

    /// What follows from the front and from the back.
    pub fn readers(&self) -> (&BitReader<'a>, &BitReader<'a, true>) {
        (&self.front, &self.back)
    }

    /// Reads the runs and their records.
    pub fn tile(&mut self, runs: u32, records: u32, tile: &mut Tile) -> Outcome<()> {
        let mut places = Places::new();
        let mut next_primitive = 0u64;
        let mut draw = 0;
        let mut first = 0u32;
        for _ in 0..runs {
            let header = self.symbol(&self.codes.header)?;
            let power = header >> 1;
            let primitive = next_primitive + (1 << power | self.take(power)?) - 1;
            let primitive = u32::try_from(primitive).map_err(|_| "a primitive below 2^32")?;
            if header & 1 == 1 {
                draw = u32::try_from(self.gamma()? - 1).map_err(|_| "a draw below 2^32")?;
            }
            let count = u32::try_from(self.number(&self.codes.count)?).unwrap_or(u32::MAX);
            if count > records - first {
                return Err("a run of no more records than the index tells");
            }
            tile.runs.push(PrimitiveRun {
                primitive,
                draw,
                first,
                count,
            });
            places.start_run(draw);
            if places.tells_regular() {
                places.set_regular(self.take(1)? == 1);
            }
            self.run(&mut places, count, &mut tile.records)?;
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
        self.front.peek_unpadded().ok_or(SHORT)
    }

    /// A number of at most 32 bits.
    #[inline(always)]
    fn take(&mut self, count: u32) -> Outcome<u64> {
        let bits = self.peek()?;
        self.front.skip(count);
        Ok(bits & ((1 << count) - 1))
    }

    /// A symbol of a code.
    #[inline(always)]
    fn symbol(&mut self, code: &Code) -> Outcome<u32> {
        let (symbol, length) = code.decode(self.peek()?);
        self.front.skip(length);
        Ok(symbol)
    }

    /// A number from 1 to 2^33 - 1: a code tells its highest bit.
    #[inline]
    fn number(&mut self, code: &Code) -> Outcome<u64> {
        let power = self.symbol(code)?;
        Ok(1 << power | self.take(power)?)
    }

    /// A number from 1 to 2^33 - 1 in Elias's gamma code.
    fn gamma(&mut self) -> Outcome<u64> {
        let zeros = self.peek()?.trailing_zeros();
        if zeros > 32 {
            return Err("a number below 2^33");
        }
        self.front.skip(zeros + 1);
        Ok(1 << zeros | self.take(zeros)?)
    }

    /// The records of a run.
    #[inline(always)]
    fn run(
        &mut self,
        places: &mut Places,
        count: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<()> {
        self.told.clear();
        // Index in `told` of each group.
        let mut known = [usize::MAX; GROUPS];
        let mut of_run = None;
        let mut left = count;
        while left > 0 {
            left -= 1;
            let mut last = places.last;
            let (place, used) = places.read(&mut last, self.codes, self.peek()?)?;
            self.front.skip(used);
            let mut record = place.record();
            let known_as = known.get_mut(usize::from(place.group) % GROUPS);
            let known_as = known_as.ok_or(SHORT)?;
            if let Some(told) = self.told.get_mut(*known_as) {
                later(&mut self.back, self.codes, &mut record, told)?;
            } else {
                *known_as = self.told.len();
                let told = self.first(&mut record, of_run, places.share(left))?;
                of_run = Some(told.plane);
                self.told.push(told);
            }
            records.push(record);
            let index = *known_as;
            if let Some(starts) = places.starts_next_quad(&last) {
                left = if starts == place.group {
                    self.quads_of_one(places, &mut last, index, left, records)?
                } else {
                    let first = known.get(usize::from(starts) % GROUPS).copied();
                    let both = [first.unwrap_or(usize::MAX), index];
                    self.quads_of_two(places, &mut last, both, left, records)?
                };
            }
            places.last = last;
        }
        Ok(())
    }

    /// Quads of a group that follows itself, for as long as no other comes. Gives back how many records of the
    /// run are left.
    #[inline(always)]
    fn quads_of_one(
        &mut self,
        places: &mut Places,
        last: &mut Last,
        index: usize,
        mut left: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<u32> {
        let told = self.told.get_mut(index).ok_or(SHORT)?;
        // In registers, not in memory.
        let (mut front, mut back, mut now) = (self.front, self.back, *told);
        while left > 0 {
            let word = front.peek_unpadded().ok_or(SHORT)?;
            let Some((place, used)) = places.read_next_quad(last, self.codes, word)? else {
                break;
            };
            front.skip(used);
            let mut record = place.record();
            later(&mut back, self.codes, &mut record, &mut now)?;
            records.push(record);
            left -= 1;
        }
        (self.front, self.back, *told) = (front, back, now);
        Ok(left)
    }

    /// The same of two groups in the same quads, in their order.
    #[inline(always)]
    fn quads_of_two(
        &mut self,
        places: &mut Places,
        last: &mut Last,
        [first, second]: [usize; 2],
        mut left: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<u32> {
        let Some((one, two)) = self.told.get(first).zip(self.told.get(second)) else {
            return Ok(left);
        };
        let group = last.place.group;
        let (mut one, mut two) = (*one, *two);
        let (mut front, mut back) = (self.front, self.back);
        while left > 1 {
            let word = front.peek_unpadded().ok_or(SHORT)?;
            let Some((place, used)) = places.read_next_quad(last, self.codes, word)? else {
                break;
            };
            front.skip(used);
            let mut record = place.record();
            record.group = one.group;
            later(&mut back, self.codes, &mut record, &mut one)?;
            records.push(record);
            record.group = group;
            later(&mut back, self.codes, &mut record, &mut two)?;
            records.push(record);
            left -= 2;
        }
        (self.front, self.back) = (front, back);
        for (index, now) in [(first, one), (second, two)] {
            if let Some(told) = self.told.get_mut(index) {
                *told = now;
            }
        }
        Ok(left)
    }

    /// The first quad of a group in a run, and its plane.
    #[inline(always)]
    fn first(
        &mut self,
        record: &mut QuadRecord,
        of_run: Option<Plane>,
        likely_others: u32,
    ) -> Outcome<Told> {
        let QuadRecord { x, y, group, .. } = *record;
        let back = usize::try_from(self.number(&self.codes.parent)? - 1).unwrap_or(usize::MAX);
        let parent = self.lineage.parent(group, back);
        let parent = parent.ok_or("an earlier run of the group")?;
        let mut left = [[0; 2]; 4];
        let mut width = 0;
        for (left, code) in left.iter_mut().zip(&self.codes.first) {
            (width, *left) = self.pair_after(code, width)?;
        }
        let (mode, level) = self.level(likely_others)?;
        let mut by = Quad::default();
        if level > 0 {
            for (pair, code) in by.iter_mut().zip(&self.codes.correction) {
                *pair = pair_of(&mut self.front, code)?;
            }
        }
        let [dx, dy, cross, uv] = left;
        let expected = Expected::new(&parent, of_run.as_ref(), x, y);
        let [of_dx, of_dy] = expected.slopes();
        let (dx, dy) = (sum(of_dx, dx), sum(of_dy, dy));
        let cross = sum(expected.cross(dx, dy), cross);
        let uv = sum(expected.uv(), uv);
        (record.uv, record.dx, record.dy, record.cross) = (uv, dx, dy, cross);
        let quad = [uv, dx, dy, cross];
        let tilt = tilt_of_run(of_run.is_some(), &quad, &expected);
        let plane = if level == 0 {
            Plane::through(x, y, &quad, tilt)
        } else {
            Plane::corrected(x, y, &quad, tilt, level, &by)
        };
        self.lineage.note(group, plane);
        Ok(Told {
            group,
            plane,
            departure: Departure::start(mode, x, y),
            noise: first_noise(level),
        })
    }

    /// How residuals are told, and how fine the correction of the plane is; a lone record has
    /// neither.
    fn level(&mut self, likely_others: u32) -> Outcome<(Mode, u32)> {
        let Some(context) = level_context(likely_others) else {
            return Ok((Mode::Plain, 0));
        };
        let symbol = self.symbol(self.codes.level.get(context).ok_or(SHORT)?)?;
        let mode = Mode::of(symbol >> 3).ok_or("one of the modes")?;
        Ok((mode, symbol & 7))
    }

    /// A pair whose width a code tells as the difference from another, zigzag; and its width.
    #[inline]
    fn pair_after(&mut self, code: &Code, before: u32) -> Outcome<(u32, Pair)> {
        let bits = self.peek()?;
        let (symbol, length) = code.decode(bits);
        let width = i64::from(before) + unzigzag(symbol.into());
        let width = u32::try_from(width).ok().filter(|width| *width <= 32);
        let width = width.ok_or("a width of at most 32 bits")?;
        Ok((width, numbers(&mut self.front, bits, length, width)?))
    }
}

/// A record after the first one of its group in its run.
#[inline(always)]
fn later(
    back: &mut BitReader<'_, true>,
    codes: &Codes,
    record: &mut QuadRecord,
    told: &mut Told,
) -> Outcome<()> {
    let context = sizes_context(told.departure.mode, told.noise);
    let bits = back.peek_unpadded().ok_or(SHORT)?;
    let (symbol, mut length) = codes.sizes.decode(context, bits);
    let mut classes = Classes::of_symbol(symbol);
    if symbol == ESCAPE_SIZES {
        let numbers = bits >> length;
        length += 4 * CLASS_NUMBER_BITS;
        let told = [0, 3, 6, 9].map(|from| low_u32(numbers >> from & 7));
        if told.iter().any(|class| *class > WIDE) {
            return Err("one of the classes");
        }
        classes = Classes::new(told);
    }
    told.noise = classes.noise.into();
    let (mut residual, used) = small_pairs(classes, bits >> length);
    back.skip(length + used);
    if classes.wide {
        residual = wide_pairs(back, codes, classes, residual)?;
    }
    let QuadRecord { x, y, .. } = *record;
    let [uv, dx, dy, cross] = told.plane.predict(x, y);
    let [by_uv, by_dx, by_dy, by_cross] = told.departure.read(x, y, &residual);
    record.uv = sum(uv, by_uv);
    record.dx = sum(dx, by_dx);
    record.dy = sum(dy, by_dy);
    record.cross = sum(cross, by_cross);
    Ok(())
}

/// Wide pairs, all of a width, in place of zeros.
#[inline(always)]
fn wide_pairs(
    back: &mut BitReader<'_, true>,
    codes: &Codes,
    classes: Classes,
    [uv, dx, dy, cross]: Quad,
) -> Outcome<Quad> {
    let word = back.peek_unpadded().ok_or(SHORT)?;
    let (width, used) = codes.later.decode(word);
    let [of_dx, of_dy, of_cross, of_uv] = classes.each();
    let all = |class: u32| 2 * width * u32::from(class == WIDE);
    let dx_end = used + all(of_dx);
    let dy_end = dx_end + all(of_dy);
    let cross_end = dy_end + all(of_cross);
    let end = cross_end + all(of_uv);
    if end <= PEEK_BITS {
        // Which ones are wide is hard to foretell: no branches.
        back.skip(end);
        let low = (1u64 << width) - 1;
        let pair = |class: u32, at: u32, small: Pair| {
            let low = low * u64::from(class == WIDE);
            let bits = word >> at;
            let [u, v] = small;
            [unfold(bits & low) | u, unfold(bits >> width & low) | v]
        };
        return Ok([
            pair(of_uv, cross_end, uv),
            pair(of_dx, used, dx),
            pair(of_dy, dx_end, dy),
            pair(of_cross, dy_end, cross),
        ]);
    }
    back.skip(used);
    let mut quad = [dx, dy, cross, uv];
    for (pair, class) in quad.iter_mut().zip(classes.each()) {
        if class == WIDE {
            let word = back.peek_unpadded().ok_or(SHORT)?;
            *pair = numbers(back, word, 0, width)?;
        }
    }
    let [dx, dy, cross, uv] = quad;
    Ok([uv, dx, dy, cross])
}

/// A pair whose width a code tells.
#[inline]
fn pair_of<const BACK: bool>(bits: &mut BitReader<'_, BACK>, code: &Code) -> Outcome<Pair> {
    let word = bits.peek_unpadded().ok_or(SHORT)?;
    let (width, length) = code.decode(word);
    numbers(bits, word, length, width)
}

/// Two numbers of a width, after `used` of the next bits.
#[inline(always)]
fn numbers<const BACK: bool>(
    bits: &mut BitReader<'_, BACK>,
    word: u64,
    used: u32,
    width: u32,
) -> Outcome<Pair> {
    let all = used + 2 * width;
    let low = (1 << width) - 1;
    if all <= PEEK_BITS {
        bits.skip(all);
        let word = word >> used;
        return Ok([unfold(word & low), unfold(word >> width & low)]);
    }
    bits.skip(used);
    let u = bits.peek_unpadded().ok_or(SHORT)?;
    bits.skip(width);
    let v = bits.peek_unpadded().ok_or(SHORT)?;
    bits.skip(width);
    Ok([unfold(u & low), unfold(v & low)])
}
