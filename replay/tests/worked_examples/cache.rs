//! `cache POLICY sets=N ways=N access=...`: look-ups of lines in one cache, each missing line filled at once.

use super::Settings;
use replay::config::LevelConfig;
use replay::memory::{AnyCache, Replacement};

pub fn output(settings: &Settings) -> Vec<String> {
    let replacement =
        Replacement::by_name(&settings.subject).unwrap_or_else(|why| panic!("{why:?}"));
    let (sets, ways) = (settings.number("sets", 1), settings.number("ways", 2));
    let config = LevelConfig {
        ways: ways as u32,
        replacement,
        victim_lines: settings.number("victim_lines", 0) as u32,
        ..LevelConfig::lru(16 * sets * ways)
    };
    let seed = settings.number("seed", 1);
    let mut cache = AnyCache::build(&config, "L1", 16, seed).unwrap().into_box();
    let accesses = settings.numbers("access").into_iter().map(|line| {
        let line = line as u32;
        if cache.lookup(line) {
            return format!("{line} hit");
        }
        match cache.fill(line) {
            u32::MAX => format!("{line} miss"),
            evicted => format!("{line} miss, {evicted} leaves"),
        }
    });
    accesses.collect()
}
