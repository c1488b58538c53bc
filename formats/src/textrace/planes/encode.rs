//! From records to bits.

use super::codes::{Code, Codes};
use super::fit::fit;
use super::mode::{Departure, Mode};
use super::plane::{Plane, Quad, Units, quad_of};
use super::residual::{WIDE, class_bits, classify, difference, fold, noise, width};
use super::state::{Expected, State};
use super::{ESCAPE_PLACE, ESCAPE_SIZES, MASKS, STEPS, first_noise, level_context};
use crate::textrace::bits::BitWriter;
use crate::textrace::{QuadRecord, Tile, quad_morton};
use crate::varint::{low_u32, zigzag};

/// Most earlier runs that a first quad is compared with. More would be smaller by little and
/// take longer.
const MOST_PARENTS: usize = 64;

/// What takes the encoder's output: bits, or counts of symbols.
pub(super) trait Sink {
    /// The lowest `count` bits of `value`, at most 32.
    fn bits(&mut self, value: u32, count: u32);

    /// A symbol of a code; where it is not in the code, `escape` instead. Tells which it was.
    fn symbol(&mut self, code: &Code, symbol: u32, escape: u32) -> bool;
}

impl Sink for BitWriter {
    fn bits(&mut self, value: u32, count: u32) {
        self.put(value, count);
    }

    fn symbol(&mut self, code: &Code, symbol: u32, escape: u32) -> bool {
        let known = code.encode(symbol);
        let written = known.or_else(|| code.encode(escape));
        let (bits, count) = written.expect("codes have every symbol or their escape");
        self.put(bits, count);
        known.is_some()
    }
}

/// Writes a tile.
pub(super) fn tile(tile: &Tile, codes: &Codes, sink: &mut impl Sink) {
    let mut encoder = Encoder {
        sink,
        codes,
        state: State::new(),
    };
    let mut next_primitive = 0;
    let mut draw = 0;
    let mut records = tile.records.as_slice();
    for run in &tile.runs {
        let step = u64::from(run.primitive) + 1 - next_primitive;
        let changed = u32::from(run.draw != draw);
        let header = step.ilog2() << 1 | changed;
        encoder.sink.symbol(&codes.header, header, 0);
        encoder.below_power(step);
        if run.draw != draw {
            encoder.gamma(u64::from(run.draw) + 1);
            draw = run.draw;
        }
        encoder.number(&codes.count, run.count.into());
        encoder.state.start_run(run);
        let (of_run, rest) = records.split_at(run.count as usize);
        for at in 0..of_run.len() {
            encoder.record(&of_run[at..], run.count);
        }
        records = rest;
        next_primitive = u64::from(run.primitive) + 1;
    }
}

struct Encoder<'a, S> {
    sink: &'a mut S,
    codes: &'a Codes,
    state: State,
}

impl<S: Sink> Encoder<'_, S> {
    /// A number from 1 on in Elias's gamma code.
    fn gamma(&mut self, number: u64) {
        self.sink.bits(0, number.ilog2());
        self.sink.bits(1, 1);
        self.below_power(number);
    }

    /// A number from 1 on: a code tells its highest bit.
    fn number(&mut self, code: &Code, number: u64) {
        self.sink.symbol(code, number.ilog2(), 0);
        self.below_power(number);
    }

    /// The bits of a number below its highest one.
    fn below_power(&mut self, number: u64) {
        let power = number.ilog2();
        self.sink.bits((number - (1 << power)) as u32, power);
    }

    /// The first of some records of a run of `count`.
    fn record(&mut self, left: &[QuadRecord], count: u32) {
        let record = &left[0];
        let morton = u32::from(quad_morton(record.x, record.y));
        self.place(record, morton);
        if self.state.has_seen(record.group) {
            let expected = self.state.group_mut(record.group).plane;
            let expected = expected.predict(record.x, record.y);
            let left = difference(&quad_of(record), &expected);
            let departure = &mut self.state.group_mut(record.group).departure;
            let residual = departure.write(record.x, record.y, &left);
            self.residuals(record.group, &residual);
        } else {
            self.first(left, count);
        }
        self.state.note_place(morton, record.mask, record.group);
    }

    fn place(&mut self, record: &QuadRecord, morton: u32) {
        let state = &self.state;
        let follow = state.follow();
        let mut step = morton.wrapping_sub(state.morton);
        if state.first_of_run {
            let apart = morton ^ state.morton_of_start;
            self.sink.symbol(&self.codes.start, apart, 0);
            step = 1;
        } else if follow.same_quad {
            let same =
                (morton, record.mask, record.group) == (state.morton, state.mask, follow.group);
            self.sink.bits(same.into(), 1);
            if same {
                return;
            }
        }
        let code = &self.codes.place[state.place_context()];
        let swapped = state.swap_mask(morton, record.mask);
        let listed = record.group == follow.group && step > 0;
        let symbol = if listed {
            (step.min(STEPS) - 1) * MASKS + u32::from(swapped) - 1
        } else {
            ESCAPE_PLACE
        };
        let known = self.sink.symbol(code, symbol, ESCAPE_PLACE) && symbol != ESCAPE_PLACE;
        if !known || step >= STEPS {
            self.sink.bits(step, 6);
        }
        if !known {
            self.sink.bits(record.mask.into(), 4);
            self.sink.bits(record.group.into(), 4);
        }
    }

    fn residuals(&mut self, group: u8, left: &Quad) {
        let group = self.state.group_mut(group);
        let code = &self.codes.sizes[group.noise];
        let (classes, pairs) = classes(left);
        group.noise = noise(classes);
        if !self.sink.symbol(code, classes, ESCAPE_SIZES) {
            self.sink.bits(classes, 8);
        }
        for (pair, (class, index)) in pairs {
            if class == WIDE {
                self.pair(&self.codes.later, pair);
            } else {
                self.sink.bits(index, class_bits(class));
            }
        }
    }

    fn pair(&mut self, code: &Code, pair: [i32; 2]) {
        let width = width(pair);
        self.sink.symbol(code, width, 0);
        self.numbers(pair, width);
    }

    fn numbers(&mut self, pair: [i32; 2], width: u32) {
        for number in pair {
            self.sink.bits(fold(number), width);
        }
    }

    /// The first quad of a run in a group, and the plane for the others.
    fn first(&mut self, left: &[QuadRecord], count: u32) {
        let QuadRecord { x, y, group, .. } = left[0];
        let quad = quad_of(&left[0]);
        let known = self.state.groups[usize::from(group)].planes.len();
        let candidates = (0..known.min(MOST_PARENTS)).chain([known]);
        let parents = candidates.filter_map(|back| {
            let expected = self.state.expect(&self.state.parent(group, back)?, x, y);
            let pairs = first_pairs(&quad, &expected);
            let power = (back as u64 + 1).ilog2();
            let bits = self.codes.parent.length(power, 0) + power + self.first_bits(&pairs);
            Some((bits, back, expected, pairs))
        });
        let best = parents.min_by_key(|(bits, ..)| *bits);
        let (_, back, expected, pairs) = best.expect("there is always the plane of zeros");
        self.number(&self.codes.parent, back as u64 + 1);
        let mut before = 0;
        for (code, pair) in self.codes.first.iter().zip(pairs) {
            let width = width(pair);
            self.sink.symbol(code, width_symbol(before, width), 0);
            self.numbers(pair, width);
            before = width;
        }
        let tilt = self.state.tilt(x, y, &quad, &expected);
        let plain = Plane::through(x, y, &quad, tilt);
        let others: Vec<QuadRecord> = left[1..]
            .iter()
            .take(count as usize)
            .filter(|record| record.group == group)
            .copied()
            .collect();
        let Some(context) = level_context(count) else {
            let departure = Departure::start(Mode::Plain, x, y);
            return self
                .state
                .start_plane(group, plain, first_noise(0), departure);
        };
        let told = self.best_plane(&quad, &plain, &left[0], &others, context);
        let (mode, level, by, plane) = told;
        self.sink
            .symbol(&self.codes.level[context], (mode as u32) << 3 | level, 0);
        if level > 0 {
            for (code, pair) in self.codes.correction.iter().zip(by) {
                self.pair(code, pair);
            }
        }
        let departure = Departure::start(mode, x, y);
        self.state
            .start_plane(group, plane, first_noise(level), departure);
    }

    /// Level, correction and plane with which a run's other records of a group take fewest bits.
    fn best_plane(
        &self,
        quad: &Quad,
        plain: &Plane,
        first: &QuadRecord,
        others: &[QuadRecord],
        context: usize,
    ) -> (Mode, u32, Quad, Plane) {
        let code = &self.codes.level[context];
        let mut best = (Mode::Plain, 0, Quad::default(), *plain);
        let mut least = u32::MAX;
        let mut try_plane = |level: u32, by: Quad, plane: Plane| {
            for mode in Mode::ALL {
                let mut bits = code.length((mode as u32) << 3 | level, 0);
                if level > 0 {
                    bits += self.pairs_bits(&self.codes.correction, &by);
                }
                bits += self.run_bits(
                    &plane,
                    Departure::start(mode, first.x, first.y),
                    others,
                    first_noise(level),
                );
                if bits < least {
                    (least, best) = (bits, (mode, level, by, plane));
                }
            }
            least
        };
        // A correction takes some 20 bits.
        if try_plane(0, Quad::default(), *plain) < 24 {
            return best;
        }
        let Some(fitted) = fit(plain, quad, others) else {
            return best;
        };
        let apart = |r: &QuadRecord| r.x.abs_diff(first.x).max(r.y.abs_diff(first.y));
        let extent = others.iter().map(apart).max().unwrap_or(0);
        let likely = u32::from(extent).checked_ilog2().unwrap_or(0) + 2;
        for level in likely.saturating_sub(1).max(1)..=(likely + 2).min(7) {
            let by = correction(quad, plain, &fitted, level);
            let plane = Plane::corrected(first.x, first.y, quad, plain.tilt, level, &by);
            try_plane(level, by, plane);
        }
        best
    }

    /// Bits of some records' residuals.
    fn run_bits(
        &self,
        plane: &Plane,
        mut departure: Departure,
        records: &[QuadRecord],
        mut at: usize,
    ) -> u32 {
        let mut bits = 0;
        for record in records {
            let left = difference(&quad_of(record), &plane.predict(record.x, record.y));
            let left = departure.write(record.x, record.y, &left);
            let (classes, pairs) = classes(&left);
            let code = &self.codes.sizes[at];
            bits += code.length(classes, code.length(ESCAPE_SIZES, 0) + 8);
            for (pair, (class, _)) in pairs {
                bits += if class == WIDE {
                    let width = width(pair);
                    self.codes.later.length(width, 0) + 2 * width
                } else {
                    class_bits(class)
                };
            }
            at = noise(classes);
        }
        bits
    }

    fn first_bits(&self, pairs: &[[i32; 2]; 4]) -> u32 {
        let mut before = 0;
        let of = |(code, pair): (&Code, &[i32; 2])| {
            let width = width(*pair);
            let symbol = width_symbol(before, width);
            before = width;
            code.length(symbol, 0) + 2 * width
        };
        self.codes.first.iter().zip(pairs).map(of).sum()
    }

    fn pairs_bits(&self, codes: &[Code; 4], pairs: &[[i32; 2]; 4]) -> u32 {
        let of = |(code, pair): (&Code, &[i32; 2])| {
            let width = width(*pair);
            code.length(width, 0) + 2 * width
        };
        codes.iter().zip(pairs).map(of).sum()
    }
}

/// The symbol of a width after another.
fn width_symbol(before: u32, width: u32) -> u32 {
    low_u32(zigzag(i64::from(width) - i64::from(before)))
}

/// What is told of a first quad: dx, dy, cross and uv less what is expected.
fn first_pairs(quad: &Quad, expected: &Expected) -> [[i32; 2]; 4] {
    let [uv, dx, dy, cross] = *quad;
    let [of_dx, of_dy] = expected.slopes();
    let minus = |[a, b]: [i32; 2], [c, d]: [i32; 2]| [a.wrapping_sub(c), b.wrapping_sub(d)];
    [
        minus(dx, of_dx),
        minus(dy, of_dy),
        minus(cross, expected.cross(dx, dy)),
        minus(uv, expected.uv()),
    ]
}

/// A pair, its class and the bits that name it in the class.
type Classified = ([i32; 2], (u32, u32));

/// Residuals in the order in which they are written, dx, dy, cross, uv, with their classes; the
/// classes as one number, too.
fn classes(left: &Quad) -> (u32, [Classified; 4]) {
    let [uv, dx, dy, cross] = *left;
    let pairs = [dx, dy, cross, uv].map(|pair| (pair, classify(pair)));
    let joined = pairs
        .iter()
        .rev()
        .fold(0, |joined, (_, (class, _))| joined << 2 | class);
    (joined, pairs)
}

/// The correction in the units of `level` that leads nearest to a plane.
fn correction(quad: &Quad, from: &Plane, to: &Plane, level: u32) -> Quad {
    let units = Units::new(level, quad);
    let steps = |a: [f64; 2], b: [f64; 2], unit: f64| {
        [0, 1].map(|axis| ((a[axis] - b[axis]) / unit).round_ties_even() as i32)
    };
    let mut by = Quad::default();
    by[3] = steps(to.tilt, from.tilt, units.tilt);
    // Slopes start from the corrected tilt.
    let [x, y] = from.origin.map(|at| (at / 2.0) as u8);
    let tilted = Plane::corrected(x, y, quad, from.tilt, level, &by);
    by[0] = steps(to.start, tilted.start, units.start);
    by[1] = steps(to.slopes[0], tilted.slopes[0], units.slope);
    by[2] = steps(to.slopes[1], tilted.slopes[1], units.slope);
    by
}
