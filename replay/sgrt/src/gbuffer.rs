//! G-buffer traffic of reprojection, with one tile's G-buffer on chip or the whole screen's in DRAM.
//!
//! Tile by tile (paper section III), shading leaves a tile's records in on-chip SRAM, from which the
//! reproject and reuse kernels read. Only error detection needs other tiles. The fields it reads of every
//! left pixel are written to DRAM once, and DMA fetches the rows for each band of tiles, once per band.
//! With a whole-screen G-buffer, every record is written to DRAM, each kernel reads it back, and detection
//! reads the same rows. With rows on chip, the copy that detection reads stays in row buffers instead.

use super::config::{Gbuffer, RowStorage};
use super::reads::Reads;
use serde::{Deserialize, Serialize};

/// Bytes moved for a G-buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Traffic {
    /// Read from and written to on-chip buffers.
    pub on_chip_bytes: u64,
    /// Read from and written to external memory.
    pub dram_bytes: u64,
}

/// Where G-buffer records are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keeping {
    /// One tile on chip.
    Tile,
    /// The whole screen in DRAM.
    Screen,
}

/// Pixels of a right tile processed by the kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct RightTile {
    /// Pixels tested.
    pub tested: u64,
    /// Pixels reused.
    pub reused: u64,
    /// The tile's share of the bytes fetched for its band.
    pub fetched_bytes: u64,
    /// Bytes that tests against whole rows read from the row buffers.
    pub row_read_bytes: u64,
}

/// Traffic of a left tile: shading writes its records, the reproject kernel reads the fields that detection
/// needs, and these are written to DRAM.
pub(super) fn left_tile(pixels: u64, keeping: Keeping, reads: Reads, g: &Gbuffer) -> Traffic {
    let record = pixels * reads.record_bytes(g);
    let row = pixels * reads.pixel_bytes(g);
    match keeping {
        Keeping::Tile if g.rows == RowStorage::Chip => Traffic {
            on_chip_bytes: record + 2 * row,
            dram_bytes: 0,
        },
        Keeping::Tile => Traffic {
            on_chip_bytes: record + row,
            dram_bytes: row,
        },
        Keeping::Screen => Traffic {
            on_chip_bytes: 0,
            dram_bytes: record + row,
        },
    }
}

/// Traffic of a tile of the previous frame: the reproject kernel reads the fields that detection needs from DRAM.
/// The records were written when the frame was rendered.
pub(super) fn previous_tile(pixels: u64, reads: Reads, g: &Gbuffer) -> Traffic {
    Traffic {
        on_chip_bytes: 0,
        dram_bytes: pixels * reads.pixel_bytes(g),
    }
}

/// Traffic of a right tile: rows are fetched and searched by detection, reuse reads left records, and the
/// tile's own records are written.
pub(super) fn right_tile(tile: &RightTile, keeping: Keeping, reads: Reads, g: &Gbuffer) -> Traffic {
    let records = (tile.reused + tile.tested) * reads.record_bytes(g);
    let searched = tile.row_read_bytes + tile.tested * reads.looked_up_bytes(g);
    let rows_on_chip = tile.fetched_bytes + searched;
    match keeping {
        Keeping::Tile if g.rows == RowStorage::Chip => Traffic {
            on_chip_bytes: records + searched,
            dram_bytes: 0,
        },
        Keeping::Tile => Traffic {
            on_chip_bytes: records + rows_on_chip,
            dram_bytes: tile.fetched_bytes,
        },
        Keeping::Screen => Traffic {
            on_chip_bytes: rows_on_chip,
            dram_bytes: records + tile.fetched_bytes,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::rows_in_dram;
    use super::*;

    #[test]
    fn tiling_leaves_only_the_rows_in_dram() {
        let g = rows_in_dram().gbuffer;
        let reads = Reads::ARRIVALS;
        let right = RightTile {
            tested: 1000,
            reused: 900,
            fetched_bytes: 12_500,
            row_read_bytes: 0,
        };
        let both = |keeping| {
            let left = left_tile(1000, keeping, reads, &g);
            let right = right_tile(&right, keeping, reads, &g);
            [
                left.dram_bytes + right.dram_bytes,
                left.on_chip_bytes + right.on_chip_bytes,
            ]
        };
        let (tiled, screen) = (both(Keeping::Tile), both(Keeping::Screen));
        assert_eq!(tiled[0], 12_000 + 12_500);
        assert!(tiled[0] < screen[0] / 2);
        let chip = Gbuffer {
            rows: RowStorage::Chip,
            ..g.clone()
        };
        let left = left_tile(1000, Keeping::Tile, reads, &chip);
        let right_bytes = right_tile(&right, Keeping::Tile, reads, &chip);
        assert_eq!([left.dram_bytes, right_bytes.dram_bytes], [0, 0]);
        // The copy is written to the row buffers instead of DRAM, and not written again by DMA.
        let on_chip = left.on_chip_bytes + right_bytes.on_chip_bytes;
        assert_eq!(on_chip, tiled[1] + 12_000 - 12_500);
        // The tile G-buffer keeps on chip what the whole screen moves through DRAM.
        assert_eq!(screen[0] - tiled[0], tiled[1] - screen[1] - 12_000);
    }
}
