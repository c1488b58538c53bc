//! What threads of a texture unit wait for: lists of cycles, with a bit for each footprint that waits.

/// Footprints of a thread that wait until a cycle. One may wait for several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pending {
    /// When a line of theirs arrives.
    ready: u64,
    /// A bit for each of them in their group, which is two segments, and above these bits the group's number.
    footprints: u64,
}

impl Pending {
    /// Footprints of a thread are counted in segments of up to so many.
    pub const SEGMENT: u32 = 24;
    const GROUP: u32 = 2 * Self::SEGMENT;

    /// Footprints that a thread may have. Of two segments that follow each other, both together have more
    /// than one can hold, so that groups' numbers fit.
    pub const MOST: u32 = 1 << 20;

    /// A bit for each footprint of a segment that waits until the cycle `ready`.
    #[inline(always)]
    #[must_use]
    pub fn new(ready: u64, footprints: u32, segment: u32) -> Self {
        let group = u64::from(segment / 2) << Self::GROUP;
        Self {
            ready,
            footprints: u64::from(footprints) << (segment % 2 * Self::SEGMENT) | group,
        }
    }

    #[inline(always)]
    fn group(self) -> u64 {
        self.footprints >> Self::GROUP
    }
}

const _: () = assert!(Pending::MOST / Pending::SEGMENT < 1 << (u64::BITS - Pending::GROUP));

/// How many footprints of a group these are, its number left out.
#[inline(always)]
fn count(footprints: u64) -> u32 {
    (footprints & ((1 << Pending::GROUP) - 1)).count_ones()
}

/// What a thread that enters waits for.
#[derive(Clone, Debug)]
pub struct Waiting {
    /// A group's follow each other.
    pub(super) list: Vec<Pending>,
    /// All of it.
    footprints: u64,
    /// When the first of what they wait for is there.
    pub(super) earliest: u64,
}

impl Default for Waiting {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            footprints: 0,
            earliest: u64::MAX,
        }
    }
}

impl Waiting {
    /// For nothing.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.list.clear();
        self.footprints = 0;
        self.earliest = u64::MAX;
    }

    /// True if all is there.
    #[inline(always)]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// For this as well.
    #[inline(always)]
    pub fn push(&mut self, pending: Pending) {
        self.footprints |= pending.footprints;
        self.earliest = self.earliest.min(pending.ready);
        self.list.push(pending);
    }

    /// After pushes in another order than that of segments.
    pub fn sort_by_segment(&mut self) {
        if !is_one_group(&self.list) {
            self.list.sort_by_key(|pending| pending.group());
        }
    }

    /// How many footprints wait.
    #[inline(always)]
    pub(super) fn count(&self) -> u32 {
        match is_one_group(&self.list) {
            true => count(self.footprints),
            false => of_groups(&self.list),
        }
    }
}

/// True of a list in the order of groups.
#[inline(always)]
fn is_one_group(list: &[Pending]) -> bool {
    let group = |one: Option<&Pending>| one.map(|one| one.group());
    group(list.first()) == group(list.last())
}

/// Drops what has arrived by `now`: how many footprints wait still, and, if any, when the first of what they
/// wait for is there.
///
/// No branches: which lines are there is a coin toss to the processor. What has arrived is a negative time
/// away, or a very long one.
#[inline(always)]
pub(super) fn drop_arrived(list: &mut Vec<Pending>, now: u64) -> (u32, u64) {
    let one_group = is_one_group(list);
    let (mut footprints, mut soonest) = (0, u64::MAX);
    let mut kept = 0_usize;
    let next = now + 1;
    for at in 0..list.len() {
        // Read whole, then written: else each would wait for the one before.
        let Pending {
            ready,
            footprints: of,
        } = list[at];
        list[kept] = Pending {
            ready,
            footprints: of,
        };
        let away = ready.wrapping_sub(next);
        let late = !(away.cast_signed() >> 63).cast_unsigned();
        kept += (late & 1) as usize;
        footprints |= of & late;
        soonest = soonest.min(away);
    }
    list.truncate(kept);
    let waiting = match one_group {
        true => count(footprints),
        false => of_groups(list),
    };
    (waiting, next.wrapping_add(soonest))
}

/// How many footprints wait.
#[inline(never)]
fn of_groups(list: &[Pending]) -> u32 {
    let groups = list.chunk_by(|a, b| a.group() == b.group());
    let of_group = |list: &[Pending]| list.iter().fold(0, |any, one| any | one.footprints);
    groups.map(|list| count(of_group(list))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_footprint_waits_for_the_last_of_its_lines() {
        let one = Pending::new;
        let mut list = vec![
            one(9, 0b11, 0),
            one(5, 0b110, 0),
            one(9, 0b1, 1),
            one(7, 0b1, 3),
        ];
        let found = [4, 6, 7, 9].map(|now| drop_arrived(&mut list, now));
        assert_eq!(found[..3], [(5, 5), (4, 7), (3, 9)]);
        assert_eq!((found[3].0, list.len()), (0, 0));
    }
}
