//! Optional columns of ray traces that FORMAT.md forbids are refused despite valid checksums.

use formats::Trace;
use formats::raytrace::TraversalKind;
use parallax_tests::columns::column_trace;
use parallax_tests::repair::{Parts, validate};
use serde_json::json;

fn refuse(expected: &str, change: impl FnOnce(&mut Parts)) {
    let mut parts = Parts::of(&column_trace(TraversalKind::Bvh2, 7));
    change(&mut parts);
    let outcome = Trace::from_bytes(parts.sealed()).and_then(|trace| validate(&trace));
    match outcome.map_err(|error| error.to_string()) {
        Ok(()) => panic!("accepted; expected {expected:?}"),
        Err(text) => assert!(text.contains(expected), "no {expected:?} in: {text}"),
    }
}

/// Changes the geometry of the first tile.
fn refuse_tile(expected: &str, change: impl FnOnce(&mut Vec<u8>)) {
    refuse(expected, |parts| {
        let mut tiles = parts.tiles_of(1);
        change(&mut tiles[0]);
        parts.set_tiles_of(1, &tiles);
    });
}

#[test]
fn chunks_that_belong_together_are_there_together() {
    for tag in [b"RGEO", b"RGIX", b"RNOD", b"RSLT"] {
        let name = String::from_utf8_lossy(tag).into_owned();
        refuse(&format!("an entry for chunk {name}"), |parts| {
            parts.chunks.retain(|(other, _)| other != tag);
        });
    }
    refuse("version 1.3 for this chunk", |parts| parts.minor = 2);
}

#[test]
fn the_geometry_of_every_tile_is_there_and_in_place() {
    refuse("16 bytes for each of 12 tiles", |parts| {
        parts.chunk(b"RGIX").truncate(11 * 16);
    });
    refuse("offset 0", |parts| parts.put(b"RGIX", 0, &[1]));
    refuse("tiles that fill", |parts| parts.chunk(b"RGEO").push(0));
    refuse_tile("2 bytes or more for each of", |tile| tile.truncate(99));
    refuse_tile("the end", |tile| tile.push(0));
    refuse_tile("the depth of a stack", |tile| {
        tile.pop();
    });
}

#[test]
fn flags_and_values_of_rays_are_checked() {
    // The first ray is a primary one: its flags are the first byte.
    refuse_tile("flags of a ray of its kind and outcome", |tile| {
        tile[0] |= 1 << 6
    });
    refuse_tile("flags of a ray of its kind and outcome", |tile| {
        tile[0] |= 1 << 4
    });
}

#[test]
fn counts_are_checked_before_any_allocation() {
    refuse("nodes, for which there are bytes", |parts| {
        parts.edit(b"RBVH", |bvh| bvh["nodes"] = json!(4_000_000_000_u32));
    });
    refuse("triangles, for which there are bytes", |parts| {
        parts.edit(b"RBVH", |bvh| bvh["triangles"] = json!(4_000_000_000_u32));
    });
}

#[test]
fn the_hierarchy_is_a_tree_over_all_slots() {
    refuse("64 leaves", |parts| {
        parts.edit(b"RBVH", |bvh| bvh["leaves"] = json!(64));
    });
    refuse("a child of kind 0 to 2", |parts| {
        parts.chunk(b"RNOD")[0] = 3
    });
    refuse("a node behind its parent and of no other", |parts| {
        // The first child of the root is the root.
        parts.chunk(b"RNOD")[0] = 1;
    });
    refuse("the end", |parts| parts.chunk(b"RNOD").push(0));
    refuse("the end", |parts| parts.chunk(b"RSLT").push(0));
    refuse("a vertex at most 0 back", |parts| {
        // The first triangle's number takes a byte, then comes its first vertex.
        parts.chunk(b"RSLT")[1] = 1;
    });
}
