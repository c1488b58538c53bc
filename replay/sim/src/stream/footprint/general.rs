//! Samples whose levels do not follow from the derivatives alone, or whose textures have a border: programs have them,
//! scenes do not. They take their texels from the reference, `formats::footprint`.

use super::{Bundle, Footprints, Kind};
use formats::footprint::{Footprint, footprints};
use formats::textrace::{LodRule, QuadRecord, Sample};
use formats::texture::{Sampler, Texture, Wrap};

/// Properties of a sample that the reference needs.
#[derive(Debug)]
pub(super) struct General {
    pub texture: Texture,
    pub sampler: Sampler,
    pub sample: Sample,
    pub layer_bytes: u64,
}

impl General {
    /// True for samples that the fast path does not support.
    pub fn is_needed(sample: &Sample, sampler: &Sampler) -> bool {
        sample.level.rule != LodRule::Derivatives
            || sample.level.operands
            || sampler.wrap.contains(&Wrap::ClampToBorder)
    }
}

impl Footprints {
    /// Footprints of a record in a texture of a general sample; lines count from the texture's first layer.
    pub(super) fn general(
        &self,
        kind: &Kind,
        general: &General,
        record: &QuadRecord,
        operands: Option<&QuadRecord>,
        out: &mut Vec<Bundle>,
    ) {
        out.clear();
        let mut last = [0; 4];
        let mut lane_before = 0;
        let add = |footprint: Footprint| {
            let level = &kind.levels[usize::from(footprint.level)];
            let layer = u64::from(footprint.layer) * general.layer_bytes;
            let base = layer + u64::from(level.base_bytes + kind.skew_bytes);
            let ([x0, x1], [y0, y1]) =
                (level.u.bytes_of(footprint.i), level.v.bytes_of(footprint.j));
            // The layout has fewer than 2^32 lines, as checked before.
            let line = |x: u32, y: u32| ((base + u64::from(x + y)) >> self.line_shift) as u32;
            // A bundle holds ascending lanes of one level.
            let fits = out.last().is_some_and(|bundle| {
                bundle.level == footprint.level && bundle.count < 4 && lane_before < footprint.lane
            });
            if !fits {
                let mut bundle = Bundle::default();
                bundle.begin(footprint.level);
                out.push(bundle);
                last = [0; 4];
            }
            lane_before = footprint.lane;
            if let Some(bundle) = out.last_mut() {
                bundle.push(
                    [line(x0, y0), line(x1, y0), line(x0, y1), line(x1, y1)],
                    &mut last,
                );
            }
        };
        let General {
            texture,
            sampler,
            sample,
            ..
        } = general;
        let (extent, sampling) = (kind.extent, &self.sampling);
        footprints(
            record, operands, extent, sample, texture, sampler, sampling, add,
        );
    }
}
