//! Builds the footprint generator's tables from a trace's tables and a layout.

use super::axis::Axis;
use super::{Footprints, Group, Kind, Level, SampleRef};
use crate::config::{FilterOverride, RunConfig};
use crate::engine::ReplayError;
use formats::texture::{Filter, MipFilter, Sampler, TexelFormat, Texture};
use formats::textrace::{SUBTEXELS, Sample, Tables, UvGroup};
use std::collections::HashMap;
use std::sync::Arc;

/// What two samples must agree on to share footprints.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct KindKey {
    size: [u32; 2],
    levels: u32,
    format: TexelFormat,
    sampler: Sampler,
    offset: [i8; 2],
    extent: [u32; 2],
    skew_bytes: u32,
}

pub(super) struct Builder<'a> {
    tables: &'a Tables,
    config: &'a RunConfig,
    layout: Layout,
    kinds: HashMap<KindKey, Arc<Kind>>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(tables: &'a Tables, config: &'a RunConfig) -> Result<Self, ReplayError> {
        let layout = Layout::new(&tables.textures, config);
        Ok(Self { tables, config, layout, kinds: HashMap::new() })
    }

    pub(super) fn finish(mut self) -> Result<Footprints, ReplayError> {
        let lines = self.layout.total_bytes().div_ceil(u64::from(self.config.line_bytes));
        if lines >= u64::from(u32::MAX) {
            return Err(ReplayError::Tables(format!(
                "textures take {lines} lines: expected fewer than 2^32"
            )));
        }
        let tables = self.tables;
        let draws = tables
            .draws
            .iter()
            .map(|draw| draw.groups.iter().map(|group| self.group(group)).collect())
            .collect::<Result<_, _>>()?;
        Ok(Footprints {
            draws,
            line_shift: self.config.line_bytes.trailing_zeros(),
            helper_lanes: self.config.sampling.helper_lanes,
            sampling: self.config.sampling,
            lines,
        })
    }

    fn group(&mut self, group: &UvGroup) -> Result<Group, ReplayError> {
        let mut out = Group::default();
        for sample in &group.samples {
            let kind = self.kind(sample, group.extent)?;
            let slot = out.kinds.iter().position(|k| Arc::ptr_eq(k, &kind)).unwrap_or_else(|| {
                out.kinds.push(kind);
                out.kinds.len() - 1
            });
            let base = self.base(sample);
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

    /// First byte of the sample's texture layer.
    fn base(&self, sample: &Sample) -> u64 {
        self.layout.address(sample.texture as usize, u32::from(sample.layer), 0, [0, 0])
    }

    fn kind(&mut self, sample: &Sample, extent: [u32; 2]) -> Result<Arc<Kind>, ReplayError> {
        let tables = self.tables;
        let unknown = |what: &str, index: usize| {
            ReplayError::Tables(format!("a sample names {what} {index}, which does not exist"))
        };
        let index = sample.texture as usize;
        let texture = tables.textures.get(index).ok_or_else(|| unknown("texture", index))?;
        let sampler = usize::from(sample.sampler);
        let sampler = tables.samplers.get(sampler).ok_or_else(|| unknown("sampler", sampler))?;
        let layer = u32::from(sample.layer);
        if layer >= texture.layers {
            return Err(unknown("layer", sample.layer.into()));
        }
        let base = self.base(sample);
        let key = KindKey {
            size: texture.size,
            levels: texture.levels,
            format: self.layout.format(index),
            sampler: overridden(*sampler, texture, self.config.sampling.filter),
            offset: sample.offset,
            extent,
            skew_bytes: (base % u64::from(self.config.line_bytes)) as u32,
        };
        if let Some(kind) = self.kinds.get(&key) {
            return Ok(Arc::clone(kind));
        }
        let steps = extent.map(|texels| i64::from(SUBTEXELS) * i64::from(texels));
        let levels = (0..texture.levels)
            .map(|level| {
                let at = |texel: [u32; 2]| self.layout.address(index, layer, level, texel);
                let first = at([0, 0]);
                let size = texture.level_size(level);
                let axis = |a: usize| {
                    let bytes = (0..size[a]).map(|t| {
                        let mut texel = [0; 2];
                        texel[a] = t;
                        (at(texel) - first) as u32
                    });
                    Axis::new(steps[a], key.sampler.wrap[a], sample.offset[a].into(), bytes.collect())
                };
                Level { base_bytes: (first - base) as u32, u: axis(0), v: axis(1) }
            })
            .collect();
        let kind = Arc::new(Kind {
            to_texels: [0, 1].map(|a| texture.size[a] as f32 / steps[a] as f32),
            sampler: key.sampler,
            skew_bytes: key.skew_bytes,
            levels,
        });
        self.kinds.insert(key, Arc::clone(&kind));
        Ok(kind)
    }
}

/// The sampler under a filter override. Textures without levels keep their sampler: a shadow map
/// is never filtered otherwise.
fn overridden(sampler: Sampler, texture: &Texture, filter: FilterOverride) -> Sampler {
    let (within, mip) = match filter {
        FilterOverride::AsRecorded => return sampler,
        _ if texture.levels == 1 => return sampler,
        FilterOverride::Trilinear => (Filter::Linear, MipFilter::Linear),
        FilterOverride::Bilinear => (Filter::Linear, MipFilter::Nearest),
        FilterOverride::Nearest => (Filter::Nearest, MipFilter::Nearest),
    };
    Sampler { wrap: sampler.wrap, mag: within, min: within, mip }
}

/// temporary
struct Layout { bases: Vec<u64>, layer: Vec<u64>, textures: Vec<Texture>, end: u64 }
impl Layout {
    fn new(textures: &[Texture], c: &RunConfig) -> Self {
        let mut end = 0u64; let mut bases = vec![]; let mut layer = vec![];
        for t in textures {
            end = end.next_multiple_of(c.layout.base_align_bytes);
            bases.push(end);
            let l: u64 = (0..t.levels).map(|l| Self::level_bytes(t, l)).sum();
            layer.push(l);
            end += l * u64::from(t.layers);
        }
        Self { bases, layer, textures: textures.to_vec(), end }
    }
    fn block(t: &Texture) -> (u32, u64) { match t.format { TexelFormat::Bc1 => (4, 8), TexelFormat::R32f | TexelFormat::Rgba8 => (1, 4), _ => (4, 16) } }
    fn level_bytes(t: &Texture, l: u32) -> u64 { let (b, n) = Self::block(t); let s = t.level_size(l); u64::from(s[0].div_ceil(b)) * u64::from(s[1].div_ceil(b)) * n }
    fn total_bytes(&self) -> u64 { self.end }
    fn format(&self, i: usize) -> TexelFormat { self.textures[i].format }
    fn address(&self, i: usize, layer: u32, level: u32, [x, y]: [u32; 2]) -> u64 {
        let t = &self.textures[i];
        let (b, n) = Self::block(t);
        self.bases[i] + u64::from(layer) * self.layer[i] + (0..level).map(|l| Self::level_bytes(t, l)).sum::<u64>()
          + n * (u64::from(y / b) * u64::from(t.level_size(level)[0].div_ceil(b)) + u64::from(x / b))
    }
}
