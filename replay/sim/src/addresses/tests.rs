use super::*;
use crate::config::{LevelConfig, Levels, Replacement};
use crate::engine::{LineOutcome, Misses};
use formats::interop::plain::{AccessKind, AddressForm, PlainAccess, PlainForm, PlainWriter};
use formats::random::Random;
use std::collections::{HashSet, VecDeque};

/// Accesses that stay near, jump, repeat and straddle lines, far apart in 64 bits.
fn accesses(count: u64) -> Vec<PlainAccess> {
    let (mut numbers, mut address) = (Random(7), 0_u64);
    let access = |_| {
        let random = numbers.bits() >> 33;
        address = match random % 16 {
            0 => (random >> 8 & 0x7fff) + ((random >> 4 & 3) << 44),
            1..9 => address + (random >> 4 & 0x1ff),
            _ => address,
        };
        PlainAccess {
            address,
            bytes: 1 + (random >> 9 & 63) as u32,
            kind: match random >> 20 & 7 {
                0 => AccessKind::Fetch,
                1 | 2 => AccessKind::Write,
                _ => AccessKind::Read,
            },
        }
    };
    (0..count).map(access).collect()
}

fn file(accesses: &[PlainAccess]) -> AddressFile<'static> {
    let mut writer = PlainWriter::new(PlainForm::Gem5, Vec::new()).unwrap();
    for access in accesses {
        writer.access(access).unwrap();
    }
    let bytes = std::io::Cursor::new(writer.into_inner());
    AddressFile::of_stream("x".to_owned(), Some(AddressForm::Gem5), bytes).unwrap()
}

fn config(line_bytes: u32, l1: (u64, u32), l2: (u64, u32), policy: Replacement) -> RunConfig {
    let cache = |(size_bytes, ways)| LevelConfig {
        ways,
        replacement: policy,
        ..LevelConfig::lru(size_bytes)
    };
    RunConfig {
        line_bytes,
        level: Levels::two(cache(l1), cache(l2)),
        ..RunConfig::default()
    }
}

/// Sets as lists, newest first: LRU, or FIFO if hits do not count as use.
struct Plain {
    sets: Vec<VecDeque<u64>>,
    ways: usize,
    hits_are_use: bool,
}

impl Plain {
    fn new(cache: &LevelConfig, line_bytes: u32) -> Self {
        let sets = cache.size_bytes / u64::from(cache.ways * line_bytes);
        Self {
            sets: vec![VecDeque::new(); sets as usize],
            ways: cache.ways as usize,
            hits_are_use: cache.replacement == Replacement::LRU,
        }
    }

    fn misses(&mut self, line: u64) -> bool {
        let index = line % self.sets.len() as u64;
        let set = &mut self.sets[index as usize];
        match set.iter().position(|&there| there == line) {
            Some(at) if self.hits_are_use => {
                set.remove(at);
            }
            Some(_) => return false,
            None => {
                set.truncate(self.ways - 1);
                set.push_front(line);
                return true;
            }
        }
        set.push_front(line);
        false
    }
}

/// Look-ups and misses by kind, and distinct lines, computed in the plainest way.
fn plainly(accesses: &[PlainAccess], config: &RunConfig) -> (Point, u64) {
    let mut l1 = Plain::new(&config.level.l1, config.line_bytes);
    let mut l2 = Plain::new(&config.level.l2, config.line_bytes);
    let (mut totals, mut misses, mut seen) = (Totals::default(), [[0; 3]; 2], HashSet::new());
    for access in accesses {
        let bytes = u64::from(config.line_bytes);
        let last = access.address + u64::from(access.bytes) - 1;
        for line in access.address / bytes..=last / bytes {
            let kind = access.kind as usize;
            totals.lookups[kind] += 1;
            seen.insert(line);
            if l1.misses(line) {
                misses[0][kind] += 1;
                misses[1][kind] += u64::from(l2.misses(line));
            }
        }
    }
    let of_kind = |kind: usize| {
        [0, 1].map(|level: usize| Misses {
            lines: misses[level][kind],
            ..Misses::default()
        })
    };
    let outcome = LineOutcome {
        misses: (0..3).map(of_kind).collect(),
        ..LineOutcome::default()
    };
    (Point::new(config, &totals, outcome), seen.len() as u64)
}

#[test]
fn counts_of_one_configuration_equal_those_of_plain_lists() {
    let all = accesses(30_000);
    for (line_bytes, l1, l2, policy) in [
        (16, (2048, 4), (16 << 10, 4), Replacement::LRU),
        (64, (2048, 2), (8192, 8), Replacement::LRU),
        (64, (1024, 1), (4096, 16), Replacement::LRU),
        (32, (1024, 4), (8192, 4), Replacement::FIFO),
        (16, (48, 3), (16 * 5 * 8, 5), Replacement::FIFO),
    ] {
        let config = config(line_bytes, l1, l2, policy);
        let outcome = replay(file(&all), &[config], KindSet::ALL).unwrap();
        let (point, unique) = plainly(&all, &config);
        assert_eq!(outcome.points, std::slice::from_ref(&point));
        assert_eq!(outcome.unique_lines, unique);
        assert!(point.l2.line_misses() > unique && point.l2.misses.iter().all(|&m| m > 0));
    }
}

#[test]
fn configurations_in_one_pass_have_the_counts_of_separate_replays() {
    let all = accesses(30_000);
    let mut configs = Vec::new();
    for l1 in [(1024, 4), (2048, 4), (2048, 2), (512, 1), (1024, 8)] {
        for l2 in [(4096, 4), (8192, 4), (8192, 16), (2048, 1)] {
            configs.push(config(32, l1, l2, Replacement::LRU));
        }
    }
    // The same geometry with other policies is not part of the shared pass.
    for policy in [
        Replacement::FIFO,
        Replacement::TREE_PLRU,
        Replacement::RANDOM,
    ] {
        configs.push(config(32, (1024, 4), (4096, 4), policy));
    }
    let together = replay(file(&all), &configs, KindSet::ALL).unwrap();
    assert_eq!(together.points.len(), configs.len());
    for (config, point) in configs.iter().zip(&together.points) {
        let alone = replay(file(&all), &[*config], KindSet::ALL).unwrap();
        assert_eq!(alone.points, std::slice::from_ref(point));
        assert_eq!(alone.unique_lines, together.unique_lines);
    }
    let policies: HashSet<u64> = together.points[20..]
        .iter()
        .map(|p| p.l1.line_misses())
        .collect();
    assert_eq!(policies.len(), 3, "the policies differ");
}

#[test]
fn kinds_that_are_not_selected_are_skipped_and_counted() {
    let all = accesses(5000);
    let config = config(32, (1024, 4), (4096, 4), Replacement::LRU);
    let wanted = KindSet::of(&[AccessKind::Read, AccessKind::Write]);
    let outcome = replay(file(&all), &[config], wanted).unwrap();
    let data: Vec<PlainAccess> = all
        .iter()
        .copied()
        .filter(|a| a.kind != AccessKind::Fetch)
        .collect();
    assert_eq!(outcome.points, [plainly(&data, &config).0]);
    assert_eq!(outcome.totals.left_out, (all.len() - data.len()) as u64);
    let error = replay(file(&data), &[config], KindSet::of(&[AccessKind::Fetch])).unwrap_err();
    assert!(error.to_string().contains("--kinds"), "{error}");
}

#[test]
fn lines_are_passed_to_the_caller_with_all_repeats() {
    let all = accesses(10_000);
    let (mut lines, mut blocks) = (Vec::new(), 0);
    let totals = for_lines(file(&all), 64, 1 << 12, |block| {
        assert!(!block.is_empty() && block.len() <= 4096);
        lines.extend_from_slice(block);
        blocks += 1;
    });
    let expected = all.iter().flat_map(|access| {
        let last = access.address + u64::from(access.bytes) - 1;
        access.address / 64..=last / 64
    });
    let expected: Vec<u64> = expected.collect();
    assert_eq!(
        totals.unwrap().lookups.iter().sum::<u64>(),
        lines.len() as u64
    );
    assert_eq!(lines.len(), expected.len());
    assert!(blocks > 1);
    let pairs: HashSet<(u64, u32)> = expected
        .iter()
        .copied()
        .zip(lines.iter().copied())
        .collect();
    let names: HashSet<u32> = lines.iter().copied().collect();
    let distinct: HashSet<u64> = expected.iter().copied().collect();
    assert_eq!((pairs.len(), names.len()), (distinct.len(), distinct.len()));
    assert!(
        expected
            .iter()
            .zip(&lines)
            .all(|(line, name)| line % 4096 == u64::from(name % 4096))
    );
}

#[test]
fn too_many_ranges_are_refused_with_the_limit() {
    let spread: Vec<PlainAccess> = (0..300).map(|i| PlainAccess::read(i << 40, 1)).collect();
    let config = config(16, (16 << 24, 1), (16 << 24, 1), Replacement::LRU);
    let error = replay(file(&spread), &[config], KindSet::ALL).unwrap_err();
    let expected = "x: expected accesses to at most 255 ranges of 268435456 bytes, found more";
    assert!(error.to_string().starts_with(expected), "{error}");
}

#[test]
fn an_impossible_cache_is_refused() {
    let config = config(16, (1000, 4), (4096, 4), Replacement::LRU);
    let error = replay(file(&accesses(1)), &[config], KindSet::ALL).unwrap_err();
    assert!(matches!(error, AddressError::Config(_)), "{error}");
}
