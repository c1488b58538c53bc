//! Analyses plain addresses in their own order.

use crate::orders::{OrderFigures, Sequence, Stream};
use crate::place::Place;
use crate::profile::{Profile, StreamCache, check_size};
use formats::interop::plain::AddressFile;
use sim::addresses::{AddressError, KindSet, for_line_blocks};
use sim::config::{ConfigError, LevelConfig, RunConfig};

/// First-level look-ups that count as one tile.
const LOOKUPS_A_TILE: u64 = 1024;

/// The analysis of a level, and its current tile.
struct Level {
    profile: Profile,
    tile: Option<u64>,
}

impl Level {
    fn new(
        level: &'static str,
        cache: &LevelConfig,
        config: &RunConfig,
        number: u64,
    ) -> Result<Self, ConfigError> {
        let profile = Profile::new(StreamCache {
            cache: *cache,
            level,
            line_bytes: config.line_bytes,
            // The seed of a replay.
            seed: config.seed.wrapping_add(number),
        })?;
        Ok(Self {
            profile,
            tile: None,
        })
    }

    /// Returns true for a hit.
    fn access(&mut self, tile: u64, line: u32) -> bool {
        if self.tile != Some(tile) {
            self.tile = Some(tile);
            let tile = (tile % u64::from(Place::MOST_TILES)) as u32;
            self.profile.at(&Place {
                tile,
                eye: None,
                row: None,
                item: tile + 1,
                tiles: 1,
            });
        }
        self.profile.access(line)
    }
}

/// Number of sets that line numbers must distinguish: that of the largest cache of the curves.
fn most_sets(
    level: &'static str,
    cache: &LevelConfig,
    line_bytes: u32,
) -> Result<u32, ConfigError> {
    /// The limit of line renumbering.
    const MOST: u32 = 1 << 24;
    let lines = u64::from(cache.sets(level, line_bytes)?) * u64::from(cache.ways);
    let largest = lines.next_power_of_two() * Profile::LARGEST_OVER_CONFIGURED;
    Ok(u32::try_from(largest).unwrap_or(MOST).min(MOST))
}

/// Analyses the accesses of `kinds` at the L1, and its misses at the L2. Uses line size, caches and seed of `config`.
///
/// # Errors
/// An impossible configuration; input that is unreadable, damaged or has nothing to analyse.
pub fn analyse_addresses(
    file: AddressFile<'_>,
    config: &RunConfig,
    kinds: KindSet,
) -> Result<OrderFigures, AddressError> {
    check_size(config, 1)?;
    let sets = [("L1", &config.level.l1), ("L2", &config.level.l2)]
        .map(|(level, cache)| most_sets(level, cache, config.line_bytes));
    let [l1_sets, l2_sets] = sets;
    let mut l1 = Level::new("L1", &config.level.l1, config, 1)?;
    let mut l2 = Level::new("L2", &config.level.l2, config, 0)?;
    let mut lookups = 0;
    let most_sets = l1_sets?.max(l2_sets?);
    for_line_blocks(file, config.line_bytes, most_sets, kinds, |block| {
        for &line in block.lines {
            let tile = lookups / LOOKUPS_A_TILE;
            lookups += 1;
            if !l1.access(tile, line) {
                l2.access(tile, line);
            }
        }
    })?;
    Ok(OrderFigures {
        order: Sequence::AsGiven,
        streams: vec![
            (Stream::L1, l1.profile.finish()),
            (Stream::L2, l2.profile.finish()),
        ],
    })
}
