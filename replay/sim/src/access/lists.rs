//! Primitive lists for tiles larger than the recorded ones.

use formats::textrace::geometry::TileLists;
use formats::view::TILE_SIZE_PX;

/// The lists of larger tiles: each contains the primitives of its recorded tiles once. The configuration
/// refuses smaller tiles, because recorded lists cannot be split.
pub(super) fn regrouped(recorded: TileLists, size_px: [u32; 2], tile_px: u32) -> TileLists {
    let factor = tile_px / TILE_SIZE_PX;
    if factor <= 1 {
        return recorded;
    }
    let small = size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
    let large = small.map(|tiles| tiles.div_ceil(factor));
    let mut lists = TileLists {
        draws: recorded.draws.clone(),
        starts: vec![0],
        primitives: Vec::new(),
    };
    let mut primitives = Vec::new();
    for tile in 0..large[0] * large[1] {
        let first = [tile % large[0], tile / large[0]].map(|at| at * factor);
        let end = [0, 1].map(|axis: usize| (first[axis] + factor).min(small[axis]));
        primitives.clear();
        for (y, x) in (first[1]..end[1]).flat_map(|y| (first[0]..end[0]).map(move |x| (y, x))) {
            primitives.extend_from_slice(recorded.tile((y * small[0] + x) as usize));
        }
        primitives.sort_unstable();
        primitives.dedup();
        lists.primitives.extend_from_slice(&primitives);
        lists.starts.push(lists.primitives.len() as u32);
    }
    lists
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_tile_lists_each_primitive_of_its_tiles_once() {
        // Three columns, two rows; primitive 7 is everywhere.
        let mut recorded = TileLists {
            draws: vec![0],
            starts: vec![0],
            primitives: Vec::new(),
        };
        for tile in 0..6 {
            recorded.primitives.extend([tile, 7]);
            recorded.starts.push(recorded.primitives.len() as u32);
        }
        let lists = regrouped(recorded.clone(), [48, 32], 32);
        assert_eq!(lists.starts, [0, 5, 8]);
        assert_eq!(
            (lists.tile(0), lists.tile(1)),
            (&[0, 1, 3, 4, 7][..], &[2, 5, 7][..])
        );
        assert_eq!(regrouped(recorded.clone(), [48, 32], 16), recorded);
    }
}
