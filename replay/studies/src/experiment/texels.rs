//! Which texels of a texture's levels lie in lines that are read, as maps of a few cells.

use super::l2_content::{Share, share};
use super::tiles::Read;
use formats::layout::{Layout, TextureLayout};

/// Cells of a map in a row or column at most.
const MOST_CELLS: u32 = 32;

/// A level of a texture, or the part of it that a draw reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevelReads {
    /// Index of the texture.
    pub texture: u32,
    /// Mip level.
    pub level: u32,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Distinct lines that are read.
    pub lines: u32,
    /// Blocks in these lines, and blocks of the level, all layers together.
    pub blocks: [u32; 2],
    /// Columns and rows of the map.
    pub cells: [u32; 2],
    /// Share of each cell's blocks that lie in these lines, row by row.
    pub shares: Vec<Share>,
}

/// The maps of the levels in `reads`, which has the lines of each level together and each line once.
pub fn level_reads(reads: &[Read], layout: &Layout, line_bytes: u32) -> Vec<LevelReads> {
    let levels = reads.chunk_by(|a, b| (a.texture, a.level) == (b.texture, b.level));
    let map = |reads: &[Read]| {
        let first = reads.first()?;
        let texture = layout.textures().get(first.texture as usize)?;
        level(texture, first, reads, line_bytes)
    };
    levels.filter_map(map).collect()
}

fn level(
    texture: &TextureLayout,
    of: &Read,
    reads: &[Read],
    line_bytes: u32,
) -> Option<LevelReads> {
    let level = texture.levels.get(of.level as usize)?;
    let size = level.size;
    let blocks = [0, 1].map(|axis| size[axis].div_ceil(texture.block.texels[axis]));
    let cells = blocks.map(|blocks| blocks.min(MOST_CELLS));
    // Of the blocks of a row or column, those of a cell.
    let cell = |axis: usize, block: u32| block * cells[axis] / blocks[axis];
    let mut of_cells: [Vec<u32>; 2] = [0, 1].map(|axis| vec![0; cells[axis] as usize]);
    for (axis, counts) in of_cells.iter_mut().enumerate() {
        (0..blocks[axis]).for_each(|block| counts[cell(axis, block) as usize] += 1);
    }
    let mut read = vec![0; (cells[0] * cells[1]) as usize];
    let mut sum = 0;
    let block_bytes = u64::from(texture.block.bytes);
    let end = texture.levels.get(of.level as usize + 1);
    let end = end.map_or(texture.layer_bytes, |next| next.offset_bytes);
    for read_line in reads {
        let first = u64::from(read_line.line) * u64::from(line_bytes);
        for address in first..first + u64::from(line_bytes) {
            let within = address.wrapping_sub(texture.base);
            if within >= texture.size_bytes() {
                continue;
            }
            let within = within % texture.layer_bytes;
            if !(level.offset_bytes..end).contains(&within)
                || !(within - level.offset_bytes).is_multiple_of(block_bytes)
            {
                continue;
            }
            let [x, y] = level
                .placement
                .block((within - level.offset_bytes) / block_bytes);
            if x < blocks[0] && y < blocks[1] {
                read[(cell(1, y) * cells[0] + cell(0, x)) as usize] += 1;
                sum += 1;
            }
        }
    }
    let all = |index: usize| {
        let [x, y] = [index % cells[0] as usize, index / cells[0] as usize];
        of_cells[0][x] * of_cells[1][y] * texture.layers
    };
    let shares = read.iter().enumerate();
    Some(LevelReads {
        texture: of.texture,
        level: of.level,
        size,
        lines: reads.len() as u32,
        blocks: [sum, blocks[0] * blocks[1] * texture.layers],
        cells,
        shares: shares
            .map(|(index, &read)| share(read, all(index)))
            .collect(),
    })
}
