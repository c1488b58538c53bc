//! Memory traffic and energy of a frame by counts, which are the same on every machine and need no cache
//! model.

use formats::footprint::{SamplingOptions, record_footprints};
use formats::layout::{Layout, LayoutConfig};
use formats::textrace::{Textrace, Tile, with_operands};
use raster::backend::Work;
use raster::vertices::VERTEX_STRIDE;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;
use techniques::plan::{FramePlan, PictureSource};

/// Bytes of a cache line.
const LINE_BYTES: u64 = 64;
/// Bytes of a pixel of a picture.
const PIXEL_BYTES: u64 = 4;

/// Energy of a byte from DRAM, pJ: 1.3 to 2.6 nJ for 64 bits at 45 nm (Horowitz, ISSCC 2014, figure 1.1.9).
const DRAM_BYTE_PJ: f64 = 1950.0 / 8.0;
/// Energy of a single-precision multiplication and addition, pJ, at 45 nm (the same figure).
const MULTIPLY_ADD_PJ: f64 = 3.7 + 0.9;
/// Multiply-adds of a fragment: the lighting of the capture's shader, and filters of four texels of four channels.
const FRAGMENT_MULTIPLY_ADDS: f64 = 100.0;
/// Multiply-adds of a vertex: two products of a matrix with a vector, and one of a normal.
const VERTEX_MULTIPLY_ADDS: f64 = 41.0;

/// Counts of a frame, both eyes and all layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Counted {
    /// Shaded fragments.
    pub fragments: u64,
    /// Transformed vertices, including those of depth passes for occlusion culling.
    pub vertices: u64,
    /// Distinct texture lines of 64 bytes per tile of 16x16 pixels: the reads of a cache that holds the lines
    /// of one tile.
    pub texture_bytes: u64,
    /// Attributes of the vertices.
    pub vertex_bytes: u64,
    /// Colour of layers and pictures, written and, if pictures are composed of layers, read again; depth that
    /// occlusion culling writes and reads; colour and depth that shading reuse reads of the other eye, whose depth is
    /// written for it. Depth that stays in a tile buffer is not included.
    pub picture_bytes: u64,
    /// Views, lists of draws, and transforms of draws that move.
    pub uploaded_bytes: u64,
}

impl Counted {
    /// Counts of a frame of `fragments` that sample `texture_bytes`, from its plan and the backend's work.
    pub fn of(plan: &FramePlan, occludes: bool, work: &Work, fragments: u64) -> Self {
        Self {
            fragments,
            vertices: work.vertices,
            texture_bytes: 0,
            vertex_bytes: work.vertices * VERTEX_STRIDE,
            picture_bytes: picture_bytes(plan, occludes),
            uploaded_bytes: work.bytes_uploaded,
        }
    }

    /// All memory traffic.
    pub fn bytes(&self) -> u64 {
        self.texture_bytes + self.vertex_bytes + self.picture_bytes + self.uploaded_bytes
    }

    /// Energy of the traffic and of shading, millijoules: for comparisons, with constants of a 45 nm process.
    pub fn energy_mj(&self) -> f64 {
        let shading = MULTIPLY_ADD_PJ
            * (FRAGMENT_MULTIPLY_ADDS * self.fragments as f64
                + VERTEX_MULTIPLY_ADDS * self.vertices as f64);
        (DRAM_BYTE_PJ * self.bytes() as f64 + shading) / 1e9
    }
}

impl AddAssign for Counted {
    fn add_assign(&mut self, other: Self) {
        formats::add_fields!(
            self,
            other,
            fragments,
            vertices,
            texture_bytes,
            vertex_bytes,
            picture_bytes,
            uploaded_bytes
        );
    }
}

fn picture_bytes(plan: &FramePlan, occludes: bool) -> u64 {
    let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let layers: Vec<u64> = (plan.layers.iter())
        .map(|layer| match &layer.mask {
            Some(mask) => mask.count(),
            None => area(layer.size_px),
        })
        .collect();
    let written: u64 = layers.iter().sum();
    let depths = if occludes { 2 * written } else { 0 };
    let composed = plan.pictures.iter().map(|picture| match picture {
        PictureSource::Layer(_) => 0,
        PictureSource::Composed { size_px, parts } => {
            let read: u64 = parts.iter().map(|part| layers[part.layer]).sum();
            read + area(*size_px)
        }
    });
    let reused: u64 = (0..layers.len())
        .filter(|layer| plan.is_reused(*layer))
        .map(|layer| 3 * layers[layer])
        .sum();
    (written + depths + reused + composed.sum::<u64>()) * PIXEL_BYTES
}

/// Texture bytes of a trace's frames, in order; see [`Counted::texture_bytes`].
///
/// # Errors
/// A trace that cannot be read, or textures beyond the address space.
pub fn texture_bytes(trace: &Textrace) -> anyhow::Result<Vec<u64>> {
    let tables = trace.tables();
    let layout = Layout::new(&tables.textures, &LayoutConfig::default())?;
    let options = SamplingOptions::default();
    let tiles: Vec<(usize, usize)> = (tables.passes.iter().enumerate())
        .flat_map(|(pass, of)| (0..of.tile_count() as usize).map(move |tile| (pass, tile)))
        .collect();
    let lines: Vec<u64> = (tiles.par_iter())
        .map_init(
            || (Tile::default(), Vec::new()),
            |(tile, lines), &(pass, number)| {
                trace.decode_tile(pass, number, tile)?;
                lines.clear();
                for run in &tile.runs {
                    let records = run.first as usize..(run.first + run.count) as usize;
                    for (record, operands) in with_operands(&tile.records[records]) {
                        record_footprints(
                            tables,
                            run.draw,
                            record,
                            operands,
                            &options,
                            |sample, footprint| {
                                let (layer, level) =
                                    (footprint.layer.into(), footprint.level.into());
                                let texels = footprint.texels();
                                lines.extend(texels.filter_map(|texel| {
                                    let at = layout.address(sample.texture, layer, level, texel)?;
                                    Some(at / LINE_BYTES)
                                }));
                            },
                        );
                    }
                    // Most lines of a run also belong to its neighbours, so the list stays short.
                    if lines.len() > 1 << 16 {
                        lines.sort_unstable();
                        lines.dedup();
                    }
                }
                lines.sort_unstable();
                lines.dedup();
                Ok(lines.len() as u64)
            },
        )
        .collect::<anyhow::Result<_>>()?;
    let frames = tables.meta.frames.iter().map(|views| {
        let of_frame = |(pass, _): &(usize, usize)| tables.passes[*pass].frame == views.frame;
        let lines = tiles.iter().zip(&lines).filter(|(tile, _)| of_frame(tile));
        LINE_BYTES * lines.map(|(_, lines)| lines).sum::<u64>()
    });
    Ok(frames.collect())
}
