//! Runs the examples on golden traces.

#[path = "../examples/read_trace.rs"]
mod read_trace;

use formats::Textrace;
use std::path::Path;

#[test]
fn the_reader_counts_the_records_of_the_index() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../traces/atrium.textrace");
    let counts = read_trace::counts(&path).unwrap();
    let trace = Textrace::open(&path).unwrap();
    assert_eq!(counts.len(), trace.tables().passes.len());
    assert_eq!(counts.iter().map(|of| of[0]).sum::<u64>(), trace.records());
    assert!(
        counts
            .iter()
            .all(|[quads, fragments]| (*quads..=4 * quads).contains(fragments))
    );
}
