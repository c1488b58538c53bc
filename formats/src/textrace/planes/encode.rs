//! Encodes records, run by run in the order of decoding.

use super::GROUPS;
use super::codes::{Code, Codes, rest_context, sizes_context};
use super::fit::{Fitted, fit};
use super::mode::{Deviation, Mode};
use super::parents::{Expected, PlaneHistory, first_noise, level_context, tilt_of_run};
use super::places::{Last, Places, QuadPlace};
use super::plane::{Plane, Quad, Units, quad_of};
use super::residual::{
    CLASS_NUMBER_BITS, Classes, ESCAPE_SIZES, Pair, WIDE, class_bits, classify, difference, fold,
    symbol, width,
};
use super::widths::{Chosen, SLOPE, START, TILT};
use crate::textrace::bits::BitWriter;
use crate::textrace::{QuadRecord, Tile, quad_morton};

/// Receives the encoder's output: writes bits, or counts symbols.
pub(super) trait Sink {
    /// Writes the lowest `count` bits of `value`, at most 32.
    fn bits(&mut self, value: u32, count: u32);

    /// Writes a symbol of a code, or `escape` if it is not in the code. Returns whether the symbol was
    /// written.
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

/// A plane, and the coding of its quads.
#[derive(Clone, Copy)]
struct Choice {
    mode: Mode,
    level: u32,
    correction: Quad,
    plane: Plane,
}

/// State of a group in the current run.
struct Group {
    deviation: Deviation,
    plane: Plane,
    /// Index of the code for the classes of its next record.
    noise: usize,
}

/// Writes a tile: runs and places to `front`, planes and deviations to `back`.
pub(super) fn tile<S: Sink>(tile: &Tile, codes: &Codes, front: &mut S, back: &mut S) {
    let mut encoder = Encoder { front, back, codes };
    encoder.tile(tile);
}

struct Encoder<'a, S> {
    front: &'a mut S,
    back: &'a mut S,
    codes: &'a Codes,
}

impl<'a, S: Sink> Encoder<'a, S> {
    /// Writes a number, at least 1, in Elias's gamma code.
    fn gamma(&mut self, number: u64) {
        self.front.bits(0, number.ilog2());
        self.front.bits(1, 1);
        below_power(self.front, number);
    }

    fn tile(&mut self, tile: &Tile) {
        let mut places = Places::new();
        let mut last = Last::new();
        let mut history = PlaneHistory::new(tile.runs.len() as u32);
        let mut next_primitive = 0;
        let mut draw = 0;
        for run in &tile.runs {
            let step = u64::from(run.primitive) + 1 - next_primitive;
            let changed = u32::from(run.draw != draw);
            let header = step.ilog2() << 1 | changed;
            self.front.symbol(&self.codes.header, header, 0);
            let count = u64::from(run.count);
            self.front.symbol(&self.codes.count, count.ilog2(), 0);
            below_power(self.front, step);
            if run.draw != draw {
                self.gamma(u64::from(run.draw) + 1);
                draw = run.draw;
            }
            below_power(self.front, count);
            next_primitive = u64::from(run.primitive) + 1;
            let records = &tile.records[run.first as usize..][..run.count as usize];
            places.start_run(&mut last, run.draw);
            if places.codes_regular() {
                let regular = places.is_regular(last, records.iter().map(place_of));
                self.front.bits(regular.into(), 1);
                last.regular = regular;
            }
            last = self.run(records, &mut places, last, &mut history);
        }
    }

    /// Writes the records of a run.
    fn run(
        &mut self,
        records: &[QuadRecord],
        places: &mut Places,
        mut last: Last,
        history: &mut PlaneHistory,
    ) -> Last {
        let mut groups: [Option<Group>; GROUPS] = [const { None }; GROUPS];
        let mut of_run = None;
        for (at, record) in records.iter().enumerate() {
            places.write(self.codes, &mut last, place_of(record), self.front);
            let group = &mut groups[usize::from(record.group)];
            if let Some(group) = group {
                self.later(record, group);
                continue;
            }
            let after = &records[at + 1..];
            let likely_others = last.share(after.len() as u32);
            let choice = self.first(record, history, of_run, likely_others, after);
            let plane = choice.plane;
            history.note(record.group, plane);
            of_run = Some(plane);
            *group = Some(Group {
                deviation: Deviation::start(choice.mode, record.x, record.y),
                plane,
                noise: first_noise(choice.level),
            });
        }
        last
    }

    /// Writes a deviation.
    fn later(&mut self, record: &QuadRecord, group: &mut Group) {
        let QuadRecord { x, y, .. } = *record;
        let left = difference(&quad_of(record), &group.plane.predict(quad_morton(x, y)));
        let residual = group.deviation.write(x, y, &left);
        let (classes, pairs) = classes(&residual);
        let code = self.sizes(group.deviation.mode, group.noise);
        if !self.back.symbol(code, symbol(classes), ESCAPE_SIZES) {
            for class in classes {
                self.back.bits(class, CLASS_NUMBER_BITS);
            }
        }
        for (_, (class, index)) in pairs {
            self.back.bits(index, class_bits(class));
        }
        if let Some(width) = wide_width(&pairs) {
            self.back.symbol(&self.codes.later, width, 0);
            for (pair, _) in pairs.iter().filter(is_wide) {
                put_numbers(self.back, *pair, width);
            }
        }
        group.noise = Classes::new(classes).noise();
    }

    /// Writes the first quad of a group in a run, and the plane for its other quads.
    fn first(
        &mut self,
        record: &QuadRecord,
        history: &PlaneHistory,
        of_run: Option<Plane>,
        likely_others: u32,
        after: &[QuadRecord],
    ) -> Choice {
        let group = record.group;
        let morton = quad_morton(record.x, record.y);
        let quad = quad_of(record);
        let known = history.count(group);
        let parents = (0..=known as u32).filter_map(|back| {
            let parent = history.parent(group, back)?;
            let expected = Expected::new(&parent, of_run.as_ref(), morton);
            let pairs = first_pairs(&quad, &expected);
            let power = (back + 1).ilog2();
            let (first, rest) = self.first_widths(&pairs);
            let bits = self.codes.parent.length(power, 0) + power + first.bits + rest.bits;
            Some((bits, back, expected, pairs))
        });
        let best = parents.min_by_key(|(bits, ..)| *bits);
        let (_, back, expected, pairs) = best.expect("there is always the plane of zeros");
        let parent = u64::from(back) + 1;
        let tilt = tilt_of_run(of_run.is_some(), &quad, &expected);
        let plain = Plane::through(morton, &quad, tilt);
        let mut choice = Choice::plain(plain);
        let context = level_context(likely_others);
        if context > 0 {
            let of_group = |other: &&QuadRecord| other.group == group;
            let others: Vec<QuadRecord> = after.iter().filter(of_group).copied().collect();
            choice = self.best_plane(record, tilt, plain, &others, context);
        }

        self.back.symbol(&self.codes.parent, parent.ilog2(), 0);
        let (first, rest) = self.first_widths(&pairs);
        let ([dx, uv], [dy, cross]) = (first.widths, rest.widths);
        self.back.symbol(&self.codes.first, first.symbol, 0);
        self.back.symbol(
            &self.codes.rest.codes[rest_context(first.symbol)],
            rest.symbol,
            0,
        );
        if let Some(code) = self.level(context) {
            self.back.symbol(code, choice.symbol(), 0);
        }
        let by = (choice.level > 0).then(|| self.correction_widths(&choice.correction));
        if let Some(by) = by {
            self.back.symbol(&self.codes.correction, by.symbol, 0);
        }
        below_power(self.back, parent);
        let widths = [dx, dy, cross, uv];
        let widths = widths.into_iter().chain(by.iter().flat_map(|by| by.widths));
        for (pair, width) in pairs.iter().chain(&choice.correction).zip(widths) {
            put_numbers(self.back, *pair, width);
        }
        choice
    }

    /// Level, correction, mode and plane for which a group's other records take the fewest bits.
    fn best_plane(
        &self,
        first: &QuadRecord,
        tilt: [f32; 2],
        plain: Plane,
        others: &[QuadRecord],
        context: usize,
    ) -> Choice {
        let mut best = Choice::plain(plain);
        let mut least = u32::MAX;
        let mut try_plane = |level: u32, correction: Quad, plane: Plane| {
            for mode in Mode::ALL {
                let choice = Choice {
                    mode,
                    level,
                    correction,
                    plane,
                };
                let code = self.level(context);
                let mut bits = code.map_or(0, |code| code.length(choice.symbol(), 0));
                if level > 0 {
                    bits += self.correction_widths(&correction).bits;
                }
                let deviation = Deviation::start(mode, first.x, first.y);
                bits += self.run_bits(&plane, deviation, others, first_noise(level));
                if bits < least {
                    least = bits;
                    best = choice;
                }
            }
            least
        };
        // A correction takes about 20 bits.
        if try_plane(0, Quad::default(), plain) < 24 {
            return best;
        }
        let Some(fitted) = fit(first, tilt, others) else {
            return best;
        };
        let apart = |r: &QuadRecord| r.x.abs_diff(first.x).max(r.y.abs_diff(first.y));
        let extent = others.iter().map(apart).max().unwrap_or(0);
        let likely = u32::from(extent).checked_ilog2().unwrap_or(0) + 2;
        for level in likely.saturating_sub(1).max(1)..=(likely + 2).min(7) {
            let by = correction(first, tilt, &fitted, level);
            let morton = quad_morton(first.x, first.y);
            let plane = Plane::corrected(morton, &quad_of(first), tilt, level, &by);
            try_plane(level, by, plane);
        }
        best
    }

    /// The code of mode and level; `None` if they are not coded.
    fn level(&self, context: usize) -> Option<&'a Code> {
        self.codes.level.codes.get(context.checked_sub(1)?)
    }

    fn sizes(&self, mode: Mode, noise: usize) -> &'a Code {
        &self.codes.sizes.codes[sizes_context(mode, noise)]
    }

    /// Number of bits of some records' residuals.
    fn run_bits(
        &self,
        plane: &Plane,
        mut deviation: Deviation,
        records: &[QuadRecord],
        mut at: usize,
    ) -> u32 {
        let mut bits = 0;
        for record in records {
            let left = difference(
                &quad_of(record),
                &plane.predict(quad_morton(record.x, record.y)),
            );
            let left = deviation.write(record.x, record.y, &left);
            let (classes, pairs) = classes(&left);
            let code = self.sizes(deviation.mode, at);
            bits += code.length(
                symbol(classes),
                code.length(ESCAPE_SIZES, 0) + 4 * CLASS_NUMBER_BITS,
            );
            bits += pairs
                .map(|(_, (class, _))| class_bits(class))
                .iter()
                .sum::<u32>();
            if let Some(width) = wide_width(&pairs) {
                let wide = pairs.iter().filter(is_wide).count() as u32;
                bits += self.codes.later.length(width, 0) + 2 * width * wide;
            }
            at = Classes::new(classes).noise();
        }
        bits
    }

    /// Coding of the widths of a first quad's pairs: of dx and uv, then of dy and cross.
    fn first_widths(&self, pairs: &[Pair; 4]) -> (Chosen<2>, Chosen<2>) {
        let [dx, dy, cross, uv] = *pairs;
        let first = self.codes.choices().first.choose(&[dx, uv]);
        let rest = &self.codes.choices().rest[rest_context(first.symbol)];
        (first, rest.choose(&[dy, cross]))
    }

    /// Coding of the widths of a correction.
    fn correction_widths(&self, correction: &Quad) -> Chosen<4> {
        self.codes.choices().correction.choose(correction)
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

    /// Mode and level.
    fn symbol(&self) -> u32 {
        (self.mode as u32) << 3 | self.level
    }
}

fn place_of(record: &QuadRecord) -> QuadPlace {
    QuadPlace {
        morton: quad_morton(record.x, record.y),
        mask: record.mask,
        group: record.group,
    }
}

/// Writes the bits of a number below its highest bit.
fn below_power(sink: &mut impl Sink, number: u64) {
    let power = number.ilog2();
    sink.bits((number - (1 << power)) as u32, power);
}

fn put_numbers(sink: &mut impl Sink, pair: [i32; 2], width: u32) {
    for number in pair {
        sink.bits(fold(number), width);
    }
}

/// The coded pairs of a first quad: dx, dy, cross and uv minus their predictions.
fn first_pairs(quad: &Quad, expected: &Expected) -> [Pair; 4] {
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

/// A pair, its class and the bits that identify it in the class.
type Classified = ([i32; 2], (u32, u32));

fn is_wide((_, (class, _)): &&Classified) -> bool {
    *class == WIDE
}

/// Number of bits of the largest number in the wide pairs; `None` if no pair is wide.
fn wide_width(pairs: &[Classified; 4]) -> Option<u32> {
    pairs
        .iter()
        .filter(is_wide)
        .map(|(pair, _)| width(*pair))
        .max()
}

/// Classes of residuals, and the classified residuals.
fn classes(left: &Quad) -> ([u32; 4], [Classified; 4]) {
    let pairs = left.map(|pair| (pair, classify(pair)));
    (pairs.map(|(_, (class, _))| class), pairs)
}

/// The correction, in the units of `level`, that brings the plane through a record closest to another one.
fn correction(record: &QuadRecord, tilt: [f32; 2], to: &Fitted, level: u32) -> Quad {
    let quad = quad_of(record);
    let units = Units::new(level, &quad);
    let steps = |to: [f64; 2], from: [f64; 2], unit: f32, widest: u8| {
        let most = f64::from(1 << (widest - 1));
        [0, 1].map(|axis| {
            let steps = ((to[axis] - from[axis]) / f64::from(unit)).round_ties_even();
            steps.clamp(-most, most - 1.0) as i32
        })
    };
    let mut by = Quad::default();
    let [.., widest] = TILT;
    by[3] = steps(to.tilt, tilt.map(f64::from), units.tilt, widest);
    // Slopes start from the corrected tilt.
    let tilted = Plane::corrected(quad_morton(record.x, record.y), &quad, tilt, level, &by);
    let [right_u, right_v, down_u, down_v] = tilted.slopes.map(f64::from);
    let ([.., widest], [right, down]) = (SLOPE, to.slopes);
    by[1] = steps(right, [right_u, right_v], units.slope, widest);
    by[2] = steps(down, [down_u, down_v], units.slope, widest);
    let [.., widest] = START;
    by[0] = steps(to.start, record.uv.map(f64::from), units.start, widest);
    by
}
