//! A tile order of its own: all tiles of the left view column by column, then those of the right view.

use formats::Textrace;
use sim::config::{Mode, Order, RunConfig};
use sim::order::curve::Curve;
use sim::order::parts::Parts;
use sim::order::{Listed, Views, WorkItem, frames, views};
use std::error::Error;
use std::path::Path;

/// Line look-ups and misses of the first level in this order.
pub fn lookups_and_misses(path: &Path) -> Result<[u64; 2], Box<dyn Error>> {
    let trace = Textrace::open(path)?;
    let passes = &trace.tables().passes;
    let mut listed = Listed::default();
    for phase in frames(passes)
        .into_iter()
        .flat_map(|frame| views(passes, frame))
    {
        let Views::Pair(left, right) = phase else {
            continue;
        };
        let mut items = Vec::new();
        for view in [left, right] {
            let [columns, rows] = view.tiles;
            let places = (0..columns).flat_map(|x| (0..rows).map(move |y| [x, y]));
            items.extend(places.filter_map(|at| view.tile(at)).map(WorkItem::Tile));
        }
        listed.pairs.push((left.pass, items));
    }
    let config = RunConfig {
        mode: Mode::Functional,
        order: Order::own("columns@example", Parts::of(Curve::MORTON), listed),
        ..RunConfig::default()
    };
    let counters = sim::replay(&trace, &config)?.l1.counters;
    Ok([counters.line_lookups, counters.line_misses])
}

#[allow(dead_code, reason = "a test runs the function above")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected FILE.textrace")?;
    let [lookups, misses] = lookups_and_misses(Path::new(&path))?;
    println!("{misses} misses of {lookups} line look-ups");
    Ok(())
}
