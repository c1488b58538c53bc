//! Many LRU configurations in one pass: a [`Forest`] for all first levels, and under each of these a
//! forest for all second levels, which see its misses.

use super::{Caches, Distinct, is_lru};
use crate::cache::Forest;
use crate::config::{CacheConfig, ConfigError, RunConfig};
use formats::interop::plain::AccessKind;

/// Sets and ways.
type Geometry = (u32, u32);

fn geometry(cache: &CacheConfig, level: &'static str, line: u32) -> Result<Geometry, ConfigError> {
    Ok((cache.sets(level, line)?, cache.ways))
}

/// Look-ups by number of sets, depth and kind. Those at the front of their stack are not counted.
struct Level {
    /// Numbers of sets with their largest associativity, ascending.
    trees: Vec<Geometry>,
    /// By tree and depth.
    depths: Vec<Vec<[u64; 3]>>,
}

impl Level {
    fn new(mut geometries: Vec<Geometry>) -> Self {
        geometries.sort_unstable();
        // Of equal sets the last has the most ways.
        geometries.reverse();
        geometries.dedup_by_key(|of| of.0);
        geometries.reverse();
        let depths = |&(_, ways): &Geometry| vec![[0; 3]; ways as usize + 1];
        Self {
            depths: geometries.iter().map(depths).collect(),
            trees: geometries,
        }
    }

    fn count(&mut self, depths: &[u8], kind: AccessKind) {
        for (counts, &depth) in self.depths.iter_mut().zip(depths) {
            counts[usize::from(depth)][kind as usize] += 1;
        }
    }

    fn tree(&self, sets: u32) -> Option<usize> {
        self.trees.iter().position(|tree| tree.0 == sets)
    }

    /// Look-ups as deep as the associativity or deeper.
    fn misses(&self, (sets, ways): Geometry) -> Option<[u64; 3]> {
        let counts = &self.depths[self.tree(sets)?];
        let sum = |kind: usize| counts[ways as usize..].iter().map(|of| of[kind]).sum();
        Some([0, 1, 2].map(sum))
    }
}

/// All second levels under one first level.
struct Under {
    l1: Geometry,
    /// Its number of sets among those of the first level.
    tree: usize,
    level: Level,
    forest: Forest,
}

/// LRU hierarchies.
pub struct OnePass {
    l1: Level,
    forest: Forest,
    under: Vec<Under>,
    /// Every first level has at least so many ways.
    least_ways: u32,
    /// Depths of a line, by number of sets.
    depths: Vec<u8>,
    l2_depths: Vec<u8>,
    /// Lines that the first of the second levels does not have.
    missed: Vec<u32>,
}

impl OnePass {
    /// Empty caches of all configurations.
    ///
    /// # Errors
    /// A configuration that cannot be built.
    pub fn new(configs: &[RunConfig]) -> Result<Self, ConfigError> {
        let mut pairs = Vec::new();
        for config in configs {
            pairs.push((
                geometry(&config.l1, "L1", config.line_bytes)?,
                geometry(&config.l2, "L2", config.line_bytes)?,
            ));
        }
        pairs.sort_unstable();
        let l1 = Level::new(pairs.iter().map(|pair| pair.0).collect());
        let under: Vec<Under> = pairs
            .chunk_by(|a, b| a.0 == b.0)
            .map(|same| {
                let level = Level::new(same.iter().map(|pair| pair.1).collect());
                Under {
                    l1: same[0].0,
                    tree: l1.tree(same[0].0.0).unwrap_or_default(),
                    forest: Forest::new(&level.trees),
                    level,
                }
            })
            .collect();
        let widest = under.iter().map(|u| u.level.trees.len()).max();
        Ok(Self {
            forest: Forest::new(&l1.trees),
            least_ways: pairs.iter().map(|pair| pair.0.1).min().unwrap_or(1),
            depths: vec![0; l1.trees.len()],
            l2_depths: vec![0; widest.unwrap_or(0)],
            missed: Vec::new(),
            l1,
            under,
        })
    }

    /// A look-up that missed some first level goes on to the second levels under it.
    #[inline(never)]
    fn missed_some(&mut self, line: u32, kind: AccessKind) {
        self.l1.count(&self.depths, kind);
        for (index, under) in self.under.iter_mut().enumerate() {
            if u32::from(self.depths[under.tree]) < under.l1.1 {
                continue;
            }
            let depths = &mut self.l2_depths[..under.level.trees.len()];
            under.forest.access(line, depths);
            under.level.count(depths, kind);
            if index == 0 && u32::from(depths[0]) == under.level.trees[0].1 {
                self.missed.push(line);
            }
        }
    }
}

impl Caches for OnePass {
    fn access(&mut self, block: &Distinct<'_>) -> &[u32] {
        self.missed.clear();
        let mut place = 0;
        loop {
            let rest = &block.lines[place..];
            place += (self.forest).access_all(rest, self.least_ways, &mut self.depths);
            let Some(&line) = block.lines.get(place) else {
                return &self.missed;
            };
            self.missed_some(line, block.kind(place));
            place += 1;
        }
    }

    fn misses(&self, config: &RunConfig) -> Option<[[u64; 3]; 2]> {
        if !is_lru(config) {
            return None;
        }
        let l1 = geometry(&config.l1, "L1", config.line_bytes).ok()?;
        let l2 = geometry(&config.l2, "L2", config.line_bytes).ok()?;
        let under = self.under.iter().find(|under| under.l1 == l1)?;
        Some([self.l1.misses(l1)?, under.level.misses(l2)?])
    }
}
