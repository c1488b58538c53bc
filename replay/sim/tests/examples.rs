//! Runs the examples on a golden trace, and compares them with what the crate has.

#[path = "../examples/own_order.rs"]
mod own_order;
#[path = "../examples/own_policy.rs"]
mod own_policy;

use formats::Textrace;
use sim::config::{Mode, Replacement, RunConfig};
use std::path::PathBuf;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../traces/atrium.textrace")
}

fn functional() -> RunConfig {
    RunConfig {
        mode: Mode::Functional,
        ..RunConfig::default()
    }
}

#[test]
fn ways_in_turn_are_first_in_first_out() {
    let mut config = functional();
    config.level.l1.replacement = Replacement::find("fifo").unwrap();
    let trace = Textrace::open(&path()).unwrap();
    let fifo = sim::replay(&trace, &config).unwrap();
    assert_eq!(
        own_policy::line_misses(&path()).unwrap(),
        fifo.l1.counters.line_misses
    );
}

#[test]
fn the_own_order_looks_up_the_same_lines_as_another_one() {
    let trace = Textrace::open(&path()).unwrap();
    let other = sim::replay(&trace, &functional()).unwrap().l1.counters;
    let [lookups, misses] = own_order::lookups_and_misses(&path()).unwrap();
    assert_eq!(lookups, other.line_lookups);
    assert!(misses > 0 && misses != other.line_misses);
}
