//! Converts quad records to cache lines. This is the hot path of every replay.
//!
//! Everything independent of the record is computed once per trace. For each draw, uv group and kind of
//! texture (size, sampler, layout), tables hold the byte offsets of all texel columns and rows of all
//! levels. An address is then two table look-ups and a sum. Textures of a group that differ only in their
//! base address share level of detail and footprints.

mod axis;
mod build;
mod bundle;
mod general;

pub use bundle::Bundle;

use super::StreamError;
use crate::config::{RunConfig, SamplingConfig};
use axis::Axis;
use formats::footprint::{LaneReach, LodFormula, Reach, fast_log2, quad_lod, select_levels};
use formats::textrace::{QuadRecord, Tables, with_operands};
use formats::texture::{Filter, Sampler};
use general::General;
use std::sync::Arc;

/// The texture of a footprint.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleRef {
    /// Origin of the relative lines.
    pub base_line: u32,
    /// Index into the texture table.
    pub texture: u32,
}

/// Buffers for the footprints of one record, reused from quad to quad.
#[derive(Clone, Debug)]
pub struct Scratch {
    /// Whether bundles list their distinct lines.
    distinct: bool,
    /// By kind of texture: one or two levels.
    bundles: Vec<[Bundle; 2]>,
    both: Vec<bool>,
    /// By kind of texture, for anisotropic pixels: all bundles.
    many: Vec<Vec<Bundle>>,
}

/// The footprint generator of a trace with one sampling and layout.
#[derive(Debug)]
pub struct Footprints {
    draws: Vec<Vec<SampleGroup>>,
    /// By draw: a level may have several bundles in some of its samples.
    long: Vec<bool>,
    line_shift: u32,
    helper_lanes: bool,
    sampling: SamplingConfig,
    lines: u64,
}

/// A uv group: its kinds of textures, and its samples in shader order.
#[derive(Debug, Default)]
struct SampleGroup {
    kinds: Vec<Arc<Kind>>,
    samples: Vec<(usize, SampleRef)>,
}

impl SampleGroup {
    /// Whether a level may have several bundles.
    fn is_long(&self, sampling: &SamplingConfig) -> bool {
        let anisotropic = |kind: &Kind| sampling.is_anisotropic(&kind.sampler);
        (self.kinds.iter()).any(|kind| kind.general.is_some() || anisotropic(kind))
    }
}

/// Properties of the textures that share footprints.
#[derive(Debug)]
struct Kind {
    /// Texels of level 0.
    size: [u32; 2],
    /// Size of the group, which defines the fixed-point step.
    extent: [u32; 2],
    /// Texels of level 0 per fixed-point step.
    to_texels: [f32; 2],
    sampler: Sampler,
    /// Offset in bytes from the start of a line to the start of the texture.
    skew_bytes: u32,
    levels: Vec<MipLevel>,
    general: Option<General>,
}

impl Kind {
    /// Size of a level in texels.
    fn level_size(&self, level: u32) -> [u32; 2] {
        let MipLevel { u, v, .. } = &self.levels[level as usize];
        [u.texels(), v.texels()]
    }
}

#[derive(Debug)]
struct MipLevel {
    /// First byte within the layer.
    base_bytes: u32,
    u: Axis,
    v: Axis,
}

impl Footprints {
    /// The generator for the draws of a trace.
    ///
    /// # Errors
    /// Tables with invalid references, or more than 2^32 - 1 lines.
    pub fn new(tables: &Tables, config: &RunConfig) -> Result<Self, StreamError> {
        build::Builder::new(tables, config)?.finish()
    }

    /// Buffers for [`Self::for_quad`]. `distinct`: bundles list their distinct lines.
    pub fn scratch(&self, distinct: bool) -> Scratch {
        let kinds = self
            .draws
            .iter()
            .flatten()
            .map(|g| g.kinds.len())
            .max()
            .unwrap_or(0);
        Scratch {
            distinct,
            bundles: vec![[Bundle::default(); 2]; kinds],
            both: vec![false; kinds],
            many: vec![Vec::new(); kinds],
        }
    }

    /// Lines of the whole address space.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// Calls `emit` for every sample and level of a quad: by record, then sample in shader order, then
    /// level. With anisotropic filtering, a level can have several bundles.
    #[inline(always)]
    pub fn for_quad(
        &self,
        draw: u32,
        records: &[QuadRecord],
        scratch: &mut Scratch,
        mut emit: impl FnMut(SampleRef, &Bundle),
    ) {
        let groups = &self.draws[draw as usize];
        if self.long[draw as usize] {
            self.for_long_quad(groups, records, scratch, &mut emit);
            return;
        }
        for record in records {
            let Some(group) = groups.get(usize::from(record.group)) else {
                // NO_GROUP: samples nothing.
                continue;
            };
            let slots = scratch.bundles.iter_mut().zip(&mut scratch.both);
            for (kind, (bundles, both)) in group.kinds.iter().zip(slots) {
                *both = self.bundles(kind, record, bundles);
                if scratch.distinct {
                    let read = &mut bundles[..1 + usize::from(*both)];
                    read.iter_mut().for_each(Bundle::list_distinct);
                }
            }
            for &(slot, sample) in &group.samples {
                let [first, second] = &scratch.bundles[slot];
                emit(sample, first);
                if scratch.both[slot] {
                    emit(sample, second);
                }
            }
        }
    }

    /// [`Self::for_quad`] for levels with any number of bundles: anisotropic filtering, levels per lane, or general samples.
    #[inline(never)]
    fn for_long_quad(
        &self,
        groups: &[SampleGroup],
        records: &[QuadRecord],
        scratch: &mut Scratch,
        emit: &mut dyn FnMut(SampleRef, &Bundle),
    ) {
        for (record, operands) in with_operands(records) {
            let Some(group) = groups.get(usize::from(record.group)) else {
                continue;
            };
            for (kind, many) in group.kinds.iter().zip(&mut scratch.many) {
                match &kind.general {
                    Some(general) => self.general(kind, general, record, operands, many),
                    None => self.long(kind, record, many),
                }
                if scratch.distinct {
                    many.iter_mut().for_each(Bundle::list_distinct);
                }
            }
            for &(slot, sample) in &group.samples {
                for bundle in &scratch.many[slot] {
                    emit(sample, bundle);
                }
            }
        }
    }

    /// Footprints of a record in one kind of texture with anisotropic filtering.
    fn long(&self, kind: &Kind, record: &QuadRecord, out: &mut Vec<Bundle>) {
        out.clear();
        let lanes = if self.helper_lanes {
            15
        } else {
            record.mask & 15
        };
        let uv = [0, 1, 2, 3].map(|lane| record.lane_uv(lane));
        let levels = kind.levels.len() as u32;
        if self.sampling.lod == LodFormula::PerLane {
            self.by_lane(kind, record, lanes, &uv, out);
            return;
        }
        match Reach::of(
            record,
            kind.extent,
            kind.size,
            levels,
            &kind.sampler,
            &self.sampling,
        ) {
            Reach::Isotropic => {
                let mut bundles = [Bundle::default(); 2];
                let both = self.bundles(kind, record, &mut bundles);
                out.extend(&bundles[..1 + usize::from(both)]);
            }
            Reach::Probes(probes) => {
                let chosen = select_levels(probes.lod, &kind.sampler, levels);
                for level in chosen.first..chosen.first + chosen.count {
                    for probe in 0..probes.count {
                        let [u, v] = probes.offset(probe);
                        let at = uv.map(|[s, t]| [s.wrapping_add(u), t.wrapping_add(v)]);
                        let mut bundle = Bundle::default();
                        self.fill(kind, level, chosen.filter, lanes, &at, &mut bundle);
                        out.push(bundle);
                    }
                }
            }
            Reach::Ellipse(ellipse) => {
                let size = kind.level_size(ellipse.level);
                let blocks =
                    lanes_of(lanes).flat_map(|lane| ellipse.blocks(uv[lane], size, kind.extent));
                self.push_blocks(kind, ellipse.level, blocks, out);
            }
        }
    }

    /// Adds bundles of 2x2 texels, each given by its top left texel before wrapping.
    fn push_blocks(
        &self,
        kind: &Kind,
        level: u32,
        blocks: impl Iterator<Item = [i64; 2]>,
        out: &mut Vec<Bundle>,
    ) {
        let MipLevel { base_bytes, u, v } = &kind.levels[level as usize];
        let base = base_bytes + kind.skew_bytes;
        let line = |offset: u32| (base + offset) >> self.line_shift;
        let mut last = [0; 4];
        for (number, [x, y]) in blocks.enumerate() {
            if number % 4 == 0 {
                out.push(Bundle::default());
            }
            let Some(bundle) = out.last_mut() else {
                continue;
            };
            if number % 4 == 0 {
                bundle.begin(level as u8);
            }
            let ([x0, x1], [y0, y1]) = (u.pair_at(x), v.pair_at(y));
            bundle.push(
                [line(x0 + y0), line(x1 + y0), line(x0 + y1), line(x1 + y1)],
                &mut last,
            );
        }
    }

    /// Footprints of a record in one kind of texture with levels per lane: by level and probe, the lanes
    /// that use them, then the ellipses on this level.
    fn by_lane(
        &self,
        kind: &Kind,
        record: &QuadRecord,
        lanes: u8,
        uv: &[[i32; 2]; 4],
        out: &mut Vec<Bundle>,
    ) {
        let levels = kind.levels.len() as u32;
        let reach = [0, 1, 2, 3].map(|lane| {
            LaneReach::of(
                record,
                lane,
                kind.extent,
                kind.size,
                levels,
                &kind.sampler,
                &self.sampling,
            )
        });
        let probes = lanes_of(lanes).map(|lane| reach[lane].probe_count()).max();
        for level in 0..levels {
            for probe in 0..probes.unwrap_or(0) {
                // Consecutive lanes with the same filter share a bundle.
                let mut open: Option<(Filter, u8)> = None;
                let mut at = *uv;
                for lane in lanes_of(lanes) {
                    let Some(([u, v], own)) = reach[lane].probe(level, probe) else {
                        continue;
                    };
                    at[lane] = [at[lane][0].wrapping_add(u), at[lane][1].wrapping_add(v)];
                    open = match open {
                        Some((filter, mask)) if filter == own => Some((filter, mask | 1 << lane)),
                        before => {
                            self.push(kind, level, before, &at, out);
                            Some((own, 1 << lane))
                        }
                    };
                }
                self.push(kind, level, open, &at, out);
            }
            let size = kind.level_size(level);
            let blocks = lanes_of(lanes).filter_map(|lane| {
                let ellipse = reach[lane].ellipse(level);
                ellipse.map(|ellipse| ellipse.blocks(uv[lane], size, kind.extent))
            });
            self.push_blocks(kind, level, blocks.flatten(), out);
        }
    }

    fn push(
        &self,
        kind: &Kind,
        level: u32,
        lanes: Option<(Filter, u8)>,
        uv: &[[i32; 2]; 4],
        out: &mut Vec<Bundle>,
    ) {
        if let Some((filter, mask)) = lanes {
            let mut bundle = Bundle::default();
            self.fill(kind, level, filter, mask, uv, &mut bundle);
            out.push(bundle);
        }
    }

    /// Footprints of a record in one kind of texture. Returns true if two levels are read.
    #[inline(always)]
    fn bundles(&self, kind: &Kind, record: &QuadRecord, out: &mut [Bundle; 2]) -> bool {
        let lod = self.lod(kind, record) + self.sampling.lod_bias;
        let levels = select_levels(lod, &kind.sampler, kind.levels.len() as u32);
        let both = levels.count > 1;
        let lanes = if self.helper_lanes {
            15
        } else {
            record.mask & 15
        };
        let uv = [0, 1, 2, 3].map(|lane| record.lane_uv(lane));
        self.fill(kind, levels.first, levels.filter, lanes, &uv, &mut out[0]);
        if both {
            self.fill(
                kind,
                levels.first + 1,
                levels.filter,
                lanes,
                &uv,
                &mut out[1],
            );
        }
        both
    }

    /// `quad_lod`, with the scale precomputed for the default formula.
    #[inline(always)]
    fn lod(&self, kind: &Kind, record: &QuadRecord) -> f32 {
        if self.sampling.lod != LodFormula::Llvmpipe {
            return quad_lod(record, kind.extent, kind.size, self.sampling.lod);
        }
        let squared = |d: [i32; 2]| {
            let [u, v] = [0, 1].map(|a| d[a] as f32 * kind.to_texels[a]);
            u * u + v * v
        };
        0.5 * fast_log2(squared(record.dx).max(squared(record.dy)))
    }

    #[inline(always)]
    fn fill(
        &self,
        kind: &Kind,
        level: u32,
        filter: Filter,
        lanes: u8,
        uv: &[[i32; 2]; 4],
        out: &mut Bundle,
    ) {
        out.begin(level as u8);
        let MipLevel { base_bytes, u, v } = &kind.levels[level as usize];
        let base = base_bytes + kind.skew_bytes;
        let line = |offset: u32| (base + offset) >> self.line_shift;
        // An array of closures over `axis` is not always inlined.
        let us = uv.map(|[u, _]| u);
        let vs = uv.map(|[_, v]| v);
        let mut last = [0; 4];
        match filter {
            Filter::Linear => {
                let (columns, rows) = (u.linear(us), v.linear(vs));
                for lane in lanes_of(lanes) {
                    let ([x0, x1], [y0, y1]) = (columns[lane], rows[lane]);
                    out.push(
                        [line(x0 + y0), line(x1 + y0), line(x0 + y1), line(x1 + y1)],
                        &mut last,
                    );
                }
            }
            Filter::Nearest => {
                let (columns, rows) = (u.nearest(us), v.nearest(vs));
                for lane in lanes_of(lanes) {
                    out.push([line(columns[lane] + rows[lane]); 4], &mut last);
                }
            }
        }
    }
}

/// The lanes of a mask, ascending.
#[inline(always)]
fn lanes_of(mask: u8) -> impl Iterator<Item = usize> {
    (0..4).filter(move |lane| mask >> lane & 1 != 0)
}

#[cfg(test)]
mod tests;
