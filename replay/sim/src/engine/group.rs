//! The groups of a stream: configurations that one machine simulates.

use super::counts::CacheCounts;
use super::error::ReplayError;
use super::fast::one_pass::{LevelGeometry, OnePass, geometry};
use super::functional::Functional;
use super::machine::{AtOnce, Machine};
use super::threads;
use crate::access::FrameClients;
use crate::config::{BetweenFrames, ConfigError, Mode, RunConfig, TmuConfig};
use crate::memory::{Caches, Hierarchy, MissPath};
use crate::stream::{Bins, Expander, TileSource};
use formats::layout::Layout;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Configurations per group at most. Their counters are large, and several groups use several cores. It
/// does not depend on the number of cores, so that all shards of a sweep form the same groups.
const MOST_TOGETHER: usize = 256;

/// The groups, by stream. A group lists indices of configurations.
pub fn sharing(configs: &[RunConfig]) -> Vec<Vec<Vec<usize>>> {
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let points = |stream| {
        groups(configs, stream)
            .into_iter()
            .map(|group| group.points)
    };
    streams
        .into_iter()
        .map(|stream| points(stream).collect())
        .collect()
}

/// Groups the indices by equal keys, in order of first member.
pub fn grouped(
    indexes: impl IntoIterator<Item = usize>,
    key: impl Fn(&usize) -> RunConfig,
) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for index in indexes {
        let key = serde_json::to_string(&key(&index)).unwrap_or_default();
        let group = *known.entry(key).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(index);
    }
    groups
}

/// The configuration reduced to the settings that determine the stream.
pub(super) fn stream_key(config: &RunConfig) -> RunConfig {
    let usual = RunConfig::default();
    let model = config.tmu_model().unwrap_or_default();
    RunConfig {
        order: usual.order,
        level: usual.level,
        seed: usual.seed,
        cores: usual.cores,
        assign: usual.assign,
        between_frames: usual.between_frames,
        prefetch: None,
        dram: None,
        tmu: TmuConfig { model, ..usual.tmu },
        ..group_key(config)
    }
}

/// The configuration reduced to the settings that must agree within a group.
fn group_key(config: &RunConfig) -> RunConfig {
    let usual = RunConfig::default();
    let mut level = usual.level;
    if config.between_frames.lost_percent().is_some() {
        // Caches of several associativities share stacks, which other work would fill differently.
        level.l2.ways = config.level.l2.ways;
    }
    RunConfig {
        // If the order depends on the L2's size, the resolved name contains that size.
        order: config.order.resolved(config.level.l2.size_bytes),
        level,
        memory_cycles: usual.memory_cycles,
        tmu: usual.tmu,
        tile_maps: false,
        frame: None,
        ..*config
    }
}

/// A group of configurations that one machine simulates.
pub(super) struct Group<'a> {
    pub(super) points: Vec<usize>,
    configs: &'a [RunConfig],
    /// Built on first use.
    pub(super) machine: Option<Box<dyn Machine>>,
    /// The other clients of memory, if a configuration has a `[frame]` table.
    pub(super) clients: Option<FrameClients<'a>>,
}

/// Divides the configurations of a stream into groups.
pub(super) fn groups(configs: &[RunConfig], stream: Vec<usize>) -> Vec<Group<'_>> {
    let shared = |index: &usize| {
        let config = &configs[*index];
        shares_passes(config) && geometry(config).is_some()
    };
    let (together, alone): (Vec<usize>, Vec<usize>) = stream.into_iter().partition(shared);
    let mut members: Vec<Vec<usize>> = alone.into_iter().map(|index| vec![index]).collect();
    for mut group in grouped(together, |&index| group_key(&configs[index])) {
        // Similar geometries share most work.
        group.sort_by_key(|&index| geometry(&configs[index]));
        members.extend(group.chunks(MOST_TOGETHER).map(<[usize]>::to_vec));
    }
    let mut members = joined(configs, members);
    members.sort_by_key(|points| points.iter().copied().min());
    let group = |points| Group {
        points,
        configs,
        machine: None,
        clients: None,
    };
    members.into_iter().map(group).collect()
}

/// Joins groups that differ only in what their caches keep between frames.
fn joined(configs: &[RunConfig], groups: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    let usual = RunConfig::default();
    let mut joined: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<(String, Vec<LevelGeometry>), usize> = HashMap::new();
    for group in groups {
        let config = &configs[group[0]];
        let of = |&index: &usize| geometry(&configs[index]);
        let geometries: Option<Vec<LevelGeometry>> = group.iter().map(of).collect();
        let Some(mut geometries) = geometries.filter(|_| shares_passes(config)) else {
            joined.push(group);
            continue;
        };
        geometries.dedup();
        let key = RunConfig {
            between_frames: usual.between_frames,
            level: usual.level,
            ..group_key(config)
        };
        let key = serde_json::to_string(&key).unwrap_or_default();
        match known.entry((key, geometries)) {
            Entry::Occupied(first) => joined[*first.get()].extend(group),
            Entry::Vacant(first) => {
                first.insert(joined.len());
                joined.push(group);
            }
        }
    }
    joined
}

impl<'a> Group<'a> {
    /// The settings that all configurations of the group share, except for those between frames.
    pub(super) fn config(&self) -> &RunConfig {
        &self.configs[self.points[0]]
    }

    /// True if a configuration loses part of its L2 between frames.
    pub(super) fn loses_lines(&self) -> bool {
        let mut of_points = self
            .points
            .iter()
            .map(|&point| self.configs[point].between_frames);
        of_points.any(|between| between.lost_percent().is_some())
    }

    fn geometries(&self) -> Option<Vec<LevelGeometry>> {
        let of = |&index: &usize| geometry(&self.configs[index]);
        self.points.iter().map(of).collect()
    }

    /// The fewest sets of any L1, if repeated footprints always hit: all caches are LRU, the lines of a
    /// footprint cannot evict each other, and no other level invalidates them.
    pub(super) fn least_sets(&self) -> Option<u32> {
        if self.config().level.depend_on_evictions() {
            return None;
        }
        let l1 = self.geometries()?.into_iter().map(|(l1, _)| l1);
        let sets = l1.map(|l1| (l1.ways >= 4).then_some(l1.sets));
        sets.min().flatten()
    }

    /// The clients other than the texture units.
    pub(super) fn build_clients(
        &mut self,
        source: &'a dyn TileSource,
        expander: &Expander<'_>,
    ) -> Result<(), ReplayError> {
        let config = *self.config();
        if let Some(machine) = config.frame {
            let texture_bytes = expander.lines() * u64::from(config.line_bytes);
            let clients = FrameClients::new(source, &config, machine, texture_bytes)?;
            self.clients = Some(clients);
        }
        Ok(())
    }

    pub(super) fn build(&self, expander: &Expander<'_>) -> Result<Box<dyn Machine>, ReplayError> {
        let config = self.config();
        let layout = config.prefetch.and_then(|_| expander.layout(config));
        let layout = layout.as_ref();
        if config.mode == Mode::Timed {
            let counts = CacheCounts::new(expander.bins(), config.tile_maps);
            return Ok(threads::machine(config, counts, layout)?);
        }
        Ok(self.build_at_once(expander.bins(), layout)?)
    }

    /// The machine of configurations whose caches fill immediately.
    pub(super) fn build_at_once(
        &self,
        bins: &Bins,
        layout: Option<&Arc<Layout>>,
    ) -> Result<Box<dyn AtOnce>, ConfigError> {
        let config = self.config();
        if shares_passes(config)
            && let Some(geometries) = self.geometries()
        {
            let maps = self.points.iter().any(|&p| self.configs[p].tile_maps);
            let mut treatments: Vec<BetweenFrames> = Vec::new();
            for point in &self.points {
                let between = self.configs[*point].between_frames;
                if !treatments.contains(&between) {
                    treatments.push(between);
                }
            }
            let one_pass = OnePass::new(bins, config.cores, maps, &geometries, &treatments);
            return Ok(Box::new(one_pass));
        }
        self.build_alone(bins, layout)
    }

    /// The machine of a configuration that is a group of its own.
    pub(super) fn build_alone(
        &self,
        bins: &Bins,
        layout: Option<&Arc<Layout>>,
    ) -> Result<Box<dyn AtOnce>, ConfigError> {
        let config = self.config();
        let counts = CacheCounts::new(bins, config.tile_maps);
        let path = MissPath::build(config, layout)?;
        Ok(match Caches::build(config)?.all_four_way() {
            Ok(caches) => Box::new(Functional::new(Hierarchy::new(caches, path), counts)),
            Err(caches) => Box::new(Functional::new(Hierarchy::new(caches, path), counts)),
        })
    }
}

/// A single pass does not produce the misses of one L2 in order.
fn shares_passes(config: &RunConfig) -> bool {
    config.mode == Mode::Functional && !config.follows_l2_misses() && config.frame.is_none()
}
