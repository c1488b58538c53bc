//! The primitives in each tile of a view.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::error::{Broken, ensure};
use crate::parse::{Cursor, Parsed, Taken};
use crate::textrace::{Draw, PrimitiveRun, Tile};
use crate::varint::put;

/// The draws of a view, and the primitives in each tile before any depth test.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TileLists {
    /// Draws that the view submits, ascending.
    pub draws: Vec<u32>,
    /// Primitives of tile `t`: `primitives[starts[t]..starts[t + 1]]`; has one entry more than there are
    /// tiles.
    pub starts: Vec<u32>,
    /// Primitive numbers, ascending in each tile.
    pub primitives: Vec<u32>,
}

impl TileLists {
    /// The primitives of a tile; empty if there is no such tile.
    pub fn tile(&self, tile: usize) -> &[u32] {
        let range = self.starts.get(tile).zip(self.starts.get(tile + 1));
        range
            .and_then(|(&first, &end)| self.primitives.get(first as usize..end as usize))
            .unwrap_or_default()
    }

    /// Checks that every primitive with records in a tile is in the tile's list.
    ///
    /// # Errors
    /// The first primitive that is not.
    pub fn check_records(&self, tile: usize, records: &Tile) -> Result<(), Broken> {
        let list = self.tile(tile);
        let missing = |run: &&PrimitiveRun| list.binary_search(&run.primitive).is_err();
        match records.runs.iter().find(missing) {
            None => Ok(()),
            Some(run) => Err(Broken::new(
                format!("primitive list of tile {tile}"),
                "every primitive that has records in the tile",
                format_args!("none of primitive {}", run.primitive),
            )),
        }
    }

    /// Checks the lists against the draws and the number of tiles.
    pub(super) fn check(&self, draws: &[Draw], tiles: usize) -> Result<(), Broken> {
        let known = self.draws.is_sorted_by(|a, b| a < b)
            && self
                .draws
                .last()
                .is_none_or(|draw| (*draw as usize) < draws.len());
        let expected = format_args!("ascending numbers below {}", draws.len());
        ensure(known, "draws of a view", expected, "others")?;
        let whole = self.starts.len() == tiles + 1
            && self.starts.first() == Some(&0)
            && self.starts.is_sorted()
            && self.starts.last().map(|end| *end as usize) == Some(self.primitives.len());
        let expected = format_args!("one for each of {tiles} tiles");
        ensure(whole, "primitive lists", expected, self.starts.len())?;
        let ranges: Vec<std::ops::Range<u32>> = (self.draws.iter())
            .filter_map(|draw| draws.get(*draw as usize))
            .map(|draw| draw.first_primitive..draw.first_primitive.saturating_add(draw.primitives))
            .collect();
        let mut draw = 0..0;
        for tile in 0..tiles {
            let list = self.tile(tile);
            let ascending = list.is_sorted_by(|a, b| a < b);
            let drawn = list.iter().all(|primitive| {
                if !draw.contains(primitive) {
                    let behind = ranges.partition_point(|range| range.start <= *primitive);
                    draw = ranges.get(behind.wrapping_sub(1)).cloned().unwrap_or(0..0);
                }
                draw.contains(primitive)
            });
            ensure(
                ascending && drawn,
                format_args!("primitive list of tile {tile}"),
                "ascending primitives of the view's draws",
                format_args!("{:?}", list.get(..8).unwrap_or(list)),
            )?;
        }
        Ok(())
    }

    /// Appends the lists in their stored form.
    pub(super) fn encode(&self, bytes: &mut Vec<u8>) {
        let ascending = |list: &[u32], bytes: &mut Vec<u8>| {
            put(list.len() as u64, bytes);
            let mut next = 0;
            for &number in list {
                put(u64::from(number - next), bytes);
                next = number + 1;
            }
        };
        ascending(&self.draws, bytes);
        for tile in 0..self.starts.len().saturating_sub(1) {
            ascending(self.tile(tile), bytes);
        }
    }

    /// Reads the lists of `tiles` tiles.
    pub(super) fn decode(tiles: usize, input: &[u8]) -> Parsed<'_, Self> {
        fn ascending<'a>(input: &mut Cursor<'a>, out: &mut Vec<u32>) -> Taken<'a> {
            let count = input.number_u32("a number of entries")?;
            let mut next = 0_u64;
            for _ in 0..count {
                let number = next + input.number("an entry of an ascending list", 32)?;
                let number =
                    u32::try_from(number).map_err(|_| input.fault("numbers below 2^32", number))?;
                next = u64::from(number) + 1;
                out.push(number);
            }
            Ok(())
        }
        let mut input = Cursor::new(input);
        let bytes = input.rest().len();
        let expected = format_args!("at least a byte for each of {tiles} tiles");
        input.check(tiles <= bytes, expected, format_args!("{bytes} bytes"))?;
        let mut lists = Self::default();
        ascending(&mut input, &mut lists.draws)?;
        lists.starts.reserve(tiles + 1);
        lists.starts.push(0);
        for _ in 0..tiles {
            ascending(&mut input, &mut lists.primitives)?;
            let end = u32::try_from(lists.primitives.len())
                .map_err(|_| input.fault("fewer than 2^32 entries", "more"))?;
            lists.starts.push(end);
        }
        Ok((input.rest(), lists))
    }
}
