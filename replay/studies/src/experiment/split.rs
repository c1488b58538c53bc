//! Distributes the points of a plan to machines.
//!
//! Points of a group (one pass) stay together, and groups that share a trace's expansion are adjacent, so
//! that few machines repeat an expansion.

use super::Plan;
use super::runner::groups;
use shell::{Piece, Shard, balanced};
use sim::config::{RunConfig, TmuModel};
use sim::engine::sharing;

/// Estimated costs per quad record, relative to expanding it to lines (4). They affect the balance of
/// shards, never the results.
mod cost {
    pub const EXPANSION: u64 = 4;
    /// Caches without latencies: the first configuration of a pass, and each further one.
    pub const FUNCTIONAL: u64 = 3;
    pub const FUNCTIONAL_PART: (u64, u64) = (1, 8);
    pub const TIMED: u64 = 6;
    pub const FIRST_MISS: u64 = 9;
    /// Nanoseconds per unit: four times the slowest measurement in results/replay-costs.csv.
    pub const NANOSECONDS: u64 = 1200;
}

/// Points of a trace that are replayed in one pass.
struct Pass {
    subject: usize,
    /// Indexes of [`groups`].
    groups: Vec<usize>,
    piece: Piece,
    /// Its share of an expansion used by several passes.
    expansion: u64,
}

/// The points of a plan on its traces, in the order of their distribution.
pub struct Split {
    passes: Vec<Pass>,
    /// Cost of each expansion, by [`Piece::set`].
    expansions: Vec<u64>,
    subjects: usize,
}

/// A point on a trace, and its cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// Index of the trace.
    pub subject: usize,
    /// Index of the first point of the plan with this configuration.
    pub point: usize,
    /// Number of the pass. All points of a pass cost little more than one of them.
    pub pass: usize,
    /// Estimated share of the work, unitless.
    pub cost: u64,
}

impl Split {
    /// Splits the points of a plan; `records[subject]` is the number of quad records of each trace.
    pub fn new(plan: &Plan, records: &[u64]) -> Self {
        let distinct = groups(&plan.points);
        let configs: Vec<RunConfig> = distinct
            .iter()
            .map(|group| plan.points[group[0]].config)
            .collect();
        let streams = sharing(&configs);
        let mut split = Self {
            passes: Vec::new(),
            expansions: Vec::new(),
            subjects: records.len(),
        };
        for (subject, &records) in records.iter().enumerate() {
            let records = records.max(1);
            for stream in &streams {
                let set = split.expansions.len();
                let expansion = cost::EXPANSION * records;
                split.expansions.push(expansion);
                for groups in stream {
                    let piece = Piece {
                        cost: records * pass_cost(&configs[groups[0]], groups.len() as u64),
                        set,
                    };
                    split.passes.push(Pass {
                        subject,
                        groups: groups.clone(),
                        piece,
                        expansion: expansion / stream.len() as u64,
                    });
                }
            }
        }
        split
    }

    /// Indexes of the distinct configurations that a shard replays, by trace.
    pub fn shard(&self, shard: Shard) -> Vec<Vec<usize>> {
        let mut wanted = vec![Vec::new(); self.subjects];
        for pass in &self.passes[self.passes_of(shard)] {
            wanted[pass.subject].extend_from_slice(&pass.groups);
        }
        wanted
    }

    /// Estimated minutes of the slowest of `count` shards, with a margin, and at least ten.
    pub fn minutes(&self, count: u32) -> u64 {
        let cost = |passes: std::ops::Range<usize>| -> u64 {
            let of_set = |passes: &[Pass]| {
                let pieces: u64 = passes.iter().map(|pass| pass.piece.cost).sum();
                pieces + self.expansions[passes[0].piece.set]
            };
            let sets = self.passes[passes].chunk_by(|a, b| a.piece.set == b.piece.set);
            sets.map(of_set).sum()
        };
        let costliest = self.shards(count).into_iter().map(cost).max();
        let nanoseconds = costliest.unwrap_or(0).saturating_mul(cost::NANOSECONDS);
        nanoseconds.div_ceil(60_000_000_000).max(10)
    }

    fn passes_of(&self, shard: Shard) -> std::ops::Range<usize> {
        self.shards(shard.count)[shard.number as usize - 1].clone()
    }

    fn shards(&self, count: u32) -> Vec<std::ops::Range<usize>> {
        let pieces: Vec<Piece> = self.passes.iter().map(|pass| pass.piece).collect();
        balanced(&pieces, &self.expansions, count)
    }

    /// Every distinct point on every trace, grouped by pass; with `shard`, only its points.
    pub fn tasks(&self, plan: &Plan, shard: Option<Shard>) -> Vec<Task> {
        let distinct = groups(&plan.points);
        let range = shard.map_or(0..self.passes.len(), |shard| self.passes_of(shard));
        let mut tasks = Vec::new();
        for number in range {
            let pass = &self.passes[number];
            let cost = (pass.piece.cost + pass.expansion) / pass.groups.len() as u64;
            tasks.extend(pass.groups.iter().map(|&group| Task {
                subject: pass.subject,
                point: distinct[group][0],
                pass: number,
                cost,
            }));
        }
        tasks
    }
}

/// Cost per quad record of a pass that simulates `configs` configurations.
fn pass_cost(config: &RunConfig, configs: u64) -> u64 {
    let (part, of) = cost::FUNCTIONAL_PART;
    match config.tmu_model() {
        Some(TmuModel::Looping | TmuModel::PrefetchFifo) => cost::TIMED,
        Some(TmuModel::FirstMiss) => cost::FIRST_MISS,
        None => cost::FUNCTIONAL + cost::FUNCTIONAL * (configs - 1) * part / of,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::ExperimentFile;

    fn split(file: &str, records: &[u64]) -> (Plan, Split) {
        let plan = ExperimentFile::parse(file).unwrap().plan().unwrap();
        let split = Split::new(&plan, records);
        (plan, split)
    }

    fn shards(split: &Split, count: u32) -> Vec<Vec<Vec<usize>>> {
        (1..=count)
            .map(|number| split.shard(Shard { number, count }))
            .collect()
    }

    const FILE: &str = "[axes]\norder = [\"morton\", \"hilbert\", \"scanline\"]\nl1.size_bytes = [\"8KiB\", \"16KiB\", \"32KiB\"]\n\
                        [one-at-a-time]\nmode = [\"functional\"]\ncores = [4]\nlayout.block_order = [\"morton\"]\nseed = [1]\n";

    #[test]
    fn every_point_of_every_trace_is_in_exactly_one_shard() {
        let (plan, split) = split(FILE, &[1000, 50, 0]);
        // Changing the seed to its own value adds no points.
        let distinct = plan.points.len() - 9;
        for count in [1, 2, 3, 7, 40, 500] {
            let mut seen = vec![vec![0; distinct]; 3];
            for shard in shards(&split, count) {
                for (subject, groups) in shard.iter().enumerate() {
                    groups.iter().for_each(|&group| seen[subject][group] += 1);
                }
            }
            assert!(seen.iter().flatten().all(|&times| times == 1), "{count}");
        }
        let all = split.tasks(&plan, None);
        assert_eq!(all.len(), 3 * distinct);
        let of_shards: Vec<Task> = (1..=7)
            .flat_map(|number| split.tasks(&plan, Some(Shard { number, count: 7 })))
            .collect();
        assert_eq!(of_shards, all);
    }

    #[test]
    fn points_that_share_a_pass_stay_together() {
        let file = "[base]\nmode = \"functional\"\n[axes]\norder = [\"morton\", \"hilbert\"]\nl1.ways = [1, 2, 4, 8]\nl2.ways = [1, 2, 4, 8]\n";
        let (plan, split) = split(file, &[1000]);
        let sizes: Vec<usize> = shards(&split, 3)
            .iter()
            .map(|shard| shard[0].len())
            .collect();
        assert_eq!(sizes, [16, 16, 0]);
        let tasks = split.tasks(&plan, None);
        assert!(
            tasks
                .chunk_by(|a, b| a.pass == b.pass)
                .all(|pass| pass.len() == 16)
        );
    }

    #[test]
    fn estimates_grow_with_the_trace_and_shrink_with_more_shards() {
        let file = "[axes]\nseed = [1, 2, 3, 4, 5, 6, 7, 8]\n";
        let minutes = |records, count| split(file, &[records]).1.minutes(count);
        assert_eq!(minutes(1000, 1), 10);
        // 8 timed passes and one expansion of 10^9 records, in units of 1200 ns.
        assert_eq!(minutes(1_000_000_000, 1), (8 * 6 + 4) * 20);
        assert_eq!(minutes(1_000_000_000, 8), (6 + 4) * 20);
    }

    #[test]
    fn a_large_trace_gets_more_machines_than_a_small_one() {
        let (_, split) = split("[axes]\nseed = [1, 2, 3, 4, 5, 6, 7, 8]\n", &[900, 100]);
        let small = shards(&split, 5)
            .iter()
            .filter(|s| !s[1].is_empty())
            .count();
        assert_eq!(small, 1);
    }
}
