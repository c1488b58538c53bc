//! Replacement policies that the caller of this library implements. The cache keeps the tags, the policy
//! only chooses ways.

use super::any_cache::{AnyCache, boxed};
use super::{ANY_WAYS, Build, Geometry, PolicyRow, Replacement};
use crate::memory::cache::{Cache, EMPTY, empty_way};
use std::sync::{Mutex, PoisonError};

/// A policy for all sets of a cache.
pub trait Policy: Send {
    /// A look-up of `line` found it in this way.
    fn hit(&mut self, set: u32, way: u32, line: u32);

    /// `line` was filled into this way.
    fn fill(&mut self, set: u32, way: u32, line: u32);

    /// The way to evict from a full set; less than the number of ways.
    fn victim(&mut self, set: u32) -> u32;
}

/// Makes the policy of a cache from its number of sets and ways.
pub type MakePolicy = Box<dyn Fn(u32, u32) -> Box<dyn Policy> + Send + Sync>;

/// The policies named so far. Configurations are copied, so a policy lives until the program ends.
static NAMED: Mutex<Vec<Replacement>> = Mutex::new(Vec::new());

/// The policy that was named so.
pub(super) fn by_name(name: &str) -> Result<Replacement, Option<String>> {
    let named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
    let found = named.iter().find(|policy| policy.name() == name);
    found.copied().ok_or(None)
}

impl Replacement {
    /// A policy under a name of its own, which configurations then accept. It replaces an earlier one of the
    /// same name. A name with `@` never equals a name of the table.
    pub fn own(name: &str, make: MakePolicy) -> Self {
        let row: &'static PolicyRow = Box::leak(Box::new(PolicyRow {
            name: name.to_owned().leak(),
            help: "",
            ways: ANY_WAYS,
            build: Build::Own(Box::leak(Box::new(make))),
        }));
        let policy = Self::new(row);
        let mut named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
        named.retain(|other| *other != policy);
        named.push(policy);
        policy
    }
}

/// A cache with such a policy.
struct Own {
    tags: Vec<u32>,
    set_mask: u32,
    ways: usize,
    policy: Box<dyn Policy>,
}

pub(super) fn build(make: &MakePolicy, geometry: Geometry) -> AnyCache {
    let Geometry { sets, ways, .. } = geometry;
    boxed(Own {
        tags: vec![EMPTY; sets as usize * ways as usize],
        set_mask: sets - 1,
        ways: ways as usize,
        policy: make(sets, ways),
    })
}

impl Own {
    fn set_of(&self, line: u32) -> (u32, usize) {
        let set = line & self.set_mask;
        (set, set as usize * self.ways)
    }

    fn way_of(&self, line: u32) -> Option<usize> {
        let (_, first) = self.set_of(line);
        let mut tags = self.tags[first..first + self.ways].iter();
        tags.position(|&tag| tag == line)
    }
}

impl Cache for Own {
    fn lookup(&mut self, line: u32) -> bool {
        let Some(way) = self.way_of(line) else {
            return false;
        };
        let (set, _) = self.set_of(line);
        self.policy.hit(set, way as u32, line);
        true
    }

    fn contains(&self, line: u32) -> bool {
        self.way_of(line).is_some()
    }

    fn fill(&mut self, line: u32) -> u32 {
        let (set, first) = self.set_of(line);
        let tags = &mut self.tags[first..first + self.ways];
        let empty = tags.iter().position(|&tag| tag == EMPTY);
        let way = empty.unwrap_or_else(|| self.policy.victim(set) as usize % self.ways);
        let evicted = std::mem::replace(&mut tags[way], line);
        self.policy.fill(set, way as u32, line);
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        let (_, first) = self.set_of(line);
        empty_way(&mut self.tags[first..first + self.ways], line).is_some()
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
    }

    /// A policy may count hits, so every repeat is simulated.
    fn repeat_safe_lines(&self) -> u32 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Mode, Order, RunConfig};
    use crate::engine::replay;
    use crate::stream::testing::Synthetic;

    /// LRU by time stamps.
    struct Stamps {
        ways: u32,
        now: u64,
        used: Vec<u64>,
    }

    impl Stamps {
        fn touch(&mut self, set: u32, way: u32) {
            self.now += 1;
            self.used[(set * self.ways + way) as usize] = self.now;
        }
    }

    impl Policy for Stamps {
        fn hit(&mut self, set: u32, way: u32, _line: u32) {
            self.touch(set, way);
        }

        fn fill(&mut self, set: u32, way: u32, _line: u32) {
            self.touch(set, way);
        }

        fn victim(&mut self, set: u32) -> u32 {
            let used = |way: &u32| self.used[(set * self.ways + way) as usize];
            (0..self.ways).min_by_key(used).unwrap()
        }
    }

    #[test]
    fn lru_by_time_stamps_has_the_counts_of_lru() {
        let own = Replacement::own(
            "Stamps@test",
            Box::new(|sets, ways| {
                Box::new(Stamps {
                    ways,
                    now: 0,
                    used: vec![0; (sets * ways) as usize],
                })
            }),
        );
        assert_eq!(Replacement::find("Stamps@test"), Some(own));
        let trace = Synthetic::default().generate();
        for mode in [Mode::Functional, Mode::Timed] {
            let mut config = RunConfig {
                mode,
                order: Order::Z2_STA,
                ..RunConfig::default()
            };
            config.level.l1.size_bytes = 1 << 10;
            config.level.l2.size_bytes = 8 << 10;
            let lru = replay(&trace, &config).unwrap();
            config.level.l1.replacement = own;
            config.level.l2.replacement = own;
            let result = replay(&trace, &config).unwrap();
            assert!(lru.l2.counters.line_misses > 100);
            assert_eq!(result.l1, lru.l1);
            assert_eq!(result.l2, lru.l2);
            assert_eq!(result.cycles, lru.cycles);
        }
    }
}
