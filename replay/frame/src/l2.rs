//! The shared cache: its banks look up one line per cycle each, in order of arrival. A miss needs an MSHR; look-ups of a
//! line in flight merge with it. A bank whose first look-up finds neither waits, and so do those behind it.

use super::machine::Machine;
use sim::config::ConfigError;
use sim::memory::{AnyCache, Cache};
use std::collections::{HashMap, VecDeque};

/// The result of a bank's cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// The line of this core is resident.
    Hit(usize, u32),
    /// The line of this core is in flight.
    Merged(usize, u32),
    /// The line of this core is to be read.
    Miss(usize, u32),
    /// The bank waits.
    Full,
    /// The bank has no look-up.
    Idle,
}

/// The shared cache.
pub struct L2 {
    cache: Box<dyn Cache>,
    /// Cores that wait for each line in flight.
    in_flight: HashMap<u32, Vec<usize>>,
    banks: Vec<VecDeque<(usize, u32)>>,
    mshrs: usize,
    merges: usize,
    /// Emptied lists of cores.
    spare: Vec<Vec<usize>>,
}

impl L2 {
    /// An empty cache.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn new(machine: &Machine) -> Result<Self, ConfigError> {
        let cache = AnyCache::build(&machine.l2, "L2", machine.line_bytes, 1)?;
        Ok(Self {
            cache: cache.into_box(),
            in_flight: HashMap::new(),
            banks: vec![VecDeque::new(); machine.banks],
            mshrs: machine.l2_mshrs,
            merges: machine.merges,
            spare: Vec::new(),
        })
    }

    /// Queues a look-up. Returns its bank, whose number depends on all bits that differ between neighbouring rows of
    /// textures.
    pub fn request(&mut self, core: usize, line: u32) -> usize {
        let bank = (line ^ line >> 5 ^ line >> 10 ^ line >> 15) as usize & (self.banks.len() - 1);
        self.banks[bank].push_back((core, line));
        bank
    }

    /// True if a look-up waits in the bank.
    pub fn has_work(&self, bank: usize) -> bool {
        !self.banks[bank].is_empty()
    }

    /// The cycle of a bank.
    pub fn step(&mut self, bank: usize) -> Found {
        let Some(&(core, line)) = self.banks[bank].front() else {
            return Found::Idle;
        };
        let found = if self.cache.lookup(line) {
            Found::Hit(core, line)
        } else if let Some(waiting) = self.in_flight.get_mut(&line) {
            if waiting.len() >= self.merges {
                return Found::Full;
            }
            waiting.push(core);
            Found::Merged(core, line)
        } else if self.in_flight.len() < self.mshrs {
            let mut waiting = self.spare.pop().unwrap_or_default();
            waiting.push(core);
            self.in_flight.insert(line, waiting);
            Found::Miss(core, line)
        } else {
            return Found::Full;
        };
        self.banks[bank].pop_front();
        found
    }

    /// Fills a line that DRAM has delivered. Calls `waits` with each core that waits for it.
    pub fn fill(&mut self, line: u32, waits: impl FnMut(usize)) {
        self.cache.fill(line);
        let mut waiting = self.in_flight.remove(&line).unwrap_or_default();
        waiting.drain(..).for_each(waits);
        self.spare.push(waiting);
    }
}
