//! Encodes records as bits: a control word, then four pairs of residuals.
//!
//! Control word, lowest bit first:
//!
//! | bits | meaning |
//! | --- | --- |
//! | 4 x 4 | width codes of the dx, dy, cross and uv residuals |
//! | 3 | step along the Morton curve since the run's last record, 7: six more bits hold it |
//! | 4 | coverage mask |
//! | 1 | 1: the group is the one that followed the last record's group before; 0: four more bits |
//!
//! Then the escapes in that order, then dx, dy, cross and uv, each u before v, in the width of the larger
//! of the two.

use super::predict::{Context, Derivatives, Pair, split};
use crate::textrace::bits::{BitReader, BitWriter, PEEK_BITS};
use crate::textrace::invariant::QUAD_POSITIONS;
use crate::textrace::{PrimitiveRun, QuadRecord, Tile, quad_morton};
use crate::varint::{low_u32, unzigzag, zigzag};
use std::num::Wrapping;

/// Number of bits of the control word.
pub(super) const CONTROL_BITS: u32 = 24;
/// Number of bits of the control word with both escapes.
const LONGEST_CONTROL_BITS: u32 = CONTROL_BITS + 6 + 4;
const _: () = assert!(LONGEST_CONTROL_BITS <= PEEK_BITS);

/// Width in bits of each width code.
const WIDTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 18, 24, 32];

/// Number of groups that a record can name.
const GROUPS: usize = 16;

/// State carried from record to record of a tile.
pub(super) struct State {
    contexts: [Context; GROUPS],
    /// Group that followed each group the last time.
    follows: [u8; GROUPS],
    /// Group of the last record.
    group: u8,
    draw: u32,
    /// Groups that occurred in this run, one bit each.
    seen: u16,
    /// Position of the run's last record on the Morton curve.
    morton: u32,
}

impl State {
    pub(super) fn new() -> Self {
        let mut follows = [0; GROUPS];
        for (group, follow) in (0u8..).zip(&mut follows) {
            *follow = group;
        }
        Self {
            contexts: [Context::default(); GROUPS],
            follows,
            group: 0,
            draw: 0,
            seen: 0,
            morton: 0,
        }
    }

    fn start_run(&mut self, run: &PrimitiveRun) {
        // Another draw has other textures, so its coordinates do not continue these.
        if run.draw != self.draw {
            *self = Self::new();
            self.draw = run.draw;
        }
        self.seen = 0;
        self.morton = 0;
    }

    /// The predicted next group.
    #[inline(always)]
    fn expected_group(&self) -> u8 {
        let group = usize::from(self.group) % GROUPS;
        self.follows.get(group).copied().unwrap_or_default()
    }

    /// Updates the state with the next record's group.
    #[inline(always)]
    fn note_group(&mut self, group: u8) {
        if let Some(follow) = self.follows.get_mut(usize::from(self.group) % GROUPS) {
            *follow = group;
        }
        self.group = group;
    }
}

/// Writes the records of a whole tile.
pub(super) fn encode(tile: &Tile, bits: &mut BitWriter) {
    let mut state = State::new();
    let mut records = tile.records.iter();
    for run in &tile.runs {
        state.start_run(run);
        for record in records.by_ref().take(run.count as usize) {
            encode_record(record, &mut state, bits);
        }
    }
}

fn encode_record(record: &QuadRecord, state: &mut State, bits: &mut BitWriter) {
    let (x, y) = (i32::from(record.x), i32::from(record.y));
    let (uv, now) = split(record);
    let group = usize::from(record.group) % GROUPS;
    let expected = state.expected_group();
    let Some(context) = state.contexts.get_mut(group) else {
        return;
    };
    let guess = context.derivatives(x, y);
    let residuals = [
        residual(now.dx, guess.dx),
        residual(now.dy, guess.dy),
        residual(now.cross, guess.cross),
        residual(uv, context.uv(x, y, &now)),
    ];
    let morton = u32::from(quad_morton(record.x, record.y));
    let step = morton - state.morton;
    let codes = residuals.map(|[u, v]| width_code(u | v));
    let [dx, dy, cross, coordinates] = codes;
    let control = dx
        | dy << 4
        | cross << 8
        | coordinates << 12
        | step.min(7) << 16
        | u32::from(record.mask) << 19
        | u32::from(record.group == expected) << 23;
    bits.put(control, CONTROL_BITS);
    if step >= 7 {
        bits.put(step, 6);
    }
    if record.group != expected {
        bits.put(u32::from(record.group), 4);
    }
    for ([u, v], code) in residuals.into_iter().zip(codes) {
        let width = width(code);
        if width <= 16 {
            bits.put(u | v << width, 2 * width);
        } else {
            bits.put(u, width);
            bits.put(v, width);
        }
    }
    let same_run = state.seen >> group & 1 == 1;
    context.learn(x, y, uv, now, same_run);
    state.seen |= 1 << group;
    state.morton = morton;
    state.note_group(record.group);
}

/// Reads the records of one run; `None` if the bits end early or a position is outside the tile.
#[inline]
pub(super) fn decode_run(
    run: &PrimitiveRun,
    state: &mut State,
    bits: &mut BitReader<'_>,
    records: &mut Vec<QuadRecord>,
) -> Option<()> {
    state.start_run(run);
    for _ in 0..run.count {
        records.push(decode_record(state, bits)?);
    }
    Some(())
}

#[inline(always)]
fn decode_record(state: &mut State, bits: &mut BitReader<'_>) -> Option<QuadRecord> {
    let control = bits.peek()?;
    let field = |from: u32, count: u32| low_u32((control >> from) & ((1 << count) - 1));
    // A field of four bits.
    let nibble = |from: u32| field(from, 4).to_le_bytes()[0];
    let widths = [0, 4, 8, 12].map(|from| width(field(from, 4)));
    let mut step = field(16, 3);
    let mask = nibble(19);
    let mut used = CONTROL_BITS;
    let mut group = state.expected_group();
    if step == 7 {
        step = field(used, 6);
        used += 6;
    }
    if field(23, 1) == 0 {
        group = nibble(used);
        used += 4;
    }
    bits.skip(used);
    let morton = state.morton + step;
    let &(x, y) = QUAD_POSITIONS.get(morton as usize)?;
    let context = state.contexts.get_mut(usize::from(group) % GROUPS)?;
    let (column, row) = (i32::from(x), i32::from(y));
    let [dx_width, dy_width, cross_width, uv_width] = widths;
    let guess = context.derivatives(column, row);
    let now = Derivatives {
        dx: take(bits, dx_width, guess.dx)?,
        dy: take(bits, dy_width, guess.dy)?,
        cross: take(bits, cross_width, guess.cross)?,
    };
    let uv = take(bits, uv_width, context.uv(column, row, &now))?;
    context.learn(column, row, uv, now, state.seen >> group & 1 == 1);
    state.seen |= 1 << group;
    state.morton = morton;
    state.note_group(group);
    Some(QuadRecord {
        x,
        y,
        mask,
        group,
        uv: uv.map(|number| number.0),
        dx: now.dx.map(|number| number.0),
        dy: now.dy.map(|number| number.0),
        cross: now.cross.map(|number| number.0),
    })
}

/// Reads a pair of residuals and adds them to the prediction.
#[inline(always)]
fn take(bits: &mut BitReader<'_>, width: u32, guess: Pair) -> Option<Pair> {
    let [u, v] = if 2 * width <= PEEK_BITS {
        let both = bits.peek()?;
        bits.skip(2 * width);
        let low = (1u64 << width) - 1;
        [both & low, both >> width & low]
    } else {
        let u = bits.peek()?;
        bits.skip(width);
        let v = bits.peek()?;
        bits.skip(width);
        [u, v]
    };
    let [guess_u, guess_v] = guess;
    Some([guess_u + unfold(low_u32(u)), guess_v + unfold(low_u32(v))])
}

/// The difference of a pair from its prediction, as stored.
fn residual(actual: Pair, guess: Pair) -> [u32; 2] {
    let fold = |number: Wrapping<i32>| low_u32(zigzag(number.0.into()));
    let ([a, b], [c, d]) = (actual, guess);
    [fold(a - c), fold(b - d)]
}

#[inline(always)]
fn unfold(value: u32) -> Wrapping<i32> {
    Wrapping(low_u32(unzigzag(value.into()).cast_unsigned()).cast_signed())
}

/// The smallest width code for `value`.
#[inline(always)]
fn width_code(value: u32) -> u32 {
    let needed = 32 - value.leading_zeros();
    CODES.get(needed as usize).copied().map_or(15, u32::from)
}

/// The smallest width code for each number of bits.
const CODES: [u8; 33] = {
    let mut codes = [0; 33];
    let (mut bits, mut code) = (0, 0);
    while bits < codes.len() {
        #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
        {
            if (WIDTHS[code as usize] as usize) < bits {
                code += 1;
            }
            codes[bits] = code;
        }
        bits += 1;
    }
    codes
};

#[inline(always)]
fn width(code: u32) -> u32 {
    WIDTHS.get(code as usize & 15).copied().map_or(0, u32::from)
}
