//! Replays plain addresses, without tiles and time, through the caches of many configurations.

use super::counts::Misses;
use super::group::{Group, groups};
use super::machine::AtOnce;
use crate::config::{ConfigError, Mode, PrefetchConfig, RunConfig, accept};
use crate::result::MemoryResult;
use crate::stream::{Bins, Tag};

/// The caches of one core for many configurations with the same line size.
pub struct LineReplay {
    configs: Vec<RunConfig>,
    /// Groups of configurations (by index), each with its machine.
    machines: Vec<(Vec<usize>, Box<dyn AtOnce>)>,
    skips_repeats: bool,
    missed: Vec<u32>,
}

/// The counts of one configuration.
#[derive(Clone, Debug, Default)]
pub struct LineOutcome {
    /// L1 and L2 misses by kind of access.
    pub misses: Vec<[Misses; 2]>,
    /// Counts beside and below the L2.
    pub memory: MemoryResult,
}

impl LineReplay {
    /// Empty caches. Uses only the cache and memory settings of the configurations.
    ///
    /// # Errors
    /// An impossible configuration.
    pub fn new(configs: &[RunConfig]) -> Result<Self, ConfigError> {
        let usual = RunConfig::default();
        let caches_alone = |config: &RunConfig| RunConfig {
            mode: Mode::Functional,
            order: usual.order,
            cores: 1,
            assign: usual.assign,
            tile_maps: false,
            frame: None,
            between_frames: usual.between_frames,
            ..*config
        };
        let configs: Vec<RunConfig> = configs.iter().map(caches_alone).collect();
        configs.iter().try_for_each(RunConfig::validate)?;
        let mut prefetchers = configs.iter().filter_map(|config| config.prefetch);
        if let Some(prefetch) = prefetchers.find(PrefetchConfig::needs_textures) {
            let name = prefetch.prefetcher.name();
            accept(
                false,
                "prefetch.prefetcher",
                "one that knows nothing of textures",
                name,
            )?;
        }
        let bins = Bins::of_kinds();
        let built = |group: Group<'_>| {
            let machine = match group.points.len() {
                1 => group.build_alone(&bins, None)?,
                _ => group.build_at_once(&bins, None)?,
            };
            Ok((group.points, machine))
        };
        let machines = groups(&configs, (0..configs.len()).collect());
        Ok(Self {
            machines: (machines.into_iter().map(built)).collect::<Result<_, ConfigError>>()?,
            skips_repeats: !configs.iter().any(|c| c.level.depend_on_evictions()),
            configs,
            missed: Vec::new(),
        })
    }

    /// True if a repeated access to a line hits in every L1 and changes nothing.
    pub fn skips_repeats(&self) -> bool {
        self.skips_repeats
    }

    /// Accesses lines in sequence. Each tag gives the kind of access. Returns some of the lines, including
    /// all that were never accessed before.
    pub fn access(&mut self, lines: &[u32], tags: &[Tag]) -> &[u32] {
        for (_, machine) in &mut self.machines {
            self.missed.clear();
            machine.lines(lines, tags, &mut self.missed);
        }
        &self.missed
    }

    /// The counts of each configuration.
    pub fn outcomes(mut self) -> Vec<LineOutcome> {
        let mut outcomes = vec![LineOutcome::default(); self.configs.len()];
        for (points, machine) in &mut self.machines {
            machine.finish();
            for &point in &*points {
                let outcome = machine.outcome(&self.configs[point]);
                let cells = outcome.counts.cells.iter();
                outcomes[point] = LineOutcome {
                    misses: cells.map(|cell| [cell.l1, cell.l2]).collect(),
                    memory: outcome.memory,
                };
            }
        }
        outcomes
    }
}
