//! The arrivals that threads of a texture unit wait for: cycles, each with a bit mask of waiting footprints.

/// Footprints of a thread that wait for one cycle. A footprint may wait for several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pending {
    /// Arrival of a line that they need.
    ready: u64,
    /// One bit per footprint of their group, which spans two segments, with the group's number above these bits.
    footprints: u64,
}

impl Pending {
    /// Maximum number of footprints per segment. Footprints of a thread are numbered by segment.
    pub const SEGMENT: u32 = 24;
    const GROUP: u32 = 2 * Self::SEGMENT;

    /// Maximum number of footprints per thread. Two consecutive segments always hold more footprints than
    /// fit in one, so that group numbers fit.
    pub const MOST: u32 = 1 << 20;

    /// `footprints` has one bit per footprint of the segment that waits until the cycle `ready`.
    #[inline(always)]
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

/// Number of footprints, ignoring the group number.
#[inline(always)]
fn count(footprints: u64) -> u32 {
    (footprints & ((1 << Pending::GROUP) - 1)).count_ones()
}

/// The arrivals that a thread waits for.
#[derive(Clone, Debug)]
pub struct Waiting {
    /// Sorted by group.
    pub(super) list: Vec<Pending>,
    /// Union of all footprint masks.
    footprints: u64,
    /// The earliest arrival.
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
    /// Removes all arrivals.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.list.clear();
        self.footprints = 0;
        self.earliest = u64::MAX;
    }

    /// True if the thread waits for nothing.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Adds an arrival.
    #[inline(always)]
    pub fn push(&mut self, pending: Pending) {
        self.footprints |= pending.footprints;
        self.earliest = self.earliest.min(pending.ready);
        self.list.push(pending);
    }

    /// Restores the order by segment after pushes in another order.
    pub fn sort_by_segment(&mut self) {
        if !is_one_group(&self.list) {
            self.list.sort_by_key(|pending| pending.group());
        }
    }

    /// Number of waiting footprints.
    #[inline(always)]
    pub(super) fn count(&self) -> u32 {
        match is_one_group(&self.list) {
            true => count(self.footprints),
            false => of_groups(&self.list),
        }
    }
}

/// True if the list, which is sorted by group, has only one group.
#[inline(always)]
fn is_one_group(list: &[Pending]) -> bool {
    let group = |one: Option<&Pending>| one.map(|one| one.group());
    group(list.first()) == group(list.last())
}

/// Removes the arrivals up to `now`. Returns the number of footprints still waiting and, if any, the
/// earliest remaining arrival.
///
/// Branch-free, because which lines have arrived is unpredictable. The remaining time wraps around for
/// lines that have already arrived, so it compares as very large.
#[inline(always)]
pub(super) fn drop_arrived(list: &mut Vec<Pending>, now: u64) -> (u32, u64) {
    let one_group = is_one_group(list);
    let (mut footprints, mut soonest) = (0, u64::MAX);
    let mut kept = 0_usize;
    let next = now + 1;
    for at in 0..list.len() {
        // Reads before writing, so that iterations do not depend on each other.
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

/// Number of waiting footprints.
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
