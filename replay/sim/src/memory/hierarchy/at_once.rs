//! All levels without time (functional mode): a miss fills immediately.

use super::caches::Caches;
use super::other_work::OtherWork;
use super::second_level::{MissPath, SecondLevel};
use crate::config::{ConfigError, RunConfig};
use crate::memory::in_flight::Immediate;
use crate::memory::{Access, Cache};
use crate::result::MemoryResult;

/// Where an access hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// The core's L1.
    L1,
    /// The L2.
    L2,
    /// A lower level or memory.
    Below,
}

/// The caches of a machine with any number of levels.
pub struct Hierarchy<C> {
    l1: Vec<C>,
    l2: SecondLevel<Immediate<C>>,
    /// True if evictions of other levels invalidate L1 lines.
    invalidates: bool,
}

impl Hierarchy<Box<dyn Cache>> {
    /// Empty caches of any policy.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        Ok(Self::new(
            Caches::build(config)?.boxed(),
            MissPath::build(config, None)?,
        ))
    }
}

impl<C: Cache> Hierarchy<C> {
    /// Empty caches.
    pub fn new(caches: Caches<C>, path: MissPath) -> Self {
        Self {
            l1: caches.l1,
            invalidates: path.invalidates(),
            l2: SecondLevel::new(caches.l2.into_iter().map(Immediate).collect(), path),
        }
    }

    /// Up to this many distinct lines accessed in sequence are all in the L1 afterwards.
    pub fn repeat_safe_lines(&self) -> u32 {
        match self.invalidates {
            true => 1,
            false => (self.l1.iter().map(Cache::repeat_safe_lines).min()).unwrap_or(1),
        }
    }

    /// True if evictions of other levels invalidate L1 lines.
    pub fn invalidates(&self) -> bool {
        self.invalidates
    }

    /// Accesses a line for a core.
    #[inline(always)]
    pub fn access(&mut self, core: usize, line: u32) -> Found {
        if self.access_l1(core, line) {
            return Found::L1;
        }
        let hit = self.access_l2(core, line);
        self.follow_evictions();
        if hit { Found::L2 } else { Found::Below }
    }

    /// Accesses a line in a core's L1 only, filling it on a miss. Returns true for a hit.
    #[inline(always)]
    pub fn access_l1(&mut self, core: usize, line: u32) -> bool {
        self.l1[core].access(line)
    }

    /// Accesses a line that missed in a core's L1. Returns true for an L2 hit.
    #[inline(always)]
    pub fn access_l2(&mut self, core: usize, line: u32) -> bool {
        self.l2.access(core, line)
    }

    /// Accesses memory for a client other than the texture units. Returns the bytes that caches serve.
    pub fn client_access(&mut self, core: usize, access: &Access) -> u64 {
        self.l2.client_access(core, access, 0)
    }

    /// Invalidates L1 lines that lower levels have evicted.
    #[inline(always)]
    pub fn follow_evictions(&mut self) {
        let l1 = &mut self.l1;
        (self.l2).invalidate_l1(|line| l1.iter_mut().map(|l1| u64::from(l1.remove(line))).sum());
    }

    /// Empties all caches.
    pub fn clear(&mut self) {
        self.l1.iter_mut().for_each(C::clear);
        self.l2.clear(0);
    }

    /// Empties the L1 caches, and other work fills part of each other cache.
    pub fn lose(&mut self, other: OtherWork) {
        self.l1.iter_mut().for_each(C::clear);
        self.l2.lose(other, 0);
        self.follow_evictions();
    }

    /// Counts beside and below the L2.
    pub fn result(&self) -> MemoryResult {
        self.l2.result()
    }
}
