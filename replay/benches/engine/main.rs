//! Measures each stage of a replay on one core, and compares it with the machine's memory bandwidth (the
//! roofline) and with a plain LRU loop over the same lines in a mapped file (the yardstick).
//! `docs/results/costs.md` explains the table.
//!
//! `cargo bench -p replay --bench engine [-- TRACE]`, or `TEXTRACE=file make bench`.

mod bandwidth;
mod plain_lru;
mod stages;
mod table;

use formats::textrace::Textrace;
use std::path::PathBuf;

/// A golden trace, which exists without a capture.
const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../traces/jungle.textrace");

fn main() {
    let given = std::env::args().skip(1).find(|arg| !arg.starts_with('-'));
    let path = given.map(PathBuf::from);
    let path = path.or_else(|| std::env::var_os("TEXTRACE").map(PathBuf::from));
    let path = path.unwrap_or_else(|| GOLDEN.into());
    let trace = match Textrace::open(&path) {
        Ok(trace) => trace,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            std::process::exit(2);
        }
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let rows = one
        .expect("a pool of one thread starts")
        .install(|| stages::measure(&trace));
    println!("{}, one core", path.display());
    table::print(bandwidth::bytes_per_second(), &rows);
}
