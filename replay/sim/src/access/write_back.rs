//! A write-back cache that allocates on writes without fetching, like colour and depth caches with byte masks.

/// The effect of an access.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Effect {
    /// The line was absent.
    pub missed: bool,
    /// A modified line that was evicted and written back.
    pub evicted: Option<u64>,
}

/// A four-way LRU cache: tags with a modified flag, most recently used first.
#[derive(Debug)]
pub(super) struct WriteBack {
    ways: Vec<(u64, bool)>,
    mask: u64,
}

const WAYS: usize = 4;
const EMPTY: u64 = u64::MAX;

impl WriteBack {
    /// `lines` is a power of two, at least 4.
    pub fn new(lines: u64) -> Self {
        Self {
            ways: vec![(EMPTY, false); lines as usize],
            mask: lines / WAYS as u64 - 1,
        }
    }

    /// Reads or writes a line.
    pub fn access(&mut self, line: u64, writes: bool) -> Effect {
        let first = (line & self.mask) as usize * WAYS;
        let set = &mut self.ways[first..first + WAYS];
        if let Some(way) = set.iter().position(|(tag, _)| *tag == line) {
            set[..=way].rotate_right(1);
            set[0].1 |= writes;
            return Effect::default();
        }
        let (victim, changed) = set[WAYS - 1];
        set.rotate_right(1);
        set[0] = (line, writes);
        Effect {
            missed: true,
            evicted: changed.then_some(victim),
        }
    }

    /// Writes back all modified lines and empties the cache.
    pub fn flush(&mut self) -> impl Iterator<Item = u64> {
        let ways = self.ways.iter_mut();
        ways.filter_map(|way| {
            let (line, changed) = std::mem::replace(way, (EMPTY, false));
            changed.then_some(line)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Compares with a cache that uses time stamps.
    #[test]
    fn accesses_have_the_effects_of_a_plain_list_of_lines() {
        let mut cache = WriteBack::new(16);
        let mut plain: HashMap<u64, (u64, bool)> = HashMap::new();
        let mut state = 1_u64;
        let mut evictions = 0;
        for time in 0..20_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let (line, writes) = (state >> 33 & 31, state >> 40 & 3 == 0);
            let found = cache.access(line, writes);
            let known = plain.get(&line).copied();
            let mut expected = Effect {
                missed: known.is_none(),
                evicted: None,
            };
            let of_set: Vec<u64> = plain
                .keys()
                .copied()
                .filter(|other| other % 4 == line % 4)
                .collect();
            if known.is_none() && of_set.len() == 4 {
                let victim = *of_set.iter().min_by_key(|other| plain[other].0).unwrap();
                expected.evicted = plain
                    .remove(&victim)
                    .filter(|(_, changed)| *changed)
                    .map(|_| victim);
                evictions += u32::from(expected.evicted.is_some());
            }
            plain.insert(
                line,
                (time, known.is_some_and(|(_, changed)| changed) || writes),
            );
            assert_eq!(found, expected);
        }
        assert!(evictions > 1000);
        let mut flushed: Vec<u64> = cache.flush().collect();
        let mut expected: Vec<u64> = plain
            .iter()
            .filter(|(_, (_, changed))| *changed)
            .map(|(line, _)| *line)
            .collect();
        flushed.sort_unstable();
        expected.sort_unstable();
        assert_eq!(flushed, expected);
        assert_eq!(cache.flush().count(), 0);
    }
}
