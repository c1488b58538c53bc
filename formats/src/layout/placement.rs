//! Block orders within a level.

use super::BlockOrder;

/// Edge of a tile of blocks, as a shift.
const TILE_SHIFT: u32 = 2;

/// A block order with the dimensions of its level, so that fast engines can tabulate it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockPlacement {
    /// `y * pitch + x`.
    Linear {
        /// Blocks per row.
        pitch: u32,
    },
    /// Bits of x and y interleaved, x lowest, for the bits of the shorter axis; the remaining bits of the
    /// longer axis are above.
    Morton {
        /// Number of bits of x and of y.
        bits: [u32; 2],
    },
    /// By tile row, by tile, and by row within the tile.
    Tiled {
        /// Width and height of a tile, as shifts; less than 4x4 only for smaller levels.
        shift: [u32; 2],
        /// Tiles per row.
        pitch: u32,
    },
}

impl BlockPlacement {
    pub(super) fn new(order: BlockOrder, blocks: [u32; 2]) -> Self {
        let bits = blocks.map(|count| count.next_power_of_two().ilog2());
        match order {
            BlockOrder::Linear => Self::Linear { pitch: blocks[0] },
            BlockOrder::Morton => Self::Morton { bits },
            BlockOrder::Tiled => {
                let shift = bits.map(|bits| bits.min(TILE_SHIFT));
                let pitch = blocks[0].div_ceil(1 << shift[0]);
                Self::Tiled { shift, pitch }
            }
        }
    }

    /// Number of blocks of a level in memory, including padding.
    pub(super) fn blocks(&self, blocks: [u32; 2]) -> u64 {
        match *self {
            Self::Linear { pitch } => u64::from(pitch) * u64::from(blocks[1]),
            Self::Morton { bits } => 1 << (bits[0] + bits[1]),
            Self::Tiled { shift, pitch } => {
                let rows = blocks[1].div_ceil(1 << shift[1]);
                (u64::from(pitch) * u64::from(rows)) << (shift[0] + shift[1])
            }
        }
    }

    /// Number of a block in memory order.
    pub fn index(&self, [x, y]: [u32; 2]) -> u64 {
        match *self {
            Self::Linear { pitch } => u64::from(y) * u64::from(pitch) + u64::from(x),
            Self::Morton { bits } => {
                let common = bits[0].min(bits[1]);
                let low = (1u32 << common) - 1;
                let rest = u64::from((x >> common) | (y >> common));
                interleave(x & low) | interleave(y & low) << 1 | rest << (2 * common)
            }
            Self::Tiled { shift, pitch } => {
                let tile = u64::from(y >> shift[1]) * u64::from(pitch) + u64::from(x >> shift[0]);
                let within = |v: u32, a: usize| u64::from(v & ((1 << shift[a]) - 1));
                (tile << (shift[0] + shift[1])) | within(y, 1) << shift[0] | within(x, 0)
            }
        }
    }
}

impl BlockPlacement {
    /// The block with a number in memory order, including padding.
    pub fn block(&self, index: u64) -> [u32; 2] {
        match *self {
            Self::Linear { pitch } => {
                let pitch = u64::from(pitch.max(1));
                [(index % pitch) as u32, (index / pitch) as u32]
            }
            Self::Morton { bits } => {
                let common = bits[0].min(bits[1]);
                let rest = ((index >> (2 * common)) as u32) << common;
                let [x, y] = [collect(index, common), collect(index >> 1, common)];
                match bits[0] > bits[1] {
                    true => [x | rest, y],
                    false => [x, y | rest],
                }
            }
            Self::Tiled { shift, pitch } => {
                let (tile, within) = (index >> (shift[0] + shift[1]), index as u32);
                let pitch = u64::from(pitch.max(1));
                let [column, row] = [(tile % pitch) as u32, (tile / pitch) as u32];
                let low = |value: u32, axis: usize| value & ((1 << shift[axis]) - 1);
                [
                    column << shift[0] | low(within, 0),
                    row << shift[1] | low(within >> shift[0], 1),
                ]
            }
        }
    }
}

/// Extracts the lowest `bits` even bits of a number.
fn collect(interleaved: u64, bits: u32) -> u32 {
    (0..bits).fold(0, |value, bit| {
        value | ((interleaved >> (2 * bit)) as u32 & 1) << bit
    })
}

/// Inserts a zero bit after each of 32 bits.
pub fn interleave(v: u32) -> u64 {
    let mut v = u64::from(v);
    for (shift, mask) in [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ] {
        v = (v | v << shift) & mask;
    }
    v
}
