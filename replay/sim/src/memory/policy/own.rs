//! Replacement policies that the caller of this library implements.

use super::{ANY_WAYS, Build, Policy, PolicyRow, Replacement};
use std::sync::{Mutex, PoisonError};

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
