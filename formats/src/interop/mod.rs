//! Accesses of textures and rays for other simulators: addresses only ([`plain`], which can also be read),
//! CSV, JSON Lines, and columns for NumPy and Parquet ([`columns`]).
//!
//! The accesses of a record are the ones that replay counts, in the order of [`crate::footprint`]. The
//! caller determines the order of tiles and primitives.

pub mod columns;
mod csv;
mod hierarchy;
mod jsonl;
mod npy;
pub mod plain;
mod rays;

pub use columns::{
    Field, GeometryRow, Get, RayRow, RecordRow, SampleRow, Tabular, Values, geometry_rows,
    ray_rows, record_rows,
};
pub use csv::CsvWriter;
pub use hierarchy::{ChildRow, SlotRow, child_rows, node_to_json, slot_rows, slot_to_json};
pub use jsonl::{record_to_json, write_json_line};
pub use npy::NpyWriter;
pub use rays::{Entry, RayAccess, RaySample, ray_samples};

use crate::footprint::{SamplingOptions, record_footprints};
use crate::layout::Layout;
use crate::textrace::{QuadRecord, Tables};
use serde::{Deserialize, Serialize};
use std::io;

/// Unit of an access.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Granularity {
    /// Every distinct texel of a footprint, at the address of its block.
    Texel,
    /// Every distinct cache line of a footprint, at its first byte. An L1 looks up the same lines.
    #[default]
    Line,
}

/// Origin of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Index of the pass.
    pub pass: u32,
    /// Tile of the pass.
    pub tile: u32,
    /// Index of the draw.
    pub draw: u32,
    /// Global primitive number.
    pub primitive: u32,
}

/// One read of texture memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Byte address.
    pub address: u64,
    /// Number of bytes: those of a line or a block.
    pub bytes: u32,
    /// Index of the pass.
    pub pass: u32,
    /// Tile of the pass.
    pub tile: u32,
    /// Index of the draw.
    pub draw: u32,
    /// Global primitive number.
    pub primitive: u32,
    /// Column of the pixel in its tile.
    pub pixel_x: u8,
    /// Row of the pixel in its tile.
    pub pixel_y: u8,
    /// Index into the texture table.
    pub texture: u32,
    /// Array layer.
    pub layer: u16,
    /// Mip level.
    pub level: u8,
    /// Texel column; with line granularity, of the first texel of the line.
    pub x: u32,
    /// Texel row.
    pub y: u32,
}

/// Expands records to accesses.
#[derive(Clone, Copy, Debug)]
pub struct Expander<'a> {
    /// Tables of the trace.
    pub tables: &'a Tables,
    /// Addresses of texels.
    pub layout: &'a Layout,
    /// Filter and level of detail.
    pub sampling: SamplingOptions,
    /// Texels or lines.
    pub granularity: Granularity,
    /// Line size, a power of two.
    pub line_bytes: u32,
}

impl Expander<'_> {
    /// Calls `visit` for each access of a record. `operands` is the preceding record in the run, if any.
    /// Stops at the first error.
    ///
    /// # Errors
    /// Errors of `visit`.
    pub fn expand(
        &self,
        origin: Origin,
        record: &QuadRecord,
        operands: Option<&QuadRecord>,
        mut visit: impl FnMut(&Access) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut outcome = Ok(());
        let sampling = &self.sampling;
        record_footprints(
            self.tables,
            origin.draw,
            record,
            operands,
            sampling,
            |sample, footprint| {
                let mut lines = [u64::MAX; 4];
                for (index, texel) in footprint.texels().enumerate() {
                    let (layer, level) = (footprint.layer, footprint.level);
                    let at = self
                        .layout
                        .address(sample.texture, layer.into(), level.into(), texel);
                    let Some(mut address) = at.filter(|_| outcome.is_ok()) else {
                        return;
                    };
                    let texture = self.layout.textures().get(sample.texture as usize);
                    let mut bytes = texture.map_or(1, |texture| texture.block.bytes);
                    if self.granularity == Granularity::Line {
                        bytes = self.line_bytes;
                        address -= address % u64::from(self.line_bytes.max(1));
                        if lines.contains(&address) {
                            continue;
                        }
                        lines[index] = address;
                    }
                    outcome = visit(&Access {
                        address,
                        bytes,
                        pass: origin.pass,
                        tile: origin.tile,
                        draw: origin.draw,
                        primitive: origin.primitive,
                        pixel_x: record.x * 2 + footprint.lane % 2,
                        pixel_y: record.y * 2 + footprint.lane / 2,
                        texture: sample.texture,
                        layer,
                        level,
                        x: texel[0],
                        y: texel[1],
                    });
                }
            },
        );
        outcome
    }
}

#[cfg(test)]
mod tests;
