//! Counts of a comparison, summed over tiles.

use super::causes::{SampleCause, UvCause};
use super::classes::Class;
use super::lookups::LookupAgreement;
use super::means::Means;

/// The side that has a fragment which the other does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The reference.
    Reference,
    /// The capture.
    Capture,
}

/// Differences of sampled levels and texels from one definition of the correct result.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleErrors {
    /// Samples compared: fragments times textures.
    pub samples: u64,
    /// Sum of the absolute errors of the level of detail, levels.
    pub lod_sum: f64,
    /// Largest of them.
    pub lod_max: f64,
    /// Samples with a different finer level.
    pub levels_differ: u64,
    /// Samples that read different levels.
    pub other_levels: u64,
    /// Samples that read different texels of the same levels.
    pub other_texels: u64,
    /// Samples that read different levels or texels, by [`SampleCause::ALL`].
    pub causes: [u64; SampleCause::ALL.len()],
}

/// A level with its columns and rows.
pub(super) type Read = (u32, [[u32; 2]; 2]);

impl SampleErrors {
    /// Adds a sample: the clamped levels of detail, and the texels that were read and that should have been
    /// read. Returns whether they differ.
    pub(super) fn add(
        &mut self,
        [lod, expected_lod]: [f64; 2],
        read: &[Read],
        expected: &[Read],
    ) -> bool {
        let error = (lod - expected_lod).abs();
        self.samples += 1;
        self.lod_sum += error;
        self.lod_max = self.lod_max.max(error);
        self.levels_differ += u64::from(lod.floor() != expected_lod.floor());
        let levels = |reads: &[Read]| (reads.len(), reads.first().map(|r| r.0));
        if levels(read) != levels(expected) {
            self.other_levels += 1;
        } else if read != expected {
            self.other_texels += 1;
        }
        read != expected
    }

    fn merge(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            samples,
            lod_sum,
            levels_differ,
            other_levels,
            other_texels
        );
        self.lod_max = self.lod_max.max(other.lod_max);
        for (sum, count) in self.causes.iter_mut().zip(&other.causes) {
            *sum += count;
        }
    }
}

/// Distances, unordered.
#[derive(Clone, Default, PartialEq)]
pub struct Distances(pub Vec<f32>);

impl Distances {
    /// Mean, 99th percentile and maximum; zeros if there are none.
    pub fn summary(&self) -> [f64; 3] {
        let mut values = self.0.clone();
        let count = values.len();
        if count == 0 {
            return [0.0; 3];
        }
        let sum: f64 = values.iter().map(|&e| f64::from(e)).sum();
        let (_, percentile, above) =
            values.select_nth_unstable_by(count * 99 / 100, f32::total_cmp);
        let maximum = above.iter().copied().fold(*percentile, f32::max);
        [
            sum / count as f64,
            f64::from(*percentile),
            f64::from(maximum),
        ]
    }
}

impl std::fmt::Debug for Distances {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [mean, percentile, max] = self.summary();
        write!(
            f,
            "{} distances: mean {mean}, 99 % {percentile}, max {max}",
            self.0.len()
        )
    }
}

/// Agreement of captured tiles with the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Fragments (draw, primitive and pixel) in both.
    pub both: u64,
    /// Fragments only in the reference and only in the capture, by [`Class::ALL`].
    pub only: [[u64; Class::ALL.len()]; 2],
    /// Lanes that the capture records twice.
    pub recorded_twice: u64,
    /// Distances of coordinates of common fragments and their groups, texels of the group's extent.
    pub uv_errors_texels: Distances,
    /// The same by [`UvCause::ALL`].
    pub uv_causes: [u64; UvCause::ALL.len()],
    /// Signed means of coordinates and of their differences over a quad.
    pub means: Means,
    /// Differences over a quad that neither rounding nor single precision explains, by record, column and
    /// axis.
    pub differences_unexplained: u64,
    /// Uv groups of common fragments without a record.
    pub groups_missing: u64,
    /// Records without a group of fragments that sample textures.
    pub groups_unexpected: u64,
    /// Common fragments with coordinates that are not finite on either side.
    pub not_finite: u64,
    /// Shadow-map look-ups of common fragments that are not compared, because the shadow maps are not known.
    pub shadow_lookups: u64,
    /// Shadow-map look-ups of common fragments.
    pub lookups: LookupAgreement,
    /// Compared with the same formula of the level of detail, so that only the capture's precision remains.
    pub capture: SampleErrors,
    /// Compared with the specification: the exact logarithm of each fragment's own derivatives.
    pub specification: SampleErrors,
}

impl Agreement {
    pub(super) fn differ(&mut self, side: Side, class: Class) {
        self.only[side as usize][class as usize] += 1;
    }

    /// Fragments that only one side has.
    pub fn only(&self, side: Side) -> u64 {
        self.only[side as usize].iter().sum()
    }

    /// Differences of a class.
    pub fn of_class(&self, class: Class) -> u64 {
        self.only.iter().map(|side| side[class as usize]).sum()
    }

    /// Common fragments over all fragments.
    pub fn coverage_iou(&self) -> f64 {
        let all = self.both + self.only(Side::Reference) + self.only(Side::Capture);
        if all == 0 {
            1.0
        } else {
            self.both as f64 / all as f64
        }
    }

    /// Adds the counts of another tile or pass.
    pub fn merge(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            both,
            recorded_twice,
            differences_unexplained,
            groups_missing,
            groups_unexpected,
            not_finite,
            shadow_lookups
        );
        for (sum, side) in self.only.iter_mut().zip(&other.only) {
            for (sum, count) in sum.iter_mut().zip(side) {
                *sum += count;
            }
        }
        self.uv_errors_texels
            .0
            .extend_from_slice(&other.uv_errors_texels.0);
        for (sum, count) in self.uv_causes.iter_mut().zip(&other.uv_causes) {
            *sum += count;
        }
        self.means.merge(&other.means);
        self.lookups.merge(&other.lookups);
        self.capture.merge(&other.capture);
        self.specification.merge(&other.specification);
    }
}
