//! Bytes that reprojection moves: with the tile's G-buffer on chip, and with a whole-screen
//! G-buffer in DRAM.
//!
//! Tile by tile (paper section III), shading leaves a tile's records in internal SRAM, from which
//! the reproject and reuse kernels read; only error detection needs other tiles, so what
//! it reads of every left pixel goes to DRAM once and DMA fetches each row once, for all tiles of the
//! row band. On the whole screen, every record goes to DRAM and each kernel reads it back.

use super::config::Gbuffer;
use serde::{Deserialize, Serialize};

/// Bytes moved by one way of keeping the G-buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// In and out of the on-chip buffers.
    pub on_chip_bytes: u64,
    /// In and out of external memory.
    pub dram_bytes: u64,
}

/// Pixels that the kernels handle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Left pixels.
    pub left: u64,
    /// Right pixels.
    pub right: u64,
    /// Right pixels reused.
    pub reused: u64,
}

/// Traffic with the G-buffer of one tile on chip.
#[must_use]
pub fn tiled(counts: Counts, g: &Gbuffer) -> Traffic {
    let record = g.record_bytes();
    let row = u64::from(g.row_bytes);
    let projected = u64::from(g.position_bytes + g.ids_bytes);
    Traffic {
        // Written by shading, read by reproject, read again by reuse, and the tile's own right
        // records written; the row comes in by DMA and is read by detection.
        on_chip_bytes: counts.left * (record + projected)
            + counts.reused * record
            + counts.right * record
            + counts.left * row
            + counts.right * row,
        dram_bytes: counts.left * row + counts.left * row,
    }
}

/// Traffic with both eyes' G-buffers in DRAM.
#[must_use]
pub fn whole_screen(counts: Counts, g: &Gbuffer) -> Traffic {
    let record = g.record_bytes();
    let row = u64::from(g.row_bytes);
    let projected = u64::from(g.position_bytes + g.ids_bytes);
    Traffic {
        on_chip_bytes: 0,
        dram_bytes: counts.left * (record + projected)
            + counts.reused * record
            + counts.right * record
            + counts.right * row,
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::SgrtConfig;
    use super::*;

    #[test]
    fn tiling_leaves_only_the_rows_in_dram() {
        let g = SgrtConfig::default().gbuffer;
        let counts = Counts {
            left: 1000,
            right: 1000,
            reused: 900,
        };
        let (tiled, screen) = (tiled(counts, &g), whole_screen(counts, &g));
        assert_eq!(tiled.dram_bytes, 2 * 1000 * u64::from(g.row_bytes));
        assert!(tiled.dram_bytes < screen.dram_bytes / 2);
        // What the tile keeps on chip is what the whole screen moves through DRAM, and the row.
        assert_eq!(
            tiled.on_chip_bytes,
            screen.dram_bytes + 1000 * u64::from(g.row_bytes)
        );
    }
}
