//! Foveation: coarser shading away from the gaze. One technique per file.
//!
//! Each technique renders layers of lower resolution. A coarse pixel therefore samples as on a display with
//! fewer pixels: its derivatives span more texels, which selects coarser mip levels.

pub(crate) mod acuity;
pub mod lens_matched;
pub(crate) mod multi_resolution;
pub(crate) mod radial_density;
pub(crate) mod rings;

use crate::eye::EyePicture;
use crate::patch::EyePatches;
use crate::settings::{FoveationKind, Rates};

/// A foveation technique: a row of [`MODES`]. Flags, help, checks, and the rows of studies and searches follow
/// from it.
pub struct Mode {
    /// The setting.
    pub kind: FoveationKind,
    /// Value of the flag.
    pub name: &'static str,
    /// Name in studies and results.
    pub technique: &'static str,
    /// Title for readers.
    pub title: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// What determines its rates, if it is not the angles of the settings.
    pub rates_of: Option<&'static str>,
    /// Whether the rates follow the gaze.
    pub follows_gaze: bool,
    /// The layers of an eye's picture.
    pub(crate) patches: fn(&EyePicture, &Rates) -> EyePatches,
}

/// The foveation techniques.
pub static MODES: &[Mode] = &[
    Mode {
        kind: FoveationKind::Rings,
        name: "rings",
        technique: "foveation-rings",
        title: "Foveation by rings",
        help: "A rate for each 16x16 tile: 1, 1/2, 1/4, 1/8 or 1/16 of the pixels",
        rates_of: None,
        follows_gaze: true,
        patches: rings::patches,
    },
    Mode {
        kind: FoveationKind::MultiResolution,
        name: "multi-resolution",
        technique: "multi-resolution",
        title: "Multi-resolution",
        help: "3x3 viewports, the outer ones at half the resolution",
        rates_of: Some("its viewports"),
        follows_gaze: true,
        patches: |picture, _| multi_resolution::patches(picture),
    },
    Mode {
        kind: FoveationKind::RadialDensity,
        name: "radial-density",
        technique: "radial-density",
        title: "Radial density mask",
        help: "Every other 2x2 quad of the periphery, filled from its neighbours",
        rates_of: None,
        follows_gaze: true,
        patches: radial_density::patches,
    },
    Mode {
        kind: FoveationKind::LensMatched,
        name: "lens-matched",
        technique: "lens-matched",
        title: "Lens-matched viewports",
        help: "2x2 viewports, coarser towards the edges by a projective map",
        rates_of: Some("its projection around straight ahead"),
        follows_gaze: false,
        patches: |picture, _| lens_matched::patches(picture),
    },
];

impl FoveationKind {
    /// Its row of [`MODES`].
    ///
    /// # Panics
    /// Never, because every variant has a row.
    pub fn mode(self) -> &'static Mode {
        let mut modes = MODES.iter();
        modes.find(|mode| mode.kind == self).expect("a row")
    }
}
