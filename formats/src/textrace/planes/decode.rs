//! From bits to records, in passes of one kind of work each: places, planes, classes, small residuals,
//! wide ones, sums. None waits for what another one calculates.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::codes::{Code, Codes};
use super::mode::{Departure, Mode};
use super::parents::{Expected, Lineage, first_noise, level_context, tilt_of_run};
use super::places::Places;
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
struct First {
    /// Index of its first record.
    record: u32,
    /// Records after that one.
    others: u32,
    /// It is the first group of its run.
    starts_run: bool,
}

/// Its plane.
struct Told {
    plane: Plane,
    departure: Departure,
    noise: usize,
}

/// A record after the first one of its group in its run.
#[derive(Clone, Copy)]
struct Later {
    record: u32,
    /// Index of its plane.
    told: u32,
    classes: Classes,
}

pub(super) struct Decoder<'a> {
    bits: BitReader<'a>,
    codes: &'static Codes,
    firsts: Vec<First>,
    told: Vec<Told>,
    later: Vec<Later>,
}

impl<'a> Decoder<'a> {
    pub fn new(input: &'a [u8]) -> Self {
        Self {
            bits: BitReader::new(input),
            codes: Codes::get(),
            firsts: Vec::new(),
            told: Vec::new(),
            later: Vec::new(),
        }
    }

    /// The bits that follow.
    pub fn bits(&self) -> &BitReader<'a> {
        &self.bits
    }

    /// Reads the runs and their records.
    pub fn tile(&mut self, runs: u32, records: u32, tile: &mut Tile) -> Outcome<()> {
        self.firsts.reserve(tile.runs.capacity());
        self.later.reserve(tile.records.capacity());
        self.places(runs, records, tile)?;
        self.planes(&mut tile.records)?;
        self.classes()?;
        self.small(&mut tile.records)?;
        self.wide(&mut tile.records)?;
        self.sums(&mut tile.records);
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

    /// A symbol of a code.
    #[inline(always)]
    fn symbol(&mut self, code: &Code) -> Outcome<u32> {
        let (symbol, length) = code.decode(self.peek()?);
        self.bits.skip(length);
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
        self.bits.skip(zeros + 1);
        Ok(1 << zeros | self.take(zeros)?)
    }

    /// The runs, and places, masks and groups of their records.
    fn places(&mut self, runs: u32, records: u32, tile: &mut Tile) -> Outcome<()> {
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
            self.run(&mut places, first, count, &mut tile.records)?;
            first += count;
            next_primitive = u64::from(primitive) + 1;
        }
        if first != records {
            return Err("runs of as many records as the index tells");
        }
        Ok(())
    }

    /// Places of a run.
    #[inline(always)]
    fn run(
        &mut self,
        places: &mut Places,
        first: u32,
        count: u32,
        records: &mut Vec<QuadRecord>,
    ) -> Outcome<()> {
        // Index of the plane of each group.
        let mut planes = [u32::MAX; GROUPS];
        // In registers, not in memory.
        let (mut last, mut bits) = (places.last, self.bits);
        for number in first..first + count {
            let word = bits.peek_unpadded().ok_or(SHORT)?;
            let (place, used) = places.read(&mut last, self.codes, word)?;
            bits.skip(used);
            let (x, y) = position(place.morton);
            records.push(QuadRecord {
                x,
                y,
                mask: place.mask,
                group: place.group,
                ..QuadRecord::default()
            });
            let plane = planes.get_mut(usize::from(place.group) % GROUPS);
            let plane = plane.ok_or(SHORT)?;
            if *plane == u32::MAX {
                *plane = low_u32(self.firsts.len() as u64);
                self.firsts.push(First {
                    record: number,
                    others: 0,
                    starts_run: number == first,
                });
            } else {
                if let Some(first) = self.firsts.get_mut(*plane as usize) {
                    first.others += 1;
                }
                self.later.push(Later {
                    record: number,
                    told: *plane,
                    classes: Classes::default(),
                });
            }
        }
        (places.last, self.bits) = (last, bits);
        Ok(())
    }

    /// First quads and planes.
    fn planes(&mut self, records: &mut [QuadRecord]) -> Outcome<()> {
        let firsts = std::mem::take(&mut self.firsts);
        self.told.reserve(firsts.len());
        let groups = firsts.iter().map(|first| {
            let record = records.get(first.record as usize);
            record.map_or(0, |record| record.group)
        });
        let mut lineage = Lineage::new(groups);
        let mut last = Plane::default();
        for (number, first) in firsts.iter().enumerate() {
            let record = records.get_mut(first.record as usize).ok_or(SHORT)?;
            let back = self.number(&self.codes.parent)? - 1;
            let back = usize::try_from(back).unwrap_or(usize::MAX);
            let parent = match lineage.parent(record.group, back) {
                Some(Some(index)) => self.told.get(index).ok_or(SHORT)?.plane,
                Some(None) => Plane::default(),
                None => return Err("an earlier run of the group"),
            };
            let of_run = (!first.starts_run).then_some(last);
            let told = self.first(record, &parent, of_run, first.others)?;
            last = told.plane;
            self.told.push(told);
            lineage.note(record.group, number);
        }
        Ok(())
    }

    /// The first quad of a group in a run, and its plane.
    #[inline(always)]
    fn first(
        &mut self,
        record: &mut QuadRecord,
        parent: &Plane,
        of_run: Option<Plane>,
        others: u32,
    ) -> Outcome<Told> {
        let QuadRecord { x, y, .. } = *record;
        let mut left = [[0; 2]; 4];
        let mut width = 0;
        for (left, code) in left.iter_mut().zip(&self.codes.first) {
            (width, *left) = self.pair_after(code, width)?;
        }
        let (mode, level) = self.level(others)?;
        let mut by = Quad::default();
        if level > 0 {
            for (pair, code) in by.iter_mut().zip(&self.codes.correction) {
                *pair = self.pair(code)?;
            }
        }
        let [dx, dy, cross, uv] = left;
        let expected = Expected::new(parent, of_run.as_ref(), x, y);
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
        Ok(Told {
            plane,
            departure: Departure::start(mode, x, y),
            noise: first_noise(level),
        })
    }

    /// How residuals are told, and how fine the correction of the plane is; a lone record has
    /// neither.
    fn level(&mut self, others: u32) -> Outcome<(Mode, u32)> {
        let Some(context) = level_context(others) else {
            return Ok((Mode::Plain, 0));
        };
        let symbol = self.symbol(self.codes.level.get(context).ok_or(SHORT)?)?;
        let mode = Mode::of(symbol >> 3).ok_or("one of the modes")?;
        Ok((mode, symbol & 7))
    }

    /// A pair whose width a code tells.
    #[inline]
    fn pair(&mut self, code: &Code) -> Outcome<Pair> {
        let bits = self.peek()?;
        let (width, length) = code.decode(bits);
        self.numbers(bits, length, width)
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

    /// Classes of the later records' residuals.
    fn classes(&mut self) -> Outcome<()> {
        let mut reader = self.bits;
        for later in &mut self.later {
            let told = self.told.get_mut(later.told as usize).ok_or(SHORT)?;
            let code = self
                .codes
                .sizes(told.departure.mode, told.noise)
                .ok_or(SHORT)?;
            let bits = reader.peek_unpadded().ok_or(SHORT)?;
            let (symbol, mut length) = code.decode(bits);
            later.classes = if symbol == ESCAPE_SIZES {
                let numbers = bits >> length;
                length += 4 * CLASS_NUMBER_BITS;
                let classes = [0, 3, 6, 9].map(|from| low_u32(numbers >> from & 7));
                if classes.iter().any(|class| *class > WIDE) {
                    return Err("one of the classes");
                }
                Classes::new(classes)
            } else {
                Classes::of_symbol(symbol)
            };
            reader.skip(length);
            told.noise = later.classes.noise.into();
        }
        self.bits = reader;
        Ok(())
    }

    /// Residuals that are not wide, into the records; wide ones are 0 there.
    fn small(&mut self, records: &mut [QuadRecord]) -> Outcome<()> {
        let mut reader = self.bits;
        for later in &self.later {
            let record = records.get_mut(later.record as usize).ok_or(SHORT)?;
            let bits = reader.peek_unpadded().ok_or(SHORT)?;
            let ([uv, dx, dy, cross], used) = small_pairs(later.classes, bits);
            reader.skip(used);
            (record.uv, record.dx, record.dy, record.cross) = (uv, dx, dy, cross);
        }
        self.bits = reader;
        Ok(())
    }

    /// Wide residuals.
    fn wide(&mut self, records: &mut [QuadRecord]) -> Outcome<()> {
        for number in 0..self.later.len() {
            let Some(later) = self.later.get(number).copied() else {
                break;
            };
            if !later.classes.wide {
                continue;
            }
            let record = records.get_mut(later.record as usize).ok_or(SHORT)?;
            let pairs = [
                &mut record.dx,
                &mut record.dy,
                &mut record.cross,
                &mut record.uv,
            ];
            for (pair, class) in pairs.into_iter().zip(later.classes.each()) {
                if class == WIDE {
                    *pair = self.pair(&self.codes.later)?;
                }
            }
        }
        Ok(())
    }

    /// From residuals to records.
    fn sums(&mut self, records: &mut [QuadRecord]) {
        for later in &self.later {
            let record = records.get_mut(later.record as usize);
            let Some((record, told)) = record.zip(self.told.get_mut(later.told as usize)) else {
                continue;
            };
            let QuadRecord { x, y, .. } = *record;
            let [uv, dx, dy, cross] = told.plane.predict(x, y);
            let residual = [record.uv, record.dx, record.dy, record.cross];
            let [by_uv, by_dx, by_dy, by_cross] = told.departure.read(x, y, &residual);
            record.uv = sum(uv, by_uv);
            record.dx = sum(dx, by_dx);
            record.dy = sum(dy, by_dy);
            record.cross = sum(cross, by_cross);
        }
    }
}

/// Column and row of a place on the Morton curve, below 64.
#[inline(always)]
fn position(morton: u32) -> (u8, u8) {
    // Bits 0, 2 and 4 to 0, 1 and 2.
    let gather = |m: u32| (m & 1 | m >> 1 & 2 | m >> 2 & 4).to_le_bytes()[0];
    (gather(morton), gather(morton >> 1))
}
