//! Computes the texels that a quad record reads. This is the reference for tests of faster engines, so it
//! is written for readability.
//!
//! Footprints have a fixed order: by record, by sample in shader order, by mip level with the finer one
//! first, by probe if there are several, and by lane. The footprints of an ellipse come lane by lane, then
//! row by row. If each lane has its own levels, a level has footprints of only the lanes that read it. A lane
//! whose texels all lie in the border of a texture has no footprint. All code that counts or writes accesses
//! uses this order.

mod aniso;
mod lanes;
mod lod;
mod operands;
mod options;

pub use aniso::{AnisotropyModel, Ellipse, MOST_ANISOTROPY, Probes, Reach};
pub use lanes::LaneReach;
pub use lod::{fast_log2, lane_record, quad_lod};
pub use operands::LaneLevel;
pub use options::{FilterOverride, LodFormula, SamplingOptions};

use crate::textrace::{LodRule, NO_GROUP, QuadRecord, SUBTEXELS, Sample, Tables, UvGroup};
use crate::texture::{Filter, MipFilter, Sampler, Texture, Wrap};

/// Texels of one lane at one level of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Lane of the quad, 0 to 3.
    pub lane: u8,
    /// Mip level.
    pub level: u8,
    /// Array layer.
    pub layer: u16,
    /// Left and right texel column; equal for nearest fetches and where the wrap mode maps both to the same
    /// column.
    pub i: [u32; 2],
    /// Upper and lower texel row.
    pub j: [u32; 2],
}

impl Footprint {
    /// The distinct texels, row by row: one, two or four.
    pub fn texels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Self { i, j, .. } = *self;
        let rows = if j[0] == j[1] { 1 } else { 2 };
        let columns = if i[0] == i[1] { 1 } else { 2 };
        j.into_iter()
            .take(rows)
            .flat_map(move |y| i.into_iter().take(columns).map(move |x| [x, y]))
    }
}

/// Mip levels of a sample and the filter within them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelSelection {
    /// The finer level.
    pub first: u32,
    /// Number of levels, 1 or 2.
    pub count: u32,
    /// Filter within a level.
    pub filter: Filter,
}

impl LevelSelection {
    /// Whether a level is one of the selected levels.
    pub fn contains(&self, level: u32) -> bool {
        (self.first..self.first + self.count).contains(&level)
    }
}

/// Chooses the levels for a level of detail, as Vulkan and llvmpipe do. The sampler's bias and bounds apply first.
///
/// `lod <= 0` magnifies: level 0 with the `mag` filter. Linear mip filtering reads `floor(lod)` and the
/// next level; from the last level on, only the last.
#[inline]
pub fn select_levels(lod: f32, sampler: &Sampler, levels: u32) -> LevelSelection {
    let last = levels.saturating_sub(1);
    let lod = sampler.lod.apply(lod);
    let magnified = lod <= 0.0;
    let filter = if magnified { sampler.mag } else { sampler.min };
    // A cast of a positive float rounds down and saturates.
    let (first, count) = match sampler.mip {
        MipFilter::None => (0, 1),
        _ if magnified => (0, 1),
        MipFilter::Nearest => (((lod + 0.5) as u32).min(last), 1),
        MipFilter::Linear => {
            let first = (lod as u32).min(last);
            (first, if first == last { 1 } else { 2 })
        }
    };
    LevelSelection {
        first,
        count,
        filter,
    }
}

/// Left (or upper) texel of a fetch along one axis, before wrapping:
/// `floor(coordinate * size / (SUBTEXELS * extent) - 0.5)` for a linear filter, without the half texel for
/// a nearest one. The result is exact.
pub fn texel_before_wrap(coordinate: i32, size: u32, extent: u32, filter: Filter) -> i64 {
    let unit = i64::from(SUBTEXELS) * i64::from(extent);
    let position = i64::from(coordinate) * i64::from(size);
    match filter {
        Filter::Nearest => position.div_euclid(unit),
        Filter::Linear => (2 * position - unit).div_euclid(2 * unit),
    }
}

/// Both texels of a fetch along one axis, before wrapping.
fn fetch(coordinate: i32, size: u32, extent: u32, filter: Filter) -> [i64; 2] {
    let low = texel_before_wrap(coordinate, size, extent, filter);
    match filter {
        Filter::Nearest => [low; 2],
        Filter::Linear => [low, low + 1],
    }
}

/// Maps a texel coordinate into `0..size`; `None` if the border is read.
pub fn wrap_texel(texel: i64, size: u32, wrap: Wrap) -> Option<u32> {
    let size = i64::from(size);
    let wrapped = match wrap {
        Wrap::Repeat => texel.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let folded = texel.rem_euclid(2 * size);
            folded.min(2 * size - 1 - folded)
        }
        Wrap::ClampToEdge => texel.clamp(0, size - 1),
        Wrap::ClampToBorder if (0..size).contains(&texel) => texel,
        Wrap::ClampToBorder => return None,
        Wrap::MirrorClampToEdge => texel.max(-1 - texel).min(size - 1),
    };
    Some(wrapped as u32)
}

/// Both texels of a fetch along one axis after wrapping. They are equal if only one is read; `None` if
/// neither is.
fn wrap_pair(texels: [i64; 2], size: u32, wrap: Wrap) -> Option<[u32; 2]> {
    match texels.map(|texel| wrap_texel(texel, size, wrap)) {
        [Some(a), Some(b)] => Some([a, b]),
        [Some(one), None] | [None, Some(one)] => Some([one; 2]),
        [None, None] => None,
    }
}

/// Yields the footprints of one sample of a quad record, in the order of the module's description. `operands`
/// is the preceding record; it is used only if the sample has operands.
#[allow(clippy::too_many_arguments)]
pub fn footprints(
    record: &QuadRecord,
    operands: Option<&QuadRecord>,
    extent: [u32; 2],
    sample: &Sample,
    texture: &Texture,
    sampler: &Sampler,
    options: &SamplingOptions,
    mut visit: impl FnMut(Footprint),
) {
    let quad = Quad {
        record,
        extent,
        texture,
        sampler: options.filter.apply(sampler),
        options: *options,
        mask: match options.helper_lanes {
            true => 15,
            false => record.mask,
        },
    };
    let visit_in = |lane: u32, level: u32, layer: u16, texels: [[i64; 2]; 2]| {
        let size = texture.level_size(level);
        let wrapped = |a: usize| {
            let offset = i64::from(sample.offset[a]);
            let texels = texels[a].map(|texel| texel + offset);
            wrap_pair(texels, size[a], sampler.wrap[a])
        };
        if let (Some(i), Some(j)) = (wrapped(0), wrapped(1)) {
            visit(Footprint {
                lane: lane as u8,
                level: level as u8,
                layer,
                i,
                j,
            });
        }
    };
    let specified = sample.level.rule == LodRule::Explicit || sample.level.operands;
    if specified || options.lod == LodFormula::PerLane {
        let operands = operands.filter(|_| sample.level.operands);
        let lanes = quad.lanes().map(|lane| {
            let own = LaneLevel::of(sample, texture, operands, lane);
            (lane, own.layer, quad.lane_reach(lane, sample, own.lod))
        });
        let lanes: Vec<_> = lanes.collect();
        return visit_lanes(&quad, lanes.iter().copied(), visit_in);
    }
    // One level of detail for all lanes.
    let reach = quad.derivative_reach(0, sample.level.lod());
    let lanes = quad.lanes().map(|lane| (lane, sample.layer, reach));
    visit_lanes(&quad, lanes, visit_in);
}

/// A quad that samples a texture.
struct Quad<'a> {
    record: &'a QuadRecord,
    extent: [u32; 2],
    texture: &'a Texture,
    sampler: Sampler,
    options: SamplingOptions,
    /// One bit per lane that samples.
    mask: u8,
}

impl Quad<'_> {
    fn lanes(&self) -> impl Iterator<Item = u32> + Clone + use<> {
        let mask = self.mask;
        (0..4).filter(move |lane| mask >> lane & 1 == 1)
    }

    /// The texels of a lane that specifies a level, or a bias to that of the derivatives.
    fn lane_reach(&self, lane: u32, sample: &Sample, lod: f32) -> LaneReach {
        if sample.level.rule == LodRule::Explicit {
            let levels = self.texture.levels;
            return LaneReach::Levels(select_levels(lod, &self.sampler, levels), None);
        }
        self.derivative_reach(lane, lod)
    }

    /// The texels of a lane by the derivatives and a bias.
    fn derivative_reach(&self, lane: u32, bias: f32) -> LaneReach {
        let (size, levels) = (self.texture.size, self.texture.levels);
        let options = SamplingOptions {
            lod_bias: self.options.lod_bias + bias,
            ..self.options
        };
        let (record, extent) = (self.record, self.extent);
        LaneReach::of(record, lane, extent, size, levels, &self.sampler, &options)
    }
}

/// Visits the texels of lanes: each is a lane, its layer and what it reads.
fn visit_lanes(
    quad: &Quad<'_>,
    lanes: impl Iterator<Item = (u32, u16, LaneReach)> + Clone,
    mut visit: impl FnMut(u32, u32, u16, [[i64; 2]; 2]),
) {
    let extent = quad.extent;
    let reaches = || lanes.clone().map(|(_, _, of)| of);
    let probes = reaches().map(|of| of.probe_count()).max();
    let first = reaches().map(|of| of.levels().start).min();
    let end = reaches().map(|of| of.levels().end).max();
    for level in first.unwrap_or(0)..end.unwrap_or(0) {
        let size = quad.texture.level_size(level);
        for probe in 0..probes.unwrap_or(0) {
            for (lane, layer, of) in lanes.clone() {
                let Some((from_lane, filter)) = of.probe(level, probe) else {
                    continue;
                };
                let uv = quad.record.lane_uv(lane);
                let axis = |a: usize| {
                    let at = uv[a].wrapping_add(from_lane[a]);
                    fetch(at, size[a], extent[a], filter)
                };
                visit(lane, level, layer, [axis(0), axis(1)]);
            }
        }
        for (lane, layer, of) in lanes.clone() {
            let blocks = of
                .ellipse(level)
                .map(|ellipse| ellipse.blocks(quad.record.lane_uv(lane), size, extent));
            for [x, y] in blocks.into_iter().flatten() {
                visit(lane, level, layer, [[x, x + 1], [y, y + 1]]);
            }
        }
    }
}

/// Yields every footprint of a record of `draw`, sample by sample, with its sample. `operands` is the
/// preceding record in the run, if any: see [`crate::textrace::with_operands`].
///
/// A record without a group, or with indices that the tables do not have, reads no texels.
pub fn record_footprints(
    tables: &Tables,
    draw: u32,
    record: &QuadRecord,
    operands: Option<&QuadRecord>,
    options: &SamplingOptions,
    mut visit: impl FnMut(&Sample, Footprint),
) {
    for (group, sample) in record_samples(tables, draw, record) {
        let texture = tables.textures.get(sample.texture as usize);
        let sampler = tables.samplers.get(usize::from(sample.sampler));
        if let Some((texture, sampler)) = texture.zip(sampler) {
            footprints(
                record,
                operands,
                group.extent,
                sample,
                texture,
                sampler,
                options,
                |footprint| visit(sample, footprint),
            );
        }
    }
}

fn record_samples<'a>(
    tables: &'a Tables,
    draw: u32,
    record: &QuadRecord,
) -> impl Iterator<Item = (&'a UvGroup, &'a Sample)> + use<'a> {
    tables
        .draws
        .get(draw as usize)
        .filter(|_| record.group != NO_GROUP)
        .and_then(|draw| draw.groups.get(usize::from(record.group)))
        .into_iter()
        .flat_map(|group| group.samples.iter().map(move |sample| (group, sample)))
}

#[cfg(test)]
mod tests;
