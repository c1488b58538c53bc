//! From records to bits, pass by pass as they are read.

use super::GROUPS;
use super::codes::{Code, Codes};
use super::fit::fit;
use super::mode::{Departure, Mode};
use super::parents::{Expected, Lineage, first_noise, level_context, tilt_of_run};
use super::places::{Place, Places};
use super::plane::{Plane, Quad, Units, quad_of};
use super::residual::{
    CLASS_NUMBER_BITS, Classes, ESCAPE_SIZES, WIDE, class_bits, classify, difference, fold, width,
};
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

/// A group of a run.
struct Told {
    /// Index of its first record.
    first: usize,
    starts_run: bool,
    /// Indices of its other records.
    others: Vec<usize>,
}

/// A plane, and how its quads are told.
#[derive(Clone, Copy)]
struct Choice {
    mode: Mode,
    level: u32,
    correction: Quad,
    plane: Plane,
}

/// A record after the first one of its group in its run.
struct Later {
    record: usize,
    /// Index of its plane.
    told: usize,
    classes: Classes,
    pairs: [Classified; 4],
    mode: Mode,
}

/// Writes a tile.
pub(super) fn tile(tile: &Tile, codes: &Codes, sink: &mut impl Sink) {
    let mut encoder = Encoder { sink, codes };
    let told = encoder.places(tile);
    let (mut later, noises) = encoder.planes(tile, &told);
    later.sort_by_key(|later| later.record);
    encoder.classes(noises, &later);
    encoder.residuals(&later);
}

struct Encoder<'a, S> {
    sink: &'a mut S,
    codes: &'a Codes,
}

impl<'a, S: Sink> Encoder<'a, S> {
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

    /// Runs and places. Tells which groups each run has.
    fn places(&mut self, tile: &Tile) -> Vec<Told> {
        let mut all: Vec<Told> = vec![];
        let mut places = Places::new();
        let mut next_primitive = 0;
        let mut draw = 0;
        for run in &tile.runs {
            let step = u64::from(run.primitive) + 1 - next_primitive;
            let changed = u32::from(run.draw != draw);
            self.sink
                .symbol(&self.codes.header, step.ilog2() << 1 | changed, 0);
            self.below_power(step);
            if run.draw != draw {
                self.gamma(u64::from(run.draw) + 1);
                draw = run.draw;
            }
            self.number(&self.codes.count, run.count.into());
            next_primitive = u64::from(run.primitive) + 1;
            places.start_run(run.draw);
            if places.tells_regular() {
                let of_run = &tile.records[run.first as usize..][..run.count as usize];
                let regular = places.is_regular(of_run.iter().map(place_of));
                self.sink.bits(regular.into(), 1);
                places.set_regular(regular);
            }
            let mut told: [Option<usize>; GROUPS] = [None; GROUPS];
            let first = run.first as usize;
            for index in first..first + run.count as usize {
                let record = &tile.records[index];
                places.write(self.codes, place_of(record), self.sink);
                match told[usize::from(record.group)] {
                    Some(told) => all[told].others.push(index),
                    None => {
                        told[usize::from(record.group)] = Some(all.len());
                        all.push(Told {
                            first: index,
                            starts_run: index == first,
                            others: vec![],
                        });
                    }
                }
            }
        }
        all
    }

    /// First quads and planes. Tells what the planes leave of the other quads, and which code tells the
    /// classes of the first of them.
    fn planes(&mut self, tile: &Tile, told: &[Told]) -> (Vec<Later>, Vec<usize>) {
        let mut lineage = Lineage::new(told.iter().map(|told| tile.records[told.first].group));
        let mut planes: Vec<Plane> = vec![];
        let mut later = vec![];
        let mut noises = vec![];
        for (number, told) in told.iter().enumerate() {
            let record = &tile.records[told.first];
            let of_run = planes.last().copied().filter(|_| !told.starts_run);
            let others: Vec<QuadRecord> = told.others.iter().map(|i| tile.records[*i]).collect();
            let choice = self.first(record, &lineage, &planes, of_run, &others);
            let mut departure = Departure::start(choice.mode, record.x, record.y);
            for (index, record) in told.others.iter().zip(&others) {
                let expected = choice.plane.predict(record.x, record.y);
                let left = difference(&quad_of(record), &expected);
                let residual = departure.write(record.x, record.y, &left);
                let (classes, pairs) = classes(&residual);
                later.push(Later {
                    record: *index,
                    told: number,
                    classes,
                    pairs,
                    mode: choice.mode,
                });
            }
            planes.push(choice.plane);
            lineage.note(record.group, number);
            noises.push(first_noise(choice.level));
        }
        (later, noises)
    }

    /// The first quad of a run in a group, and the plane for the others.
    fn first(
        &mut self,
        record: &QuadRecord,
        lineage: &Lineage,
        planes: &[Plane],
        of_run: Option<Plane>,
        others: &[QuadRecord],
    ) -> Choice {
        let QuadRecord { x, y, group, .. } = *record;
        let quad = quad_of(record);
        let known = lineage.count(group);
        let candidates = (0..known.min(MOST_PARENTS)).chain([known]);
        let parents = candidates.filter_map(|back| {
            let parent = match lineage.parent(group, back)? {
                Some(index) => planes[index],
                None => Plane::default(),
            };
            let expected = Expected::new(&parent, of_run.as_ref(), x, y);
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
        let tilt = tilt_of_run(of_run.is_some(), &quad, &expected);
        let plain = Plane::through(x, y, &quad, tilt);
        let Some(context) = level_context(others.len() as u32) else {
            return Choice::plain(plain);
        };
        let choice = self.best_plane(&quad, plain, record, others, context);
        let symbol = (choice.mode as u32) << 3 | choice.level;
        self.sink.symbol(&self.codes.level[context], symbol, 0);
        if choice.level > 0 {
            for (code, pair) in self.codes.correction.iter().zip(choice.correction) {
                self.pair(code, pair);
            }
        }
        choice
    }

    /// Level, correction, mode and plane with which a group's other records take fewest bits.
    fn best_plane(
        &self,
        quad: &Quad,
        plain: Plane,
        first: &QuadRecord,
        others: &[QuadRecord],
        context: usize,
    ) -> Choice {
        let code = &self.codes.level[context];
        let mut best = Choice::plain(plain);
        let mut least = u32::MAX;
        let mut try_plane = |level: u32, correction: Quad, plane: Plane| {
            for mode in Mode::ALL {
                let mut bits = code.length((mode as u32) << 3 | level, 0);
                if level > 0 {
                    bits += self.pairs_bits(&self.codes.correction, &correction);
                }
                let departure = Departure::start(mode, first.x, first.y);
                bits += self.run_bits(&plane, departure, others, first_noise(level));
                if bits < least {
                    least = bits;
                    best = Choice {
                        mode,
                        level,
                        correction,
                        plane,
                    };
                }
            }
            least
        };
        // A correction takes some 20 bits.
        if try_plane(0, Quad::default(), plain) < 24 {
            return best;
        }
        let Some(fitted) = fit(&plain, quad, others) else {
            return best;
        };
        let apart = |r: &QuadRecord| r.x.abs_diff(first.x).max(r.y.abs_diff(first.y));
        let extent = others.iter().map(apart).max().unwrap_or(0);
        let likely = u32::from(extent).checked_ilog2().unwrap_or(0) + 2;
        for level in likely.saturating_sub(1).max(1)..=(likely + 2).min(7) {
            let by = correction(quad, &plain, &fitted, level);
            let plane = Plane::corrected(first.x, first.y, quad, plain.tilt, level, &by);
            try_plane(level, by, plane);
        }
        best
    }

    /// Classes of residuals.
    fn classes(&mut self, mut noises: Vec<usize>, later: &[Later]) {
        for later in later {
            let at = &mut noises[later.told];
            let (code, symbol) = (self.sizes(later.mode, *at), later.classes.symbol());
            if !self.sink.symbol(code, symbol, ESCAPE_SIZES) {
                for class in later.classes.each() {
                    self.sink.bits(class, CLASS_NUMBER_BITS);
                }
            }
            *at = usize::from(later.classes.noise);
        }
    }

    /// Residuals: first those of few bits, then the wide ones.
    fn residuals(&mut self, later: &[Later]) {
        for (_, (class, index)) in later.iter().flat_map(|later| later.pairs) {
            self.sink.bits(index, class_bits(class));
        }
        for (pair, (class, _)) in later.iter().flat_map(|later| later.pairs) {
            if class == WIDE {
                self.pair(&self.codes.later, pair);
            }
        }
    }

    fn sizes(&self, mode: Mode, noise: usize) -> &'a Code {
        let code = self.codes.sizes(mode, noise);
        code.expect("a code for each mode and noise")
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
            let code = self.sizes(departure.mode, at);
            bits += code.length(
                classes.symbol(),
                code.length(ESCAPE_SIZES, 0) + 4 * CLASS_NUMBER_BITS,
            );
            for (pair, (class, _)) in pairs {
                bits += if class == WIDE {
                    let width = width(pair);
                    self.codes.later.length(width, 0) + 2 * width
                } else {
                    class_bits(class)
                };
            }
            at = usize::from(classes.noise);
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

impl Choice {
    fn plain(plane: Plane) -> Self {
        Self {
            mode: Mode::Plain,
            level: 0,
            correction: Quad::default(),
            plane,
        }
    }
}

fn place_of(record: &QuadRecord) -> Place {
    Place {
        morton: u32::from(quad_morton(record.x, record.y)),
        mask: record.mask,
        group: record.group,
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
fn classes(left: &Quad) -> (Classes, [Classified; 4]) {
    let [uv, dx, dy, cross] = *left;
    let pairs = [dx, dy, cross, uv].map(|pair| (pair, classify(pair)));
    (Classes::new(pairs.map(|(_, (class, _))| class)), pairs)
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
