//! Builds the tables of the footprint generator from a trace's tables and a layout.

use super::axis::Axis;
use super::general::General;
use super::{Footprints, Kind, MipLevel, SampleGroup, SampleRef};
use crate::config::RunConfig;
use crate::stream::StreamError;
use formats::footprint::LodFormula;
use formats::layout::{Layout, LevelLayout};
use formats::textrace::{SUBTEXELS, Sample, SampleLevel, Tables, UvGroup};
use formats::texture::{Sampler, TexelFormat};
use std::collections::HashMap;
use std::sync::Arc;

/// The properties that samples with common footprints share.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct KindKey {
    size: [u32; 2],
    levels: u32,
    format: TexelFormat,
    sampler: Sampler,
    offset: [i8; 2],
    extent: [u32; 2],
    skew_bytes: u32,
    /// MipLevel and layer of a general sample, and the texture's layers.
    general: Option<(SampleLevel, u16, u32)>,
}

pub(super) struct Builder<'a> {
    tables: &'a Tables,
    config: &'a RunConfig,
    layout: Layout,
    kinds: HashMap<KindKey, Arc<Kind>>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(tables: &'a Tables, config: &'a RunConfig) -> Result<Self, StreamError> {
        let layout = Layout::new(&tables.textures, &config.layout)
            .map_err(|error| StreamError::Tables(error.to_string()))?;
        Ok(Self {
            tables,
            config,
            layout,
            kinds: HashMap::new(),
        })
    }

    pub(super) fn finish(mut self) -> Result<Footprints, StreamError> {
        let lines = self
            .layout
            .end()
            .div_ceil(u64::from(self.config.line_bytes));
        if lines >= u64::from(u32::MAX) {
            return Err(StreamError::Tables(format!(
                "textures take {lines} lines: expected fewer than 2^32"
            )));
        }
        let largest = self
            .layout
            .textures()
            .iter()
            .map(|t| t.layer_bytes)
            .max()
            .unwrap_or(0);
        if largest > u64::from(u32::MAX / 2) {
            return Err(StreamError::Tables(format!(
                "a texture layer takes {largest} bytes: expected at most 2 GiB"
            )));
        }
        let tables = self.tables;
        let draws: Vec<Vec<SampleGroup>> = tables
            .draws
            .iter()
            .map(|draw| draw.groups.iter().map(|group| self.group(group)).collect())
            .collect::<Result<_, _>>()?;
        let sampling = &self.config.sampling;
        let long = |groups: &Vec<SampleGroup>| {
            sampling.lod == LodFormula::PerLane || groups.iter().any(|g| g.is_long(sampling))
        };
        Ok(Footprints {
            long: draws.iter().map(long).collect(),
            draws,
            line_shift: self.config.line_bytes.trailing_zeros(),
            helper_lanes: self.config.sampling.helper_lanes,
            sampling: self.config.sampling,
            lines,
        })
    }

    fn group(&mut self, group: &UvGroup) -> Result<SampleGroup, StreamError> {
        let mut out = SampleGroup::default();
        for sample in &group.samples {
            let kind = self.kind(sample, group.extent)?;
            let slot = out
                .kinds
                .iter()
                .position(|k| Arc::ptr_eq(k, &kind))
                .unwrap_or_else(|| {
                    out.kinds.push(kind);
                    out.kinds.len() - 1
                });
            let base = self.base(sample).unwrap_or(0);
            out.samples.push((
                slot,
                SampleRef {
                    base_line: (base / u64::from(self.config.line_bytes)) as u32,
                    texture: sample.texture,
                },
            ));
        }
        Ok(out)
    }

    /// First byte of the sample's texture layer; of the texture itself where fragments choose the layer.
    fn base(&self, sample: &Sample) -> Option<u64> {
        let placed = self.layout.textures().get(sample.texture as usize)?;
        let sampler = self.tables.samplers.get(usize::from(sample.sampler))?;
        let layer = match General::is_needed(sample, sampler) {
            true => 0,
            false => sample.layer,
        };
        Some(placed.base + u64::from(layer) * placed.layer_bytes)
    }

    fn kind(&mut self, sample: &Sample, extent: [u32; 2]) -> Result<Arc<Kind>, StreamError> {
        let tables = self.tables;
        let unknown = |what: &str, index: usize| {
            StreamError::Tables(format!(
                "a sample names {what} {index}, which does not exist"
            ))
        };
        let index = sample.texture as usize;
        let texture = tables
            .textures
            .get(index)
            .ok_or_else(|| unknown("texture", index))?;
        let sampler = usize::from(sample.sampler);
        let sampler = tables
            .samplers
            .get(sampler)
            .ok_or_else(|| unknown("sampler", sampler))?;
        let layer = u32::from(sample.layer);
        if layer >= texture.layers {
            return Err(unknown("layer", sample.layer.into()));
        }
        let placed = &self.layout.textures()[index];
        let base = self.base(sample).unwrap_or(0);
        let is_general = General::is_needed(sample, sampler);
        let key = KindKey {
            size: texture.size,
            levels: texture.levels,
            format: placed.format,
            sampler: self.config.sampling.filter.apply(sampler),
            offset: sample.offset,
            extent,
            skew_bytes: (base % u64::from(self.config.line_bytes)) as u32,
            general: is_general.then_some((sample.level, sample.layer, texture.layers)),
        };
        if let Some(kind) = self.kinds.get(&key) {
            return Ok(Arc::clone(kind));
        }
        let steps = extent.map(|texels| i64::from(SUBTEXELS) * i64::from(texels));
        let level = |layout: &LevelLayout| {
            let axis = |a: usize| {
                let bytes = (0..layout.size[a]).map(|texel| {
                    let mut block = [0; 2];
                    block[a] = texel / placed.block.texels[a];
                    layout.placement.index(block) as u32 * placed.block.bytes
                });
                Axis::new(
                    steps[a],
                    key.sampler.wrap[a],
                    sample.offset[a],
                    bytes.collect(),
                )
            };
            MipLevel {
                base_bytes: layout.offset_bytes as u32,
                u: axis(0),
                v: axis(1),
            }
        };
        let levels = placed.levels.iter().map(level).collect();
        let kind = Arc::new(Kind {
            size: texture.size,
            extent,
            to_texels: [0, 1]
                .map(|a| texture.size[a] as f32 / (SUBTEXELS as f32 * extent[a] as f32)),
            sampler: key.sampler,
            skew_bytes: key.skew_bytes,
            levels,
            general: is_general.then(|| General {
                texture: texture.clone(),
                sampler: *sampler,
                sample: *sample,
                layer_bytes: placed.layer_bytes,
            }),
        });
        self.kinds.insert(key, Arc::clone(&kind));
        Ok(kind)
    }
}
