//! Compares the shadow look-ups of a fragment with the reference.

use super::agreement::{Agreement, Distances};
use super::causes::{LARGEST_DIFFERENCE, SMALL, UvCause};
use super::compare::{Comparison, Lane, captured_uv};
use super::geometry::Geometry;
use super::piece::{center, quad_center};
use super::reference::Fragment;
use super::shadows::Receiver;
use formats::footprint::LodFormula;
use formats::textrace::{NO_GROUP, QuadRecord, SUBTEXELS, Tile, UvGroup};
use glam::DVec2;

/// Agreement of shadow look-ups with the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LookupAgreement {
    /// Distances of coordinates, texels of the shadow map.
    pub errors_texels: Distances,
    /// The same by [`UvCause::ALL`].
    pub causes: [u64; UvCause::ALL.len()],
    /// Fragments that are looked up in another cascade, in several, or not at all.
    pub other_cascades: u64,
    /// Look-ups by cascade.
    pub by_cascade: [u64; 4],
}

impl LookupAgreement {
    /// Adds the counts of another tile or pass.
    pub fn merge(&mut self, other: &Self) {
        (self.errors_texels.0).extend_from_slice(&other.errors_texels.0);
        self.other_cascades += other.other_cascades;
        let sums = self.causes.iter_mut().zip(&other.causes);
        let cascades = self.by_cascade.iter_mut().zip(&other.by_cascade);
        for (sum, count) in sums.chain(cascades) {
            *sum += count;
        }
    }
}

impl Comparison<'_> {
    /// Compares the look-ups of a fragment, whose groups follow the material's.
    pub(super) fn lookups(
        &self,
        geometry: &Geometry<'_>,
        fragment: &Fragment,
        lanes: &[Lane],
        tile: &Tile,
        result: &mut Agreement,
    ) {
        let piece = geometry.piece(fragment.piece);
        let first = geometry.groups(piece).len();
        let groups = &self.tables.draws[piece.draw as usize].groups;
        let is_lookup = |lane: &&Lane| (first..groups.len()).contains(&usize::from(lane.group));
        let mut taken = lanes.iter().filter(is_lookup);
        let Some(shadows) = self.shadows.filter(|shadows| shadows.count() > 0) else {
            result.shadow_lookups += taken.count() as u64;
            return;
        };
        let taken = (taken.next(), taken.next());
        let cascade = taken.0.map(|lane| usize::from(lane.group) - first);
        let receiver = shadows.on(geometry, piece);
        let at = center(fragment.pixel);
        let may_take = |receiver: Receiver<'_>| receiver.may_take(cascade, at);
        let alone = lanes.iter().any(|lane| lane.group == NO_GROUP);
        let is_right = taken.1.is_none()
            && cascade.is_none_or(|k| k < shadows.count())
            && !(alone && cascade.is_some())
            && receiver.faces().any(may_take);
        if !is_right {
            result.lookups.other_cascades += 1;
            return;
        }
        let (Some(lane), Some(cascade)) = (taken.0, cascade) else {
            return;
        };
        result.lookups.by_cascade[cascade] += 1;
        let lookup = Lookup {
            receiver,
            cascade,
            pixel: fragment.pixel,
            record: &tile.records[lane.record as usize],
            group: &groups[usize::from(lane.group)],
            formula: self.formula,
        };
        let found = lookup
            .receiver
            .faces()
            .map(|receiver| Lookup { receiver, ..lookup }.compare());
        let best = found.min_by_key(|(cause, ..)| *cause as usize);
        if let Some((cause, error_texels, differences)) = best {
            result.lookups.errors_texels.0.push(error_texels as f32);
            result.lookups.causes[cause as usize] += 1;
            result.differences_unexplained += differences;
        }
    }
}

/// A captured look-up and what is expected of it.
struct Lookup<'a> {
    receiver: Receiver<'a>,
    cascade: usize,
    pixel: [u32; 2],
    record: &'a QuadRecord,
    group: &'a UvGroup,
    formula: LodFormula,
}

impl Lookup<'_> {
    /// The cause of the lane's difference, its size in texels, and the unexplained differences of the record,
    /// which are counted with its first lane.
    fn compare(&self) -> (UvCause, f64, u64) {
        let lane = (self.pixel[0] & 1) | (self.pixel[1] & 1) << 1;
        let extent = DVec2::from(self.group.extent.map(f64::from));
        let captured = captured_uv(self.record, lane, self.group) * extent;
        let error = captured - self.receiver.texels(self.cascade, center(self.pixel));
        let is_first = lane == self.record.mask.trailing_zeros();
        let differences = if is_first { self.differences() } else { 0 };
        (self.cause(error), error.length(), differences)
    }

    fn cause(&self, error: DVec2) -> UvCause {
        if error.length() <= SMALL {
            return UvCause::Small;
        }
        let bound = |cut| {
            let error = self
                .receiver
                .error_texels(self.cascade, center(self.pixel), cut);
            if error.is_nan() {
                f64::INFINITY
            } else {
                SMALL + error.length()
            }
        };
        if error.length() <= bound(false) || error.length() <= bound(true) {
            return UvCause::SinglePrecision;
        }
        if self.formula == LodFormula::Softpipe {
            let [_, _, cross] = self.expected();
            if error.length() <= bound(true) + cross.length() {
                return UvCause::NoCross;
            }
        }
        let differences = [self.record.dx, self.record.dy, self.record.cross];
        let is_large = |d: &i32| d.unsigned_abs() >= LARGEST_DIFFERENCE;
        match differences.as_flattened().iter().any(is_large) {
            true => UvCause::Saturated,
            false => UvCause::Unexplained,
        }
    }

    /// The corners of the quad.
    fn corners(&self) -> [DVec2; 4] {
        let steps = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];
        steps.map(|step| quad_center(self.pixel) + step)
    }

    /// The differences over the quad, texels: dx, dy, cross.
    fn expected(&self) -> [DVec2; 3] {
        let corners = self
            .corners()
            .map(|p| self.receiver.texels(self.cascade, p));
        let [top_left, top_right, bottom_left, bottom_right] = corners;
        let dx = top_right - top_left;
        [dx, bottom_left - top_left, bottom_right - bottom_left - dx]
    }

    /// Number of differences of the record that single precision does not explain.
    fn differences(&self) -> u64 {
        if self.formula == LodFormula::Softpipe {
            return 0;
        }
        let found = [self.record.dx, self.record.dy, self.record.cross];
        let mut bound: Option<DVec2> = None;
        let mut unexplained = 0;
        for (found, expected) in found.into_iter().zip(self.expected()) {
            for axis in 0..2 {
                let error = f64::from(found[axis]) / f64::from(SUBTEXELS) - expected[axis];
                if error.abs() <= SMALL
                    || !error.is_finite()
                    || found[axis].unsigned_abs() >= LARGEST_DIFFERENCE
                {
                    continue;
                }
                let bound = bound.get_or_insert_with(|| {
                    let errors = self
                        .corners()
                        .map(|p| self.receiver.error_texels(self.cascade, p, true));
                    errors.into_iter().sum()
                });
                let is_within = error.abs() <= SMALL + bound[axis] || bound[axis].is_nan();
                unexplained += u64::from(!is_within);
            }
        }
        unexplained
    }
}
