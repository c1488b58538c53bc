//! Equal tiles, whose bytes are stored once, and passes that repeat all tiles of an earlier one.
#![deny(clippy::cast_possible_truncation)]

use super::Pass;
use super::index::IndexEntry;
use crate::tiles::TileSpan;
use std::collections::HashMap;
use xxhash_rust::xxh3::xxh3_128;

/// How often an index has the entries of one pass for other passes. It bounds the tiles that a small file can
/// claim to have.
pub(super) const MOST_REPEATS: u32 = 63;

/// Size of a pass's number at the start of the index.
pub(super) const REPEAT_BYTES: usize = 4;

/// The tiles stored so far, by their bytes. Equal hashes of 128 bits mean equal bytes: a file's content is its
/// writer's own, and accidental collisions do not occur.
#[derive(Debug, Default)]
pub(super) struct StoredTiles {
    entries: HashMap<u128, IndexEntry>,
    shared: u64,
}

impl StoredTiles {
    /// The entry of a tile: that of the equal tile stored before it, or else `new`, which is stored.
    pub(super) fn entry(&mut self, bytes: &[u8], new: IndexEntry) -> IndexEntry {
        let known = *self.entries.entry(xxh3_128(bytes)).or_insert(new);
        let place = TileSpan {
            offset: known.span.offset,
            ..new.span
        };
        let same = IndexEntry { span: place, ..new };
        if known != same || known == new {
            return new;
        }
        self.shared += 1;
        known
    }

    /// True if a tile has the bytes of an earlier one.
    pub(super) fn has_shared(&self) -> bool {
        self.shared > 0
    }
}

/// Tile columns, tile rows and entries of a pass.
type PassIndex<'i> = ([u32; 2], &'i [IndexEntry]);

/// For each pass the earlier pass whose entries it repeats, or its own number.
pub(super) fn repeated_passes(passes: &[Pass], index: &[IndexEntry]) -> Vec<u32> {
    // The last pass with entries of its own, and its repeats so far.
    let mut known: HashMap<PassIndex<'_>, (u32, u32)> = HashMap::new();
    let mut rest = index;
    let mut repeat = |(number, pass): (u32, &Pass)| {
        let entries = rest
            .split_off(..pass.tile_count() as usize)
            .unwrap_or_default();
        let (of, repeats) = known.entry((pass.tiles, entries)).or_insert((number, 0));
        if *of != number && *repeats == MOST_REPEATS {
            (*of, *repeats) = (number, 0);
        }
        *repeats += u32::from(*of != number);
        *of
    };
    (0..).zip(passes).map(&mut repeat).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::{Container, ContainerWriter, Kind};
    use crate::textrace::tests::{tables, tile};
    use crate::textrace::{
        Encoding, INDEX_ENTRY_BYTES, TILE_INDEX, TILES, Tables, Textrace, TextraceWriter, Tile,
    };
    use proptest::prelude::*;

    /// Tables of stereo frames.
    fn tables_of(frames: u32) -> Tables {
        let mut all = tables();
        let (views, passes) = (all.meta.frames[0].clone(), all.passes.clone());
        all.passes.clear();
        all.meta.frames.clear();
        for frame in 0..frames {
            let of_frame = passes.iter().map(|pass| Pass { frame, ..*pass });
            all.passes.extend(of_frame);
            let mut views = views.clone();
            views.frame = frame;
            all.meta.frames.push(views);
        }
        all
    }

    /// Writes a trace whose pass `p` has the tiles `passes[p]`.
    fn write(passes: &[Vec<Tile>], growing: bool) -> Vec<u8> {
        let tables = tables_of(u32::try_from(passes.len() / 2).unwrap());
        let mut writer = match growing {
            false => TextraceWriter::in_memory(&tables).unwrap(),
            true => TextraceWriter::growing_in_memory().unwrap(),
        };
        if growing {
            for draw in &tables.draws {
                writer.add_draw(draw.clone()).unwrap();
            }
        }
        let mut writer = writer.with_encoding(Encoding::Planes);
        for (number, tiles) in passes.iter().enumerate() {
            if growing {
                writer.add_pass(tables.passes[number]).unwrap();
            }
            for (index, tile) in tiles.iter().enumerate() {
                writer.write_tile(number, index, tile).unwrap();
            }
        }
        if growing {
            for texture in &tables.textures {
                writer.add_texture(texture.clone()).unwrap();
            }
            for sampler in &tables.samplers {
                writer.add_sampler(*sampler).unwrap();
            }
            writer.set_meta(tables.meta.clone()).unwrap();
        }
        writer.into_bytes().unwrap()
    }

    fn check(trace: &Textrace, passes: &[Vec<Tile>]) {
        let mut found = Tile::default();
        for (number, tiles) in passes.iter().enumerate() {
            for (index, tile) in tiles.iter().enumerate() {
                trace.decode_tile(number, index, &mut found).unwrap();
                assert_eq!(found, *tile, "pass {number}, tile {index}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn equal_frames_are_stored_once_and_read_back(
            left in prop::collection::vec(tile(), 6..=6),
            right in prop::collection::vec(tile(), 6..=6),
            other in prop::collection::vec(tile(), 6..=6),
            frames in 2_usize..70,
            growing: bool,
        ) {
            let frame = [left.clone(), right.clone()];
            let one = write(&frame, growing);
            let mut passes: Vec<Vec<Tile>> = (0..frames).flat_map(|_| frame.clone()).collect();
            passes.extend([left.clone(), other.clone()]);
            let trace = Textrace::from_bytes(write(&passes, growing)).unwrap();
            check(&trace, &passes);
            let touched = |tiles: &[Tile]| tiles.iter().filter(|tile| !tile.records.is_empty()).count();
            let distinct: std::collections::BTreeSet<Vec<u8>> = (passes.iter().flatten())
                .filter(|tile| !tile.records.is_empty())
                .map(crate::textrace::planes::encode)
                .collect();
            let all: usize = passes.iter().map(|tiles| touched(tiles)).sum();
            prop_assert_eq!(trace.shared_tiles(), (all - distinct.len()) as u64);
            if all == distinct.len() {
                return Ok(());
            }
            prop_assert_eq!(trace.container().version(), (if growing { 5 } else { 4 }, 0));
            for pass in 0..passes.len() {
                prop_assert!(trace.has_same_tiles(pass, pass % 2) || pass + 1 == passes.len());
            }
            prop_assert_eq!(trace.has_same_tiles(passes.len() - 1, 1), other == right);
            // Passes that repeat another one add four bytes to the index.
            let with_entries = 2 * frames.div_ceil(1 + MOST_REPEATS as usize) + 2;
            let least = 4 * passes.len() + 6 * INDEX_ENTRY_BYTES;
            let most = 4 * passes.len() + 6 * with_entries * INDEX_ENTRY_BYTES;
            let index = trace.container().chunk(TILE_INDEX).unwrap().len();
            prop_assert!((least..=most).contains(&index), "{} of {}", index, most);
            let one = Textrace::from_bytes(one).unwrap();
            let bytes_of = |trace: &Textrace| trace.container().chunk(TILES).unwrap().len();
            prop_assert!(bytes_of(&trace) >= bytes_of(&one));
        }
    }

    /// A trace of two equal frames of one touched tile in each eye, with a changed index.
    fn with_index(change: impl FnOnce(&mut Vec<u8>)) -> Result<Textrace, String> {
        let tables = tables();
        let touched = |primitive| {
            let mut tile = Tile::default();
            let record = crate::textrace::QuadRecord {
                mask: 15,
                ..Default::default()
            };
            tile.push_run(primitive, primitive / 1000, [record]);
            tile
        };
        let pass = |primitive| {
            let mut tiles = vec![Tile::default(); tables.passes[0].tile_count() as usize];
            tiles[0] = touched(primitive);
            // The second tile shares the bytes of the first one of the same pass.
            tiles[1] = touched(primitive);
            tiles
        };
        let frame = [pass(5), pass(2005)];
        let bytes = write(&[frame.clone(), frame].concat(), false);
        let container = Container::from_bytes(bytes).unwrap();
        let mut writer = ContainerWriter::in_memory(Kind::Textrace).unwrap();
        let mut change = Some(change);
        for entry in container.directory() {
            let mut chunk = container.chunk(entry.tag).unwrap().to_vec();
            if entry.tag == TILE_INDEX {
                change.take().unwrap()(&mut chunk);
            }
            writer.chunk(entry.tag, &chunk).unwrap();
        }
        writer.set_major(container.version().0);
        let bytes = writer.into_bytes().unwrap();
        Textrace::from_bytes(bytes).map_err(|error| error.to_string())
    }

    #[test]
    fn an_index_that_shares_wrongly_is_refused_with_its_place() {
        /// Start of the entries, after four numbers of passes.
        const FIRST: usize = 16;
        assert_eq!(with_index(|_| ()).unwrap().shared_tiles(), 6);
        let put = |at: usize, value: u32| {
            move |index: &mut Vec<u8>| index[at..at + 4].copy_from_slice(&value.to_le_bytes())
        };
        let entry = |slot: usize| FIRST + slot * INDEX_ENTRY_BYTES;
        type Change = Box<dyn FnOnce(&mut Vec<u8>)>;
        let refused: [(Change, &str); 10] = [
            // Entries that overlap a stored tile in part, lie outside, or share with other facts.
            (
                Box::new(put(entry(1), 1)),
                "the whole entry of an earlier tile, found 1",
            ),
            (
                Box::new(put(entry(1), 1 << 30)),
                "the whole entry of an earlier tile",
            ),
            (Box::new(put(entry(1) + 8, 1)), "expected"),
            (
                Box::new(put(entry(1) + 12, 0)),
                "the whole entry of an earlier tile, found 0",
            ),
            (
                Box::new(put(entry(1) + 24, 1)),
                "the whole entry of an earlier tile, found 0",
            ),
            // Passes that repeat a later one, one that has no entries, or none.
            (
                Box::new(put(0, 1)),
                "its own number or that of an earlier pass",
            ),
            (
                Box::new(put(12, 2)),
                "its own number or that of an earlier pass",
            ),
            (
                Box::new(put(8, u32::MAX)),
                "its own number or that of an earlier pass",
            ),
            (Box::new(put(8, 2)), "for each of 18 tiles"),
            (
                Box::new(|index| index.truncate(9)),
                "a pass's number for each pass",
            ),
        ];
        for (number, (change, expected)) in refused.into_iter().enumerate() {
            let error = with_index(change).expect_err(expected);
            assert!(error.contains(expected), "{number}: {error}");
            assert!(error.contains("TIDX"), "{number}: {error}");
        }
        // The tile of another pass is shared like one of the same pass.
        let shared = with_index(|index| {
            let first: Vec<u8> = index[entry(0)..entry(1)].to_vec();
            index[entry(2)..entry(3)].copy_from_slice(&first);
        });
        assert_eq!(shared.unwrap().shared_tiles(), 8);
    }
}
