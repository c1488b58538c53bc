//! All levels where time does not pass: a miss fills at once.

use super::caches::Caches;
use super::second_level::{MissPath, SecondLevel};
use crate::config::{ConfigError, RunConfig};
use crate::memory::{Access, Cache};
use crate::result::MemoryResult;

/// Where an access found its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// In the core's L1.
    L1,
    /// In the L2.
    L2,
    /// In a lower level or in memory.
    Below,
}

/// The caches of a machine, of any number of levels.
pub struct Hierarchy<C> {
    l1: Vec<C>,
    l2: SecondLevel<C>,
    /// True where lines leave L1 caches because other levels evict them.
    invalidates: bool,
}

impl Hierarchy<Box<dyn Cache>> {
    /// Empty caches of any policy.
    ///
    /// # Errors
    /// A geometry that cannot be built.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        Ok(Self::new(
            Caches::build(config)?.boxed(),
            MissPath::build(config, None)?,
        ))
    }
}

impl<C: Cache> Hierarchy<C> {
    /// Empty caches.
    #[must_use]
    pub fn new(caches: Caches<C>, path: MissPath) -> Self {
        Self {
            l1: caches.l1,
            invalidates: path.invalidates(),
            l2: SecondLevel::new(caches.l2, path),
        }
    }

    /// Up to so many distinct lines accessed one after another are all in the L1 right after.
    #[must_use]
    pub fn repeat_safe_lines(&self) -> u32 {
        match self.invalidates {
            true => 1,
            false => (self.l1.iter().map(Cache::repeat_safe_lines).min()).unwrap_or(1),
        }
    }

    /// True where lines leave L1 caches because other levels evict them.
    #[must_use]
    pub fn invalidates(&self) -> bool {
        self.invalidates
    }

    /// A core accesses a line.
    #[inline(always)]
    pub fn access(&mut self, core: usize, line: u32) -> Found {
        if self.access_l1(core, line) {
            return Found::L1;
        }
        let hit = self.access_l2(core, line);
        self.follow_evictions();
        if hit { Found::L2 } else { Found::Below }
    }

    /// A core accesses a line in its L1 alone, which takes it. True for a hit.
    #[inline(always)]
    pub fn access_l1(&mut self, core: usize, line: u32) -> bool {
        self.l1[core].access(line)
    }

    /// A core's L1 missed a line, which the levels below it are asked for. True if the L2 has it.
    #[inline(always)]
    pub fn access_l2(&mut self, core: usize, line: u32) -> bool {
        self.l2.access(core, line)
    }

    /// Another client than the texture units reads or writes: the bytes that caches serve.
    pub fn client_access(&mut self, core: usize, access: &Access) -> u64 {
        self.l2.client_access_at_once(core, access)
    }

    /// Takes lines out of the L1 caches that lower levels have evicted.
    #[inline(always)]
    pub fn follow_evictions(&mut self) {
        let l1 = &mut self.l1;
        (self.l2).invalidate_l1(|line| l1.iter_mut().map(|l1| u64::from(l1.remove(line))).sum());
    }

    /// Empties all caches.
    pub fn clear(&mut self) {
        self.l1.iter_mut().for_each(C::clear);
        self.l2.empty();
    }

    /// What was counted beside and below the L2.
    #[must_use]
    pub fn result(&self) -> MemoryResult {
        self.l2.result()
    }
}
