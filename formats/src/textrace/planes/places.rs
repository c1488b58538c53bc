//! Positions of records, their covered lanes and their groups, with the state from record to record, for
//! encoder and decoder.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::GROUPS;
use super::codes::Codes;
use super::encode::Sink;
use crate::textrace::QuadRecord;
use crate::textrace::invariant::QUAD_POSITIONS;
use crate::varint::low_u32;

/// Largest step along the curve with its own symbol. The last symbol stands for this step and all larger
/// ones, and the step follows. Symbols are `16 * (step - 1) + mask`.
const STEPS: u32 = 7;
/// The symbol after which step, mask and group follow as numbers. It is free because no mask is 0.
pub(super) const ESCAPE_PLACE: u32 = 0;

const OUTSIDE: &str = "a quad inside the tile";

/// Position on the Morton curve, covered lanes, and group of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuadPlace {
    pub morton: u8,
    pub mask: u8,
    pub group: u8,
}

impl QuadPlace {
    /// A record at this place, with all other fields zero.
    #[inline(always)]
    pub fn record(self) -> QuadRecord {
        let (x, y) = QUAD_POSITIONS
            .get(usize::from(self.morton & 63))
            .copied()
            .unwrap_or_default();
        QuadRecord {
            x,
            y,
            mask: self.mask,
            group: self.group,
            ..QuadRecord::default()
        }
    }
}

/// The record that followed a group's record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Follow {
    group: u8,
    /// Whether it was in the same quad with the same mask.
    same_quad: bool,
}

/// State from one record to the next: eight bytes, which stay in a register.
#[derive(Clone, Copy)]
pub(super) struct Last {
    /// The run's last record; before the first one 0, 0 and the last run's group.
    pub place: QuadPlace,
    /// Whether its mask was the most likely one.
    likeliest: bool,
    /// Whether it directly followed the record before it on the curve.
    stepped_one: bool,
    /// Position of the first record of the run, or of the run before until its first record.
    start: u8,
    first_of_run: bool,
    /// Whether every expected record in the same quad occurs, so that it is not coded.
    pub regular: bool,
}

impl Last {
    pub fn new() -> Self {
        Self {
            place: QuadPlace {
                morton: 0,
                mask: 0,
                group: 0,
            },
            likeliest: false,
            stepped_one: false,
            start: 0,
            first_of_run: true,
            regular: false,
        }
    }

    /// Number of the run's remaining records that are likely to be of a group: half of them if groups
    /// alternate.
    pub fn share(&self, left_in_run: u32) -> u32 {
        left_in_run >> u32::from(self.regular)
    }

    /// Index of the code for step and mask.
    #[inline(always)]
    fn context(&self) -> usize {
        if self.first_of_run {
            16
        } else {
            self.later_context()
        }
    }

    /// The same after a run's first record.
    #[inline(always)]
    fn later_context(&self) -> usize {
        let corner = usize::from(self.place.morton & 3);
        corner << 2 | usize::from(self.likeliest) << 1 | usize::from(self.stepped_one)
    }
}

/// State over a tile.
#[derive(Clone)]
pub(super) struct Places {
    follows: [Follow; GROUPS],
    /// Lanes of each quad that the draw has covered.
    covered: [u8; 64],
    draw: u32,
}

impl Places {
    pub fn new() -> Self {
        Self {
            follows: follow_themselves(),
            covered: [0; 64],
            draw: 0,
        }
    }

    pub fn start_run(&mut self, last: &mut Last, draw: u32) {
        if draw != self.draw {
            self.draw = draw;
            self.covered = [0; 64];
            self.follows = follow_themselves();
            last.place.group = 0;
        }
        last.place.morton = 0;
        last.place.mask = 0;
        last.first_of_run = true;
        last.regular = false;
    }

    /// Whether each run has a bit for regularity. It has one only if some group is followed by another one in
    /// the same quad.
    pub fn codes_regular(&self) -> bool {
        self.follows.iter().any(|follow| follow.same_quad)
    }

    /// Whether a run of these records, starting now, is regular.
    pub fn is_regular(&self, mut last: Last, mut run: impl Iterator<Item = QuadPlace>) -> bool {
        let mut places = self.clone();
        run.all(|place| {
            let follow = places.follow(last.place.group);
            let expected = QuadPlace {
                group: follow.group,
                ..last.place
            };
            let holds = last.first_of_run || !follow.same_quad || place == expected;
            places.note_at(&mut last, place);
            holds
        })
    }

    /// The record expected after a record of a group.
    #[inline(always)]
    fn follow(&self, group: u8) -> Follow {
        let found = self.follows.get(usize::from(group) % GROUPS);
        found.copied().unwrap_or(Follow {
            group: 0,
            same_quad: false,
        })
    }

    /// Exchanges a quad's full mask with the mask of the lanes that the draw has not covered yet, or undoes
    /// it. A mesh covers every lane once, so 15 stands for the most likely mask.
    #[inline(always)]
    fn swap_mask(&self, morton: u8, mask: u8) -> u8 {
        let covered = self.covered.get(usize::from(morton & 63)).copied();
        let at = usize::from(covered.unwrap_or_default() & 15) << 4 | usize::from(mask & 15);
        SWAPPED.get(at).copied().unwrap_or_default()
    }

    /// Updates the state with a record.
    fn note_at(&mut self, last: &mut Last, place: QuadPlace) {
        let likeliest = self.swap_mask(place.morton, place.mask) == 15;
        self.note(last, place, likeliest);
    }

    /// The same, with the result of whether its mask was the most likely one.
    #[inline(always)]
    fn note(&mut self, last: &mut Last, place: QuadPlace, likeliest: bool) {
        let same_quad = !last.first_of_run
            & (place.morton == last.place.morton)
            & (place.mask == last.place.mask);
        self.note_other(last, place, likeliest, same_quad);
    }

    #[inline(always)]
    fn note_other(&mut self, last: &mut Last, place: QuadPlace, likeliest: bool, same_quad: bool) {
        if let Some(follow) = self.follows.get_mut(usize::from(last.place.group) % GROUPS) {
            *follow = Follow {
                group: place.group,
                same_quad,
            };
        }
        if let Some(covered) = self.covered.get_mut(usize::from(place.morton & 63)) {
            *covered |= place.mask;
        }
        if !same_quad {
            last.likeliest = likeliest;
            last.stepped_one = !last.first_of_run & (place.morton == last.place.morton + 1);
        }
        if last.first_of_run {
            last.start = place.morton;
        }
        last.place = place;
        last.first_of_run = false;
    }

    /// The group of the next quad's first record, if [`Self::read_next_quad`] can read it: if groups
    /// alternate in the same quads, two by two, and the last record ended a quad, or if the last record's
    /// group follows itself in other quads.
    #[inline(always)]
    pub fn starts_next_quad(&self, last: &Last) -> Option<u8> {
        let group = last.place.group;
        let next = self.follow(group);
        let after = self.follow(next.group);
        let alone = !next.same_quad & (next.group == group);
        let in_pairs = !next.same_quad & last.regular & after.same_quad & (after.group == group);
        (alone | in_pairs).then_some(next.group)
    }

    /// Group of the first record of a quad if groups alternate, two by two.
    pub fn first_of_two(&self, last: &Last) -> u8 {
        self.follow(last.place.group).group
    }

    /// Reads the next quad, if one is expected: only step and mask, without updating the state of groups.
    /// `None` if it is coded differently, so that [`Self::read`] must read it.
    #[inline(always)]
    pub fn read_next_quad(
        &mut self,
        last: &mut Last,
        codes: &Codes,
        bits: u64,
    ) -> Result<Option<(QuadPlace, u32)>, &'static str> {
        let (symbol, length) = codes.place.decode(last.later_context(), bits);
        let far = symbol >= (STEPS - 1) << 4;
        let step = if far {
            low_u32(bits >> length & 63)
        } else {
            1 + (symbol >> 4)
        };
        if (symbol == ESCAPE_PLACE) | (step == 0) {
            return Ok(None);
        }
        let morton = u32::from(last.place.morton) + step;
        if morton > 63 {
            return Err(OUTSIDE);
        }
        let morton = morton.to_le_bytes()[0];
        let mask = (symbol & 15).to_le_bytes()[0];
        last.likeliest = mask == 15;
        last.stepped_one = step == 1;
        last.place.morton = morton;
        last.place.mask = self.swap_mask(morton, mask);
        if let Some(covered) = self.covered.get_mut(usize::from(morton & 63)) {
            *covered |= last.place.mask;
        }
        Ok(Some((last.place, length + if far { 6 } else { 0 })))
    }

    /// Reads the record after `last` from at least 57 bits. Returns the number of bits used.
    #[inline(always)]
    pub fn read(
        &mut self,
        last: &mut Last,
        codes: &Codes,
        mut bits: u64,
    ) -> Result<(QuadPlace, u32), &'static str> {
        let follow = self.follow(last.place.group);
        let mut used = 0;
        let mut before = u32::from(last.place.morton);
        if last.first_of_run {
            let (apart, length) = codes.start.decode(bits);
            before = (u32::from(last.start) ^ apart).wrapping_sub(1);
            used = length;
        } else if follow.same_quad {
            used = u32::from(!last.regular);
            if last.regular | (bits & 1 == 1) {
                let place = QuadPlace {
                    group: follow.group,
                    ..last.place
                };
                self.note(last, place, last.likeliest);
                return Ok((place, used));
            }
        }
        bits >>= used;
        let (symbol, length) = codes.place.decode(last.context(), bits);
        used += length;
        bits >>= length;
        if symbol == ESCAPE_PLACE {
            used += 14;
            let morton = before.wrapping_add(low_u32(bits & 63));
            if morton > 63 {
                return Err(OUTSIDE);
            }
            let place = QuadPlace {
                morton: morton.to_le_bytes()[0],
                mask: low_u32(bits >> 6 & 15).to_le_bytes()[0],
                group: low_u32(bits >> 10 & 15).to_le_bytes()[0],
            };
            self.note_at(last, place);
            return Ok((place, used));
        }
        let mask = (symbol & 15).to_le_bytes()[0];
        let mut step = 1 + (symbol >> 4);
        if step == STEPS {
            step = low_u32(bits & 63);
            used += 6;
        }
        let morton = before.wrapping_add(step);
        if morton > 63 {
            return Err(OUTSIDE);
        }
        let morton = morton.to_le_bytes()[0];
        let place = QuadPlace {
            morton,
            mask: self.swap_mask(morton, mask),
            group: follow.group,
        };
        if step == 0 {
            self.note(last, place, mask == 15);
        } else {
            // The context of the next code does not depend on the mask, so it need not wait for it.
            self.note_other(last, place, mask == 15, false);
        }
        Ok((place, used))
    }

    /// Writes the next record.
    pub fn write(
        &mut self,
        codes: &Codes,
        last: &mut Last,
        place: QuadPlace,
        sink: &mut impl Sink,
    ) {
        self.put(codes, last, place, sink);
        self.note_at(last, place);
    }

    fn put(&self, codes: &Codes, last: &Last, place: QuadPlace, sink: &mut impl Sink) {
        let follow = self.follow(last.place.group);
        let mut step = u32::from(place.morton.wrapping_sub(last.place.morton));
        if last.first_of_run {
            let apart = place.morton ^ last.start;
            sink.symbol(&codes.start, apart.into(), 0);
            step = 1;
        } else if follow.same_quad {
            let expected = QuadPlace {
                group: follow.group,
                ..last.place
            };
            if !last.regular {
                sink.bits((place == expected).into(), 1);
            }
            if place == expected {
                return;
            }
        }
        #[allow(clippy::indexing_slicing, reason = "the context is one of 17")]
        let code = &codes.place.codes[last.context()];
        let swapped = self.swap_mask(place.morton, place.mask);
        let symbol = if place.group == follow.group && step > 0 {
            (step.min(STEPS) - 1) << 4 | u32::from(swapped)
        } else {
            ESCAPE_PLACE
        };
        let known = sink.symbol(code, symbol, ESCAPE_PLACE) && symbol != ESCAPE_PLACE;
        if !known || step >= STEPS {
            sink.bits(step, 6);
        }
        if !known {
            sink.bits(place.mask.into(), 4);
            sink.bits(place.group.into(), 4);
        }
    }
}

/// By covered lanes, then mask: see [`Places::swap_mask`]. A table, because branches would be
/// unpredictable.
static SWAPPED: [u8; 256] = {
    let mut masks = [0; 256];
    let mut at = 0;
    while at < 256 {
        let (rest, mask) = (15 & !(at >> 4), at & 15);
        let swaps = rest != 0 && (mask == 15 || mask == rest);
        #[allow(
            clippy::indexing_slicing,
            clippy::cast_possible_truncation,
            reason = "evaluated when compiled"
        )]
        {
            masks[at] = if swaps { mask ^ 15 ^ rest } else { mask } as u8;
        }
        at += 1;
    }
    masks
};

fn follow_themselves() -> [Follow; GROUPS] {
    let mut group = 0;
    std::array::from_fn(|_| {
        group += 1;
        Follow {
            group: group - 1,
            same_quad: false,
        }
    })
}
