//! A replacement policy of its own: evicts the ways of a set in turn.

use formats::Textrace;
use sim::config::{Mode, RunConfig};
use sim::memory::{Policy, Replacement};
use std::error::Error;
use std::path::Path;

struct InTurn {
    ways: u32,
    next: Vec<u32>,
}

impl Policy for InTurn {
    fn hit(&mut self, _set: u32, _way: u32, _line: u32) {}

    fn fill(&mut self, set: u32, way: u32, _line: u32) {
        self.next[set as usize] = (way + 1) % self.ways;
    }

    fn victim(&mut self, set: u32) -> u32 {
        self.next[set as usize]
    }
}

/// Line misses of the first level with this policy.
pub fn line_misses(path: &Path) -> Result<u64, Box<dyn Error>> {
    let make = |sets: u32, ways| -> Box<dyn Policy> {
        let next = vec![0; sets as usize];
        Box::new(InTurn { ways, next })
    };
    let mut config = RunConfig {
        mode: Mode::Functional,
        ..RunConfig::default()
    };
    config.level.l1.replacement = Replacement::own("in-turn@example", Box::new(make));
    let result = sim::replay(&Textrace::open(path)?, &config)?;
    Ok(result.l1.counters.line_misses)
}

#[allow(dead_code, reason = "a test runs the function above")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected FILE.textrace")?;
    println!("{} line misses", line_misses(Path::new(&path))?);
    Ok(())
}
