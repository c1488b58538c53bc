//! Counts of differences in a class of fragments.

use super::differences::Differences;
use formats::textrace::SUBTEXELS;
use serde::Serialize;

/// Steps per level of detail.
pub(super) const LOD_STEPS: u32 = 1 << 16;

/// Differences in a class of fragments.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Tally {
    /// Fragments in both captures.
    pub fragments_in_both: u64,
    /// Fragments in the first capture only.
    pub fragments_only_in_a: u64,
    /// Fragments in the second capture only.
    pub fragments_only_in_b: u64,
    /// Texture coordinates of common fragments that only one capture has, or that sample other textures.
    pub lanes_sampled_differently: u64,
    /// Distance of texture coordinates (the larger of both axes), in texels of the largest texture sampled with them.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "crate::compare::differences::Summary")
    )]
    pub uv_texels: Differences,
    /// Difference of the exact level of detail in levels, per record.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "crate::compare::differences::Summary")
    )]
    pub lod_levels: Differences,
    /// Footprints of the common fragments.
    pub footprints: u64,
    /// Footprints that the other capture's fragment does not have.
    pub footprints_that_differ: u64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            fragments_in_both: 0,
            fragments_only_in_a: 0,
            fragments_only_in_b: 0,
            lanes_sampled_differently: 0,
            uv_texels: Differences::new(SUBTEXELS as u32),
            lod_levels: Differences::new(LOD_STEPS),
            footprints: 0,
            footprints_that_differ: 0,
        }
    }
}

impl Tally {
    /// Adds another class.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            fragments_in_both,
            fragments_only_in_a,
            fragments_only_in_b,
            lanes_sampled_differently
        );
        self.uv_texels.add(&other.uv_texels);
        self.lod_levels.add(&other.lod_levels);
        formats::add_fields!(self, other, footprints, footprints_that_differ);
    }

    /// Fragments in at least one capture.
    fn fragments_in_either(&self) -> u64 {
        self.fragments_in_both + self.fragments_only_in_a + self.fragments_only_in_b
    }

    /// True without fragments.
    pub fn is_empty(&self) -> bool {
        self.fragments_in_either() == 0
    }

    /// Common fragments over fragments in at least one capture, percent.
    pub fn intersection_over_union_pct(&self) -> f64 {
        match self.fragments_in_either() {
            0 => 100.0,
            either => 100.0 * self.fragments_in_both as f64 / either as f64,
        }
    }

    /// Different footprints over footprints, percent.
    pub fn footprints_that_differ_pct(&self) -> f64 {
        100.0 * self.footprints_that_differ as f64 / self.footprints.max(1) as f64
    }
}
