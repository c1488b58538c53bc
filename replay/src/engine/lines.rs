//! Lines without tiles and without time: plain addresses through the caches of many configurations.

use super::AtOnce;
use super::batch::{Pass, passes};
use super::counts::Misses;
use crate::config::{ConfigError, Mode, PrefetchConfig, RunConfig, accept};
use crate::result::MemoryResult;
use crate::stream::{Bins, Tag};

/// The caches of one core under many configurations, which all have the same line size.
pub struct LineReplay {
    configs: Vec<RunConfig>,
    /// Configurations by index, and the machine that answers for them.
    machines: Vec<(Vec<usize>, Box<dyn AtOnce>)>,
    skips_repeats: bool,
    missed: Vec<u32>,
}

/// What one configuration made of the lines.
#[derive(Clone, Debug, Default)]
pub struct LineOutcome {
    /// Misses of the L1 and the L2 by the kind of access.
    pub misses: Vec<[Misses; 2]>,
    /// What was counted beside and below the L2.
    pub memory: MemoryResult,
}

impl LineReplay {
    /// Empty caches. Only what concerns caches and memory counts of a configuration.
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
        let built = |pass: Pass<'_>| {
            let machine = match pass.points.len() {
                1 => pass.build_alone(&bins, None)?,
                _ => pass.build_at_once(&bins, None)?,
            };
            Ok((pass.points, machine))
        };
        let machines = passes(&configs, (0..configs.len()).collect());
        Ok(Self {
            machines: (machines.into_iter().map(built)).collect::<Result<_, ConfigError>>()?,
            skips_repeats: !configs.iter().any(|c| c.level.depend_on_evictions()),
            configs,
            missed: Vec::new(),
        })
    }

    /// True if an access to the line of the one before finds it in every L1 and changes nothing.
    #[must_use]
    pub fn skips_repeats(&self) -> bool {
        self.skips_repeats
    }

    /// Accesses lines one after another; the tag of each has the kind of access. Returns some of them, all that were
    /// never accessed before among them.
    pub fn access(&mut self, lines: &[u32], tags: &[Tag]) -> &[u32] {
        for (_, machine) in &mut self.machines {
            self.missed.clear();
            machine.lines(lines, tags, &mut self.missed);
        }
        &self.missed
    }

    /// What each configuration made of all lines.
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
