//! The traces at the start of the corpus: small ones of every encoding with every feature of the format.
//! `UPDATE_CORPUS=1` rewrites them.

use formats::raytrace::TraversalKind;
use formats::textrace::Encoding;
use parallax_tests::columns::{column_tables, column_trace_of};
use parallax_tests::traces;
use std::path::Path;

const SIZE_PX: [u32; 2] = [18, 5];

/// Names in the corpus, and bytes.
fn seeds() -> Vec<(String, Vec<u8>)> {
    let mut tables = traces::texture_tables();
    tables.meta.hmd.eye_size_px = SIZE_PX;
    tables.meta.command_line.truncate(1);
    // Both eyes, a shadow map, and a layer without an eye.
    tables.passes.truncate(4);
    for pass in &mut tables.passes {
        pass.size_px = SIZE_PX;
        pass.tiles = SIZE_PX.map(|size| size.div_ceil(16));
    }
    let mut seeds: Vec<(String, Vec<u8>)> = Encoding::ALL
        .into_iter()
        .map(|encoding| {
            let name = format!("textrace/{encoding:?}").to_lowercase();
            (name, traces::texture_trace_of(&tables, encoding, 5))
        })
        .collect();
    for (samples, has_visits) in [(1, true), (1, false), (2, true)] {
        let mut tables = traces::ray_tables(samples, has_visits);
        let size_px = [3, 2];
        tables.meta.trace.hmd.eye_size_px = size_px;
        for eye in &mut tables.meta.eyes {
            eye.size_px = size_px;
        }
        let visits = if has_visits { "-visits" } else { "" };
        let name = format!("raytrace/{samples}-samples{visits}");
        seeds.push((name, traces::ray_trace_of(&tables, 7)));
    }
    for traversal in TraversalKind::ALL {
        let mut tables = column_tables(1, traversal);
        let size_px = [3, 2];
        tables.meta.trace.hmd.eye_size_px = size_px;
        for eye in &mut tables.meta.eyes {
            eye.size_px = size_px;
        }
        let name = format!("raytrace/columns-{traversal:?}").to_lowercase();
        seeds.push((name, column_trace_of(&tables, 7)));
    }
    seeds
}

#[test]
fn the_corpus_begins_with_traces_of_every_kind() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (name, bytes) in seeds() {
        let path = corpus.join(name);
        if std::env::var_os("UPDATE_CORPUS").is_some() {
            let folder = path.parent().expect("a folder");
            std::fs::create_dir_all(folder).expect("a folder");
            std::fs::write(&path, &bytes).expect("a file");
        }
        let found = std::fs::read(&path).unwrap_or_default();
        assert!(
            found == bytes,
            "{}: UPDATE_CORPUS=1 writes it anew",
            path.display()
        );
    }
}
