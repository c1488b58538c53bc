//! Both kinds of traces: valid ones can be replayed, and are unchanged when written and read again.

use crate::Change;
use formats::Trace;
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile};
use parallax_tests::exercise::exercise;
use parallax_tests::repair::{Parts, repair_header};
use parallax_tests::traces::Random;

/// Reads a trace, replays it and writes it again.
pub fn run(bytes: &[u8]) {
    if !exercise(bytes.to_vec()) {
        return;
    }
    match Trace::from_bytes(bytes.to_vec()) {
        Ok(Trace::Texture(trace)) => {
            for encoding in Encoding::ALL {
                rewritten(&trace, encoding);
            }
        }
        Ok(Trace::Ray(_)) => {}
        Err(error) => panic!("it was read before: {error}"),
    }
}

/// Checks that a trace written with an encoding has the same tiles.
fn rewritten(trace: &Textrace, encoding: Encoding) {
    let tables = trace.tables();
    let mut tile = Tile::default();
    let slots = || {
        let passes = tables.passes.iter().enumerate();
        passes
            .flat_map(|(pass, info)| (0..info.tile_count() as usize).map(move |slot| (pass, slot)))
    };
    let mut writer = TextraceWriter::in_memory(tables).expect("the tables were read");
    for (pass, slot) in slots() {
        trace
            .decode_tile(pass, slot, &mut tile)
            .expect("it was decoded before");
        if tile.records.is_empty() {
            continue;
        }
        let encoded = formats::textrace::encode_tile_as(encoding, tables, &tile);
        let encoded = encoded.expect("what was decoded can be encoded");
        writer.append(pass, slot, encoded).expect("in order");
    }
    let bytes = writer.into_bytes().expect("in memory");
    let again = Textrace::from_bytes(bytes).expect("what was written is read");
    let mut other = Tile::default();
    for (pass, slot) in slots() {
        trace
            .decode_tile(pass, slot, &mut tile)
            .expect("it was decoded before");
        again
            .decode_tile(pass, slot, &mut other)
            .expect("what was written is decoded");
        assert!(
            tile == other,
            "tile {slot} of pass {pass} as {encoding:?} differs"
        );
    }
}

/// Changes a chunk, a tile or the container, and corrects offsets, lengths and checksums.
pub fn mutate(bytes: &[u8], most_bytes: usize, seed: u32, change: Change<'_>) -> Vec<u8> {
    let mut random = Random(u64::from(seed));
    let parts = match random.below(8) {
        0 => None,
        _ => Parts::read(bytes).ok().filter(|p| !p.chunks.is_empty()),
    };
    let Some(mut parts) = parts else {
        let mut bytes = bytes.to_vec();
        change(&mut bytes, most_bytes);
        repair_header(&mut bytes);
        return bytes;
    };
    let room = most_bytes.saturating_sub(bytes.len());
    let family = random.below(parts.family_count());
    let mut tiles = parts.tiles_of(family);
    let full: Vec<usize> = (0..tiles.len()).filter(|i| !tiles[*i].is_empty()).collect();
    if random.below(2) == 0 && !full.is_empty() {
        let tile = &mut tiles[full[random.below(full.len() as u32) as usize]];
        let most = tile.len() + room;
        change(tile, most);
        parts.set_tiles_of(family, &tiles);
    } else {
        let chunk = random.below(parts.chunks.len() as u32) as usize;
        let chunk = &mut parts.chunks[chunk].1;
        let most = chunk.len() + room;
        change(chunk, most.max(1));
        parts.repair_tiles();
    }
    parts.sealed()
}
