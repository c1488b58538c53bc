//! `levels inclusive|exclusive l1=N l2=N l3=N access=...`: look-ups of lines in three fully associative LRU
//! levels of so many lines, in functional mode. The word is the inclusion of the L3.

use super::Settings;
use replay::config::RunConfig;
use replay::memory::{Found, Hierarchy};

pub fn output(settings: &Settings) -> Vec<String> {
    let level = |name: &str, more: &str| {
        let lines = settings.number(name, 1);
        format!(
            "[[level]]\nsize_bytes = {}\nways = {lines}\n{more}\n",
            16 * lines
        )
    };
    let inclusion = format!("inclusion = \"{}\"", settings.subject);
    let text = [
        "mode = \"functional\"\ncores = 1\n".to_owned(),
        level("l1", ""),
        level("l2", ""),
        level("l3", &inclusion),
    ];
    let config: RunConfig = toml::from_str(&text.concat()).unwrap();
    config.validate().unwrap();
    let mut levels = Hierarchy::build(&config).unwrap();
    let mut invalidated = 0;
    let mut misses = 0;
    let accesses = settings.numbers("access").into_iter().map(|line| {
        let found = levels.access(0, line as u32);
        let result = levels.result();
        let below = result.lower_levels[0].line_misses;
        let place = match found {
            Found::L1 => "L1",
            Found::L2 => "L2",
            Found::Below if below == misses => "L3",
            Found::Below => "memory",
        };
        misses = below;
        let more = result.invalidated_lines.unwrap_or(0) - invalidated;
        invalidated += more;
        match more {
            0 => format!("{line} from {place}"),
            _ => format!("{line} from {place}, {more} invalidated"),
        }
    });
    accesses.collect()
}
