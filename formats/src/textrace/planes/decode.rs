//! Decodes records, run by run: runs and places from the front, planes and deviations from the back. The
//! two readers are independent of each other, and neither depends on the predictions of the planes.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Codes, rest_context, sizes_context};
use super::mode::{Deviation, Mode};
use super::parents::{
    Expected, MOST_PARENT_BITS, PlaneHistory, first_noise, level_context, tilt_of_run,
};
use super::places::{Last, Places, QuadPlace};
use super::plane::{Plane, Quad};
use super::residual::{CLASS_NUMBER_BITS, Classes, Pair, WIDE, sum, symbol, unfold};
use super::widths::{CROSS, EACH, MOST_WIDTH, SLOPE, START, TILT, of_level};
use super::{GROUPS, SHORT};
use crate::textrace::bits::BitReader;
use crate::textrace::{PrimitiveRun, QuadRecord, Tile};
use crate::varint::low_u32;

/// Result of decoding; the error is what was expected.
pub(super) type Outcome<T> = Result<T, &'static str>;

/// State of a group in the current run.
#[derive(Clone, Copy, Default)]
struct GroupState {
    plane: Plane,
    deviation: Deviation,
    noise: usize,
}

pub(super) struct Decoder<'a> {
    pub front: BitReader<'a>,
    pub back: BitReader<'a>,
    codes: &'static Codes,
    history: PlaneHistory,
    /// By group, for the groups of the current run.
    groups: [GroupState; GROUPS],
}

impl<'a> Decoder<'a> {
    /// Starts with the bytes from the front and from the back, both with padding, and the number of runs.
    pub fn new(front: &'a [u8], back: &'a [u8], runs: u32) -> Self {
        Self {
            front: BitReader::new(front),
            back: BitReader::new(back),
            codes: Codes::get(),
            history: PlaneHistory::new(runs),
            groups: [GroupState::default(); GROUPS],
        }
    }

    /// Reads the runs and their records.
    pub fn tile(&mut self, runs: u32, records: u32, tile: &mut Tile) -> Outcome<()> {
        let mut places = Places::new();
        let mut last = Last::new();
        let mut next_primitive = 0u64;
        let mut draw = 0;
        let mut first = 0u32;
        for _ in 0..runs {
            // At most two codes and 32 bits.
            let bits = self.front.peek().ok_or(SHORT)?;
            let (header, header_bits) = self.codes.header.decode(bits);
            let (power, count_bits) = self.codes.count.decode(bits >> header_bits);
            let used = header_bits + count_bits;
            let primitive = next_primitive + from_one(header >> 1, bits >> used) - 1;
            let primitive = u32::try_from(primitive).map_err(|_| "a primitive below 2^32")?;
            self.front.skip(used + (header >> 1));
            if header & 1 == 1 {
                draw = self.draw()?;
            }
            let bits = self.front.peek().ok_or(SHORT)?;
            let count = u32::try_from(from_one(power, bits)).unwrap_or(u32::MAX);
            if count > records - first {
                return Err("a run of no more records than in the index");
            }
            tile.runs.push(PrimitiveRun {
                primitive,
                draw,
                first,
                count,
            });
            places.start_run(&mut last, draw);
            let codes_regular = places.codes_regular();
            last.regular = codes_regular & (bits >> power & 1 == 1);
            self.front.skip(power + u32::from(codes_regular));
            last = self.run(&mut places, last, count, &mut tile.records)?;
            first += count;
            next_primitive = u64::from(primitive) + 1;
        }
        if first != records {
            return Err("runs of as many records as in the index");
        }
        Ok(())
    }

    /// A draw number in Elias's gamma code.
    fn draw(&mut self) -> Outcome<u32> {
        let zeros = self.front.peek().ok_or(SHORT)?.trailing_zeros();
        if zeros > 32 {
            return Err("a number below 2^33");
        }
        self.front.skip(zeros + 1);
        let number = from_one(zeros, self.front.peek().ok_or(SHORT)?);
        self.front.skip(zeros);
        u32::try_from(number - 1).map_err(|_| "a draw below 2^32")
    }

    /// Decodes the records of a run.
    #[inline(always)]
    fn run(
        &mut self,
        places: &mut Places,
        mut last: Last,
        count: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<Last> {
        // Groups whose planes were decoded, one bit each.
        let mut known = 0u32;
        let mut tilt_from = None;
        let mut left = count;
        while left > 0 {
            left -= 1;
            let word = self.front.peek().ok_or(SHORT)?;
            let (place, used) = places.read(&mut last, self.codes, word)?;
            self.front.skip(used);
            let group = usize::from(place.group);
            if known >> group & 1 == 0 {
                known |= 1 << group;
                let share = last.share(left);
                records.push(self.first(place, tilt_from, share)?);
                tilt_from = Some(group);
            } else {
                let state = self.groups.get_mut(group).ok_or(SHORT)?;
                if state.deviation.mode == Mode::Plain {
                    later::<true>(&mut self.back, self.codes, place, state, records)?;
                } else {
                    later::<false>(&mut self.back, self.codes, place, state, records)?;
                }
            }
            if let Some(starts) = places.starts_next_quad(&last) {
                let starts = usize::from(starts);
                if starts == group {
                    (left, last) = self.quads_of_one(places, last, left, records)?;
                } else if known >> starts & 1 == 1 {
                    let groups = [starts, group];
                    (left, last) = self.quads_of_two(places, last, groups, left, records)?;
                }
            }
        }
        Ok(last)
    }

    /// Decodes quads of a group that follows itself, until another group comes. Returns the number of
    /// remaining records of the run and the new last record.
    #[inline(always)]
    fn quads_of_one(
        &mut self,
        places: &mut Places,
        last: Last,
        left: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<(u32, Last)> {
        let state = self.groups.get_mut(usize::from(last.place.group));
        let state = state.ok_or(SHORT)?;
        let readers = (&mut self.front, &mut self.back);
        if state.deviation.mode == Mode::Plain {
            one::<true>(readers, self.codes, places, last, state, left, records)
        } else {
            one::<false>(readers, self.codes, places, last, state, left, records)
        }
    }

    /// Decodes quads of two alternating groups, in their order.
    #[inline(always)]
    fn quads_of_two(
        &mut self,
        places: &mut Places,
        last: Last,
        groups: [usize; 2],
        left: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<(u32, Last)> {
        let state = self.groups.get_disjoint_mut(groups).map_err(|_| SHORT)?;
        let readers = (&mut self.front, &mut self.back);
        let codes = self.codes;
        match state
            .each_ref()
            .map(|state| state.deviation.mode == Mode::Plain)
        {
            [true, true] => two::<true, true>(readers, codes, places, last, state, left, records),
            [true, false] => two::<true, false>(readers, codes, places, last, state, left, records),
            [false, true] => two::<false, true>(readers, codes, places, last, state, left, records),
            [false, false] => {
                two::<false, false>(readers, codes, places, last, state, left, records)
            }
        }
    }

    /// Decodes the first quad of a group in a run, and its plane. `tilt_from` is the group of the run's
    /// previous plane.
    #[inline(always)]
    fn first(
        &mut self,
        place: QuadPlace,
        tilt_from: Option<usize>,
        likely_others: u32,
    ) -> Outcome<QuadRecord> {
        let mut record = place.record();
        let QuadRecord { x, y, group, .. } = record;
        let codes = self.codes;
        let mut back = self.back;
        // At most five codes of 10 bits, and the 6 bits of the parent's number.
        let bits = back.peek().ok_or(SHORT)?;
        let (power, mut used) = codes.parent.decode(bits);
        let (first, length) = codes.first.decode(bits >> used);
        used += length;
        let (rest, length) = codes.rest.decode(rest_context(first), bits >> used);
        used += length;
        let context = level_context(likely_others).wrapping_sub(1);
        let (mode_and_level, length) = codes.level.decode(context, bits >> used);
        used += length;
        let level = mode_and_level & 7;
        let mut correction = 0;
        if level > 0 {
            let length;
            (correction, length) = codes.correction.decode(bits >> used);
            used += length;
        }
        let parent = from_one(power, bits >> used) - 1;
        if power > MOST_PARENT_BITS {
            return Err("an earlier run of the group");
        }
        back.skip(used + power);
        // Widths and levels are the same except for the widest.
        let [dx, uv, dy] = [first & 31, first >> 5 & 31, rest & 31];
        let cross = of_level(&CROSS, rest >> 5);
        let pairs;
        (pairs, back) = if [dx, uv, dy, cross].iter().all(|width| *width <= MOST_WIDTH) {
            let dx = pair(&mut back, dx)?;
            let dy = pair(&mut back, dy)?;
            let cross = pair(&mut back, cross)?;
            ([dx, dy, cross, pair(&mut back, uv)?], back)
        } else {
            let [dx, uv, dy] = [dx, uv, dy].map(|level| of_level(&EACH, level));
            long_pairs(back, [dx, dy, cross, uv])?
        };
        let [dx, dy, cross, uv] = pairs;
        let mut by = Quad::default();
        if level > 0 {
            // At most 46 bits, then 32.
            let start = of_level(&START, correction);
            let [right, down] =
                [correction >> 2, correction >> 5].map(|level| of_level(&SLOPE, level));
            let bits = back.peek().ok_or(SHORT)?;
            back.skip(2 * (start + right + down));
            by = [
                numbers(bits, start),
                numbers(bits >> (2 * start), right),
                numbers(bits >> (2 * (start + right)), down),
                pair(&mut back, of_level(&TILT, correction >> 8))?,
            ];
        }
        self.back = back;

        let parent = self.history.parent(group, low_u32(parent));
        let parent = parent.ok_or("an earlier run of the group")?;
        let of_run = tilt_from.and_then(|group| self.history.last(group));
        let expected = Expected::new(&parent, of_run, place.morton);
        let [of_dx, of_dy] = expected.slopes();
        let (dx, dy) = (sum(of_dx, dx), sum(of_dy, dy));
        let cross = sum(expected.cross(dx, dy), cross);
        let uv = sum(expected.uv(), uv);
        (record.uv, record.dx, record.dy, record.cross) = (uv, dx, dy, cross);
        let quad = [uv, dx, dy, cross];
        let tilt = tilt_of_run(of_run.is_some(), &quad, &expected);
        let plane = if level > 0 {
            Plane::corrected(place.morton, &quad, tilt, level, &by)
        } else {
            Plane::through(place.morton, &quad, tilt)
        };
        self.history.note(group, plane);
        let mode = Mode::of(mode_and_level >> 3).ok_or("one of the modes")?;
        let state = self.groups.get_mut(usize::from(group) % GROUPS);
        *state.ok_or(SHORT)? = GroupState {
            plane,
            deviation: Deviation::start(mode, x, y),
            noise: first_noise(level),
        };
        Ok(record)
    }
}

type Readers<'r, 'a> = (&'r mut BitReader<'a>, &'r mut BitReader<'a>);

/// See [`Decoder::quads_of_one`]. `PLAIN`: the group has the plain mode.
fn one<const PLAIN: bool>(
    readers: Readers<'_, '_>,
    codes: &Codes,
    places: &mut Places,
    mut last: Last,
    state: &mut GroupState,
    mut left: u32,
    records: &mut Vec<QuadRecord>,
) -> Outcome<(u32, Last)> {
    // Copies that stay in registers.
    let (mut front, mut back) = (*readers.0, *readers.1);
    while left > 0 {
        let word = front.peek().ok_or(SHORT)?;
        let Some((place, used)) = places.read_next_quad(&mut last, codes, word)? else {
            break;
        };
        front.skip(used);
        later::<PLAIN>(&mut back, codes, place, state, records)?;
        left -= 1;
    }
    (*readers.0, *readers.1) = (front, back);
    Ok((left, last))
}

/// See [`Decoder::quads_of_two`]. `FIRST`, `SECOND`: the group has the plain mode.
fn two<const FIRST: bool, const SECOND: bool>(
    readers: Readers<'_, '_>,
    codes: &Codes,
    places: &mut Places,
    mut last: Last,
    [first, second]: [&mut GroupState; 2],
    mut left: u32,
    records: &mut Vec<QuadRecord>,
) -> Outcome<(u32, Last)> {
    let (mut front, mut back) = (*readers.0, *readers.1);
    let group = places.first_of_two(&last);
    while left > 1 {
        let word = front.peek().ok_or(SHORT)?;
        let Some((place, used)) = places.read_next_quad(&mut last, codes, word)? else {
            break;
        };
        front.skip(used);
        let place_of_first = QuadPlace { group, ..place };
        later::<FIRST>(&mut back, codes, place_of_first, first, records)?;
        later::<SECOND>(&mut back, codes, place, second, records)?;
        left -= 2;
    }
    (*readers.0, *readers.1) = (front, back);
    Ok((left, last))
}

/// Decodes a record after the first one of its group in its run. `PLAIN`: the group has the plain mode.
#[inline(always)]
fn later<const PLAIN: bool>(
    back: &mut BitReader<'_>,
    codes: &Codes,
    place: QuadPlace,
    state: &mut GroupState,
    records: &mut Vec<QuadRecord>,
) -> Outcome<()> {
    let mode = if PLAIN {
        Mode::Plain
    } else {
        state.deviation.mode
    };
    let context = sizes_context(mode, state.noise);
    let bits = back.peek().ok_or(SHORT)?;
    let (symbol, code_bits) = codes.sizes.decode(context, bits);
    let mut classes = Classes::of_symbol(symbol);
    let mut residual = classes.small_pairs(bits >> code_bits);
    back.skip(code_bits + classes.bits());
    let mut record = place.record();
    let QuadRecord { x, y, .. } = record;
    let expected = state.plane.predict(place.morton);
    if PLAIN {
        add(&mut record, &expected, &residual);
        records.push(record);
        if classes.is_special() {
            let (after, instead, [uv, dx, dy, cross]) = special(*back, codes, classes)?;
            (*back, classes) = (after, instead);
            // Correct the record after it was pushed, so that the common case need not wait.
            if let Some(record) = records.last_mut() {
                record.uv = sum(record.uv, uv);
                record.dx = sum(record.dx, dx);
                record.dy = sum(record.dy, dy);
                record.cross = sum(record.cross, cross);
            }
        }
    } else {
        if classes.is_special() {
            let rest;
            (*back, classes, rest) = special(*back, codes, classes)?;
            for (to, rest) in residual.iter_mut().zip(rest) {
                *to = sum(*to, rest);
            }
        }
        let deviation = state.deviation.read(x, y, &residual);
        add(&mut record, &expected, &deviation);
        records.push(record);
    }
    state.noise = classes.noise();
    Ok(())
}

#[inline(always)]
fn add(record: &mut QuadRecord, expected: &Quad, deviation: &Quad) {
    let [uv, dx, dy, cross] = *expected;
    let [by_uv, by_dx, by_dy, by_cross] = *deviation;
    record.uv = sum(uv, by_uv);
    record.dx = sum(dx, by_dx);
    record.dy = sum(dy, by_dy);
    record.cross = sum(cross, by_cross);
}

/// Handles wide residuals, and classes coded as numbers. Returns the numbers to add, the classes, and the
/// reader after them.
#[inline(never)]
fn special<'a>(
    mut back: BitReader<'a>,
    codes: &Codes,
    mut classes: Classes,
) -> Outcome<(BitReader<'a>, Classes, Quad)> {
    let mut residual = Quad::default();
    if classes.is_escape() {
        let bits = back.peek().ok_or(SHORT)?;
        let numbers = [0, 3, 6, 9].map(|from| low_u32(bits >> from & 7));
        if numbers.iter().any(|class| *class > WIDE) {
            return Err("one of the classes");
        }
        classes = Classes::of_symbol(symbol(numbers));
        residual = classes.small_pairs(bits >> (4 * CLASS_NUMBER_BITS));
        back.skip(4 * CLASS_NUMBER_BITS + classes.bits());
    }
    let wide = classes.wide();
    if wide != [0; 4] {
        let (width, used) = codes.later.decode(back.peek().ok_or(SHORT)?);
        back.skip(used);
        let widths = wide.map(|wide| wide * width);
        let numbers;
        (numbers, back) = if width > MOST_WIDTH {
            long_pairs(back, widths)?
        } else {
            let [uv, dx, dy, cross] = widths;
            let uv = pair(&mut back, uv)?;
            let dx = pair(&mut back, dx)?;
            let dy = pair(&mut back, dy)?;
            ([uv, dx, dy, pair(&mut back, cross)?], back)
        };
        for (to, wide) in residual.iter_mut().zip(numbers) {
            *to = sum(*to, wide);
        }
    }
    Ok((back, classes, residual))
}

/// Reads a pair of numbers of at most 28 bits.
#[inline(always)]
fn pair(bits: &mut BitReader<'_>, width: u32) -> Outcome<Pair> {
    let word = bits.peek().ok_or(SHORT)?;
    bits.skip(2 * width);
    Ok(numbers(word, width))
}

/// The pair at the start of some bits.
#[inline(always)]
fn numbers(bits: u64, width: u32) -> Pair {
    let low = (1 << width) - 1;
    [unfold(bits & low), unfold(bits >> width & low)]
}

/// Reads pairs of numbers of at most 32 bits.
#[cold]
fn long_pairs(mut bits: BitReader<'_>, widths: [u32; 4]) -> Outcome<([Pair; 4], BitReader<'_>)> {
    let mut pairs = [[0; 2]; 4];
    for (pair, width) in pairs.iter_mut().zip(widths) {
        for number in pair {
            *number = unfold(bits.peek().ok_or(SHORT)? & ((1 << width) - 1));
            bits.skip(width);
        }
    }
    Ok((pairs, bits))
}

/// A number, at least 1, from its highest bit and the `bits` below.
#[inline(always)]
fn from_one(power: u32, bits: u64) -> u64 {
    let highest = 1 << power;
    highest | bits & (highest - 1)
}
