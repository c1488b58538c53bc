//! A cache level of a machine: one cache or one per core, and its place among the levels.

use crate::config::{Inclusion, RunConfig};

/// What a level is, whatever the type of its caches.
#[derive(Clone, Copy, Debug)]
pub(super) struct LevelShape {
    pub name: &'static str,
    /// Lines of each cache.
    pub lines: u64,
    pub line_bytes: u32,
    /// log2 of its line size over the L2's line size.
    pub shift: u32,
    pub inclusion: Inclusion,
    pub is_for_all_clients: bool,
    pub hit_cycles: u64,
}

impl LevelShape {
    /// The levels of a configuration, L1 first.
    pub fn all(config: &RunConfig) -> impl Iterator<Item = Self> {
        let levels = config.level.named(config.line_bytes);
        levels.map(|(name, level, line_bytes)| Self {
            name,
            lines: level.size_bytes / u64::from(line_bytes),
            line_bytes,
            shift: line_bytes.ilog2() - config.line_bytes.ilog2(),
            inclusion: level.inclusion,
            is_for_all_clients: !level.clients.is_textures(),
            hit_cycles: level.hit_cycles.into(),
        })
    }

    /// The L2 of a machine that holds textures only, above memory alone.
    pub const fn alone() -> Self {
        Self {
            name: "L2",
            lines: 0,
            line_bytes: 1,
            shift: 0,
            inclusion: Inclusion::None,
            is_for_all_clients: false,
            hit_cycles: 0,
        }
    }
}

/// A cache level. A line of the L2 lies in the line whose number is that of the L2 shifted by `shape.shift`.
pub(super) struct Level<C> {
    pub shape: LevelShape,
    /// One cache, or one per core.
    pub caches: Vec<C>,
}

impl<C> Level<C> {
    /// The cache that a core uses.
    #[inline(always)]
    pub fn cache(&mut self, core: usize) -> &mut C {
        of_core(&mut self.caches, core)
    }
}

/// The part of a level that a core uses: of each core, or of all.
#[inline(always)]
pub(super) fn of_core<C>(parts: &mut [C], core: usize) -> &mut C {
    let last = parts.len() - 1;
    &mut parts[core.min(last)]
}
