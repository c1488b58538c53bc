//! Footprints by lane if every lane has its own level of detail: with
//! [`LodFormula::PerLane`](super::LodFormula), or because each has its own bias or level.

use super::{
    Ellipse, LevelSelection, LodFormula, Probes, Reach, SamplingOptions, lane_record, quad_lod,
    select_levels,
};
use crate::textrace::QuadRecord;
use crate::texture::{Filter, Sampler};
use std::ops::Range;

/// The texels that one lane reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LaneReach {
    /// The filter on one or two levels, at the lane's own position or at several probes.
    Levels(LevelSelection, Option<Probes>),
    /// All texels of an ellipse.
    Ellipse(Ellipse),
}

impl LaneReach {
    /// The texels of a lane in a texture with `levels` levels, whose level 0 has `size` texels, by the derivatives.
    pub fn of(
        record: &QuadRecord,
        lane: u32,
        extent: [u32; 2],
        size: [u32; 2],
        levels: u32,
        sampler: &Sampler,
        options: &SamplingOptions,
    ) -> Self {
        let own = match options.lod {
            LodFormula::PerLane => lane_record(record, lane),
            _ => *record,
        };
        let selected = |lod| select_levels(lod, sampler, levels);
        match Reach::of(&own, extent, size, levels, sampler, options) {
            Reach::Isotropic => {
                let lod = quad_lod(&own, extent, size, options.lod) + options.lod_bias;
                Self::Levels(selected(lod), None)
            }
            Reach::Probes(probes) => Self::Levels(selected(probes.lod), Some(probes)),
            Reach::Ellipse(ellipse) => Self::Ellipse(ellipse),
        }
    }

    /// The range of the levels that the lane reads.
    pub(super) fn levels(&self) -> Range<u32> {
        match self {
            Self::Levels(levels, _) => levels.first..levels.first + levels.count,
            Self::Ellipse(ellipse) => ellipse.level..ellipse.level + 1,
        }
    }

    /// Number of filter applications per level.
    pub fn probe_count(&self) -> u32 {
        match self {
            Self::Levels(_, probes) => probes.map_or(1, |probes| probes.count),
            Self::Ellipse(_) => 0,
        }
    }

    /// Offset of a probe from the lane's coordinates on a level, and its filter; `None` if the lane has no
    /// such probe.
    pub fn probe(&self, level: u32, probe: u32) -> Option<([i32; 2], Filter)> {
        let Self::Levels(levels, probes) = self else {
            return None;
        };
        let from_lane = probes.map_or([0; 2], |probes| probes.offset(probe));
        (levels.contains(level) && probe < self.probe_count()).then_some((from_lane, levels.filter))
    }

    /// The ellipse of the lane on a level.
    pub fn ellipse(&self, level: u32) -> Option<&Ellipse> {
        match self {
            Self::Ellipse(ellipse) if ellipse.level == level => Some(ellipse),
            _ => None,
        }
    }
}
